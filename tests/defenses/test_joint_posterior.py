"""`joint_posterior`: the same as in NumPy, what its terms promise, and what it does against attacks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joint_in_numpy import JointInNumPy

import trust_env
from trust_env.agents import Player, build_policy
from trust_env.defenses import build_defense
from trust_env.defenses.joint.hypotheses import adversary_sets, behaviours, count_sets
from trust_env.defenses.joint_posterior import JointPosterior
from trust_env.metrics import EpisodeMetrics
from trust_env.scenario import load_scenario

SEED = 1000
ONLY_PATTERNS = {
    **dict.fromkeys(("counts", "kinematics", "exactness", "edges", "departures"), False),
    **dict.fromkeys(("memory", "kappa", "dormant"), 0.0),
    "cap_track": 60.0,
}


def play(scenario: Any, attack: str, defenses: tuple[Any, ...], worlds: int, frames: int) -> Any:
    """Step one environment per defense through the same attack; yields them after every frame."""
    envs = [trust_env.vector_env(scenario, d, num_worlds=worlds, autoreset=False) for d in defenses]
    players = [Player(env, {"adversary": build_policy(attack)}) for env in envs]
    seen = [env.reset(seed=SEED)[0] for env in envs]
    for _ in range(frames):
        seen = [env.step(p.actions(s))[0] for env, p, s in zip(envs, players, seen, strict=True)]
        yield envs


def damage(scenario: Any, attack: str, defense: str, worlds: int) -> float:
    """Mean damage per frame over whole episodes."""
    recorded = None
    horizon = load_scenario(scenario).horizon or 1
    for (env,) in play(scenario, attack, (defense,), worlds, horizon):
        recorded = recorded or EpisodeMetrics(env)
        recorded.update()
    assert recorded is not None
    return float(recorded.result()["damage_per_frame"].mean())


@pytest.mark.core
@pytest.mark.parametrize(
    ("scenario", "attack", "worlds", "frames", "given"),
    [
        ("trio", "false_positive", 2, 60, {}),
        ("trio", "suppress", 2, 30, ONLY_PATTERNS),
        (
            "patrol(knowledge=poses)",
            "fov_aware",
            1,
            25,
            {"pi": 0.4, "r": 0.6, "cap_track": 20.0, "cap_motion": 12.0, "cap_dead": 9.0},
        ),
    ],
)
def test_kernels_agree_with_numpy(scenario, attack, worlds, frames, given):
    spread = []
    for ours, theirs in play(scenario, attack, (JointPosterior(**given), JointInNumPy(**given)), worlds, frames):
        tracked = ours.arrays.track_status > 0
        np.testing.assert_allclose(ours.arrays.agent_trust, theirs.arrays.agent_trust, rtol=0, atol=1e-9)
        found, expected = (env.arrays.track_trust[tracked] for env in (ours, theirs))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
        spread.append(np.std(ours.arrays.agent_trust))
    assert max(spread) > 0.01


@pytest.mark.core
@pytest.mark.filterwarnings("ignore:joint_posterior considers")
def test_kernels_agree_with_numpy_beyond_ten_agents_and_with_platforms():
    types = (0, 1, 0, 1, 2, 2, 0, 3, 4, 4, 3)
    scenario = load_scenario("trio", n_adversaries=3, n_benign=8, platforms=["abcde"[t] for t in types])
    defenses = JointPosterior(most=2), JointInNumPy(types, most=2)
    for ours, theirs in play(scenario, "false_positive", defenses, 1, 8):
        np.testing.assert_allclose(ours.arrays.agent_trust, theirs.arrays.agent_trust, rtol=0, atol=1e-9)
        assert ours.arrays.joint_posterior_set_prior.shape == (1, 1 + 11 + 55)


def test_all_sets_up_to_ten_agents_and_small_ones_beyond():
    assert count_sets(10, most=3) == 1024
    assert count_sets(16, most=3) == 1 + 16 + 120 + 560
    sets = adversary_sets(3, most=3)
    assert sorted(sets.members.tolist()) == list(range(8)) and sets.members[0] == 0
    joined = sets.members[sets.parent[1:]] | (1 << sets.lowest[1:])
    assert np.array_equal(joined, sets.members[1:]) and np.all(sets.parent[1:] < np.arange(1, 8))


def test_more_sets_than_are_feasible_are_an_error():
    scenario = load_scenario("crowd", n_adversaries=2, n_benign=38)
    with pytest.raises(ValueError, match=r"most = 3: 40 agents have 10701 sets"):
        trust_env.vector_env(scenario, "joint_posterior", num_worlds=1)
    with pytest.warns(UserWarning, match="at most 2 adversaries among 40"):
        trust_env.vector_env(scenario, "joint_posterior(most=2)", num_worlds=1)
    with pytest.raises(ValueError, match="64 agents; expected at most 62"):
        trust_env.vector_env(load_scenario("crowd", n_benign=60), "joint_posterior(most=1)", num_worlds=1)


def test_priors_of_behaviours_sum_to_one_and_the_dormant_one_has_its_share():
    tables = behaviours(alone=2, together=3, levels=2, modes=2, dormant=0.3)
    assert tables.prior.sum() == pytest.approx(1.0)
    assert len(tables.prior) == 24 and tables.prior[:2].sum() == pytest.approx(0.3)
    assert tables.first.tolist() == [0, 2, 14, 22] and tables.case[-1].tolist() == [1, 13, 21]


def test_agents_of_a_platform_type_are_compromised_together():
    scenario = load_scenario("trio", platforms=["ship", "ship", "plane"])
    defense = JointPosterior(pi=0.25, platform_prior=0.1, platform_share=0.9)
    env = trust_env.vector_env(scenario, defense, num_worlds=1)
    env.reset(seed=0)
    prior = dict(zip(adversary_sets(3, 3).members.tolist(), np.exp(env.arrays.joint_posterior_set_prior[0])))
    both_ships = 0.9 * 0.25 * 0.25 + 0.1 * 0.9 * 0.9
    one_ship = 0.9 * 0.25 * 0.75 + 0.1 * 0.9 * 0.1
    assert prior[0b011] == pytest.approx(both_ships * (0.9 * 0.75 + 0.1 * 0.1))
    assert prior[0b001] == pytest.approx(one_ship * (0.9 * 0.75 + 0.1 * 0.1))
    assert sum(prior.values()) == pytest.approx(1.0)


def test_agents_own_priors_count():
    agents = [{"role": "benign", "belief": {"compromised": p}} for p in (0.01, 0.2)] + [{"role": "adversary"}]
    env = trust_env.vector_env(load_scenario("trio", agents=agents), "joint_posterior(pi=0.3)", num_worlds=1)
    env.reset(seed=0)
    assert env.arrays.joint_posterior_set_prior[0, 0] == pytest.approx(math.log(0.99 * 0.8 * 0.7))


def test_the_papers_first_case_is_resolved_without_counting():
    *_, (env,) = play("case1", "false_positive", ("joint_posterior(counts=False)",), 4, 19)
    adversary, benign, other = env.arrays.agent_trust.mean(axis=0)
    assert adversary < 0.3 and other < 0.3 and benign > 0.8
    real = env.arrays.scored_confirmed & (env.arrays.track_label >= 0)
    assert env.arrays.track_trust[real].min() > 0.8


@pytest.mark.parametrize(("attack", "share"), [("fov_aware", 0.2), ("optimal_false_positive", 0.5)])
def test_attacks_on_patrol_do_a_small_share_of_what_they_do_to_trust(attack, share):
    ours, theirs = (damage("patrol(knowledge=poses)", attack, d, 12) for d in ("joint_posterior", "trust"))
    assert ours < share * theirs


def test_three_adversaries_of_five_do_a_fifth_of_what_they_do_to_trust():
    scenario = load_scenario("patrol", n_adversaries=3, n_benign=2)
    ours, theirs = (damage(scenario, "optimal_false_positive", d, 12) for d in ("joint_posterior", "trust"))
    assert ours < 0.2 * theirs


def test_moving_phantoms_that_only_adversaries_see_are_told_by_how_many_there_were():
    ours, theirs, forgetful = (
        damage("patrol(knowledge=poses)", "stealth", defense, 12)
        for defense in ("joint_posterior", "trust", "joint_posterior(memory=0)")
    )
    assert ours < 0.7 * theirs and ours < 0.8 * forgetful


def test_standing_false_tracks_are_told_from_moving_targets():
    ours, without = (
        damage("patrol(knowledge=poses)", "fov_aware", defense, 12)
        for defense in ("joint_posterior", "joint_posterior(kinematics=False)")
    )
    assert ours < 0.5 * without


@pytest.mark.parametrize("benign", [3, 5])
def test_honest_play_is_no_worse_than_by_score_and_nobody_is_accused(benign):
    scenario = load_scenario("patrol", n_adversaries=5 - benign, n_benign=benign)
    assert damage(scenario, "honest", "joint_posterior", 12) <= damage(scenario, "honest", "score", 12)
    below = np.zeros((12, 5), int)
    for (env,) in play(scenario, "honest", ("joint_posterior",), 12, 200):
        below = np.where(env.arrays.agent_trust < 0.4, below + 1, 0)
        assert below.max() < 10


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("pi", 0.0, r"a number in \(0, 1\)"),
        ("gamma", 1.0, r"a number in \[0, 1\)"),
        ("counts", 1, "False or True"),
        ("cap_track", 100.0, r"a number in \[1, 60\]"),
        ("alone", (0.5, 0.1), "a list of 1 to 8 rising numbers"),
        ("most", 0, "a whole number from 1 to 10"),
        ("standing_weight", -1.0, r"a number in \(0"),
    ],
)
def test_parameters_out_of_range_are_named(name, value, expected):
    with pytest.raises(ValueError, match=f"joint_posterior: {name} must be {expected}.*, not"):
        JointPosterior(**{name: value})


def test_it_is_built_by_name():
    built = build_defense("joint_posterior(pi=0.3)")
    assert isinstance(built, JointPosterior) and built.params()["pi"] == 0.3
