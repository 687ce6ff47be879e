"""The lattice of spots for phantoms, its cells, and who looks there."""

from __future__ import annotations

import numpy as np
import pytest
from wrapper_runs import ADVERSARIES, patrol, play

from trust_env.agents.wrappers.by_need import ByNeed
from trust_env.agents.wrappers.spots import cells, lattice
from trust_env.scenario import Fovs
from trust_env.vector import VectorEnv

pytestmark = pytest.mark.core


@pytest.mark.parametrize("spacing", [0.05, 0.114, 0.3])
def test_lattice_points_are_no_nearer_than_the_spacing_and_fill_the_circle(spacing: float) -> None:
    points = lattice(spacing)
    distance = np.abs(points[:, None] - points) + 9.0 * np.eye(len(points))
    assert distance.min() >= spacing * (1.0 - 1e-5)
    assert len(points) == pytest.approx(np.pi / (np.sqrt(0.75) * spacing**2), rel=0.15)


def test_every_spot_is_in_the_one_cell_that_lies_around_it() -> None:
    points, g = lattice(0.114), 7
    members, cell = cells(points, g)
    assert sorted(members[members < len(points)]) == list(range(len(points)))
    for own in members:
        assert (cell[own[own < len(points)]] == np.flatnonzero((members == own).all(axis=1))).all()
        spots = points[own[own < len(points)]]
        assert len({(int((z.real + 1) * g / 2), int((z.imag + 1) * g / 2)) for z in spots}) == 1


def by_need(spec: str = "by_need(frame=area)", worlds: int = 6, **fields: object) -> tuple[VectorEnv, ByNeed]:
    env, wrapper = patrol(spec, worlds, **fields)
    assert isinstance(wrapper, ByNeed)
    wrapper.observe(env.arrays.observation[:, ADVERSARIES])
    return env, wrapper


def test_who_looks_at_a_spot_is_counted_by_the_fovs_of_all_agents() -> None:
    env, wrapper = by_need(knowledge="poses", worlds=6)
    poses, spots = env.observation_table.read(env.arrays.observation, None, "poses")[:, 0], wrapper.spots
    points = spots.positions(spots.offset, poses[:, ADVERSARIES], wrapper.reference.axis)
    looks = Fovs.of(env.scenario, np.arange(5)).contains(poses, points.reshape(6, 1, -1, 2))
    looks = looks.reshape(6, 5, 2, -1)
    np.testing.assert_array_equal(spots.honest, looks[:, 2:].sum(axis=1))
    np.testing.assert_array_equal(spots.others[:, 0], looks[:, 1, 0])
    np.testing.assert_array_equal(spots.others[:, 1], looks[:, 0, 1])


def test_at_level_own_nobody_knows_where_honest_agents_look() -> None:
    _, wrapper = by_need(knowledge="own")
    assert not wrapper.spots.honest.any()
    assert wrapper.spots.others.any()  # a coalition tells each other where it stands


def test_a_phantom_appears_where_the_fewest_honest_agents_look() -> None:
    env, wrapper = by_need("by_need(g=2, placed=1)", 6, knowledge="poses")
    play(env, wrapper, np.tile([0, 3, 0, 0, 0], (6, 2, 1)))
    spot = wrapper.spot.max(axis=2)  # of the only phantom
    members = wrapper.spots.members[0]
    members = members[members < len(wrapper.spots.offset)]
    honest = np.where(wrapper.spots.usable[..., members], wrapper.spots.honest[..., members], 99)
    chosen = np.take_along_axis(wrapper.spots.honest, spot[..., None], axis=2)[..., 0]
    np.testing.assert_array_equal(chosen, honest.min(axis=2))
    assert (honest.max(axis=2) > honest.min(axis=2)).any()
