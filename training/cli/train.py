"""Command line: train."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from trust_env.training.cli.options import (
    Json,
    Knowledge,
    Repeated,
    ScenarioOrDefault,
    assignments,
    fields_of,
    print_json,
)


def train(
    scenario: ScenarioOrDefault = None,
    defense: Annotated[str | None, arg(help="what is learned against: trust, my_file.py:MyDefense")] = None,
    steps: Annotated[int | None, arg(help="frames of all learners together")] = None,
    seed: Annotated[int | None, arg(help="seed of weights, exploration and worlds")] = None,
    seeds: Annotated[int | None, arg(help="so many runs, of --seed and on, in folders of --out")] = None,
    out: Annotated[Path | None, arg(help="folder for the run, new or empty")] = None,
    resume: Annotated[Path | None, arg(help="folder of a run to continue, as it was configured")] = None,
    config: Annotated[Path | None, arg(help="YAML file with what differs from the defaults")] = None,
    knowledge: Knowledge = None,
    wrapper: Annotated[str | None, arg(help="what a learner's action means: by_need, grid, phantoms(n=2)")] = None,
    others: Annotated[
        Repeated,
        arg(metavar="ROLE=POLICY", help="policy of a role or an agent that does not learn; repeatable"),
    ] = (),
    settings: Annotated[
        Repeated,
        arg(
            name="set",
            metavar="FIELD=VALUE",
            help="set a field of the configuration, as in ppo.gamma=0.95; repeatable",
        ),
    ] = (),
    as_json: Json = False,
) -> None:
    """Train a policy against a defense, or go on with a run. Defaults: training/learning/defaults.yaml."""
    options = {"scenario": scenario, "defense": defense, "steps": steps, "seed": seed, "config": config}
    options |= {"knowledge": knowledge, "wrapper": wrapper}
    options |= {"others": policies_of(others), "overrides": fields_of(settings)}
    try:
        found = _run_of_every_seed(seeds, out, resume, options) if seeds is not None else _run(out, resume, options)
    except (KeyboardInterrupt, OSError):
        folder = resume if resume is not None else out
        if folder is not None and (folder / "config.yaml").is_file():
            print(f"trust-env: to continue: trust-env train --resume {folder}", file=sys.stderr)
        raise
    if as_json:
        print_json(found.to_dict())
    else:
        print(found.describe())


def _run(out: Path | None, resume: Path | None, options: Mapping[str, Any]) -> Any:
    from trust_env.training.learning.train import train as run

    return run(out=out, resume=resume, **options)


def _run_of_every_seed(seeds: int, out: Path | None, resume: Path | None, options: Mapping[str, Any]) -> Any:
    from trust_env.training.learning.seeds import train_seeds

    if out is None or resume is not None:
        raise ValueError(
            "--seeds: expected --out, the folder for all runs, and no --resume: it continues what is there"
        )
    return train_seeds(seeds, out, **options)


def policies_of(texts: tuple[str, ...]) -> dict[str, str]:
    """The values of `--others` by role or agent: {"benign": "honest"} from benign=honest."""
    expected = "ROLE=POLICY, such as benign=honest"
    policies = assignments(texts, "--others", expected)
    for role, policy in policies.items():
        if not policy:
            raise ValueError(f"--others {role}=: expected {expected}")
    return policies
