"""The FOV shapes that policies compute with, against those of the simulator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from attack_runs import SHAPES, quiet

from trust_env.scenario import Fovs, load_scenario
from trust_env.spaces.action import ActionTable
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


class TestGeometry:
    def world(self, shape: str, worlds: int = 16) -> tuple[VectorEnv, Fovs, np.ndarray]:
        agents = [{"role": "adversary"}, {"role": "benign", "heading": 1.0}]
        env = VectorEnv({"base": "patrol", "agents": agents, "fov": SHAPES[shape]}, "score", worlds)
        seen, _ = env.reset(9)
        pose = env.observation_table.read(seen, np.arange(2))["pose"]
        return env, Fovs.of(env.scenario, np.arange(2)), pose

    @pytest.mark.parametrize("shape", SHAPES)
    def test_boxes_are_those_of_the_simulator(self, shape: str) -> None:
        env, fovs, pose = self.world(shape)
        np.testing.assert_allclose(fovs.boxes(pose), env.arrays.fov_box, atol=1e-3)

    @pytest.mark.parametrize("shape", SHAPES)
    def test_contains_agrees_with_the_simulator(self, shape: str) -> None:
        env, fovs, pose = self.world(shape)
        rng, checked = np.random.default_rng(1), 0
        for _ in range(20):
            box = fovs.boxes(pose)[:, :1, None]
            points = box[..., 0::2] + rng.random((16, 1, 4, 2)) * (box[..., 1::2] - box[..., 0::2])
            actions = np.zeros((16, 2, 28), dtype=np.float32)
            actions[:, :1] = ActionTable(env.scenario).encode(box[..., 0, :], points)
            env.step(actions)
            reported = env.arrays.report_count[:, 0]
            rows = [env.arrays.report_detections[w, 0, c - 4 : c] for w, c in enumerate(reported)]
            stays = np.linalg.norm(np.array(rows) - points[:, 0], axis=-1) < 1e-3
            np.testing.assert_array_equal(fovs.contains(pose, points)[:, 0], stays)
            checked += int(stays.sum())
        assert 0.2 * 1280 < checked < 1280

    @pytest.mark.parametrize("shape", SHAPES)
    def test_samples_are_inside_and_uniform(self, shape: str) -> None:
        _, fovs, pose = self.world(shape)
        draws = np.random.default_rng(2).random((16, 2, 1000, 3))
        points = fovs.sample(pose, draws)
        assert fovs.contains(pose, points).all()
        box = fovs.boxes(pose)
        share = fovs.contains(
            pose, box[..., None, 0::2] + draws[..., :2] * (box[..., None, 1::2] - box[..., None, 0::2])
        )
        # Uniform over the box and kept where contained: the same distribution, by another way.
        kept = box[..., None, 0::2] + draws[..., :2] * (box[..., None, 1::2] - box[..., None, 0::2])
        for k in range(2):
            a = (points - pose[..., None, :2])[0, k]
            b = (kept - pose[..., None, :2])[0, k][share[0, k]]
            spread = 5 * np.hypot(a.std(axis=0) / math.sqrt(len(a)), b.std(axis=0) / math.sqrt(len(b)))
            assert (np.abs(a.mean(axis=0) - b.mean(axis=0)) < spread).all()
            assert (np.abs(a.std(axis=0) / b.std(axis=0) - 1.0) < 0.15).all()

    def test_shapes_have_the_numbers_worked_out_by_hand(self) -> None:
        agents = [
            {"role": "adversary", "position": [0, 0], "fov": fov}
            for fov in (
                {"type": "sector", "radius": 10, "heading": 0, "width": math.pi / 2},
                {"type": "polygon", "vertices": [[0, 0], [0, 4], [4, 0]]},
            )
        ]
        fovs = Fovs.of(load_scenario(quiet(agents)), np.arange(2))
        north = np.array([[1.0, 2.0, 0.0, 1.0]] * 2)  # at (1, 2), heading north
        points = np.array([[[1.0, 11.0], [1.0, 12.1], [8.0, 8.9], [8.0, 9.1], [1.0, 2.0], [-1.0, 3.0], [-2.4, 2.5]]])
        assert fovs.contains(north, points).tolist() == [
            [True, False, False, True, True, False, False],
            [False, False, False, False, True, True, True],
        ]
        half = math.sqrt(0.5) * 10
        expected = [[1 - half, 1 + half, 2.0, 12.0], [-3.0, 1.0, 2.0, 6.0]]
        np.testing.assert_allclose(fovs.boxes(north), expected, atol=1e-12)
        centroid = 2 / 3 * 10 * math.sin(math.pi / 4) / (math.pi / 4)
        np.testing.assert_allclose(fovs.middle, [[centroid, 0.0], [4 / 3, 4 / 3]])
        edge = np.array([[[1.0, 11.5]], [[0.9, 4.0]]])  # inside, but for the sector not well inside
        assert fovs.contains(north, edge).tolist() == [[True], [True]]
        assert fovs.contains(north, edge, 0.2).tolist() == [[False], [False]]
