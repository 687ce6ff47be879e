"""What an evaluation consists of, by name: who takes part, and all that its numbers depend on."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import trust_env
from trust_env.agents import is_run, parse_policy
from trust_env.agents.learned.policy import Learned
from trust_env.parallel import TrustEnv
from trust_env.scenario import Scenario
from trust_env.spec import Spec, parse, split_specs


@dataclass(frozen=True)
class Contender:
    """An attack or a defense under its name; `make` gives one that has not played yet."""

    name: str
    make: Callable[[], Any]
    spec: Spec | None


def contenders(kind: str, named: str | Iterable[Any], build: Callable[[Any], Any]) -> list[Contender]:
    """Those in a text with commas, or in a list of texts and objects. ValueError: unknown, or twice."""
    items = (
        split_specs(named) if isinstance(named, str) else [named] if hasattr(named, "reset") else list(named)
    )
    read = parse_policy if kind == "attack" else parse
    found = [_contender(item, build, read) for item in items]
    names = [contender.name for contender in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{kind} {', '.join(twice)}: given twice, so that cells could not be told apart")
    if not found:
        raise ValueError(f"no {kind} is given; expected at least one name")
    return found


def _contender(item: Any, build: Callable[[Any], Any], read: Callable[[str], Spec]) -> Contender:
    if isinstance(item, str):
        spec = read(item)
        build(str(spec))  # refuses what cannot be built before anything is played
        name = item.strip() if read is parse_policy and is_run(item) else str(spec)
        return Contender(name, lambda: build(str(spec)), spec)
    build(item)
    name = getattr(item, "name", None) or type(item).__name__
    return Contender(str(name), lambda: copy.deepcopy(item), None)


def configuration(
    scenario: Scenario,
    attackers: list[Contender],
    defenders: list[Contender],
    episodes: int,
    seed: int,
    horizon: int,
) -> dict[str, Any]:
    """Everything that the results depend on, as plain values. Files count by what is in them."""
    fields = scenario.model_dump(mode="json")
    data = fields["targets"].pop("data")
    files = {} if data is None else {"targets.data": digest(data)}
    for contender in (*attackers, *defenders):
        if contender.spec is not None:
            files |= {name: digest(file) for name, file in files_of(contender.spec)}
    return {
        "scenario": fields,
        "attacks": [attacker.name for attacker in attackers],
        "defenses": [defender.name for defender in defenders],
        "episodes": episodes,
        "seed": seed,
        "horizon": horizon,
        "version": TrustEnv.metadata["name"],
        "package": trust_env.__version__,
        "files": files,
    }


def files_of(spec: Spec) -> Iterator[tuple[str, str | Path]]:
    """The files that a spec names, itself or within: users' code, and weights."""
    if spec.path is not None:
        yield spec.path, spec.path
    elif spec.name == Learned.name:
        yield str(spec), Learned(**spec.params).file
    if isinstance(spec.params.get("inner"), str):
        yield from files_of(parse_policy(spec.params["inner"]))


def digest(file: str | Path) -> str:
    return hashlib.sha256(Path(file).expanduser().read_bytes()).hexdigest()[:16]
