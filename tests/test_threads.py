"""Two threads on one environment: the second is refused, nothing is corrupted, nothing hangs."""

from __future__ import annotations

import copy
import os
import pickle
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import trust_env

PATIENCE = 60.0  # s; nothing here takes as long unless it hangs
FRAMES = 40


class Waits:
    """A defense in whose `update` a step stays until it is let go."""

    def __init__(self):
        self.inside, self.let_go = threading.Event(), threading.Event()

    def reset(self, shape: Any, worlds: np.ndarray) -> None: ...

    def update(self, evidence: Any) -> trust_env.Verdict:
        self.inside.set()
        assert self.let_go.wait(PATIENCE)
        return trust_env.Verdict()

    def __deepcopy__(self, memo: dict) -> Waits:
        return self


def parallel(defense: Any) -> tuple[Any, Callable[[], Any]]:
    env = trust_env.parallel_env("trio", defense, max_cycles=1000)
    actions = {agent: np.full(env.action_space(agent).shape, 0.5, np.float32) for agent in env.possible_agents}
    return env, lambda: env.step(actions)


def vector(defense: Any, num_worlds: int = 3, **more: Any) -> tuple[Any, Callable[[], Any]]:
    env = trust_env.vector_env("trio", defense, num_worlds=num_worlds, **more)
    actions = np.full(env.arrays.action.shape, 0.5)
    return env, lambda: env.step(actions)


def centre(defense: Any) -> tuple[Any, Callable[[], Any]]:
    env = trust_env.FusionCentre("case1", defense)
    return env, lambda: env.update([np.zeros((1, 2))] * env.n_agents)


def begin(env: Any) -> None:
    env.reset() if isinstance(env, trust_env.FusionCentre) else env.reset(seed=1)


def rows_of(env: Any) -> np.ndarray:
    return (env._worlds if isinstance(env, trust_env.FusionCentre) else env.worlds).rows


@pytest.mark.core
@pytest.mark.parametrize("face", [parallel, vector, centre])
def test_what_a_second_thread_asks_of_an_environment_in_use_is_refused_and_changes_nothing(face):
    defense = Waits()
    env, step = face(defense)
    begin(env)
    thread = threading.Thread(target=step, daemon=True)
    thread.start()
    assert defense.inside.wait(PATIENCE)
    before = rows_of(env).copy()
    calls = [step, lambda: begin(env), lambda: copy.deepcopy(env), lambda: pickle.dumps(env)]
    if face is parallel:
        calls += [env.state, env.get_state, lambda: env.set_state({})]
    calls += [] if face is centre else [env.close]
    for call in calls:
        with pytest.raises(RuntimeError, match="another thread is using this environment"):
            call()
    assert np.array_equal(rows_of(env), before)
    defense.let_go.set()
    thread.join(PATIENCE)
    assert not thread.is_alive()
    twin, step_twin = face("score")
    begin(twin)
    step_twin(), step_twin(), step()
    names = ("frame", "track_id", "track_mean", "track_score")
    for a, b in zip(*(arrays_of(env, names) for env in (env, twin))):
        assert np.array_equal(a, b)


def arrays_of(env: Any, names: tuple[str, ...]) -> list[np.ndarray]:
    arrays = env._worlds.arrays if isinstance(env, trust_env.FusionCentre) else env.arrays
    return [arrays[name] for name in names]


@pytest.mark.core
@pytest.mark.parametrize("face", [parallel, centre, vector, lambda d: vector(d, 40, threads=2, max_cycles=7)])
def test_whatever_two_threads_do_only_whole_frames_are_made(face):
    env, step = face("trust")
    begin(env)
    made, strange = [0, 0], []

    def play(number: int) -> None:
        while made[number] < FRAMES and not strange:
            try:
                step()
                made[number] += 1
            except RuntimeError as error:
                if "another thread" not in str(error):
                    strange.append(error)

    threads = [threading.Thread(target=play, args=(number,), daemon=True) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
        assert not thread.is_alive(), "a thread hangs"
    assert not strange
    twin, step_twin = face("trust")
    begin(twin)
    for _ in range(2 * FRAMES):
        step_twin()
    assert np.array_equal(rows_of(env), rows_of(twin))


@pytest.mark.core
def test_what_an_ended_thread_left_in_use_is_free_for_others():
    env, step = parallel("trust")
    begin(env)
    thread = threading.Thread(target=env.worlds.use.__enter__)  # and ends without leaving
    thread.start()
    thread.join()
    step()
    assert env.arrays.frame[0] == 1 and not env.worlds.use.holder


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_in_the_middle_of_another_threads_step_asks_for_reset_and_then_goes_on():
    defense = Waits()
    env, step = vector(defense, 40, threads=2)
    begin(env)
    thread = threading.Thread(target=step, daemon=True)
    thread.start()
    assert defense.inside.wait(PATIENCE)
    receiver, sender = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(sender, in_the_child(env, step, defense))
        os._exit(0)
    os.close(sender)
    os.waitpid(child, 0)
    assert os.read(receiver, 1000).decode() == "call reset() True"
    defense.let_go.set()
    thread.join(PATIENCE)


def in_the_child(env: Any, step: Callable[[], Any], defense: Waits) -> bytes:
    """What the step that the fork cut off says, and whether the environment begins anew like another one."""
    try:
        step()
        said = "nothing"
    except RuntimeError as error:
        said = str(error)[-12:]
    defense.let_go = threading.Event()
    defense.let_go.set()
    twin, step_twin = vector(defense, 40)
    begin(env), begin(twin)
    step(), step_twin()
    return f"{said} {np.array_equal(rows_of(env), rows_of(twin))}".encode()
