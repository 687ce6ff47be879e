"""A defense is one file and one line of the registry: one that stands here, with kernels, is played as any other."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from invariants import check

import trust_env
from trust_env.compiled.kernels import kernel
from trust_env.defenses import DEFENSES, BuiltIn, build_defense, name_of, named_in_full
from trust_env.frame import declare_defenses


class Surprise(BuiltIn):
    """Trust in an agent falls with the mean d² of its hits; a track is as good as the best agent that hit it.

    rate: of the moving average, kept for the last `frames` frames.
    """

    parameters: ClassVar = {"rate": "f8"}
    memory: ClassVar = {"mean": "f8 G K | of d², in the last frames"}
    needs: ClassVar = ("innovations",)

    def __init__(self, rate: float = 0.25, frames: int = 3):
        self.rate, self.frames = rate, frames

    def params(self) -> dict[str, Any]:
        return {"rate": self.rate, "frames": self.frames}

    def values(self, n_agents: int) -> dict[str, Any]:
        return {"rate": self.rate}

    def lengths(self, n_agents: int) -> dict[str, int]:
        return {"G": self.frames}

    @staticmethod
    @kernel
    def reset(world):
        memory = world.surprise
        for g in range(memory.mean.shape[0]):
            for k in range(memory.mean.shape[1]):
                memory.mean[g, k] = 2.0

    @staticmethod
    @kernel
    def judge(world):
        memory, verdict, evidence = world.surprise, world.verdict, world.evidence
        now = (world.clock.frame + 1) % memory.mean.shape[0]
        for k in range(memory.mean.shape[1]):
            _average(world, k, memory.mean[world.clock.frame % memory.mean.shape[0], k], now)
            verdict.agent_trust[k] = np.exp(-0.25 * memory.mean[now, k])
        for j in range(world.tracks.count):
            best = np.nan
            for k in range(memory.mean.shape[1]):
                if not np.isnan(evidence.distance2[k, j]) and not verdict.agent_trust[k] <= best:
                    best = verdict.agent_trust[k]
            verdict.track_trust[j] = best
            verdict.publish[j] = verdict.publish[j] and not best < 0.5


@kernel
def _average(world, k, mean, now):
    for j in range(world.tracks.count):
        distance2 = world.evidence.distance2[k, j]
        if not np.isnan(distance2):
            mean += world.surprise.rate * (distance2 - mean)
    world.surprise.mean[now, k] = mean


class SurpriseInNumPy:
    """The same as a user would write it."""

    def __init__(self, rate: float = 0.25):
        self.rate = rate

    def reset(self, shape: trust_env.Shape, worlds: np.ndarray) -> None:
        if worlds.all():
            self.mean = np.full((shape.W, shape.K), 2.0)
        self.mean[worlds] = 2.0

    def update(self, e: trust_env.Evidence) -> trust_env.Verdict:
        distance2 = np.where((e.status > 0)[:, None], e.distance2, np.nan)
        for j in range(distance2.shape[2]):
            d = distance2[..., j]
            self.mean += np.where(np.isnan(d), 0.0, self.rate * (d - self.mean))
        agents = np.exp(-0.25 * self.mean)
        tracks = np.where(np.isnan(distance2), -np.inf, agents[..., None]).max(axis=1)
        return trust_env.Verdict(track_trust=np.where(tracks < 0.0, np.nan, tracks), agent_trust=agents)


EVERY = [name if name != "path_trust" else "path_trust(anchor=3)" for name in DEFENSES]


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DEFENSES, "surprise", Surprise)


@pytest.mark.core
def test_a_registered_defense_plays_as_the_same_one_in_numpy_does(registered):
    built_in = trust_env.vector_env("patrol", "surprise(rate=0.3, frames=2)", num_worlds=5, max_cycles=12)
    users = trust_env.vector_env("patrol", SurpriseInNumPy(rate=0.3), num_worlds=5, max_cycles=12)
    rng, trusts = np.random.default_rng(3), []
    for env in (built_in, users):
        env.reset(seed=4)
    for _ in range(30):
        actions = rng.uniform(-1.0, 1.0, built_in.arrays.action.shape)
        ours, theirs = built_in.step(actions), users.step(actions)
        assert ours[0] == pytest.approx(theirs[0], abs=1e-6) and ours[1] == pytest.approx(theirs[1], abs=1e-9)
        for name in ("agent_trust", "track_trust"):
            known = built_in.arrays.track_status > 0 if name == "track_trust" else slice(None)
            expected = pytest.approx(users.arrays[name][known], abs=1e-12, nan_ok=True)
            assert built_in.arrays[name][known] == expected
        trusts.append(built_in.arrays.agent_trust.copy())
    assert np.nanstd(trusts) > 0.05


@pytest.mark.core
def test_other_defenses_do_not_change_when_one_is_registered(monkeypatch):
    def play() -> np.ndarray:
        env = trust_env.vector_env("trio", "trust", num_worlds=3)
        env.reset(seed=1)
        return np.stack([env.step(np.ones(env.arrays.action.shape))[0] for _ in range(20)])

    before = play()
    monkeypatch.setitem(DEFENSES, "surprise", Surprise)
    assert np.array_equal(play(), before)


def test_worlds_hold_the_memory_of_their_own_defense_only(registered):
    assert "surprise_mean" in trust_env.vector_env("trio", "surprise").arrays
    assert "surprise_mean" not in trust_env.vector_env("trio", "trust").arrays
    assert trust_env.vector_env("trio", "surprise(frames=7)").arrays.surprise_mean.shape == (1, 7, 3)


def test_a_registered_defense_is_listed_and_built_by_name(registered):
    assert "surprise" in trust_env.defenses()
    assert build_defense("surprise(rate=0.5)").params() == {"rate": 0.5, "frames": 3}


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("trust", "trust(preset=paper)"),
        (" trust( trusted=[1] ) ", "trust(preset=paper, trusted=[1])"),
        ("trust(trusted=[1], preset=mate)", "trust(preset=mate, trusted=[1])"),
        ("score", "score"),
        ("majority(window=4)", "majority(window=4)"),
        ("my.py:trust(x=1)", "my.py:trust(x=1)"),
    ],
)
def test_the_full_name_of_a_defense_has_its_preset(name, full):
    assert named_in_full(name) == full


def test_a_built_defense_is_called_by_its_name_and_preset():
    assert name_of(build_defense("trust(preset=mate, trusted=[1])")) == "trust(preset=mate)"
    assert name_of(build_defense("majority(window=4)")) == "majority"


def test_a_defense_cannot_have_the_name_of_a_part_of_the_world(monkeypatch):
    monkeypatch.setitem(DEFENSES, "tracks", Surprise)
    with pytest.raises(ValueError, match="cannot be called 'tracks'"):
        declare_defenses()


@pytest.mark.core
@pytest.mark.parametrize("defense", EVERY)
def test_every_defense_keeps_the_worlds_in_order_whatever_the_batch(defense):
    small, large = (
        trust_env.vector_env("patrol(knowledge=white_box)", defense, num_worlds=worlds, max_cycles=20)
        for worlds in (2, 4)
    )
    small.reset(seed=2)
    large.reset(seed=2)
    actions = np.random.default_rng(5).uniform(-1.0, 1.0, large.arrays.action.shape)
    actions[..., -large.scenario.sensor.max_detections :] -= 0.8  # phantoms that stay, and hardly a suppression
    for _ in range(30):
        small.step(actions[:2])
        large.step(actions)
        check(large)
        for name in ("agent_trust", "published", "track_trust", "observation"):
            assert np.array_equal(small.arrays[name], large.arrays[name][:2], equal_nan=True), name
