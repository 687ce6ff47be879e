"""Runs that were stopped: the same weights and logs after resuming, and what raises."""

from __future__ import annotations

import errno
import json
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
import yaml
from folder_runs import TRAIN, out_of_space, played_in_peace
from paths import ROOT
from training_runs import PROGRAM, ROLLOUT, SMALL, interrupted, lines, logged, same, saved, train, weights

from trust_env import files, training
from trust_env.training.cli.main import main

pytestmark = pytest.mark.extra("train")


def test_a_resumed_run_gives_the_weights_and_logs_of_an_uninterrupted_one(run, copy):
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


def test_a_damaged_checkpoint_is_replaced_by_the_one_before(run, copy, capsys):
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


def test_a_run_without_a_checkpoint_starts_over(run, copy):
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


@pytest.mark.slow
def test_a_run_killed_three_times_gives_the_same_weights_and_logs(tmp_path):
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


def test_sigint_saves_a_checkpoint_and_prints_the_command_to_resume(tmp_path):
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


def test_resuming_a_finished_run_changes_nothing(run, capsys):
    before = weights(run.folder)
    events = len(list((run.folder / "tensorboard").iterdir()))
    assert main(["train", "--resume", str(run.folder)]) == 0
    assert "was finished before: 1,536 steps" in capsys.readouterr().out
    assert same(weights(run.folder), before)
    assert len(list((run.folder / "tensorboard").iterdir())) == events


def test_a_second_process_in_the_same_folder_raises(run):
    with files.locked(run.folder), pytest.raises(ValueError, match="another process is at work in this folder"):
        training.train(resume=run.folder, progress=False)


def test_a_changed_file_of_the_user_raises_on_resume(tmp_path):
    mine = tmp_path / "mine.py"
    text = "from trust_env.defenses import Verdict\nclass Mine:\n    def reset(self, shape, worlds): ...\n"
    mine.write_text(text + "    def update(self, evidence): return Verdict()\n")
    done = train(out=tmp_path / "run", steps=ROLLOUT + 1, defense=f"{mine}:Mine")
    interrupted(done.folder, ROLLOUT)
    mine.write_text(mine.read_text() + "# changed\n")
    with pytest.raises(ValueError, match=r"mine\.py: it has changed since the run"):
        training.train(resume=done.folder, progress=False)


def test_a_disk_full_of_logs_names_the_file_and_the_command_to_resume(tmp_path):
    """A limit to the size of files stands for the disk: every file is hit by one of these limits first."""
    whole = played_in_peace(TRAIN, tmp_path / "whole")[0]
    run = tmp_path / "run"
    hit = {100: "scenario.yaml", 5000: "policy.safetensors", 230_000: "checkpoints/000000000032.zip"}
    for most_bytes, name in hit.items():
        told = out_of_space(TRAIN, run, most_bytes)
        assert told.endswith(f"trust-env: error: {run}/{name}: File too large\n")
        assert (f"to continue: trust-env train --resume {run}" in told) == (most_bytes > 100)
    assert saved(run) == {"000000000000.zip"}
    assert played_in_peace(TRAIN, run)[0] == whole


@pytest.mark.parametrize("name", ["progress.csv", "tensorboard/events"])
def test_a_log_that_cannot_be_written_is_named(run, copy, monkeypatch, name):
    """And closing it, with what it still holds, does not hide that."""
    from trust_env.training.learning.logs import AppendedFile

    interrupted(copy, 2 * ROLLOUT)
    opened = AppendedFile.__init__

    def on_a_full_disk(self, path):
        opened(self, path)
        if name in str(path):
            self._file.close()
            self._file = open("/dev/full", "wb")  # noqa: SIM115

    with monkeypatch.context() as patched:
        patched.setattr(AppendedFile, "__init__", on_a_full_disk)
        with pytest.raises(OSError, match=rf"No space left on device: '{copy}/{name}"):
            training.train(resume=copy, progress=False)
    training.train(resume=copy, progress=False)
    assert same(weights(copy), weights(run.folder)) and logged(copy) == logged(run.folder)


def test_a_full_disk_keeps_the_saved_checkpoints(copy, run, monkeypatch):
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
