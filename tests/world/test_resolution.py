"""What a sensor cannot tell apart is one detection, honest or injected."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from trust_env.fusion_centre import FusionCentre
from trust_env.scenario import load_scenario
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


def world(targets: list[list[float]], **changes: Any) -> Any:
    """Two agents at the origin, perfect sensors, no clutter."""
    agents = [{"role": "adversary", "position": [0.0, 0.0]}, {"role": "benign", "position": [0.0, 0.0]}]
    still = {"positions": targets, "velocities": [[0.0, 0.0]] * len(targets)}
    fields = {"base": "theorem", "agents": agents, "targets": still, "injection": {"slots": 3}}
    sensor = {"p_detect": 1.0, "sigma": 1e-3, "noise_cov": None, "clutter_density": 0.0, "max_detections": 8}
    return load_scenario(fields | {"sensor": sensor}, **changes)


def reported(env: VectorEnv, k: int) -> np.ndarray:
    return env.arrays.report_detections[0, k, : env.arrays.report_count[0, k]]


def step(scenario: Any, injected: list[list[float]]) -> VectorEnv:
    """A frame in which the adversary injects some points."""
    env = VectorEnv(scenario, "score", 1, autoreset=False)
    env.reset(1)
    actions = np.zeros((1, 2, env.action_table.size), dtype=np.float32)
    actions[0, 0] = env.action_table.encode(env.arrays.fov_box[0, 0], np.array(injected).reshape(-1, 2))
    env.step(actions)
    return env


TARGETS = [[10.0, 0.0], [12.0, 0.0], [14.0, 0.0], [30.0, 0.0]]


def test_of_honest_detections_the_nearest_to_the_agent_stays_as_it_is() -> None:
    """At 10, 12, 14 and 30 m with a resolution of 3 m: 12 falls to 10; 14 is 4 from what is kept."""
    env = step(world(TARGETS, **{"sensor.resolution": 3.0}), [])
    for k in range(2):
        np.testing.assert_allclose(reported(env, k), [[10.0, 0.0], [14.0, 0.0], [30.0, 0.0]], atol=0.01)
        assert env.arrays.report_origin[0, k, :3].tolist() == [0, 2, 3]
    assert env.arrays.raw_count[0].tolist() == [4, 4]


def test_honest_detections_stay_before_injections_and_agents_are_apart() -> None:
    """An injection 1 m from a target is gone, of two at one place one is left; the other agent reports as before."""
    env = step(world(TARGETS[3:], **{"sensor.resolution": 3.0}), [[29.0, 0.0], [0.0, 50.0], [0.0, 50.0]])
    np.testing.assert_allclose(reported(env, 0), [[30.0, 0.0], [0.0, 50.0]], atol=0.01)
    assert env.arrays.report_origin[0, 0, :2].tolist() == [0, -3]
    np.testing.assert_allclose(reported(env, 1), [[30.0, 0.0]], atol=0.01)
    assert env.arrays.track_count[0] == 2


def test_without_a_resolution_all_are_told_apart() -> None:
    env = step(world(TARGETS), [[0.0, 50.0], [0.0, 50.0]])
    assert env.arrays.report_count[0].tolist() == [6, 4] and env.arrays.track_count[0] == 6


def test_it_can_differ_between_agents() -> None:
    agents = [
        {"role": "adversary", "position": [0.0, 0.0], "sensor": {"resolution": 30.0}},
        {"role": "benign", "position": [0.0, 0.0]},
    ]
    env = step(world(TARGETS, agents=agents), [])
    assert env.arrays.report_count[0].tolist() == [1, 4]


@pytest.mark.parametrize("seed", range(3))
def test_many_detections_agree_with_a_plain_count(seed: int) -> None:
    scenario = load_scenario("crowd", **{"sensor.resolution": 60.0, "horizon": 3})
    env = VectorEnv(scenario, "score", 2, autoreset=False)
    env.reset(seed)
    merged = 0
    for _ in range(3):
        raw, counts = env.arrays.raw_detections.copy(), env.arrays.raw_count.copy()
        env.step(np.zeros((2, scenario.n_agents, env.action_table.size), dtype=np.float32))
        for w, k in np.ndindex(2, scenario.n_agents):
            kept: list[np.ndarray] = []
            for point in raw[w, k, : counts[w, k]]:
                if all(np.linalg.norm(point - other) >= 60.0 for other in kept):
                    kept.append(point)
            found = env.arrays.report_detections[w, k, : env.arrays.report_count[w, k]]
            np.testing.assert_array_equal(found, np.array(kept).reshape(-1, 2))
            merged += counts[w, k] - len(kept)
    assert merged > 30


def test_the_fusion_centre_merges_what_it_is_given() -> None:
    for resolution, tracks in ((None, 3), (5.0, 2)):
        centre = FusionCentre(world([], **{"sensor.resolution": resolution}), "score")
        frame = centre.update([np.array([[10.0, 0.0], [12.0, 0.0], [50.0, 0.0]]), np.zeros((0, 2))])
        assert len(frame.track_id) == tracks


def test_a_resolution_is_a_length() -> None:
    with pytest.raises(ValueError, match=r"sensor\.resolution.*expected a number from 1e-06 to 1e\+09"):
        world([], **{"sensor.resolution": 0.0})
