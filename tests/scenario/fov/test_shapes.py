"""Every FOV shape: its area, samples, box and outline agree with what it contains."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from trust_env.scenario import Fov, Fovs, load_scenario
from trust_env.scenario.fov import SHAPES

TRIANGLE = ((0.0, -20.0), (60.0, 0.0), (0.0, 20.0))
SQUARE_AHEAD = ((40.0, 5.0), (40.0, -5.0), (50.0, -5.0), (50.0, 5.0))
EXAMPLES: dict[str, list[dict[str, Any]]] = {
    "circle": [{"radius": 50.0}, {"radius": 1e-3}],
    "sector": [
        {"radius": 50.0, "heading": 0.3, "width": 1.0},
        {"radius": 50.0, "heading": -2.0, "width": 5.5},
        {"radius": 50.0, "heading": 1.0, "width": 2 * math.pi},
    ],
    "polygon": [{"vertices": TRIANGLE}, {"vertices": TRIANGLE[::-1]}, {"vertices": SQUARE_AHEAD}],
}
CASES = [(kind, i) for kind in SHAPES for i in range(len(EXAMPLES[kind]))]
HEADINGS = np.array([0.0, 0.7, math.pi / 2, -2.0])  # rad, one per world
X, Y = 300.0, -200.0  # m
POSES = np.stack([np.full(4, X), np.full(4, Y), np.cos(HEADINGS), np.sin(HEADINGS)], axis=-1)


def fov_of(case: tuple[str, int]) -> Fov:
    kind, i = case
    return Fov.model_validate({**load_scenario("patrol").fov.model_dump(), "type": kind, **EXAMPLES[kind][i]})


def fovs_of(cases: list[tuple[str, int]]) -> Fovs:
    agents = [{"role": "benign", "fov": {"type": kind, **EXAMPLES[kind][i]}} for kind, i in cases]
    return Fovs.of(load_scenario("patrol", agents=agents), np.arange(len(cases)))


def poses_of(n: int) -> np.ndarray:
    """[4, n, 4]"""
    return np.repeat(POSES[:, None], n, axis=1)


@pytest.fixture(params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def case(request: pytest.FixtureRequest) -> tuple[str, int]:
    return request.param


def test_every_shape_has_examples() -> None:
    assert EXAMPLES.keys() == SHAPES.keys()


def test_the_types_of_a_scenario_are_the_registered_shapes(error_of) -> None:
    expected = f"did you mean 'polygon'? expected one of {', '.join(SHAPES)}"
    assert f"fov.type = 'polygn' (override): {expected}" in error_of("patrol", type="polygn")


def test_the_area_is_that_of_the_points_contained(case) -> None:
    n, fovs, poses = 40_000, fovs_of([case]), poses_of(1)
    box = fovs.boxes(poses)[..., None, :]  # [4, 1, 1, 4]
    low, size = box[..., 0::2], box[..., 1::2] - box[..., 0::2]
    points = low + np.random.default_rng(3).random((4, 1, n, 2)) * size
    inside = fovs.contains(poses, points).mean(axis=-1)  # [4, 1]
    areas, deviation = inside * size.prod(axis=-1)[..., 0], np.sqrt(inside * (1.0 - inside) / n)
    tolerance = 5.0 * deviation * size.prod(axis=-1)[..., 0] + 1e-12
    assert (np.abs(areas - fov_of(case).area) <= tolerance).all()


def test_samples_are_contained_within_reach_and_in_the_box(case) -> None:
    fovs, poses = fovs_of([case]), poses_of(1)
    draws = np.random.default_rng(4).random((4, 1, 5000, 3))
    draws[..., :8, :] = np.indices((2, 2, 2)).reshape(3, 8).T * np.nextafter(1.0, 0.0)  # the extremes
    samples, box = fovs.sample(poses, draws), fovs.boxes(poses)[..., None, :]
    assert fovs.contains(poses, samples).all()
    assert (samples >= box[..., 0::2]).all() and (samples <= box[..., 1::2]).all()
    assert np.hypot(*np.moveaxis(samples - (X, Y), -1, 0)).max() <= fov_of(case).reach


def test_the_outline_lies_in_the_box_and_extends_to_the_reach(case) -> None:
    fov, boxes = fov_of(case), fovs_of([case]).boxes(poses_of(1))
    slack = 1e-9 * (fov.reach + abs(X) + abs(Y))
    for heading, (x_min, x_max, y_min, y_max) in zip(HEADINGS, boxes[:, 0], strict=True):
        outline = fov.shape.outline(np.array([X, Y, heading]))
        assert (outline >= (x_min - slack, y_min - slack)).all()
        assert (outline <= (x_max + slack, y_max + slack)).all()
        assert np.hypot(*(outline - (X, Y)).T).max() == pytest.approx(fov.reach, abs=slack)


def test_the_box_touches_the_samples_on_all_sides(case) -> None:
    fovs, poses = fovs_of([case]), poses_of(1)
    samples = fovs.sample(poses, np.random.default_rng(5).random((4, 1, 20_000, 3)))[:, 0]
    box = fovs.boxes(poses)[:, 0]  # [4, 4]
    gaps = np.concatenate([samples.min(axis=1) - box[:, 0::2], box[:, 1::2] - samples.max(axis=1)], axis=-1)
    assert (gaps < 0.1 * fov_of(case).reach).all()


def test_the_opening_holds_all_samples(case) -> None:
    samples = fovs_of([case]).sample(poses_of(1), np.random.default_rng(6).random((4, 1, 1000, 3)))[0, 0]
    axis, half_width = fov_of(case).shape.opening  # the first world's heading is 0
    off_axis = np.angle(np.exp(1j * (np.arctan2(*(samples - (X, Y)).T[::-1]) - axis)))
    assert (np.abs(off_axis) <= half_width + 1e-9).all()


def test_the_middle_is_well_inside(case) -> None:
    fovs, poses = fovs_of([case]), poses_of(1)
    u, v = fovs.middle[0]
    c, s = np.cos(HEADINGS), np.sin(HEADINGS)
    middle = np.stack([X + c * u - s * v, Y + s * u + c * v], axis=-1)[:, None, None]
    assert fovs.contains(poses, middle, margin=0.9).all()


def test_an_fov_has_the_same_bits_alone_and_among_other_shapes() -> None:
    rng, n = np.random.default_rng(7), len(CASES)
    poses, draws = poses_of(n), rng.random((4, n, 50, 3))
    together = fovs_of(CASES)
    samples, boxes = together.sample(poses, draws), together.boxes(poses)
    points = samples + rng.normal(size=samples.shape) * np.array([fov_of(c).reach for c in CASES])[:, None, None]
    contained, well_inside = together.contains(poses, points), together.contains(poses, points, 0.2)
    assert 0.05 < contained.mean() < 0.95
    for k, case in enumerate(CASES):
        alone, pose, of_k = fovs_of([case]), poses[:, k : k + 1], np.s_[:, k : k + 1]
        np.testing.assert_array_equal(alone.sample(pose, draws[of_k]), samples[of_k])
        np.testing.assert_array_equal(alone.boxes(pose), boxes[of_k])
        np.testing.assert_array_equal(alone.contains(pose, points[of_k]), contained[of_k])
        np.testing.assert_array_equal(alone.contains(pose, points[of_k], 0.2), well_inside[of_k])


def test_fovs_of_no_agents_are_empty() -> None:
    none = Fovs.of(load_scenario("patrol"), np.arange(0))
    assert none.boxes(np.zeros((2, 0, 4))).shape == (2, 0, 4)
    assert none.contains(np.zeros((2, 0, 4)), np.zeros((2, 0, 3, 2))).shape == (2, 0, 3)
    assert none.sample(np.zeros((2, 0, 4)), np.zeros((2, 0, 3, 3))).shape == (2, 0, 3, 2)


def test_areas_by_hand() -> None:
    assert fov_of(("circle", 0)).area == pytest.approx(math.pi * 2500.0)
    assert fov_of(("sector", 0)).area == pytest.approx(1250.0)
    assert fov_of(("polygon", 0)).area == fov_of(("polygon", 1)).area == 1200.0
    assert fov_of(("polygon", 2)).area == 100.0


def test_reaches_by_hand() -> None:
    assert fov_of(("sector", 0)).reach == 50.0
    assert fov_of(("polygon", 0)).reach == 60.0
    assert fov_of(("polygon", 2)).reach == pytest.approx(math.sqrt(2525.0))


def test_a_star_is_no_convex_polygon(error_of) -> None:
    star = [[math.cos(a), math.sin(a)] for a in np.arange(5) * 4 * math.pi / 5]
    assert "corners of a convex polygon" in error_of("patrol", type="polygon", vertices=star)
    convex = [[math.cos(a), math.sin(a)] for a in np.arange(5) * -2 * math.pi / 5]
    scenario = load_scenario("patrol", type="polygon", vertices=convex)
    assert scenario.fov.area == pytest.approx(2.5 * math.sin(2 * math.pi / 5))
