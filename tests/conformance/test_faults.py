"""`check` passes a correct environment, and finds in each faulty one its fault and no other."""

from __future__ import annotations

import re

import faulty_envs
import pytest
from walkers import Walkers

from trust_env.conformance import CHECKS, check

# By environment: the checks that fail, one of them, and what its detail says. PettingZoo's tests find some of
# the faults as well; `parallel_seed_test` cannot find the second one, as it compares one step only.
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
    "TextAsImage": ({"render_test"}, "render_test", "rgb_array mode must return a valid image array"),
    "StateOutsideItsSpace": ({"state_test"}, "state_test", "outside of it's state space"),
    "MaxCyclesOverrun": ({"max_cycles_test"}, "max_cycles_test", r"AssertionError: .*max_cycles_test.py:"),
    "MaxCyclesIgnored": (
        {"max_cycles_test"},
        "max_cycles_test",
        "with max_cycles=4 the episode has not ended after 14 cycles",
    ),
    "NewSpacesEachCall": (
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


def test_a_correct_environment_passes_every_check() -> None:
    report = check(Walkers)
    assert report.ok
    assert report.passed == tuple(CHECKS), str(report)


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_environment_fails_only_the_checks_of_its_fault(name: str) -> None:
    failing, found_by, detail = FAULTS[name]
    report = check(getattr(faulty_envs, name), num_cycles=50)
    assert set(report.failed) == failing, str(report)
    assert not report.ok
    assert re.search(detail, report[found_by].detail), report[found_by].detail


def test_every_check_fails_on_some_environment() -> None:
    assert set().union(*(failing for failing, _, _ in FAULTS.values())) == set(CHECKS)


def test_pettingzoos_seed_test_compares_one_step_only() -> None:
    """The reason for `whole_episode_determinism`; if this fails, PettingZoo has corrected its test."""
    report = check(faulty_envs.NondeterministicFromSecondStep, checks=["parallel_seed_test"])
    assert report.passed == ("parallel_seed_test",)


@pytest.mark.extra("bench")
def test_mpe2_fails_for_the_state_it_loses_when_copied() -> None:
    """mpe2's `EzPickle` rebuilds an environment from its constructor's arguments, and forgets the episode."""
    from mpe2 import simple_spread_v3

    report = check(simple_spread_v3.parallel_env)
    assert set(report.failed) == {"copy_mid_episode", "pickle_mid_episode"}, str(report)
    assert report.skipped == ("snapshot_mid_episode",)
