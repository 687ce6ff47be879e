"""The outline of an FOV: its corners in the world."""

import math

import numpy as np
import pytest

from trust_env.scenario.fov import Fov

CIRCLE = {"type": "circle", "radius": 2.0, "heading": 0.0, "width": 1.0, "vertices": None}


def test_outline_of_a_circle_lies_on_it():
    outline = Fov.model_validate(CIRCLE).shape.outline(np.array([1.0, -1.0, 0.3]))
    assert np.allclose(np.hypot(*(outline - [1.0, -1.0]).T), 2.0)


def test_outline_of_a_sector_turns_with_the_agent():
    fov = Fov.model_validate(CIRCLE | {"type": "sector", "heading": 0.5, "width": 1.0})
    outline = fov.shape.outline(np.array([1.0, 2.0, math.pi / 2]))
    angles = np.arctan2(*(outline[1:] - [1.0, 2.0]).T[::-1])
    assert outline[0].tolist() == [1.0, 2.0]  # the apex
    assert angles.min() == pytest.approx(math.pi / 2) and angles.max() == pytest.approx(math.pi / 2 + 1.0)


def test_outline_of_a_polygon_turns_with_the_agent():
    fov = Fov.model_validate(CIRCLE | {"type": "polygon", "vertices": [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]})
    outline = fov.shape.outline(np.array([10.0, 0.0, math.pi / 2]))
    assert np.allclose(outline, [[10.0, 0.0], [10.0, 2.0], [9.0, 0.0]])  # ahead is up, left is left
