"""Fields of view: what they hold, where they end, how points get inside, and how clutter fills them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from kernels import Bench, entry, fov_of, reach_of
from oracle import Contains
from scipy import stats

from trust_env.world import fov
from trust_env.world.random import Key

TRIANGLE = [[0.0, -20.0], [60.0, 0.0], [0.0, 20.0]]
HEXAGON = [[30.0 * math.cos(a), 30.0 * math.sin(a)] for a in np.arange(6) * math.pi / 3]
FOVS: dict[str, dict[str, Any]] = {
    "circle": {"type": "circle", "radius": 50.0},
    "small circle": {"type": "circle", "radius": 1e-3},
    "sector": {"type": "sector", "radius": 50.0, "heading": 0.0, "width": math.pi / 3},
    "narrow sector": {"type": "sector", "radius": 50.0, "heading": 2.0, "width": 0.01},
    "half": {"type": "sector", "radius": 50.0, "heading": -1.0, "width": math.pi},
    "wide sector": {"type": "sector", "radius": 50.0, "heading": 3.0, "width": 5.5},
    "full sector": {"type": "sector", "radius": 50.0, "heading": 1.0, "width": 2 * math.pi},
    "triangle": {"type": "polygon", "vertices": TRIANGLE},
    "clockwise triangle": {"type": "polygon", "vertices": TRIANGLE[::-1]},
    "hexagon": {"type": "polygon", "vertices": HEXAGON},
    "ahead of the agent": {"type": "polygon", "vertices": [[40, -5], [90, -5], [90, 5], [40, 5]]},
}
POSES = [(0.0, 0.0, 0.0), (-3000.0, 5000.0, math.pi), (5.0, 5.0, 40.0)]


@entry
def run_contains(world, k, points, out):
    for i in range(points.shape[0]):
        out[i] = fov.contains(world, k, points[i, 0], points[i, 1])


@entry
def run_move_inside(world, k, points, out):
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1] = fov.move_inside(world, k, points[i, 0], points[i, 1])


@entry
def run_sample(world, k, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = fov.sample(world, k, Key(7, 0, 0), i // 1000, (k << 12) | (i % 1000))


@entry
def run_locate(world):
    fov.locate_fovs(world)


class Case:
    """An agent with one FOV at one pose (agent 1 of two, so that indices matter), and the reference's Φ."""

    def __init__(self, shape: dict[str, Any], pose: tuple[float, float, float]):
        agents = [
            {"role": "benign", "position": [0.0, 0.0], "fov": {"type": "circle", "radius": 0.5}},
            {"role": "benign", "position": list(pose[:2]), "heading": pose[2], "fov": shape},
        ]
        self.bench = Bench({"base": "patrol", "agents": agents, "sensor": {"clutter_density": 1e-6}})
        self.bench["pose"][1] = self.pose = np.array(pose)
        if shape["type"] == "sector":
            self.bench["fov_heading"][1] = shape["heading"]  # as at the beginning of an episode
        run_locate(self.bench.world)
        self.k = np.int64(1)
        self.phi: Contains = fov_of(self.bench.scenario, 1, self.pose)
        self.reach = reach_of(self.bench.scenario, 1)

    def contains(self, points: np.ndarray) -> np.ndarray:
        out = np.zeros(len(points), dtype=bool)
        run_contains(self.bench.world, self.k, points, out)
        return out

    def move_inside(self, points: np.ndarray) -> np.ndarray:
        out = np.empty_like(points)
        run_move_inside(self.bench.world, self.k, points, out)
        return out

    def box(self) -> np.ndarray:
        return self.bench["fov_box"][1].copy()

    def around(self, n: int, factor: float = 1.5) -> np.ndarray:
        rng = np.random.default_rng(11)
        return self.pose[:2] + rng.uniform(-factor * self.reach, factor * self.reach, (n, 2))


def border_of(case: Case) -> np.ndarray:
    """Corners of the FOV and a fine walk along its arc, in the world frame."""
    shape, (x, y, heading) = case.bench.scenario.agent(1).fov, case.pose
    if shape.type == "polygon":
        corners = np.array(shape.vertices)
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        return corners @ turn.T + (x, y)
    half = math.pi if shape.type == "circle" else shape.width / 2
    middle = heading + (0.0 if shape.type == "circle" else shape.heading)
    angle = middle + np.linspace(-half, half, 20_001)
    arc = np.column_stack([np.cos(angle), np.sin(angle)]) * shape.radius + (x, y)
    return np.concatenate([arc, [[x, y]]])


def same_distribution(a: np.ndarray, b: np.ndarray) -> bool:
    result: Any = stats.ks_2samp(a, b)
    return result.pvalue > 1e-4


@pytest.fixture(params=[(name, i) for name in FOVS for i in range(len(POSES))], ids=lambda p: f"{p[0]}-{p[1]}")
def case(request) -> Case:
    name, i = request.param
    return Case(FOVS[name], POSES[i])


@pytest.mark.core
def test_contains_what_the_reference_contains(case):
    points = case.around(500)
    expected = np.array([case.phi(point) for point in points])
    assert (case.contains(points) == expected).all()


@pytest.mark.core
def test_moved_points_are_inside_and_inside_points_stay(case):
    points = np.concatenate([case.around(200), case.around(200, factor=1e3), case.pose[None, :2]])
    moved, inside = case.move_inside(points), case.contains(points)
    assert (moved[inside] == points[inside]).all()
    assert case.contains(moved).all()
    assert all(case.phi(point) for point in moved[:-1])  # of the apex itself the reference has no opinion
    again = case.move_inside(moved)
    assert (again == moved).all()


@pytest.mark.core
def test_the_box_holds_the_fov_and_touches_it(case):
    x0, x1, y0, y1 = case.box()
    points = case.around(5000, factor=1.01)
    held = points[case.contains(points)]
    slack = 1e-9 * (case.reach + np.abs(case.pose[:2]).max())
    assert (held >= (x0 - slack, y0 - slack)).all() and (held <= (x1 + slack, y1 + slack)).all()
    border = border_of(case)
    assert [x0, x1] == pytest.approx([border[:, 0].min(), border[:, 0].max()], abs=1e-6 * case.reach)
    assert [y0, y1] == pytest.approx([border[:, 1].min(), border[:, 1].max()], abs=1e-6 * case.reach)


@pytest.mark.core
def test_clutter_fills_the_fov_evenly(case):
    n = 6000
    sample = np.empty((n, 2))
    run_sample(case.bench.world, case.k, sample)
    assert case.contains(sample).mean() > 1.0 - 1e-3
    assert len(np.unique(sample[:, 0])) > 0.99 * n
    uniform = case.around(400_000, factor=1.0)  # rejection sampling, as the other way to the same distribution
    uniform = uniform[case.contains(uniform)]
    if len(uniform) < 500:
        return  # too narrow to compare with
    for direction in (0.0, 0.5, 1.1, 2.0):
        axis = np.array([math.cos(direction), math.sin(direction)])
        assert same_distribution(sample @ axis, uniform @ axis)
    radii = (np.hypot(*(points - case.pose[:2]).T) for points in (sample, uniform))
    assert same_distribution(*radii)


@pytest.mark.core
@pytest.mark.nojit
def test_edges_by_hand():
    circle = Case(FOVS["circle"], POSES[0])
    assert circle.contains(np.array([[50.0, 0.0], [0.0, -50.0], [30.0, 40.0], [50.0, 1e-3]])).tolist() == [
        True, True, True, False,
    ]  # fmt: skip
    sector = Case(FOVS["half"] | {"heading": 0.0}, (10.0, 0.0, math.pi / 2))  # looks north from (10, 0)
    points = np.array([[10.0, 0.0], [10.0, 50.0], [10.0, -1.0], [-39.0, 1.0], [-39.0, -1.0], [45.0, 35.0]])
    assert sector.contains(points).tolist() == [True, True, False, True, False, True]
    assert sector.box() == pytest.approx([-40.0, 60.0, 0.0, 50.0], abs=1e-9)
    square = {"type": "polygon", "vertices": [[0, 0], [10, 0], [10, 10], [0, 10]]}
    turned = Case(square, (0.0, 0.0, math.pi / 4))
    assert turned.contains(np.array([[0.0, 14.0], [0.0, -0.1], [7.0, 7.1], [7.0, 6.9]])).tolist() == [
        True, False, True, False,
    ]  # fmt: skip
    half = math.sqrt(200.0) / 2
    assert turned.box() == pytest.approx([-half, half, 0.0, 2 * half], abs=1e-9)


@pytest.mark.core
@pytest.mark.nojit
def test_moved_by_hand():
    circle = Case(FOVS["circle"], (10.0, 0.0, 0.0))
    assert circle.move_inside(np.array([[110.0, 0.0]])) == pytest.approx(np.array([[10 + 50 * (1 - 1e-6), 0.0]]))
    sector = Case(FOVS["sector"], POSES[0])  # opens 30 degrees to each side
    moved = sector.move_inside(np.array([[0.0, 20.0], [100.0, 0.0], [-10.0, -1e-3]]))
    root = math.sqrt(3.0)
    expected = np.array([[10 * root, 10.0], [50.0, 0.0], [5 * root, -5.0]])
    assert moved == pytest.approx(expected, abs=1e-4)


@pytest.mark.core
@pytest.mark.nojit
def test_boxes_follow_the_poses():
    case = Case(FOVS["triangle"], POSES[0])
    case.bench["pose"][1] = (1000.0, 0.0, 0.0)
    run_locate(case.bench.world)
    assert case.bench["fov_box"][1] == pytest.approx([1000.0, 1060.0, -20.0, 20.0])
    assert case.bench["fov_box"][0] == pytest.approx(
        np.array([-0.5, 0.5, -0.5, 0.5]) + np.repeat(case.bench["pose"][0, :2], 2)
    )
