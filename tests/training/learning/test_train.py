"""Training: what a run leaves in its folder, and the same weights again."""

from __future__ import annotations

import json
import random
import shutil
from importlib.util import find_spec

import numpy as np
import pytest
from training_runs import ROLLOUT, SMALL, interrupted, lines, logged, same, train, weights

from trust_env import training
from trust_env.agents.learned.policy_file import load_policy
from trust_env.metrics import METRICS
from trust_env.scenario import load_scenario
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.training.learning.configuration import TRAINING_SEEDS, defaults, load_configuration

pytestmark = pytest.mark.extra("train")


def test_the_folder_holds_configuration_versions_and_two_checkpoints(run):
    names = {path.name for path in run.folder.iterdir() if not path.name.startswith(".")}
    assert names == {
        "config.yaml", "scenario.yaml", "run.json", "checkpoints", "policy.safetensors",
        "progress.csv", "evaluations.csv", "tensorboard", *(["curve.png"] if find_spec("matplotlib") else []),
    }  # fmt: skip
    config = load_configuration(run.folder / "config.yaml")
    assert config == load_configuration(SMALL)
    session = json.loads((run.folder / "run.json").read_text())["sessions"][0]
    assert {"torch", "stable-baselines3", "trust-env", "numpy"} <= set(session["packages"])
    assert len(list((run.folder / "checkpoints").iterdir())) == 2


def test_steps_are_counted_in_whole_rollouts(run):
    assert run.steps == 3 * ROLLOUT
    progress = lines(run.folder / "progress.csv")
    assert [int(row["steps"]) for row in progress] == [ROLLOUT, 2 * ROLLOUT, 3 * ROLLOUT]
    rates = [float(row["learning_rate"]) for row in progress]
    start = defaults()["ppo"]["learning_rate"]
    assert rates == pytest.approx([start * (1 - i * ROLLOUT / 1300) for i in range(3)], rel=1e-4)
    for row in progress:
        parts = float(row["false_tracks_per_frame"]) + float(row["missing_targets_per_frame"])
        assert float(row["damage_per_frame"]) == pytest.approx(parts, abs=1e-4)


def test_the_steps_of_whole_rollouts_are_said_before_the_first(tmp_path, capsys):
    train(out=tmp_path / "more", steps=ROLLOUT + 1, progress=True)
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "trust-env: train: 1,024 steps instead of 513: whole rollouts of 512 steps"
    assert said[1].startswith("trust-env: train: 0 of 1,024 steps")
    train(out=tmp_path / "exact", steps=ROLLOUT, progress=True)
    assert "instead of" not in capsys.readouterr().err


def test_evaluations_are_those_of_the_policy_on_held_out_worlds(run):
    """The last line is what anybody gets who plays the exported policy on the seed of the configuration."""
    rows = lines(run.folder / "evaluations.csv")
    assert [int(row["steps"]) for row in rows] == [0, 2 * ROLLOUT, 3 * ROLLOUT]
    assert set(rows[0]) == {"steps", *METRICS}
    config = load_configuration(SMALL)
    played = training.evaluate("trio(horizon=20)", str(run.folder), "trust", 4, config.evaluation.seed, progress=False)
    damage = played.cells[0].metrics["damage_per_frame"].mean()
    assert float(rows[-1]["damage_per_frame"]) == pytest.approx(damage, rel=1e-5)
    assert run.evaluations[-1]["damage_per_frame"] == float(rows[-1]["damage_per_frame"])


def test_training_and_evaluation_never_share_world_seeds(copy):
    """By their seeds: of training from 2^62 on, of evaluations below."""
    from trust_env.training.learning.session import Session
    from trust_env.training.learning.training_folder import TrainingFolder

    session = Session(TrainingFolder.open(copy), None)
    assert set(session.env.learners.env.arrays.seed.reshape(-1).tolist()) == {TRAINING_SEEDS}
    session.close()
    with pytest.raises(ValueError, match=r"evaluation\.seed = 4611686018427387904.*expected a number below"):
        load_configuration(overrides={"evaluation.seed": TRAINING_SEEDS})


def test_tensorboard_shows_training_and_evaluations(run):
    found = logged(run.folder)
    tags = {tag for tag, _, _ in found}
    assert {"train/approx_kl", "rollout/damage_per_frame", "evaluation/damage_per_frame"} <= tags
    steps = [step for tag, step, _ in found if tag == "rollout/damage_per_frame"]
    assert steps == [ROLLOUT, 2 * ROLLOUT, 3 * ROLLOUT]


def test_the_exported_policy_names_its_origin_and_sizes(run):
    tensors, config = load_policy(run.folder)
    assert config["about"]["defense"] == "trust(preset=paper)" and config["about"]["steps"] == run.steps
    assert config["layers"][1:-1] == [64, 64] and config["knowledge"] == "own"
    assert {"obs_mean", "obs_var", "action.weight"} <= set(tensors)
    assert ("log_std" in tensors) == (config["choices"] is None)  # a deviation where actions are continuous


def test_learning_changes_weights(run, tmp_path):
    begun = train(out=tmp_path / "begun", steps=1, overrides={"evaluation.every": 1})
    assert begun.steps == ROLLOUT
    assert not same(weights(begun.folder), weights(run.folder))


def test_weights_depend_on_the_seed_and_not_on_evaluations_or_checkpoints(run, tmp_path):
    """A second run, that is evaluated and saved at other times; another seed gives others."""
    often = {"evaluation.every": 10**6, "evaluation.episodes": 2, "checkpoint.every": 100.0}
    again = train(out=tmp_path / "again", overrides=often)
    assert same(weights(again.folder), weights(run.folder))
    other = train(out=tmp_path / "other", seed=1, overrides=often)
    assert not same(weights(other.folder), weights(run.folder))


def test_training_does_not_change_global_random_state(tmp_path):
    random.seed(3)
    np.random.seed(3)  # noqa: NPY002
    expected = random.Random(3).random(), np.random.RandomState(3).random_sample()
    train(out=tmp_path / "run", steps=1)
    assert (random.random(), np.random.random_sample()) == expected  # noqa: NPY002


@pytest.mark.parametrize("knowledge", KNOWLEDGE)
def test_every_knowledge_level_and_wrapper_trains_and_resumes(tmp_path, knowledge):
    wrapper = {"own": "raw", "poses": "grid", "picture": "phantoms(n=1)", "white_box": "phantoms"}[knowledge]
    found = train(out=tmp_path / "run", steps=1, knowledge=knowledge, wrapper=wrapper)
    config = load_policy(found.folder)[1]
    assert config["knowledge"] == knowledge and config["wrapper"].startswith(wrapper.partition("(")[0])
    resumed = training.train(resume=found.folder, progress=False)
    assert resumed.began_at == found.steps


def test_benign_agents_learn_against_an_attack_and_resume(tmp_path):
    """The state of the attack is part of a checkpoint."""
    given = {
        "others": {"adversary": "false_positive(n=2, motion=random_walk)"},
        "overrides": {"role": "benign"},
    }
    steps = 5 * 32 * 32
    whole = train(out=tmp_path / "whole", steps=steps, **given)
    folder = shutil.copytree(whole.folder, tmp_path / "copy")
    assert whole.steps == steps  # 16 worlds x 2 benign agents
    interrupted(folder, steps - 32 * 32)
    training.train(resume=folder, progress=False)
    assert same(weights(folder), weights(whole.folder))


def test_exploration_begins_where_the_wrapper_says():
    """At the first step phantoms are seldom withdrawn, and few targets get a double."""
    from trust_env.training.learning.ppo import build_ppo
    from trust_env.training.learning.sb3 import LearnersVecEnv
    from trust_env.training.learning.session import build_learners

    config = load_configuration(SMALL, {"wrapper": "by_need"})
    env = LearnersVecEnv(build_learners(config, load_scenario("trio"), 4))
    logits = build_ppo(config, env).policy.state_dict()["action_net.bias"].numpy()
    *_, withdrawn, doubles, suppressed = np.split(logits, np.cumsum(env.action_space.nvec)[:-1])
    for choice, none in ((withdrawn, 0.98), (doubles, 0.8), (suppressed, 0.8)):
        chance = np.exp(choice) / np.exp(choice).sum()
        assert chance[0] == pytest.approx(none)
        np.testing.assert_allclose(chance[1:], (1.0 - none) / (len(chance) - 1), rtol=1e-5)
    env.close()


def test_episodes_of_training_are_no_longer_than_the_horizon():
    from trust_env.training.learning.session import build_learners

    for asked, horizon, expected in ((40, 200, 40), (40, 20, 20), (None, 20, 20)):
        config = load_configuration(SMALL, {"max_cycles": asked})
        learners = build_learners(config, load_scenario("trio", horizon=horizon), 1)
        assert learners.env.max_cycles == expected
        learners.close()
