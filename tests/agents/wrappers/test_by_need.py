"""The by_need wrapper: what each choice does, and that more phantoms than slots live."""

from __future__ import annotations

import numpy as np
import pytest
from wrapper_runs import ADVERSARIES, injected, off_agent, patrol, play, reset_wrapper

from trust_env.agents.wrappers.by_need import ANYWHERE, NOWHERE, ByNeed
from trust_env.scenario import load_scenario
from trust_env.vector import vector_env

pytestmark = pytest.mark.core


def chosen(
    place: int | None = None, withdraw: int | None = None, doubles: int = 0, suppress: int = 0, learners: int = 2
) -> np.ndarray:
    """Choices in one world that place a phantom in a cell, or none, and withdraw one of a cell, or none; placed=1."""
    sight = NOWHERE if place is None else ANYWHERE
    withdrawn = 0 if withdraw is None else 1 + withdraw
    return np.tile([place or 0, sight, withdrawn, doubles, suppress], (1, learners, 1))


def middle_cell(wrapper: ByNeed) -> int:
    """The cell in the middle of the FOV."""
    return int(np.flatnonzero((wrapper.spots.members == 0).any(axis=1))[0])


def test_a_phantom_stays_on_its_spot_until_its_cell_is_chosen_to_withdraw_one() -> None:
    env, wrapper = patrol("by_need(placed=1, frame=area)")
    assert isinstance(wrapper, ByNeed)
    play(env, wrapper, chosen())
    assert off_agent(env, 0).size == 0
    middle = middle_cell(wrapper)
    play(env, wrapper, chosen(place=middle))
    placed = off_agent(env, 0)
    assert placed.shape == (1, 2) and np.abs(placed).max() <= 50.0  # a seventh of the diameter to each side
    for choices in (chosen(), chosen(withdraw=middle + 1)):
        play(env, wrapper, choices)
        np.testing.assert_allclose(off_agent(env, 0), placed, atol=1e-2)
    play(env, wrapper, chosen(withdraw=middle))
    assert off_agent(env, 0).size == 0


def test_phantoms_in_one_cell_stand_apart_until_it_is_full() -> None:
    env, wrapper = patrol("by_need(placed=1, spacing=40)")
    assert isinstance(wrapper, ByNeed)
    cell = middle_cell(wrapper)
    room = int((wrapper.spots.members[cell] < len(wrapper.spots.offset)).sum())
    assert room < wrapper.phantoms
    for _ in range(room + 3):
        play(env, wrapper, chosen(place=cell))
    assert ((wrapper.spot >= 0).sum(axis=2) == room).all()
    spots = wrapper.spots.offset[wrapper.spot[0, 0, :room]] * 350.0
    assert (np.abs(spots[:, None] - spots) + 99.0 * np.eye(room)).min() > 39.9


def test_doubles_stand_beside_the_farthest_own_detections() -> None:
    env, wrapper = patrol("by_need(placed=1, beside=2)", sensor={"sigma": 5.0, "clutter_density": 2e-5})
    table, rows = env.observation_table, ADVERSARIES
    for count in (0, 1, 3, 4):
        seen = table.read(env.arrays.observation[:, rows], rows)
        own = seen["detections"][0, 0, : int(seen["detections_mask"][0, 0].sum())]
        off = np.linalg.norm(own - seen["pose"][0, 0, :2], axis=1)
        farthest = own[np.argsort(-off, kind="stable")[:count]]
        inside = np.linalg.norm(farthest + np.array([10.0, 0.0]) - seen["pose"][0, 0, :2], axis=1) < 350.0
        play(env, wrapper, chosen(doubles=count))
        found = injected(env, 0)
        assert len(found) == min(count, len(own))
        np.testing.assert_allclose(found[inside], farthest[inside] + [10.0, 0.0], atol=1e-2)


def test_more_phantoms_than_slots_live_on_reports_by_need() -> None:
    """Alone in its FOV an adversary keeps three confirmed tracks for each of its slots."""
    empty = {"initial": 0.0, "birth_rate": 0.0}
    scenario = load_scenario("patrol", team={"n_adversaries": 1, "n_benign": 0}, targets=empty)
    env = vector_env(scenario, "score", 1, autoreset=False)
    env.reset(7)
    wrapper = reset_wrapper("by_need(placed=1, n=12)", env, ADVERSARIES[:1])
    assert isinstance(wrapper, ByNeed)
    assert scenario.injection.slots == 4
    cells = len(wrapper.spots.members)
    metrics = {}
    for frame in range(100):
        choices = chosen(place=3 * frame % cells, learners=1)
        metrics = env.step(wrapper.act(choices, env.arrays.observation))[4]
    assert int(wrapper.forecast.confirmed.sum()) == 12
    assert metrics["false_tracks"].item() == 12
