"""`parsimony` on the paper's two cases, whose conflicts were worked out by hand, and its limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trust_env
from trust_env.spaces.action import ActionTable

FRAMES = 20
POSITIONS = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.8660254037844386]]


def agents_of(case: str, prior: float | None = None) -> dict[str, Any]:
    """The case with a prior probability that agent 1 is compromised."""
    roles = {"case1": "aba", "case2": "bba"}[case]
    agents: list[dict[str, Any]] = [
        {"role": "adversary" if role == "a" else "benign", "position": position}
        for role, position in zip(roles, POSITIONS)
    ]
    if prior is not None:
        agents[1]["belief"] = {"compromised": prior}
    return {"base": case, "agents": agents}


def played(scenario: Any, seed: int) -> Any:
    """The arrays of an episode of the case, with the false positives that the scenario names."""
    env = trust_env.vector_env(scenario, "parsimony", num_worlds=1, autoreset=False)
    env.reset(seed=seed)
    actions = np.zeros(env.arrays.action.shape, dtype=np.float32)
    for k in range(env.scenario.n_agents):
        places = [i.position for i in env.scenario.injections if i.agent == k]
        if places:
            actions[0, k] = ActionTable(env.scenario).encode(env.arrays.fov_box[0, k], np.array(places))
    for _ in range(FRAMES):
        env.step(actions)
    return env.arrays


def in_conflict(arrays: Any) -> set[tuple[int, int]]:
    bits = arrays.parsimony_conflicts[0]
    return {(k, other) for k in range(3) for other in range(k) if bits[k] >> other & 1}


@pytest.mark.core
@pytest.mark.parametrize("seed", range(3))
def test_case_1_has_three_explanations_by_two_liars(seed):
    arrays = played("case1", seed)
    assert in_conflict(arrays) == {(1, 0), (2, 0), (2, 1)}
    assert arrays.agent_trust[0] == pytest.approx([1 / 3] * 3)  # {0, 1}, {0, 2}, {1, 2}


@pytest.mark.parametrize("seed", range(3))
def test_case_1_with_agent_1_trusted_has_one_explanation(seed):
    arrays = played(agents_of("case1", prior=0.05), seed)
    assert arrays.agent_trust[0].tolist() == [0.0, 1.0, 0.0]
    assert set(arrays.track_trust[0][arrays.track_status[0] == 2]) == {0.0, 0.5, 1.0}


@pytest.mark.parametrize("seed", range(3))
def test_case_2_has_one_liar(seed):
    arrays = played("case2", seed)
    assert in_conflict(arrays) == {(2, 0), (2, 1)}
    assert arrays.agent_trust[0].tolist() == [1.0, 1.0, 0.0]
    confirmed = arrays.track_status[0] == 2
    # both false positives are denied by who does not lie; a target that only agent 2 sees is left open
    assert sorted(arrays.track_trust[0][confirmed]) == [0.0, 0.0, 0.5, 1.0, 1.0, 1.0]


def test_a_conflict_of_two_on_recorded_evidence_by_hand():
    """Four hits of four make a claim at ε = .02, four misses of four a denial at P_D = .9; three of each do not."""
    frame = {"track_id": [7], "expected": [[True], [True]], "detected": [[True], [False]], "held": [[True], [False]]}
    verdicts = trust_env.replay_evidence([frame] * 4, 2, "parsimony(gamma=1.0, a=5e-4)")
    assert verdicts[2].agent_trust.tolist() == [1.0, 1.0] and verdicts[2].track_trust.tolist() == [1.0]
    assert verdicts[3].agent_trust.tolist() == [0.5, 0.5]  # {0} and {1} explain it
    assert verdicts[3].track_trust.tolist() == [0.5] and verdicts[3].publish.tolist() == [True]


def test_without_conflict_nobody_lies():
    arrays = played(agents_of("case2") | {"injections": []}, 0)
    assert arrays.agent_trust[0].tolist() == [1.0, 1.0, 1.0]


def test_thirteen_agents_are_too_many():
    team = {"team.n_adversaries": 3, "team.n_benign": 9}
    trust_env.vector_env("trio(team.n_adversaries=3, team.n_benign=9)", "parsimony")
    with pytest.raises(ValueError, match=r"parsimony .*at most 12, not K = 13"):
        trust_env.vector_env(trust_env.load_scenario("trio", **(team | {"team.n_benign": 10})), "parsimony")
