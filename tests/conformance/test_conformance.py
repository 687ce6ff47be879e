"""`check` passes a good environment, and finds in each broken one its fault and no other."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable
from typing import Any, ClassVar

import broken_envs
import numpy as np
import pytest
from broken_envs import Walkers
from gymnasium import spaces
from gymnasium.spaces import Box
from rich.console import Console

from trust_env.conformance import CHECKS, check
from trust_env.conformance.difference import difference

# Environment: the checks that fail, one of them, and what its detail says. PettingZoo's tests see some of the
# faults as well; `parallel_seed_test` must not see the second one, as it looks at one step only.
FAULTS: dict[str, tuple[set[str], str, str]] = {
    "SeedDropped": (
        {"parallel_seed_test", "seed_test", "whole_episode_determinism"},
        "whole_episode_determinism",
        r"frame 0, observations\['walker_0'\]\[1\]: .* in the first run, .* in a second fresh environment",
    ),
    "NondeterministicFromSecondStep": (
        {"seed_test", "whole_episode_determinism"},
        "whole_episode_determinism",
        r"frame 2, observations\['walker_0'\]\[1\]: ",
    ),
    "ObservationOutsideItsSpace": (
        {"api_test", "observations_in_space"},
        "observations_in_space",
        r"frame 4, observation of walker_0\[0\]: -5.0 is not between -1.0 and 1.0",
    ),
    "StateLostOnCopy": (
        {"copy_mid_episode"},
        "copy_mid_episode",
        r"taken at frame 6, it goes another way: frame 7, observations\['walker_0'\]\[1\]: .* in the copy",
    ),
    "AgentRevived": (
        {"parallel_api_test", "api_test", "agents_never_revive"},
        "agents_never_revive",
        r"frame 8: walker_2 is back, which left in frame 6",
    ),
    "WithoutAnOptionsArgument": (  # what wraps an environment passes options on, so every AEC form breaks
        {"parallel_api_test", "api_test", "seed_test", "render_test", "state_test", "max_cycles_test"},
        "parallel_api_test",
        "unexpected keyword argument 'options'",
    ),
    "WordsAsImage": ({"render_test"}, "render_test", "rgb_array mode must return a valid image array"),
    "StateOutsideItsSpace": ({"state_test"}, "state_test", "outside of it's state space"),
    "MaxCyclesOverrun": ({"max_cycles_test"}, "max_cycles_test", r"AssertionError: .*max_cycles_test.py:"),
    "MaxCyclesIgnored": (
        {"max_cycles_test"},
        "max_cycles_test",
        "with max_cycles=4 the episode has not ended after 14 cycles",
    ),
    "SpacesMadeAnew": (
        {"parallel_api_test", "api_test", "spaces_are_stable"},
        "spaces_are_stable",
        r"observation_space\('walker_0'\) after reset is another object",
    ),
    "ObservationsOverwritten": (
        {"observations_not_overwritten"},
        "observations_not_overwritten",
        r"frame 0, observations\['walker_0'\]\[1\]: .* became .* in the next step",
    ),
    "RewardsAreArrays": ({"value_types"}, "value_types", r"frame 1, reward of walker_0: .*float32"),
    "InfoGainsAKey": (
        {"infos_keep_their_keys"},
        "infos_keep_their_keys",
        "frame 3, info of walker_0: gained 'late'",
    ),
    "RewardMissing": (
        {"parallel_api_test", "api_test", "seed_test", "state_test", "dicts_match_agents"},
        "dicts_match_agents",
        "frame 3, rewards: lacks walker_1",
    ),
    "EverySeedTheSame": ({"seeds_matter"}, "seeds_matter", "seeds 0 to 3 all give the same episode"),
    "UnseededResetRepeats": (
        {"unseeded_second_reset"},
        "unseeded_second_reset",
        "repeats the seeded episode",
    ),
    "UnseededResetForgets": (
        {"unseeded_second_reset"},
        "unseeded_second_reset",
        r"the episode after an unseeded reset: frame 0, observations\['walker_0'\]\[1\]: ",
    ),
    "GeneratorSharedByCopies": (
        {"copy_mid_episode"},
        "copy_mid_episode",
        "the copy disturbs the original: frame 7, ",
    ),
    "StateLostInPickle": (
        {"pickle_mid_episode"},
        "pickle_mid_episode",
        "it goes another way: frame 7, .* in the unpickled environment",
    ),
    "SnapshotWithoutTheGenerator": (
        {"snapshot_mid_episode"},
        "snapshot_mid_episode",
        r"they part: frame 7, observations\['walker_0'\]\[1\]: .* in the first time, .* in after set_state",
    ),
    "ClosesOnlyOnce": ({"close_twice"}, "close_twice", "already closed"),
    "KeepsEveryFrame": ({"memory"}, "memory", "Python memory grows in each of 4 laps"),
}


def test_a_good_environment_passes_every_check() -> None:
    report = check(Walkers)
    assert report.ok
    assert report.passed == tuple(CHECKS), str(report)


@pytest.mark.parametrize("name", FAULTS)
def test_a_broken_environment_fails_by_its_fault_alone(name: str) -> None:
    failing, found_by, words = FAULTS[name]
    report = check(getattr(broken_envs, name), num_cycles=50)
    assert set(report.failed) == failing, str(report)
    assert not report.ok
    assert re.search(words, report[found_by].detail), report[found_by].detail


def test_every_check_fails_some_environment() -> None:
    assert set().union(*(failing for failing, _, _ in FAULTS.values())) == set(CHECKS)


def test_pettingzoo_looks_at_one_step_only() -> None:
    """Why there is a determinism check of our own; if this fails, PettingZoo has mended its test."""
    report = check(broken_envs.NondeterministicFromSecondStep, checks=["parallel_seed_test"])
    assert report.passed == ("parallel_seed_test",)


# What else environments look like.


class Masked(Walkers):
    """Dict observations with an action mask; a masked action is refused."""

    def __init__(self) -> None:
        super().__init__()
        self._choice = spaces.Discrete(3)
        self._view = spaces.Dict(
            {"observation": self._observation_space, "action_mask": spaces.MultiBinary(3)}
        )

    def observation_space(self, agent: str) -> spaces.Dict:  # type: ignore[override]
        return self._view

    def action_space(self, agent: str) -> spaces.Discrete:  # type: ignore[override]
        return self._choice

    def observe(self, agents: list[str]) -> dict[str, Any]:
        mask = np.array([1, self.frame % 2, 1 - self.frame % 2], np.int8)
        seen = super().observe(agents)
        return {agent: {"observation": seen[agent], "action_mask": mask.copy()} for agent in agents}

    def step(self, actions: dict) -> tuple[dict, dict, dict, dict, dict]:
        for agent, action in actions.items():
            if action == 1 + self.frame % 2:
                raise ValueError(f"{agent}: action {action} is masked")
        return super().step({agent: [action - 1.0] for agent, action in actions.items()})


def test_action_masks_are_kept_and_recommendations_are_remarks() -> None:
    report = check(Masked, num_cycles=50)
    assert report.ok, str(report)
    assert re.search("without the action masks: .* is masked", report["state_test"].detail)
    assert "Observation is not a NumPy array" in report["api_test"].detail
    assert "no render_mode" in report["render_test"].detail
    assert "no max_cycles" in report["max_cycles_test"].detail
    assert report.skipped == ("render_test", "state_test", "max_cycles_test")


class Everlasting(Walkers):
    """No rendering, no state, no end, and a warning at each reset."""

    metadata: ClassVar[dict[str, Any]] = {"name": "everlasting_v0"}
    get_state = set_state = property()  # type: ignore[assignment]

    def __init__(self) -> None:
        super().__init__(10**9)

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        warnings.warn("the everlasting warns", UserWarning, stacklevel=2)
        return super().reset(seed, options)

    def state(self) -> np.ndarray:
        raise NotImplementedError


def test_what_an_environment_lacks_is_skipped_with_the_reason() -> None:
    report = check(Everlasting, num_cycles=30, allow_warnings=["everlasting"])
    assert report.ok, str(report)
    assert {name: report[name].detail for name in report.skipped} == {
        "render_test": "the environment's metadata name no render_modes",
        "state_test": "the environment has no state()",
        "max_cycles_test": "the factory takes no max_cycles",
        "snapshot_mid_episode": "the environment has no get_state() and set_state()",
    }
    assert report["whole_episode_determinism"].detail == "the first 30 steps; the episode had not ended"


def test_a_warning_fails_pettingzoos_tests_unless_allowed() -> None:
    report = check(Everlasting, num_cycles=10, checks=["parallel_api_test", "seeds_matter"])
    assert report["parallel_api_test"].detail == "warns: the everlasting warns"
    assert report["seeds_matter"].status == "passed"


class Chanceless(Walkers):
    def __init__(self) -> None:
        super().__init__()
        self._action_space = Box(0, 0, (1,), np.float32)

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        return super().reset(5, options)


def test_a_game_without_chance_needs_no_seed() -> None:
    report = check(Chanceless, checks=["whole_episode_determinism", "seeds_matter", "unseeded_second_reset"])
    assert report.skipped == ("seeds_matter", "unseeded_second_reset")
    assert report.ok


def test_an_environment_in_place_of_a_factory_is_copied() -> None:
    env = Walkers()
    env.reset(seed=3)
    before = env.get_state()
    report = check(env, num_cycles=50)
    assert report.ok, str(report)
    assert report.skipped == ("render_test", "max_cycles_test")
    assert difference(before, env.get_state()) is None


def test_a_policy_chooses_the_actions() -> None:
    made: list[int] = []

    def policy(env: Any, seed: int) -> Callable[[dict, dict], dict]:
        made.append(seed)
        return lambda observations, infos: {agent: np.ones(1, np.float32) for agent in observations}

    assert check(Walkers, seed=4, policy=policy, checks=["value_types"]).ok
    assert made == [4, 4]  # once to warm up


def test_an_environment_that_cannot_be_made_fails_every_check() -> None:
    def make() -> Walkers:
        print("not for the caller's eyes")
        raise OSError("no such device")

    report = check(make)
    assert set(report.failed) == set(CHECKS) - {"max_cycles_test"}
    assert report["value_types"].detail.startswith("OSError: no such device (test_conformance.py:")


def test_what_the_environment_prints_stays_out_of_the_way(capsys: pytest.CaptureFixture[str]) -> None:
    check(Walkers, checks=["parallel_api_test"])
    assert capsys.readouterr() == ("", "")


def test_unknown_check() -> None:
    with pytest.raises(ValueError, match="unknown checks \\['colour'\\]; known: parallel_api_test"):
        check(Walkers, checks=["colour"])


def test_the_report_as_text_table_and_json() -> None:
    seen: list[str] = []
    report = check(
        broken_envs.RewardsAreArrays,
        seed=1,
        checks=["value_types", "close_twice"],
        on_result=lambda result: seen.append(result.name),
    )
    assert seen == ["value_types", "close_twice"]
    told = json.loads(json.dumps(report.to_dict()))
    assert (told["environment"], told["seed"], told["ok"]) == ("walkers_v0", 1, False)
    assert [entry["status"] for entry in told["checks"]] == ["failed", "passed"]
    assert "failed   value_types" in str(report)
    assert str(report).endswith("walkers_v0: 1 passed, 1 failed, 0 skipped")
    console = Console(width=120)
    with console.capture() as printed:
        console.print(report)
    assert "value_types" in printed.get()
    with pytest.raises(KeyError):
        report["memory"]


@pytest.mark.parametrize(
    ("a", "b", "found"),
    [
        ({"x": [1.0, float("nan")]}, {"x": [1.0, float("nan")]}, None),
        (np.array([1.0, np.nan]), np.array([1.0, np.nan]), None),
        (np.array(["a"], object), np.array(["a"], object), None),
        (spaces.Discrete(2), spaces.Discrete(2), None),
        (object(), object(), None),
        (1, 1.0, ("", "1 (int)", "1.0 (float)")),
        (np.float32(1), 1.0, ("", "np.float32(1.0) (float32)", "1.0 (float)")),
        ({"x": (1, 2)}, {"x": (1, 3)}, ("['x'][1]", "2", "3")),
        ({"x": 1}, {"y": 1}, ("", "keys ['x']", "keys ['y']")),
        ([1], [1, 2], ("", "[1]", "[1, 2]")),
        (np.zeros((2, 2)), np.eye(2), ("[0, 0]", "0.0", "1.0")),
        (np.zeros(2), np.zeros(2, np.float32), ("", "float64[2]", "float32[2]")),
    ],
)
def test_difference_by_hand(a: Any, b: Any, found: tuple[str, str, str] | None) -> None:
    assert difference(a, b) == found


@pytest.mark.extra("bench")
def test_a_peer_that_loses_its_state_when_copied() -> None:
    """mpe2's `EzPickle` rebuilds an environment from its constructor's arguments, and forgets the episode."""
    from mpe2 import simple_spread_v3

    report = check(simple_spread_v3.parallel_env)
    assert set(report.failed) == {"copy_mid_episode", "pickle_mid_episode"}, str(report)
    assert report.skipped == ("snapshot_mid_episode",)
