"""Conformance checks over scenarios and defenses, or of an environment of the user's own."""

from __future__ import annotations

import contextlib
import functools
import inspect
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

import trust_env
from trust_env.agents import Player, build_policy, sufficient_knowledge
from trust_env.conformance import CHECKS, Report, check, random_policy
from trust_env.defenses import DEFENSES, named_in_full
from trust_env.scenario import Scenario, load_scenario
from trust_env.spec import load_object, parse, split_specs
from trust_env.training.console import print_table, progress_bar
from trust_env.training.evaluation.recording import needs_recording


@dataclass(frozen=True)
class Conformance:
    """One report per environment that was checked."""

    reports: tuple[Report, ...]

    @property
    def ok(self) -> bool:
        return all(report.ok for report in self.reports)

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return {"ok": self.ok, "environments": [report.to_dict() for report in self.reports]}

    def print(self, console: Console) -> None:
        """All checks of a single environment; of several the counts, and every check that failed."""
        if len(self.reports) == 1:
            console.print(self.reports[0])
            return
        table = Table("environment", "passed", "failed", "skipped", "seconds")
        for report in self.reports:
            counts = [str(len(names)) for names in (report.passed, report.failed, report.skipped)]
            seconds = f"{sum(result.seconds for result in report.results):.1f}"
            table.add_row(Text(report.environment), *counts, seconds, style="" if report.ok else "bold red")
        print_table(console, table)
        for report in self.reports:
            for name in report.failed:
                console.print(f"{report.environment}: {name}: {report[name].detail}", markup=False, style="red")


def conform(
    scenarios: str | Iterable[Any] | None = None,
    defenses: str | Iterable[Any] | None = None,
    env: str | None = None,
    attack: str | None = None,
    data: str | Path | None = None,
    seed: int = 0,
    max_seconds: float = 5.0,
    progress: bool = True,
) -> Conformance:
    """Run `trust_env.conformance.check` on scenarios x defenses, or on the environment that `env` makes.

    scenarios, defenses: names in a text with commas, or a list; by default all built in (what needs a
    recording only with `data`, no defense that needs a parameter or takes fewer agents). env:
    `my_file.py:make_env`, a function or class that returns a ParallelEnv. attack: who plays the
    adversaries; by default all actions are random. max_seconds: of an episode.
    """
    if env is not None:
        if scenarios is not None or defenses is not None or attack is not None:
            raise ValueError("env is checked as it is; expected no scenario, defense or attack beside it")
        subjects = [(env, _factory(env), None)]
    else:
        subjects = _environments(_names(scenarios) or _playable(data), _names(defenses), data, attack)
    policy = random_policy if attack is None else functools.partial(_attack_policy, attack)
    reports: list[Report] = []
    with progress_bar("conform", len(subjects) * len(CHECKS), progress) as (advance, describe):
        for name, make, aec in subjects:
            describe(name)
            report = check(
                make,
                aec=aec,
                seed=seed,
                max_seconds=max_seconds,
                policy=policy,
                on_result=lambda _: advance(1),
            )
            reports.append(Report(name, report.seed, report.results))
    return Conformance(tuple(reports))


def _names(named: str | Iterable[Any] | None) -> list[Any]:
    return split_specs(named) if isinstance(named, str) else list(named or ())


def _playable(data: str | Path | None) -> list[str]:
    """All built-in scenarios, those on a recording only where one is given."""
    return [name for name in trust_env.scenarios() if data is not None or not needs_recording(name)]


def _environments(
    scenarios: Iterable[Any], defenses: Iterable[Any], data: str | Path | None, attack: str | None
) -> list[Any]:
    """Name, factory of the parallel form and factory of the AEC form, for every pair."""
    policies = () if attack is None else (build_policy(attack),)
    subjects = []
    for source in scenarios:
        recording = {"targets.data": data} if data is not None and needs_recording(source) else {}
        scenario = load_scenario(source, **recording)
        scenario = load_scenario(scenario, knowledge=sufficient_knowledge(scenario, *policies))
        for defense in defenses or _fitting_defenses(scenario):
            trust_env.parallel_env(scenario, defense).close()  # raises what is wrong with the arguments
            makes = (functools.partial(make, scenario, defense) for make in (trust_env.parallel_env, trust_env.env))
            name = named_in_full(defense) if isinstance(defense, str) else defense
            subjects.append((f"{scenario.name} x {name}", *makes))
    return subjects


def _fitting_defenses(scenario: Scenario) -> list[str]:
    """The built-in defenses that need no parameters and take as many agents."""
    fitting = []
    for name, defense in DEFENSES.items():
        needed = [p for p in inspect.signature(defense).parameters.values() if p.default is p.empty]
        if all(p.kind is p.VAR_KEYWORD for p in needed):
            with contextlib.suppress(ValueError), warnings.catch_warnings(action="ignore"):  # it warns when it is built
                defense().values(scenario.n_agents)
                fitting.append(name)
    return fitting


def _factory(text: str) -> Any:
    """The function or class that a text such as `my_file.py:make_env` names, with its arguments."""
    spec = parse(text)
    found = load_object(spec)
    if not callable(found) and not hasattr(found, "reset"):
        raise ValueError(f"{text}: expected a function or class that returns a ParallelEnv, found {found!r}")
    return functools.partial(found, **spec.params) if spec.params else found


def _attack_policy(attack: str, env: Any, seed: int) -> Any:
    """A policy for the checks: adversaries play `attack`, benign agents are honest."""
    player = Player(env, {"adversary": attack})
    return lambda observations, infos: player.actions(observations)
