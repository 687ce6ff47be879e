"""The attacks and defenses of an evaluation by name, and the configuration that its results depend on."""

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
from trust_env.defenses import named_in_full
from trust_env.files import expanded
from trust_env.parallel import TrustEnv
from trust_env.scenario import Scenario
from trust_env.spec import Spec, parse, split_specs


@dataclass(frozen=True)
class NamedSpec:
    """An attack or a defense under its name; `construct` gives one that has not played yet."""

    name: str
    construct: Callable[[], Any]
    spec: Spec | None  # None: it was given as an object


def named_specs(kind: str, given: str | Iterable[Any], build: Callable[[Any], Any]) -> list[NamedSpec]:
    """Those in a text with commas, or in a list of texts and objects. ValueError: unknown, or twice."""
    read = parse_policy if kind == "attack" else parse
    found = [_named_spec(item, build, read) for item in _items(given)]
    names = [one.name for one in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{kind} {', '.join(twice)}: given twice, so that cells could not be told apart")
    if not found:
        raise ValueError(f"no {kind} is given; expected at least one name")
    return found


def _items(given: str | Iterable[Any]) -> list[Any]:
    if isinstance(given, str):
        return list(split_specs(given))
    return [given] if hasattr(given, "reset") else list(given)


def _named_spec(item: Any, build: Callable[[Any], Any], read: Callable[[str], Spec]) -> NamedSpec:
    if isinstance(item, str):
        spec = read(item)
        build(str(spec))  # refuses what cannot be built before anything is played
        full = str(spec) if read is parse_policy else named_in_full(item)
        name = item.strip() if read is parse_policy and is_run(item) else full
        return NamedSpec(name, lambda: build(str(spec)), spec)
    build(item)
    name = getattr(item, "name", None) or type(item).__name__
    return NamedSpec(str(name), lambda: copy.deepcopy(item), None)


def configuration(
    scenario: Scenario,
    attacks: list[NamedSpec],
    defenses: list[NamedSpec],
    episodes: int,
    seed: int,
    horizon: int,
) -> dict[str, Any]:
    """Everything that the results depend on, as plain values; of files, digests of what is in them."""
    fields = scenario.model_dump(mode="json")
    data = fields["targets"].pop("data")
    files = {} if data is None else {"targets.data": digest(data)}
    for named in (*attacks, *defenses):
        if named.spec is not None:
            files |= {name: digest(file) for name, file in files_of(named.spec)}
    return {
        "scenario": fields,
        "attacks": [attack.name for attack in attacks],
        "defenses": [defense.name for defense in defenses],
        "episodes": episodes,
        "seed": seed,
        "horizon": horizon,
        "version": TrustEnv.metadata["name"],
        "package": trust_env.__version__,
        "files": files,
    }


def files_of(spec: Spec) -> Iterator[tuple[str, str | Path]]:
    """The files that a spec names, or a spec within it: users' code, and weights, by name and path."""
    if spec.path is not None:
        yield spec.path, spec.path
    elif spec.name == Learned.name:
        yield str(spec), Learned(**spec.params).file
    if isinstance(spec.params.get("inner"), str):
        yield from files_of(parse_policy(spec.params["inner"]))


def is_code(kind: str, name: str) -> bool:
    """Whether the name of an attack or a defense names code in a file, or an attack with such code in it."""
    try:
        spec = parse_policy(name) if kind == "attack" else parse(name)
        return any(str(file).endswith(".py") for file, _ in files_of(spec))
    except ValueError:
        return False


def digest(file: str | Path) -> str:
    """The first 16 digits of the SHA-256 of a file's content."""
    return hashlib.sha256(expanded(file).read_bytes()).hexdigest()[:16]
