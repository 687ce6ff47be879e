"""What cannot be trained, and folders that cannot be used."""

from __future__ import annotations

import pytest
from training_runs import train

from trust_env import training

pytestmark = pytest.mark.extra("train")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"overrides": {"ppo.lerning_rate": 1}}, r"did you mean 'ppo.learning_rate'\?"),
        ({"config": {"stepz": 3}}, r"stepz = 3: unknown field; did you mean 'steps'\?"),
        ({"steps": -5}, r"steps = -5 \(override\): expected a number of at least 1"),
        ({"overrides": {"ppo.gamma": 1.5}}, "expected a number from 0 to 1"),
        ({"seed": 2**40}, "expected a number below 4294967296"),
        ({"scenario": "trio(n_adversaries=0)"}, "has no agent of role 'adversary'"),
        ({"scenario": "trois"}, r"unknown scenario 'trois'; did you mean 'trio'\?"),
        ({"defense": "trusst"}, r"unknown defense 'trusst'; did you mean 'trust'\?"),
        ({"wrapper": "ghosts"}, "unknown .*'ghosts'"),
        ({"others": {"benign": "honesty"}}, r"unknown policy 'honesty'; did you mean 'honest'\?"),
        ({"others": {"benine": "honest"}}, r"did you mean 'benign'\?"),
        ({"others": {"adversary": "honest"}}, "adversary is the role that learns"),
    ],
    ids=lambda value: None if isinstance(value, str) else "-".join(value),
)
def test_what_cannot_be_trained_raises_before_a_folder_is_created(tmp_path, arguments, text):
    with pytest.raises(ValueError, match=text):
        train(out=tmp_path / "run", **arguments)
    assert not (tmp_path / "run").exists()


def test_folders_that_cannot_be_used_raise(run, tmp_path):
    with pytest.raises(ValueError, match="expected out, a new or empty folder for the run, or resume"):
        train()
    with pytest.raises(ValueError, match=r"there is a training run in this folder.*--resume"):
        train(out=run.folder)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"not empty \(it holds notes.txt\)"):
        train(out=tmp_path)
    with pytest.raises(ValueError, match=r"expected a folder, this is a file"):
        train(out=tmp_path / "notes.txt")
    with pytest.raises(ValueError, match=r"there is no config\.yaml in it; expected the folder of a training run"):
        training.train(resume=tmp_path)
    with pytest.raises(ValueError, match="there is no such folder"):
        training.train(resume=tmp_path / "nowhere")
    with pytest.raises(ValueError, match="expected nothing beside it, got steps"):
        training.train(resume=run.folder, steps=10**6)
