"""Every built-in defense without draws gives what its plain version gives, under random attacks."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import plain_defenses
import pytest

import trust_env
from trust_env.vector import VectorEnv

CASES: dict[str, Any] = {
    "quorum": {},
    "quorum(l=0, window=5, misses=2, strict=False)": {"l": 0, "window": 5, "misses": 2, "strict": False},
    "quorum(strict=False)": {"strict": False},
    "binary_beta": {},
    "binary_beta(window=3)": {"window": 3},
    "rfsn_beta": {},
    "rfsn_beta(w=0.8, window=4)": {"w": 0.8, "window": 4},
    "parsimony": {},
    "parsimony(a=0.05, gamma=0.8, epsilon=0.1)": {"a": 0.05, "gamma": 0.8, "epsilon": 0.1},
    "score_asymmetry": {},
    "score_asymmetry(l=1, a=0.2, gamma=0.8)": {"l": 1, "a": 0.2, "gamma": 0.8},
    "dawid_skene": {},
    "dawid_skene(p=0.5, rho=0.9, gamma=1.0, real=(4, 2), fake=(1, 3))": {
        "p": 0.5, "rho": 0.9, "gamma": 1.0, "real": (4, 2), "fake": (1, 3),
    },
    "path_trust(anchor=2)": {"anchor": 2},
    "path_trust(anchor=0, ageing=0.8, window=3)": {"anchor": 0, "ageing": 0.8, "window": 3},
    "cusum": {},
    "cusum(h=2.5)": {"h": 2.5},
    "oracle": {},
    "oracle(lone='show', epsilon=0.1)": {"lone": "show", "epsilon": 0.1},
}  # fmt: skip
SCENARIO = {
    "base": "patrol",
    "agents": [{"role": "adversary"}, {"role": "adversary", "belief": {"compromised": 0.4}}] + [{"role": "benign"}] * 3,
}
WORLDS, FRAMES, HORIZON = 4, 60, 40


def plain_version(defense: str, parameters: dict[str, Any]) -> plain_defenses.Plain:
    judge = getattr(plain_defenses, "".join(word.title() for word in defense.split("(")[0].split("_")))
    return plain_defenses.Plain(judge, roles=[1, 1, -1, -1, -1], **parameters)


def attack(env: VectorEnv, rng: np.random.Generator):
    """Phantoms that stay for a while, so that they make tracks, and some suppressions."""
    shape = env.arrays.action.shape
    for frame in range(FRAMES):
        if frame % 20 == 0:
            phantoms = np.abs(rng.uniform(-1.0, 1.0, shape)) * np.where(rng.random(shape) < 0.5, 1.0, -1.0)
        actions = np.where(rng.random(shape[:2])[..., None] < 0.9, phantoms, 0.0)
        actions[..., -env.scenario.sensor.max_detections :] -= 0.8
        yield actions


@pytest.mark.core
@pytest.mark.parametrize("defense", CASES)
def test_kernels_agree_with_the_plain_version(defense):
    envs = [
        trust_env.vector_env(SCENARIO, judge, num_worlds=WORLDS, max_cycles=HORIZON)
        for judge in (defense, plain_version(defense, CASES[defense]))
    ]
    for env in envs:
        env.reset(seed=8)
    opinions, decisions = [], []
    for actions in attack(envs[0], np.random.default_rng(2)):
        for env in envs:
            env.step(actions)
        ours, theirs = (env.arrays for env in envs)
        known = ours.track_status == 2
        assert np.array_equal(ours.track_id, theirs.track_id)
        assert ours.agent_trust == pytest.approx(theirs.agent_trust, abs=1e-9, nan_ok=True)
        assert ours.track_trust[known] == pytest.approx(theirs.track_trust[known], abs=1e-9, nan_ok=True)
        assert np.array_equal(ours.published, theirs.published)
        opinions.append(ours.agent_trust.copy())
        decisions.extend(ours.published[known])
    assert set(decisions) == {True, False}
    if not np.isnan(opinions).all():
        assert np.nanstd(opinions) > 0.02


def test_every_parameter_of_a_plain_version_is_varied():
    for name in {case.split("(")[0] for case in CASES}:
        judge = plain_version(name, {}).judge
        wanted = set(inspect.signature(judge).parameters) - {"K"}
        varied = {key for case, given in CASES.items() if case.split("(")[0] == name for key in given}
        assert wanted - varied <= {"window", "pi"}, name
