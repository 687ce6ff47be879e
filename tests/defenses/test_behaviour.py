"""What each built-in defense is good for, and what defeats it: attacks on `patrol`, one seed, with margin."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import trust_env
from trust_env import training
from trust_env.agents import Player

EPISODES = 30


@functools.cache
def played(attack: str, defense: str) -> tuple[float, float]:
    """Mean damage per frame, and mean AUROC of the adversaries."""
    cell = training.evaluate("patrol", attack, [defense], EPISODES, seed=0, progress=False)[attack, defense]
    return float(np.mean(cell.metrics["damage_per_frame"])), float(np.mean(cell.metrics["adversary_auroc"]))


def damage(attack: str, defense: str) -> float:
    return played(attack, defense)[0]


def auroc(attack: str, defense: str) -> float:
    return played(attack, defense)[1]


def test_quorum_pays_for_its_promise_with_the_tracks_that_one_agent_sees():
    assert damage("honest", "quorum") > 2 * damage("honest", "trust")
    assert damage("exclusive", "quorum") < 0.4 * damage("exclusive", "trust")


def test_quorum_needs_one_more_agent_than_collude():
    """Two adversaries that report the same phantoms are a quorum of two, and none of three."""
    assert damage("stealth", "quorum") > 0.65 * damage("stealth", "trust")
    assert damage("stealth", "quorum(l=2)") < 0.55 * damage("stealth", "trust")


def test_quorum_shows_no_false_track_of_one_liar_that_no_honest_detection_supports():
    nothing_else = {"sensor": {"clutter_density": 0.0}, "targets": {"initial": 0.0, "birth_rate": 0.0}}
    team = {"n_adversaries": 1, "n_benign": 4}
    scenario = {"base": "patrol", "team": team, **nothing_else, "tracker": {"beta_fp": 1e-6}}
    found = training.evaluate(scenario, "false_positive", ["quorum", "trust"], 10, seed=0, progress=False)
    quorum, trust = (
        found["false_positive", d].metrics["injected_tracks_per_frame"].mean() for d in ("quorum", "trust")
    )
    assert quorum == 0.0 and trust > 0.3


@pytest.mark.parametrize(
    ("defense", "least"), [("binary_beta", 0.75), ("rfsn_beta", 0.78), ("particle", 0.78), ("parsimony", 0.85)]
)
def test_agents_that_report_what_others_do_not_see_are_found(defense, least):
    assert auroc("false_positive", defense) > least
    assert damage("false_positive", defense) < 0.6 * damage("false_positive", "score")


def test_particle_is_like_rfsn_beta():
    assert abs(damage("false_positive", "particle") - damage("false_positive", "rfsn_beta")) < 0.2
    assert abs(auroc("false_positive", "particle") - auroc("false_positive", "rfsn_beta")) < 0.05


@pytest.mark.parametrize(("defense", "most"), [("parsimony", 0.7), ("path_trust(anchor=4)", 0.7)])
def test_few_liars_explain_what_a_local_majority_claims(defense, most):
    assert damage("optimal_false_positive", defense) < most * damage("optimal_false_positive", "trust")
    assert auroc("optimal_false_positive", defense) > auroc("optimal_false_positive", "trust") + 0.1


def test_score_asymmetry_gives_one_suppressor_a_veto():
    assert damage("suppress", "score_asymmetry") > 3 * damage("suppress", "trust")
    assert damage("suppress", "score_asymmetry(l=1)") < 0.6 * damage("suppress", "score_asymmetry")


def test_dawid_skene_takes_a_local_majority_for_the_truth():
    assert auroc("false_positive", "dawid_skene") > 0.75
    assert damage("fov_aware", "dawid_skene") > 0.95 * damage("fov_aware", "score")
    assert auroc("fov_aware", "dawid_skene") < 0.65


def test_cusum_finds_those_who_suppress():
    assert auroc("suppress", "cusum") > 0.95
    assert damage("suppress", "cusum") < damage("suppress", "trust")


def test_cusum_finds_hits_that_are_too_good():
    """Whether each agent's last d² were ever improbable, [W, K], under an attack that reports exact places."""
    env = trust_env.vector_env("patrol(knowledge=poses)", "cusum", num_worlds=20, autoreset=False)
    player = Player(env, {"adversary": "optimal_false_positive"})
    observations, _ = env.reset(seed=0)
    alarmed = np.zeros((20, 5), dtype=bool)
    for _ in range(150):
        observations, *_ = env.step(player.actions(observations))
        alarmed |= env.arrays.cusum_improbable
    assert alarmed[:, :2].mean() > 0.9 and alarmed[:, 2:].mean() < 0.1


def test_the_oracle_bounds_what_phantoms_can_do():
    for attack in ("false_positive", "optimal_false_positive", "fov_aware"):
        assert damage(attack, "oracle") < 1.3 * damage("honest", "oracle")
    assert damage("honest", "oracle(lone=show)") < 0.8 * damage("honest", "oracle")
    assert damage("fov_aware", "oracle(lone=show)") > 4 * damage("fov_aware", "oracle")


def test_blank_costs_the_same_whatever_the_attack():
    assert damage("honest", "blank") == damage("fov_aware", "blank") == pytest.approx(6.3, abs=0.5)
