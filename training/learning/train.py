"""Training of adversaries, or of benign agents, by PPO on many worlds at once.

run = train("patrol", "trust", steps=20_000_000, seed=0, out="RUN")
training.evaluate("patrol", attacks=["RUN", "fov_aware"], defenses="trust")
train(resume="RUN")    # after whatever stopped it
"""

from __future__ import annotations

import contextlib
import csv
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trust_env.defenses import build_defense, refuse_reference
from trust_env.files import expanded, locked
from trust_env.scenario import Scenario, load_scenario
from trust_env.training.console import progress_bar
from trust_env.training.learning.configuration import Configuration, load_configuration
from trust_env.training.learning.learning_curve import CURVE, draw_curve
from trust_env.training.learning.signals import stop_on_signals

if TYPE_CHECKING:
    from trust_env.training.learning.session import Session
    from trust_env.training.learning.training_folder import TrainingFolder


@dataclass(frozen=True)
class TrainingRun:
    """The result of a run. evaluations: the lines of evaluations.csv, numbers by column."""

    folder: Path
    steps: int
    evaluations: list[dict[str, float]]
    began_at: int = 0  # steps that earlier sessions had done

    def to_dict(self) -> dict[str, Any]:
        """The result as built-in values, for JSON."""
        return {"folder": str(self.folder), "steps": self.steps, "evaluations": self.evaluations}

    def describe(self) -> str:
        """The result, where its learning curve is, and the command that evaluates it."""
        from trust_env.training.learning.next_step import next_step

        done = "was finished before" if self.began_at == self.steps else "is finished"
        damage = self.evaluations[-1]["damage_per_frame"]
        return "\n".join([
            f"{self.folder} {done}: {self.steps:,} steps, damage per frame {damage:.2f} on held-out worlds",
            *([f"its learning curve: {self.folder / CURVE}"] if (self.folder / CURVE).is_file() else []),
            next_step([self.folder]),
        ])  # fmt: skip


def train(
    scenario: Any = None,
    defense: str | None = None,
    steps: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    resume: str | Path | None = None,
    config: str | Path | Mapping[str, Any] | None = None,
    knowledge: str | None = None,
    wrapper: str | None = None,
    others: Mapping[str, str] | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> TrainingRun:
    """Train a policy against a defense, in the folder `out`, or continue the run in the folder `resume`.

    config: a YAML file or a mapping that says what differs from `learning/defaults.yaml`; the other arguments
    override it where given. overrides: single fields, {"ppo.learning_rate": 1e-3}. others: policies of the
    agents that do not learn, by role or name. The same configuration gives the same weights on the same
    machine, however often the run was stopped and resumed.

    Raises ValueError for what cannot be trained and for a folder that may not be used, OSError for one that
    cannot be written, KeyboardInterrupt when interrupted: the run can then be resumed.
    """
    from trust_env.training.learning.training_folder import TrainingFolder

    given = given_fields(defense, steps, seed, knowledge, wrapper, others, overrides)
    if resume is not None:
        _check_nothing_beside_resume({"scenario": scenario, "out": out, "config": config} | given)
        folder, new_run = TrainingFolder.open(resume), None
    elif out is not None:
        folder, new_run = TrainingFolder(expanded(out)), configured(scenario, config, given)
    else:
        raise ValueError("train: expected out, a new or empty folder for the run, or resume, that of a run")
    from trust_env.training.learning.torch_state import isolated_torch

    with locked(folder.path):
        if new_run is not None:
            folder.create(*new_run)
        with isolated_torch(folder.configuration().threads):
            return _continue(folder, progress)


def given_fields(
    defense: str | None = None,
    steps: int | None = None,
    seed: int | None = None,
    knowledge: str | None = None,
    wrapper: str | None = None,
    others: Mapping[str, str] | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The fields of the configuration that arguments of `train` set."""
    own = {"defense": defense, "steps": steps, "seed": seed, "knowledge": knowledge, "wrapper": wrapper}
    own |= {f"others.{key}": value for key, value in (others or {}).items()}
    return {name: value for name, value in own.items() if value is not None} | dict(overrides or {})


def _check_nothing_beside_resume(given: Mapping[str, Any]) -> None:
    named = [name for name, value in given.items() if value is not None]
    if named:
        raise ValueError(
            f"resume continues a run as it was configured, to its last step; expected nothing beside it, "
            f"got {', '.join(named)}"
        )


def configured(scenario: Any, config: Any, given: Mapping[str, Any]) -> tuple[Configuration, Scenario]:
    """What is trained. ValueError: it cannot be."""
    from trust_env.training.learning.session import build_learners

    named = scenario
    if scenario is not None and not isinstance(scenario, (str, Path)):
        named = load_scenario(scenario).name
    settings = load_configuration(config, given if named is None else {"scenario": str(named), **given})
    loaded = load_scenario(settings.scenario if scenario is None else scenario)
    refuse_reference(build_defense(settings.defense), "training")
    build_learners(settings, loaded, num_worlds=1).close()  # ValueError for what does not fit together
    return settings, loaded


def _continue(folder: TrainingFolder, progress: bool) -> TrainingRun:
    from trust_env.training.learning.session import Session

    saved = folder.checkpoints.load(_warn)
    if saved and saved["steps"] >= folder.configuration().steps:
        draw_curve([folder.path], folder.path / CURVE)
        return TrainingRun(folder.path, saved["steps"], _evaluations(folder.path), saved["steps"])
    session = Session(folder, saved)
    began, configured = session.steps, session.config.steps
    if progress and session.total != configured:
        _warn(f"train: {session.total:,} steps instead of {configured:,}: whole rollouts of {session.rollout:,} steps")
    try:
        with stop_on_signals() as stop_requested, _shown(session, progress) as (advance, tell):
            session.run(advance, tell, stop_requested)
    finally:
        session.close()
    draw_curve([folder.path], folder.path / CURVE)
    return TrainingRun(folder.path, session.steps, _evaluations(folder.path), began)


def _warn(text: str) -> None:
    print(f"trust-env: {text}", file=sys.stderr)


@contextlib.contextmanager
def _shown(session: Session, progress: bool) -> Iterator[tuple[Callable[[int], None], Callable[[str], None]]]:
    """A bar on a terminal, else a line for every evaluation."""
    total, began, at = session.total, session.steps, time.monotonic()
    with progress_bar("train", total, progress, session.steps) as (advance, tell):

        def report(text: str) -> None:
            tell(f"train: {text}")
            if progress and not sys.stderr.isatty():
                left = _time_left(session.steps - began, total - session.steps, time.monotonic() - at)
                _warn(f"train: {session.steps:,} of {total:,} steps, {session.seconds:.0f} s{left}: {text}")

        yield advance, report


def _time_left(done: int, missing: int, seconds: float) -> str:
    """How long the missing steps take at the speed of those that are done."""
    return f", {seconds * missing / done:.0f} s left" if done and missing else ""


def _evaluations(folder: Path) -> list[dict[str, float]]:
    with open(folder / "evaluations.csv", newline="", encoding="utf-8") as lines:
        return [{name: float(value) for name, value in line.items() if value} for line in csv.DictReader(lines)]
