"""An interrupt or an error at any moment leaves an environment that goes on exactly, or one that asks for reset()."""

from __future__ import annotations

import copy
import hashlib
import itertools
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from paths import ROOT

import trust_env
from trust_env.compiled import threads as worker_threads

SCENARIO = "trio(knowledge=white_box)"


class Counts:
    """A defense with a memory: the verdict depends on how many frames it has seen."""

    def __init__(self):
        self.frames = np.zeros(0)

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        self.shape = shape
        self.frames = self.frames if len(self.frames) else np.zeros(shape.W)
        self.frames[worlds] = 0

    def update(self, evidence: Any) -> trust_env.Verdict:
        self.frames += 1
        return trust_env.Verdict(track_trust=np.repeat(1 / self.frames[:, None], self.shape.J, axis=1))


class Fails(Counts):
    """Raises in the calls whose numbers it is given."""

    def __init__(self, resets: tuple[int, ...] = (), updates: tuple[int, ...] = ()):
        super().__init__()
        self.left = {"reset": list(resets), "update": list(updates)}
        self.calls = {"reset": 0, "update": 0}

    def count(self, method: str) -> None:
        self.calls[method] += 1
        if self.calls[method] in self.left[method]:
            raise KeyError("of the user")

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        super().reset(shape, worlds)
        self.count("reset")

    def update(self, evidence: Any) -> trust_env.Verdict:
        self.count("update")
        return super().update(evidence)


def parallel(defense: Any) -> tuple[Any, Callable[[Any], Any]]:
    env = trust_env.parallel_env(SCENARIO, defense, max_cycles=20)
    actions = {agent: np.full(env.action_space(agent).shape, 0.5, np.float32) for agent in env.possible_agents}
    return env, lambda env: env.step(actions)


def vector(defense: Any, num_worlds: int = 3, **more: Any) -> tuple[Any, Callable[[Any], Any]]:
    env = trust_env.vector_env(SCENARIO, defense, num_worlds=num_worlds, max_cycles=4, **more)
    actions = np.full(env.arrays.action.shape, 0.5)
    return env, lambda env: env.step(actions)


def two_threads(defense: Any) -> tuple[Any, Callable[[Any], Any]]:
    return vector(defense, 33, threads=2)


def centre(defense: Any) -> tuple[Any, Callable[[Any], Any]]:
    env = trust_env.FusionCentre("case1", defense)
    return env, lambda env: env.update([np.full((1, 2), 3.0)] * env.n_agents)


def begin(env: Any) -> None:
    env.reset() if isinstance(env, trust_env.FusionCentre) else env.reset(seed=1)


def state_of(env: Any) -> str:
    """One number for all that worlds hold; what is in empty columns means nothing."""
    arrays = (env._worlds if isinstance(env, trust_env.FusionCentre) else env.worlds).arrays
    known, digest = arrays["track_status"] > 0, hashlib.sha256()
    for name in ("track_mean", "track_cov", "track_score", "track_trust", "track_age"):
        digest.update(arrays[name][known].tobytes())
    for name in ("seed", "world_id", "episode", "frame", "active", "dt", "track_id", "published", "observation"):
        digest.update(arrays[name].tobytes())
    return digest.hexdigest()[:12]


def reference(env: Any, step: Callable[[Any], Any], frames: int) -> list[str]:
    """The state before the first and after every frame."""
    begin(env)
    states = [state_of(env)]
    for _ in range(frames):
        step(env)
        states.append(state_of(env))
    return states


@contextmanager
def interrupt_at(line: int) -> Iterator[None]:
    """KeyboardInterrupt before the given line of the package that would run, counted from 0."""
    ahead = itertools.count(line, -1)

    def trace(frame: Any, event: str, _: Any) -> Any:
        if "/trust_env/" not in frame.f_code.co_filename:
            return None
        if event == "line" and next(ahead) == 0:
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


def asks_for_reset(env: Any, step: Callable[[Any], Any]) -> bool:
    """Whether a step does so, instead of making a frame."""
    try:
        step(env)
    except RuntimeError as error:
        if "call reset()" in str(error):
            return True
        raise
    return False


def goes_on_or_asks_for_reset(env: Any, step: Callable[[Any], Any], expected: list[str], frame: int) -> bool:
    """Assert that an environment broken off between two frames keeps the promise; whether it asked for reset()."""
    state = state_of(env)
    if asks_for_reset(env, step):
        assert asks_for_reset(env, step)
        assert reference(env, step, frame + 1) == expected[: frame + 2]
        return True
    at = expected[frame : frame + 2].index(state) + frame
    assert state_of(env) == expected[at + 1]
    return False


FACES = [parallel, vector, two_threads, centre]


@pytest.mark.parametrize("defense", ["trust", Counts])
@pytest.mark.parametrize("face", FACES)
def test_an_interrupt_at_any_line_of_a_step(face, defense):
    env, step = face(defense if isinstance(defense, str) else defense())
    expected, frame = reference(env, step, 6), 3  # in batches the frame after these ends the episodes
    asked: list[bool] = []
    while reference(env, step, frame):
        try:
            with interrupt_at(len(asked)):
                step(env)
            break  # all lines have run
        except KeyboardInterrupt:
            asked.append(goes_on_or_asks_for_reset(env, step, expected, frame))
    assert len(asked) > 20 and any(asked) and not all(asked)


@pytest.mark.parametrize("face", FACES)
def test_an_interrupt_at_any_line_of_a_reset(face):
    env, step = face(Counts())
    expected = reference(env, step, 4)
    asked: list[bool] = []
    while reference(env, step, 3):
        try:
            with interrupt_at(len(asked)):
                begin(env)
            break
        except KeyboardInterrupt:
            state = state_of(env)
        asked.append(asks_for_reset(env, step))
        if asked[-1]:
            assert reference(env, step, 4) == expected
        else:
            assert (state, state_of(env)) in [tuple(expected[:2]), tuple(expected[3:])]
    assert len(asked) > 15 and any(asked) and not all(asked)


def test_an_interrupt_while_the_other_threads_work_leaves_them_at_rest(monkeypatch):
    env, step = two_threads("trust")
    expected, naps = reference(env, step, 3), []
    begin(env)

    def interrupted_nap(_: float) -> None:
        naps.append(1)
        if len(naps) == 1:
            raise KeyboardInterrupt

    workers = env.worlds._workers
    monkeypatch.setattr(worker_threads.time, "sleep", interrupted_nap)
    workers._shared[worker_threads.DONE] -= 5  # as if others were at work, for as long as two naps

    def finish() -> None:
        workers._shared[worker_threads.DONE] += 5 * (len(naps) == 2)

    monkeypatch.setattr(worker_threads.time, "sleep", lambda s: (interrupted_nap(s), finish()))
    with pytest.raises(KeyboardInterrupt):
        step(env)
    assert len(naps) == 2 and workers._shared[worker_threads.DONE] == workers._shared[worker_threads.WORLDS]
    with pytest.raises(RuntimeError, match=r"call reset\(\)"):
        step(env)
    assert reference(env, step, 3) == expected


@pytest.mark.core
@pytest.mark.parametrize("face", FACES)
def test_an_error_in_a_users_update_asks_for_reset(face):
    env, step = face(Fails(updates=(3,)))
    begin(env)
    step(env), step(env)
    with pytest.raises(ValueError, match=r"test_interrupts\.py:Fails\.update raised KeyError: 'of the user' \(line"):
        step(env)
    for _ in range(2):
        with pytest.raises(RuntimeError, match=r"an error in it\) and left its worlds half changed: call reset\(\)"):
            step(env)
    twin, _ = face(Counts())
    assert reference(env, step, 3) == reference(twin, step, 3)


@pytest.mark.core
def test_an_error_in_a_users_reset_asks_for_reset_in_the_automatic_one_too():
    env, step = vector(Fails(resets=(2,)))
    begin(env)
    for _ in range(3):
        step(env)
    with pytest.raises(ValueError, match=r"Fails\.reset raised KeyError"):
        step(env)
    with pytest.raises(RuntimeError, match=r"call reset\(\)"):
        step(env)
    twin, _ = vector(Counts())
    assert reference(env, step, 9) == reference(twin, step, 9)


@pytest.mark.core
def test_a_world_that_broke_off_is_not_shown_nor_kept_and_its_copies_know_it():
    env, step = parallel(Fails(updates=(1,)))
    env.render_mode = "ansi"
    begin(env)
    kept = env.get_state()
    with pytest.raises(ValueError, match="KeyError"):
        step(env)
    for call in (env.state, env.get_state, env.render, lambda: step(copy.deepcopy(env))):
        with pytest.raises(RuntimeError, match=r"call reset\(\)"):
            call()
    env.set_state(kept)  # which is as good as a reset
    env.worlds.own_defense = Counts()
    env.worlds.own_defense.frames = np.zeros(1)
    env.worlds.own_defense.shape = trust_env.Shape(1, *env.arrays.expected.shape[1:], D=0)
    step(env)


@pytest.mark.core
def test_a_defense_that_resets_the_environment_that_asks_it_is_refused():
    class Resets(Counts):
        def update(self, evidence: Any) -> trust_env.Verdict:
            if env.arrays.frame[0] == 2:
                env.reset(seed=1)
            return super().update(evidence)

    env, step = parallel(Resets())
    begin(env)
    step(env), step(env)
    with pytest.raises(RuntimeError, match=r"Resets\.update has called reset\(\) of the environment that called it"):
        step(env)
    assert env.arrays.frame[0] == 0
    step(env)


IN_A_PROCESS = """
import random, signal, time
from test_interrupts import state_of, vector

def interrupt(*_):
    raise KeyboardInterrupt

env, step = vector("trust", 40, threads=2)
env.reset(seed=1)
expected, asked, went_on = {}, 0, 0
for _ in range(30):
    expected[state_of(env)] = len(expected)
    step(env)
started = time.perf_counter()
for _ in range(28):
    step(env)
longest = time.perf_counter() - started
signal.signal(signal.SIGALRM, interrupt)
draw = random.Random(1)
for attempt in range(300):
    env.reset(seed=1)
    try:
        signal.setitimer(signal.ITIMER_REAL, draw.uniform(1e-5, longest))
        for _ in range(28):
            step(env)
        signal.setitimer(signal.ITIMER_REAL, 0)
        continue
    except KeyboardInterrupt:
        pass
    before = expected.get(state_of(env))
    try:
        step(env)
    except RuntimeError as error:
        assert "call reset()" in str(error), error
        asked += 1
        continue
    after = expected[state_of(env)]
    assert after == before + 1, (before, after)
    went_on += 1
env.close()
print(asked, went_on)
"""


def test_signals_at_random_moments_of_a_batch_on_two_threads():
    command = [sys.executable, "-c", IN_A_PROCESS]
    found = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT / "tests")
    assert found.returncode == 0, found.stderr
    asked, went_on = map(int, found.stdout.split())
    assert asked + went_on > 50
