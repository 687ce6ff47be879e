"""Attackers, or defenders of the picture, that learn: PPO on many worlds at once.

run = train("patrol", "trust", steps=20_000_000, seed=0, out="RUN")
training.evaluate("patrol", attacks=["RUN", "fov_aware"], defenses="trust")
train(resume="RUN")    # after whatever stopped it
"""

from __future__ import annotations

import contextlib
import csv
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trust_env.scenario import load_scenario
from trust_env.training.console import progress_bar
from trust_env.training.learning.configuration import load_configuration

if TYPE_CHECKING:
    from trust_env.training.learning.session import Session
    from trust_env.training.learning.training_folder import TrainingFolder


@dataclass(frozen=True)
class TrainingRun:
    """What a run has come to. evaluations: the lines of evaluations.csv, numbers by column."""

    folder: Path
    steps: int
    evaluations: list[dict[str, float]]
    began_at: int = 0  # steps that earlier sessions had done

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return {"folder": str(self.folder), "steps": self.steps, "evaluations": self.evaluations}

    def told(self) -> str:
        """What it has come to, and what can be done with it."""
        done = "was finished before" if self.began_at == self.steps else "is finished"
        damage = self.evaluations[-1]["damage_per_frame"]
        return (
            f"{self.folder} {done}: {self.steps:,} steps, damage per frame {damage:.2f} on held-out worlds\n"
            f"to compare: trust-env evaluate --attack {self.folder},false_positive"
        )


def train(
    scenario: Any = None,
    defense: str | None = None,
    steps: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    resume: str | Path | None = None,
    config: str | Path | Mapping[str, Any] | None = None,
    knowledge: str | None = None,
    view: str | None = None,
    others: Mapping[str, str] | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> TrainingRun:
    """Train a policy against a defense, in the folder `out`, or go on with the run in the folder `resume`.

    config: a YAML file or a mapping that says what differs from `learning/defaults.yaml`; everything else but
    `progress` goes before it where given; overrides: single fields, {"ppo.learning_rate": 1e-3}. others:
    policies of the agents that do not learn, by role or name. The same configuration gives the same weights
    on the same machine, however often the run was stopped and resumed.

    Raises ValueError for what cannot be trained and for a folder that may not be used, OSError for one that
    cannot be written, KeyboardInterrupt when interrupted: the folder then has what it takes to resume.
    """
    from trust_env.training.learning.training_folder import TrainingFolder

    own = {"defense": defense, "steps": steps, "seed": seed, "knowledge": knowledge, "view": view}
    own |= {f"others.{key}": value for key, value in (others or {}).items()}
    given = {name: value for name, value in own.items() if value is not None} | dict(overrides or {})
    if resume is not None:
        _refuse_beside_resume({"scenario": scenario, "out": out, "config": config} | given)
        folder = TrainingFolder.open(resume)
    else:
        folder = _begin(scenario, config, given, out)
    from trust_env.training.learning.ppo import own_torch

    with folder.alone(), own_torch(folder.configuration().threads):
        return _continue(folder, progress)


def _refuse_beside_resume(given: Mapping[str, Any]) -> None:
    named = [name for name, value in given.items() if value is not None]
    if named:
        raise ValueError(
            f"resume continues a run as it was configured, to its last step; expected nothing beside it, "
            f"got {', '.join(named)}"
        )


def _begin(scenario: Any, config: Any, given: Mapping[str, Any], out: str | Path | None) -> TrainingFolder:
    """The folder of a run that has not begun, if it can be trained at all."""
    from trust_env.training.learning.session import build_learners
    from trust_env.training.learning.training_folder import TrainingFolder

    if out is None:
        raise ValueError("train: expected out, a new or empty folder for the run, or resume, that of a run")
    named = (
        scenario if scenario is None or isinstance(scenario, (str, Path)) else load_scenario(scenario).name
    )
    settings = load_configuration(config, given if named is None else {"scenario": str(named), **given})
    loaded = load_scenario(settings.scenario if scenario is None else scenario)
    build_learners(settings, loaded, num_worlds=1).close()  # refuses what does not fit together
    return TrainingFolder.create(out, settings, loaded)


def _continue(folder: TrainingFolder, progress: bool) -> TrainingRun:
    from trust_env.training.learning.session import Session

    saved = folder.checkpoints.load(_warn)
    if saved and saved["steps"] >= folder.configuration().steps:
        return TrainingRun(folder.path, saved["steps"], _evaluations(folder.path), saved["steps"])
    session = Session(folder, saved)
    began = session.steps
    try:
        with interruptions() as stops, _shown(session, progress) as (advance, tell):
            session.run(advance, tell, stops)
    finally:
        session.close()
    return TrainingRun(folder.path, session.steps, _evaluations(folder.path), began)


def _warn(text: str) -> None:
    print(f"trust-env: {text}", file=sys.stderr)


@contextlib.contextmanager
def _shown(session: Session, progress: bool) -> Iterator[tuple[Callable[[int], None], Callable[[str], None]]]:
    """A bar on a terminal, else a line for every evaluation."""
    total = session.total
    with progress_bar("train", total, progress, session.steps) as (advance, tell):

        def say(text: str) -> None:
            tell(f"train: {text}")
            if progress and not sys.stderr.isatty():
                _warn(f"train: {session.steps:,} of {total:,} steps, {session.seconds:.0f} s: {text}")

        yield advance, say


@contextlib.contextmanager
def interruptions() -> Iterator[Callable[[], bool]]:
    """While the block runs, Ctrl-C and the wish to terminate only make a note, which the block may ask for;
    the second one interrupts at once.
    """
    noted: list[int] = []

    def note(number: int, frame: Any) -> None:
        if noted:
            raise KeyboardInterrupt
        noted.append(number)
        _warn("stopping after this rollout; once more stops at once, back to the last checkpoint")

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(noted)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _evaluations(folder: Path) -> list[dict[str, float]]:
    with open(folder / "evaluations.csv", newline="", encoding="utf-8") as lines:
        return [
            {name: float(value) for name, value in line.items() if value} for line in csv.DictReader(lines)
        ]
