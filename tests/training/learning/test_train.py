"""Training: the same weights again, after kills too; what the folder holds; what is refused."""

import csv
import errno
import json
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from paths import ROOT

from trust_env import files, training
from trust_env.agents.learned.policy_file import load_policy
from trust_env.metrics import METRICS
from trust_env.spaces.observation import KNOWLEDGE
from trust_env.training.cli.main import main
from trust_env.training.learning.configuration import TRAINING_SEEDS, defaults, load_configuration

PROGRAM = [sys.executable, "-m", "trust_env.training.cli", "train"]
SMALL = {
    "scenario": "trio(horizon=20)",
    "worlds": 16,
    "steps": 1300,  # three rollouts of 16 worlds x 1 adversary x 32 frames
    "ppo": {"n_steps": 32, "batch_size": 128, "n_epochs": 2},
    "normalise": {"observations": True},
    "evaluation": {"every": 600, "episodes": 4},
    "checkpoint": {"every": 0},
}
ROLLOUT = 512

pytestmark = pytest.mark.extra("train")


def train(**arguments):
    return training.train(**{"config": SMALL, "progress": False} | arguments)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """An uninterrupted run."""
    return train(out=tmp_path_factory.mktemp("train") / "run")


@pytest.fixture
def copy(run, tmp_path) -> Path:
    """A finished run that may be spoilt."""
    return shutil.copytree(run.folder, tmp_path / "copy")


def weights(folder: Path) -> dict[str, np.ndarray]:
    return load_policy(folder)[0]


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def lines(file: Path) -> list[dict[str, str]]:
    """Of a CSV, without the columns that depend on the clock."""
    with open(file, newline="", encoding="utf-8") as opened:
        rows = list(csv.DictReader(opened))
    return [{k: v for k, v in row.items() if k not in ("seconds", "steps_per_second")} for row in rows]


def logged(folder: Path) -> list[tuple[str, int, float]]:
    """Tag, step and value of all that TensorBoard shows, but for what depends on the clock."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = []
    for file in sorted((folder / "tensorboard").iterdir()):
        events = EventAccumulator(str(file), size_guidance={"scalars": 0})
        events.Reload()
        for tag in events.Tags()["scalars"]:
            if not tag.startswith("time/"):
                found += [(tag, event.step, event.value) for event in events.Scalars(tag)]
    return sorted(found)


# --- what a run leaves behind --------------------------------------------------------------------------


def test_the_folder_says_all_that_is_needed(run):
    names = {path.name for path in run.folder.iterdir() if not path.name.startswith(".")}
    assert names == {
        "config.yaml", "scenario.yaml", "run.json", "checkpoints", "policy.safetensors",
        "progress.csv", "evaluations.csv", "tensorboard",
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


def test_evaluations_are_those_of_the_policy_on_held_out_worlds(run):
    """The last line is what anybody gets who plays the exported policy on the seed of the configuration."""
    rows = lines(run.folder / "evaluations.csv")
    assert [int(row["steps"]) for row in rows] == [0, 2 * ROLLOUT, 3 * ROLLOUT]
    assert set(rows[0]) == {"steps", *METRICS}
    config = load_configuration(SMALL)
    played = training.evaluate(
        "trio(horizon=20)", str(run.folder), "trust", 4, config.evaluation.seed, progress=False
    )
    damage = played.cells[0].metrics["damage_per_frame"].mean()
    assert float(rows[-1]["damage_per_frame"]) == pytest.approx(damage, rel=1e-5)
    assert run.evaluations[-1]["damage_per_frame"] == float(rows[-1]["damage_per_frame"])


def test_worlds_of_training_are_never_those_of_evaluations(copy):
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


def test_the_exported_policy_says_what_it_is(run):
    tensors, config = load_policy(run.folder)
    assert config["about"]["defense"] == "trust" and config["about"]["steps"] == run.steps
    assert config["layers"][1:-1] == [64, 64] and config["knowledge"] == "own"
    assert {"obs_mean", "obs_var", "action.weight"} <= set(tensors)
    assert ("log_std" in tensors) == (config["choices"] is None)  # a deviation where actions are continuous


def test_learning_changes_weights(run, tmp_path):
    begun = train(out=tmp_path / "begun", steps=1, overrides={"evaluation.every": 1})
    assert begun.steps == ROLLOUT
    assert not same(weights(begun.folder), weights(run.folder))


# --- the same again ------------------------------------------------------------------------------------


def test_same_seed_same_weights_whatever_is_watched(run, tmp_path):
    """A second run, that is evaluated and saved at other times; another seed gives others."""
    often = {"evaluation.every": 10**6, "evaluation.episodes": 2, "checkpoint.every": 100.0}
    again = train(out=tmp_path / "again", overrides=often)
    assert same(weights(again.folder), weights(run.folder))
    other = train(out=tmp_path / "other", seed=1, overrides=often)
    assert not same(weights(other.folder), weights(run.folder))


def test_training_leaves_the_random_generators_of_others_alone(tmp_path):
    random.seed(3)
    np.random.seed(3)  # noqa: NPY002
    expected = random.Random(3).random(), np.random.RandomState(3).random_sample()
    train(out=tmp_path / "run", steps=1)
    assert (random.random(), np.random.random_sample()) == expected  # noqa: NPY002


def interrupted(folder: Path, steps: int) -> None:
    """Make a finished run one that was killed just after its checkpoint at `steps`, with newer lines."""
    for file in (folder / "checkpoints").iterdir():
        if int(file.stem) > steps:
            file.unlink()


def test_resuming_gives_what_an_undisturbed_run_gives(run, copy):
    """Weights, lines and events: nothing is missing, and nothing stands there twice."""
    sessions = len(json.loads((copy / "run.json").read_text())["sessions"])
    interrupted(copy, 2 * ROLLOUT)
    with open(copy / "progress.csv", "a") as file:
        file.write("9999,half a li")
    resumed = training.train(resume=copy, progress=False)
    assert (resumed.began_at, resumed.steps) == (2 * ROLLOUT, 3 * ROLLOUT)
    assert same(weights(copy), weights(run.folder))
    for name in ("progress.csv", "evaluations.csv"):
        assert lines(copy / name) == lines(run.folder / name)
    assert logged(copy) == logged(run.folder)
    assert len(json.loads((copy / "run.json").read_text())["sessions"]) == sessions + 1


def test_a_damaged_checkpoint_gives_way_to_the_one_before(run, copy, capsys):
    last = sorted((copy / "checkpoints").iterdir())[-1]
    data = bytearray(last.read_bytes())
    data[len(data) // 2] ^= 1
    last.write_bytes(data)
    resumed = training.train(resume=copy, progress=False)
    assert f"{last}: not a complete checkpoint" in capsys.readouterr().err
    assert resumed.began_at == 2 * ROLLOUT
    assert same(weights(copy), weights(run.folder))
    for file in (copy / "checkpoints").glob("*.zip"):
        file.write_bytes(b"PK")
    with pytest.raises(ValueError, match="none of the 2 checkpoints can be read"):
        training.train(resume=copy, progress=False)


def test_a_run_that_died_before_its_first_checkpoint_begins_anew(run, copy):
    shutil.rmtree(copy / "checkpoints")
    resumed = training.train(resume=copy, progress=False)
    assert resumed.began_at == 0
    assert same(weights(copy), weights(run.folder))
    assert lines(copy / "progress.csv") == lines(run.folder / "progress.csv")


def kill_and_resume(folder: Path, config: Path, kills: int, rng: random.Random) -> None:
    """Start a run, kill it at a random moment of its work `kills` times, and let it finish."""
    command = [*PROGRAM, "--config", str(config), "--out", str(folder)]
    for _ in range(kills):
        before = saved(folder)
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        while saved(folder) == before and process.poll() is None:
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 0.3))
        assert process.poll() is None, process.communicate()[0].decode()
        process.kill()
        assert process.wait() == -signal.SIGKILL
        command = [*PROGRAM, "--resume", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)


def saved(folder: Path) -> set[str]:
    return {file.name for file in (folder / "checkpoints").glob("*.zip")}


@pytest.mark.slow
def test_killed_three_times_it_learns_the_same(tmp_path):
    """kill -9 at random moments. The weights are the same to the last bit, and so are all lines."""
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump(SMALL | {"steps": 40 * ROLLOUT}))
    whole = training.train(config=config, out=tmp_path / "whole", progress=False)
    folder = tmp_path / "killed"
    kill_and_resume(folder, config, 3, random.Random())
    assert same(weights(folder), weights(whole.folder))
    for name in ("progress.csv", "evaluations.csv"):
        assert lines(folder / name) == lines(whole.folder / name)
    assert logged(folder) == logged(whole.folder)
    assert len(json.loads((folder / "run.json").read_text())["sessions"]) == 4


def test_interrupted_it_saves_and_says_how_to_go_on(tmp_path):
    config, folder = tmp_path / "config.yaml", tmp_path / "run"
    rare = {"checkpoint": {"every": 3600.0}, "evaluation": {"every": 10**9, "episodes": 2}, "steps": 10**9}
    config.write_text(yaml.safe_dump(SMALL | rare))
    command = [*PROGRAM, "--config", str(config), "--out", str(folder)]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (folder / "progress.csv").is_file() or not lines(folder / "progress.csv"):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert f"trust-env train --resume {folder}" in told
    steps = int(lines(folder / "progress.csv")[-1]["steps"])
    assert f"{steps:012d}.zip" in saved(folder)


def test_choices_taken_together_are_those_taken_one_by_one():
    """Against Stable-Baselines3's own distribution; drawn in proportion to their probabilities."""
    import torch as th
    from stable_baselines3.common.distributions import MultiCategoricalDistribution

    from trust_env.training.learning.distribution import GroupedCategorical

    sizes = [5, 5, 3, 4, 4]
    logits = th.randn(6, sum(sizes), generator=th.Generator().manual_seed(0))
    ours = GroupedCategorical(sizes).proba_distribution(logits)
    theirs = MultiCategoricalDistribution(sizes).proba_distribution(logits)
    actions = theirs.sample()
    assert th.allclose(ours.log_prob(actions), theirs.log_prob(actions), atol=1e-5)
    assert th.allclose(ours.entropy(), theirs.entropy(), atol=1e-5)
    assert th.equal(ours.mode(), theirs.mode())
    drawn = ours.proba_distribution(logits[:1].expand(100_000, -1)).sample()
    shares = np.bincount(drawn[:, 0].numpy(), minlength=5) / 100_000
    assert shares == pytest.approx(th.softmax(logits[0, :5], dim=0).numpy(), abs=0.01)


# --- other things to learn ------------------------------------------------------------------------------


@pytest.mark.parametrize("knowledge", KNOWLEDGE)
def test_every_knowledge_level_and_view(tmp_path, knowledge):
    view = {"own": "raw", "poses": "grid", "picture": "phantoms(n=1)", "white_box": "phantoms"}[knowledge]
    found = train(out=tmp_path / "run", steps=1, knowledge=knowledge, view=view)
    config = load_policy(found.folder)[1]
    assert config["knowledge"] == knowledge and config["view"].startswith(view.partition("(")[0])
    resumed = training.train(resume=found.folder, progress=False)
    assert resumed.began_at == found.steps


def test_benign_agents_learn_against_an_attack(tmp_path):
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


# --- what is refused ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"overrides": {"ppo.lerning_rate": 1}}, r"did you mean 'ppo.learning_rate'\?"),
        ({"config": {"stepz": 3}}, r"stepz = 3: unknown field; did you mean 'steps'\?"),
        ({"steps": -5}, r"steps = -5 \(override\): expected a number of at least 1"),
        ({"overrides": {"ppo.gamma": 1.5}}, "expected a number of at most 1"),
        ({"seed": 2**40}, "expected a number below 4294967296"),
        ({"scenario": "trio(n_adversaries=0)"}, "has no agent of role 'adversary'"),
        ({"scenario": "trois"}, r"unknown scenario 'trois'; did you mean 'trio'\?"),
        ({"defense": "trusst"}, r"unknown defense 'trusst'; did you mean 'trust'\?"),
        ({"view": "ghosts"}, "unknown .*'ghosts'"),
        ({"others": {"benign": "honesty"}}, r"unknown policy 'honesty'; did you mean 'honest'\?"),
        ({"others": {"benine": "honest"}}, r"did you mean 'benign'\?"),
        ({"others": {"adversary": "honest"}}, "adversary is the role that learns"),
    ],
    ids=lambda value: None if isinstance(value, str) else "-".join(value),
)
def test_what_cannot_be_trained_is_refused_before_there_is_a_folder(tmp_path, arguments, text):
    with pytest.raises(ValueError, match=text):
        train(out=tmp_path / "run", **arguments)
    assert not (tmp_path / "run").exists()


def test_folders_that_may_not_be_used(run, tmp_path):
    with pytest.raises(ValueError, match="expected out, a new or empty folder for the run, or resume"):
        train()
    with pytest.raises(ValueError, match=r"there is a training run in this folder.*--resume"):
        train(out=run.folder)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"not empty \(it holds notes.txt\)"):
        train(out=tmp_path)
    with pytest.raises(ValueError, match="expected a folder, this is a file"):
        train(out=tmp_path / "notes.txt")
    with pytest.raises(
        ValueError, match=r"there is no config\.yaml in it; expected the folder of a training run"
    ):
        training.train(resume=tmp_path)
    with pytest.raises(ValueError, match="there is no such folder"):
        training.train(resume=tmp_path / "nowhere")
    with pytest.raises(ValueError, match="expected nothing beside it, got steps"):
        training.train(resume=run.folder, steps=10**6)


def test_a_finished_run_is_finished(run, capsys):
    before = weights(run.folder)
    events = len(list((run.folder / "tensorboard").iterdir()))
    assert main(["train", "--resume", str(run.folder)]) == 0
    assert "was finished before: 1,536 steps" in capsys.readouterr().out
    assert same(weights(run.folder), before)
    assert len(list((run.folder / "tensorboard").iterdir())) == events


def test_one_process_at_a_time(run):
    from trust_env.training.learning.training_folder import TrainingFolder

    with (
        TrainingFolder.open(run.folder).alone(),
        pytest.raises(ValueError, match="another process is training in this folder"),
    ):
        training.train(resume=run.folder, progress=False)


def test_files_of_the_user_must_stay_what_they_were(tmp_path):
    mine = tmp_path / "mine.py"
    text = "from trust_env.defenses import Verdict\nclass Mine:\n    def reset(self, shape, worlds): ...\n"
    mine.write_text(text + "    def update(self, evidence): return Verdict()\n")
    done = train(out=tmp_path / "run", steps=ROLLOUT + 1, defense=f"{mine}:Mine")
    interrupted(done.folder, ROLLOUT)
    mine.write_text(mine.read_text() + "# changed\n")
    with pytest.raises(ValueError, match=r"mine\.py: it has changed since the run"):
        training.train(resume=done.folder, progress=False)


def test_a_full_disk_keeps_what_was_saved(copy, run, monkeypatch):
    interrupted(copy, 2 * ROLLOUT)
    before = saved(copy)

    def full(path):
        if ".zip" in path.name:
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(files, "sync", full)
        with pytest.raises(OSError, match=r"No space left on device: '.*\.zip'"):
            training.train(resume=copy, progress=False)
    assert saved(copy) == before and not list(copy.glob("checkpoints/*.unfinished"))
    training.train(resume=copy, progress=False)
    assert same(weights(copy), weights(run.folder))


# --- configuration --------------------------------------------------------------------------------------


def test_a_configuration_reads_back(tmp_path):
    config = load_configuration(SMALL, {"others.benign": "honest", "ppo.gamma": 0.5, "gae_lambda": 0.4})
    (tmp_path / "copy.yaml").write_text(config.to_yaml())
    assert load_configuration(tmp_path / "copy.yaml") == config
    assert (config.others, config.ppo.gamma, config.ppo.gae_lambda) == ({"benign": "honest"}, 0.5, 0.4)


def test_a_file_says_only_what_differs_and_errors_name_its_lines(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("steps: 10\nppo:\n  gamma: 2\n")
    with pytest.raises(
        ValueError, match=r"mine\.yaml, line 3: ppo\.gamma = 2: expected a number of at most 1"
    ):
        load_configuration(mine)
    mine.write_text("steps: 10\n")
    assert load_configuration(mine) == load_configuration(overrides={"steps": 10})
    with pytest.raises(ValueError, match="No such file"):
        load_configuration(tmp_path / "missing.yaml")


def test_every_default_is_commented():
    text = (ROOT / "training" / "learning" / "defaults.yaml").read_text()
    missing = [
        line for line in text.splitlines() if line.strip() and not line.startswith("#") and "#" not in line
    ]
    assert [line.split(":")[0].strip() for line in missing] == []
