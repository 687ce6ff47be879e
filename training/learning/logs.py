"""The logs of a training run: progress.csv, evaluations.csv and TensorBoard's files, in its folder.

Lines are only ever added, and a checkpoint holds the length of each file: a resumed run truncates the files
to it, so that no line stands there twice.
"""

from __future__ import annotations

import contextlib
import csv
import io
import os
import socket
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.logger import KVWriter, Logger
from tensorboard.compat.proto.event_pb2 import Event  # type: ignore[attr-defined]
from tensorboard.compat.proto.summary_pb2 import Summary  # type: ignore[attr-defined]
from tensorboard.summary.writer.record_writer import RecordWriter

from trust_env.files import naming, sync
from trust_env.metrics import METRICS

PROGRESS, EVALUATIONS, TENSORBOARD = "progress.csv", "evaluations.csv", "tensorboard"
PROGRESS_COLUMNS = (
    "time/steps", "time/seconds", "time/steps_per_second",
    "rollout/damage_per_frame", "rollout/false_tracks_per_frame", "rollout/missing_targets_per_frame",
    "rollout/episode_reward",
    "train/learning_rate", "train/entropy_loss", "train/policy_gradient_loss", "train/value_loss",
    "train/approx_kl", "train/clip_fraction", "train/explained_variance", "train/std",
)  # fmt: skip
EVALUATION_COLUMNS = ("time/steps", *(f"evaluation/{name}" for name in METRICS))


class Logs:
    """Two Stable-Baselines3 loggers: `training`, which the algorithm writes to, and `evaluation`."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._board = TensorBoardFile(folder / TENSORBOARD)
        self._lines = {
            name: AppendedCsv(folder / name, columns)
            for name, columns in ((PROGRESS, PROGRESS_COLUMNS), (EVALUATIONS, EVALUATION_COLUMNS))
        }
        self.training = Logger(str(folder), [self._board, self._lines[PROGRESS]])
        self.evaluation = Logger(str(folder), [self._board, self._lines[EVALUATIONS]])

    def sizes(self) -> dict[str, int]:
        """The size of every file in bytes, after all of it is on the disk."""
        found = {}
        for file in _files(self._folder):
            sync(file)
            found[str(file.relative_to(self._folder))] = file.stat().st_size
        return found

    def close(self) -> None:
        self._board.close()
        for lines in self._lines.values():
            lines.close()


def truncate(folder: Path, sizes: Mapping[str, int]) -> None:
    """Truncate the log files of a folder to these sizes; remove those that have none."""
    for file in _files(folder):
        size = sizes.get(str(file.relative_to(folder)), 0)
        if size == 0:
            file.unlink()
        elif file.stat().st_size > size:
            os.truncate(file, size)


def _files(folder: Path) -> list[Path]:
    found = [folder / PROGRESS, folder / EVALUATIONS, *sorted((folder / TENSORBOARD).glob("*"))]
    return [file for file in found if file.is_file()]


class AppendedFile:
    """A file to whose end bytes are added."""

    def __init__(self, path: Path):
        self._path, self._file = path, open(path, "ab")  # noqa: SIM115

    def write(self, data: bytes) -> None:
        """Add to the file at once. OSError, naming the file: there is no room, or the like."""
        with naming(self._path):
            self._file.write(data)
            self._file.flush()

    def close(self) -> None:
        with contextlib.suppress(OSError):  # `write` has raised it before
            self._file.close()


class TensorBoardFile(KVWriter):
    """A file of scalars for TensorBoard, whose own writer fails in a thread, and then names no file."""

    def __init__(self, folder: Path):
        folder.mkdir(exist_ok=True)
        seconds, number = int(time.time()), len(list(folder.iterdir()))
        name = f"events.out.tfevents.{seconds}.{socket.gethostname()}.{os.getpid()}.{number}"
        self._file = AppendedFile(folder / name)
        self._records = RecordWriter(self._file)
        self._add(file_version="brain.Event:2")

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        for name, value in key_values.items():
            if "tensorboard" not in (key_excluded.get(name) or ()):
                self._add(step=step, summary=Summary(value=[Summary.Value(tag=name, simple_value=float(value))]))

    def _add(self, **fields: Any) -> None:
        self._records.write(Event(wall_time=time.time(), **fields).SerializeToString())

    def close(self) -> None:
        self._file.close()


class AppendedCsv(KVWriter):
    """A line for every dump, of the given columns, without the part of their names before the slash."""

    def __init__(self, file: Path, columns: Sequence[str]):
        self._columns = columns
        self._file = AppendedFile(file)
        if file.stat().st_size == 0:
            self._add([name.partition("/")[2] for name in columns])

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        self._add([_text(key_values.get(name)) for name in self._columns])

    def _add(self, row: list[str]) -> None:
        line = io.StringIO(newline="")
        csv.writer(line).writerow(row)
        self._file.write(line.getvalue().encode())

    def close(self) -> None:
        self._file.close()


def _text(value: Any) -> str:
    """Six digits; nothing where there is no value."""
    if value is None or value != value:
        return ""
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)
