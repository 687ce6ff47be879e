"""Copies, pickles and snapshots of both faces."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from parallel_envs import play, snapshot

import trust_env
from trust_env.parallel import TrustEnv


class DefenseWithMemory:
    """A user's defense, which keeps its memory outside the worlds'."""

    def __init__(self):
        self.level = 0.5

    def reset(self, shape, worlds):
        self.shape = shape
        self.level = 0.5

    def update(self, evidence):
        self.level = 0.9 * self.level + 0.1 * float(evidence.detected.mean() > 0.02)
        return trust_env.Verdict(track_trust=np.full((self.shape.W, self.shape.J), self.level))


@pytest.mark.core
@pytest.mark.parametrize("defense", ["trust", "majority(window=4)", "own"])
@pytest.mark.parametrize("way", ["deepcopy", "pickle", "state", "state into a fresh one"])
def test_copies_and_snapshots_continue_bit_for_bit(way, defense):
    def make() -> TrustEnv:
        scenario = {"base": "trio", "knowledge": "white_box", "horizon": 60}
        return trust_env.parallel_env(scenario, DefenseWithMemory() if defense == "own" else defense)

    env = make()
    env.reset(seed=8)
    play(env, np.random.default_rng(1), 25)
    state = env.get_state()
    if way == "deepcopy":
        twin = copy.deepcopy(env)
    elif way == "pickle":
        twin = pickle.loads(pickle.dumps(env))
    elif way == "state":
        twin = env
    else:
        twin = make()
        twin.reset(seed=99)
        twin.set_state(pickle.loads(pickle.dumps(state)))
    original = play(env, np.random.default_rng(2), 50)
    if way == "state":
        env.reset(seed=55)
        play(env, np.random.default_rng(5), 7)
        env.set_state(state)
    assert len(original) == 35
    assert play(twin, np.random.default_rng(2), 50) == original
    assert env.agents == twin.agents == []
    if way == "state":
        return
    first, second = ({a: o.tobytes() for a, o in e.reset()[0].items()} for e in (env, twin))
    assert first == second


def test_a_snapshot_of_another_scenario_raises_and_changes_nothing():
    env, other = trust_env.parallel_env("trio"), trust_env.parallel_env("case1")
    env.reset(seed=1)
    other.reset(seed=1)
    before = snapshot(env)
    with pytest.raises(ValueError, match="snapshot"):
        env.set_state(other.get_state())
    assert snapshot(env) == before


INVALID_SNAPSHOTS = [
    (lambda good: {}, "lacks 'row', 'agents', 'started', 'defense'; expected what get_state"),
    (lambda good: {"row": good["row"]}, "lacks 'agents', 'started', 'defense'"),
    (lambda good: None, "a dict; got a NoneType"),
    (lambda good: good["row"], "a dict; got a ndarray"),
    (lambda good: good | {"row": None}, "'row' must be an array of uint8; got NoneType"),
    (lambda good: good | {"row": good["row"].astype(float)}, "'row' must be an array of uint8; got float64"),
    (lambda good: good | {"row": good["row"][:-1]}, "a world of this scenario and defense holds"),
    (lambda good: good | {"row": good["row"][None]}, "row is of shape"),
    (lambda good: good | {"agents": ["nobody"]}, "'agents' are .'nobody'.; expected .'adversary_0', 'benign_0'"),
    (lambda good: good | {"agents": None}, "'agents' are None"),
    (lambda good: good | {"started": "yes"}, "'started' is 'yes'; expected True or False"),
    (lambda good: good | {"defense": DefenseWithMemory()}, "with a user's own defense; this one has a built-in"),
]


@pytest.mark.parametrize(("change", "message"), INVALID_SNAPSHOTS)
def test_what_is_no_snapshot_raises_and_changes_nothing(change, message):
    env = trust_env.parallel_env("trio")
    env.reset(seed=1)
    play(env, np.random.default_rng(0), 3)
    state, before = change(env.get_state()), snapshot(env)
    with pytest.raises(ValueError, match=message):
        env.set_state(state)
    assert snapshot(env) == before
    play(env, np.random.default_rng(0), 1)


def test_a_snapshot_without_the_users_defense_raises_and_changes_nothing():
    own = trust_env.parallel_env("trio", DefenseWithMemory())
    own.reset(seed=1)
    kept, before = own.get_state(), snapshot(own)
    wrong = {None: "with a built-in defense", 3: "int has no method reset", DefenseWithMemory: "is a class"}
    for defense, message in wrong.items():
        with pytest.raises(ValueError, match=message):
            own.set_state(kept | {"defense": defense})
        assert snapshot(own) == before


def test_a_snapshot_does_not_change_with_its_environment():
    env = trust_env.parallel_env("trio")
    env.reset(seed=1)
    state = env.get_state()
    row = state["row"].copy()
    play(env, np.random.default_rng(0), 3)
    assert np.array_equal(state["row"], row)


def test_copies_of_a_batch_continue_bit_for_bit():
    venv = trust_env.vector_env("trio", "trust", num_worlds=40, max_cycles=20, threads=2)
    venv.reset(seed=1)
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (30, *venv.arrays.action.shape))
    for action in actions[:10]:
        venv.step(action)
    twins = [venv, copy.deepcopy(venv), pickle.loads(pickle.dumps(venv))]
    for action in actions[10:]:
        results = [twin.step(action) for twin in twins]
        for other in results[1:]:
            for a, b in zip(results[0][:4], other[:4], strict=True):
                np.testing.assert_array_equal(a, b)
    assert all(np.array_equal(twin.worlds.rows, venv.worlds.rows) for twin in twins)
