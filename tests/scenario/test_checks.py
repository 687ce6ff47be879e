"""Values out of bounds, and fields that contradict each other."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            {"radius": 0},
            "fov.radius = 0.0 (override): expected a number from 1e-06 to 1e+09, or the FOV sees nothing",
        ),
        ({"type": "sector", "width": 0}, "fov.width = 0.0 (override): expected radians above 0"),
        ({"type": "sector", "width": 90}, "at most 2 pi (6.283185307179586)"),
        ({"type": "polygon"}, "fov.vertices = null (from base.yaml"),
        ({"type": "polygon", "vertices": [[0, 0], [1, 0]]}, "expected at least 3 vertices"),
        ({"type": "polygon", "vertices": [[0, 0], [1, 0], [2, 0]]}, "enclose an area above 0"),
        (
            {"type": "polygon", "vertices": [[0, 0], [0, 0], [1, 0], [0, 1]]},
            "differ from their neighbours",
        ),
        (
            {"type": "polygon", "vertices": [[0, 0], [4, 0], [1, 1], [0, 4]]},
            "corners of a convex polygon",
        ),
        ({"noise_cov": [[-1, 0], [0, -1]]}, "expected a positive definite matrix: variances above 0"),
        (
            {"noise_cov": [[1, 2], [2, 1]]},
            "sensor.noise_cov = [[1.0, 2.0], [2.0, 1.0]] (override): expected a positive",
        ),
        ({"noise_cov": [[1, 1], [1, 1]]}, "expected a positive definite matrix"),
        ({"noise_cov": [[1, 0.5], [0.2, 1]]}, "expected a symmetric matrix"),
        (
            {"noise_cov": [[1, 0, 0], [0, 1, 0]]},
            "noise_cov[0] = [1, 0, 0] (override): expected a list of 2 numbers",
        ),
        ({"noise_cov": [[1, 0], [0, 1]], "sigma": 3}, "expected exactly one of sigma and noise_cov"),
        ({"sigma": None}, "expected exactly one of sigma and noise_cov"),
        ({"sigma": -1}, "sensor.sigma = -1 (override): expected a number from 1e-06 to 1e+09"),
        ({"area": [0, 0, 0, 1]}, "or the area is zero"),
        ({"confirm_m": 6}, "tracker.confirm_m = 6 (override): expected at most confirm_n (5)"),
        ({"confirm_n": 33}, "expected a whole number from 1 to 32"),
        ({"tracker.alpha": 0.5, "beta": 0.5}, "expected alpha + beta below 1"),
        ({"tracker.p_detect": 1}, "tracker.p_detect = 1 (override): expected a number from 1e-15 to below 1"),
        (
            {"clutter_density": 0},
            "expected false positives per m^2 above 0, as the clutter density of agent 0 is 0",
        ),
        (
            {"clutter_density": 1e-3},
            "holds 384.845 false positives on average; expected at most sensor.max_detections",
        ),
        ({"injection.slots": 20}, "expected at least injection.slots (20)"),
        ({"n_adversaries": 0, "n_benign": 0}, "there are 0 agents; expected 1 to 64 in all"),
        ({"n_benign": 63}, "there are 65 agents; expected 1 to 64 in all"),
        ({"agents": []}, "agents (override): there are 0 agents"),
        (
            {"placement": "traffic"},
            "team.placement = 'traffic' (override): expected a recording in targets.data",
        ),
        ({"speed": [3, 1]}, "targets.speed = [3.0, 1.0] (override): expected [min, max] with min <= max"),
        (
            {"positions": [[0, 0]], "velocities": [[1, 1], [2, 2]]},
            "expected one velocity per position (1)",
        ),
        ({"velocities": [[1, 1]]}, "expected one velocity per position (0)"),
        ({"injections": [{"agent": 5, "position": [0, 0]}]}, "expected the index of an agent, 0 to 4"),
        (
            {"injections": [{"agent": 2, "position": [0, 0]}]},
            "at most 0 injections of benign_0, its budget",
        ),
        (
            {"agents": [{"role": "benign", "fov": {"radius": -1}}]},
            "agents[0].fov.radius = -1.0 (override)",
        ),
        (
            {"agents": [{"role": "benign", "sensor": {"noise_cov": [[1, 3], [3, 1]]}}]},
            "agents[0].sensor.noise_cov = [[1.0, 3.0], [3.0, 1.0]] (override): expected a positive",
        ),
        (
            {"agents": [{"role": "benign", "sensor": {"clutter_density": 1.0}}]},
            "agents[0].sensor.clutter_density = 1.0",
        ),
    ],
)
def test_inconsistent_fields_are_named_with_what_was_expected(
    error_of, overrides: dict[str, object], expected: str
) -> None:
    assert expected in error_of("patrol", **overrides)
