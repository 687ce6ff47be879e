"""Defenses for evaluation only: marked, and refused where a verdict would be acted or trained on."""

from __future__ import annotations

import numpy as np
import pytest

import trust_env
from trust_env import training
from trust_env.defenses import DEFENSES

REFERENCES = [name for name, defense in DEFENSES.items() if defense.reference]
FRAME = {"track_id": [0], "expected": [[True]], "detected": [[True]], "held": [[True]]}


def test_which_defenses_are_references():
    assert REFERENCES == ["oracle", "blank"]


@pytest.mark.parametrize("name", REFERENCES)
def test_references_are_refused_outside_evaluation(name, tmp_path):
    with pytest.raises(ValueError, match="for evaluation only; the fusion centre takes any other"):
        trust_env.FusionCentre("case1", name)
    with pytest.raises(ValueError, match="for evaluation only; recorded evidence takes any other"):
        trust_env.replay_evidence([FRAME], 1, name)
    with pytest.raises(ValueError, match="for evaluation only; training takes any other"):
        training.train("trio", name, steps=512, out=tmp_path / "run")
    with pytest.raises(ValueError, match=r"for evaluation only; training .* takes any other"):
        training.exploit("trio", name, attacks="honest", seeds=1, out=tmp_path / "found")
    assert not (tmp_path / "run" / "config.yaml").exists() and not (tmp_path / "found" / "exploit.json").exists()


def test_blank_shows_nothing_and_has_no_opinion():
    env = trust_env.vector_env("patrol", "blank", num_worlds=3)
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros(env.arrays.action.shape))
    assert (env.arrays.track_status == 2).sum() > 10 and not env.arrays.published.any()
    assert np.isnan(env.arrays.agent_trust).all()


def test_the_oracle_knows_the_roles():
    env = trust_env.vector_env("patrol", "oracle", num_worlds=2)
    env.reset(seed=0)
    env.step(np.zeros(env.arrays.action.shape))
    assert env.arrays.agent_trust.tolist() == [[0.0, 0.0, 1.0, 1.0, 1.0]] * 2
