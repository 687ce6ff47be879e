"""Environments of other kinds, and the arguments of `check`."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.spaces import Box
from walkers import Walkers

from trust_env.conformance import CHECKS, check
from trust_env.conformance.difference import difference


class Masked(Walkers):
    """Dict observations with an action mask; a masked action raises."""

    def __init__(self) -> None:
        super().__init__()
        self._choice = spaces.Discrete(3)
        self._view = spaces.Dict({"observation": self._observation_space, "action_mask": spaces.MultiBinary(3)})

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


def test_random_actions_obey_masks_and_recommendations_are_remarks() -> None:
    report = check(Masked, num_cycles=50)
    assert report.ok, str(report)
    assert re.search("without the action masks: .* is masked", report["state_test"].detail)
    assert "Observation is not a NumPy array" in report["api_test"].detail
    assert "no render_mode" in report["render_test"].detail
    assert "no max_cycles" in report["max_cycles_test"].detail
    assert report.skipped == ("render_test", "state_test", "max_cycles_test")


class Endless(Walkers):
    """No rendering, no state, no end, and a warning at each reset."""

    metadata: ClassVar[dict[str, Any]] = {"name": "endless_v0"}
    get_state = set_state = property()  # type: ignore[assignment]

    def __init__(self) -> None:
        super().__init__(10**9)

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        warnings.warn("this environment warns", UserWarning, stacklevel=2)
        return super().reset(seed, options)

    def state(self) -> np.ndarray:
        raise NotImplementedError


def test_checks_of_what_an_environment_lacks_are_skipped_with_the_reason() -> None:
    report = check(Endless, num_cycles=30, allow_warnings=["this environment"])
    assert report.ok, str(report)
    assert {name: report[name].detail for name in report.skipped} == {
        "render_test": "the environment's metadata name no render_modes",
        "state_test": "the environment has no state()",
        "max_cycles_test": "the factory takes no max_cycles",
        "snapshot_mid_episode": "the environment has no get_state() and set_state()",
    }
    assert report["whole_episode_determinism"].detail == "the first 30 steps; the episode had not ended"


def test_a_warning_fails_pettingzoos_tests_only() -> None:
    report = check(Endless, num_cycles=10, checks=["parallel_api_test", "seeds_matter"])
    assert report["parallel_api_test"].detail == "warns: this environment warns"
    assert report["seeds_matter"].status == "passed"


class Deterministic(Walkers):
    """Nothing is random, and actions change nothing."""

    def __init__(self) -> None:
        super().__init__()
        self._action_space = Box(0, 0, (1,), np.float32)

    def reset(self, seed: int | None = None, options: dict | None = None) -> tuple[dict, dict]:
        return super().reset(5, options)


def test_seeds_are_not_checked_where_nothing_is_random() -> None:
    checks = ["whole_episode_determinism", "seeds_matter", "unseeded_second_reset"]
    report = check(Deterministic, checks=checks)
    assert report.skipped == ("seeds_matter", "unseeded_second_reset")
    assert report.ok


def test_an_environment_in_place_of_a_factory_is_checked_and_left_unchanged() -> None:
    env = Walkers()
    env.reset(seed=3)
    before = env.get_state()
    report = check(env, num_cycles=50)
    assert report.ok, str(report)
    assert report.skipped == ("render_test", "max_cycles_test")
    assert difference(before, env.get_state()) is None


def test_actions_come_from_the_policy() -> None:
    seeds: list[int] = []

    def policy(env: Any, seed: int) -> Callable[[dict, dict], dict]:
        seeds.append(seed)
        return lambda observations, infos: {agent: np.ones(1, np.float32) for agent in observations}

    assert check(Walkers, seed=4, policy=policy, checks=["value_types"]).ok
    assert seeds == [4, 4]  # the first one to warm up


def test_a_factory_that_raises_fails_every_check_that_calls_it() -> None:
    def make() -> Walkers:
        print("not for the caller's eyes")
        raise OSError("no such device")

    report = check(make)
    assert set(report.failed) == set(CHECKS) - {"max_cycles_test"}
    assert report["value_types"].detail.startswith("OSError: no such device (test_check.py:")


def test_output_of_the_environment_is_discarded(capsys: pytest.CaptureFixture[str]) -> None:
    check(Walkers, checks=["parallel_api_test"])
    assert capsys.readouterr() == ("", "")


def test_an_unknown_check_raises_naming_the_known_ones() -> None:
    with pytest.raises(ValueError, match="unknown checks \\['colour'\\]; known: parallel_api_test"):
        check(Walkers, checks=["colour"])
