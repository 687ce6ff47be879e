"""The commands that learn."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import UseAppendAction, arg

Json = Annotated[bool, arg(name="json", help="print JSON instead of text")]
Assigned = UseAppendAction[tuple[str, ...]]


def train(
    scenario: Annotated[str | None, arg(help="name, name(field=value, ...), or a YAML file")] = None,
    defense: Annotated[str | None, arg(help="what is learned against: trust, my_file.py:MyDefense")] = None,
    steps: Annotated[int | None, arg(help="frames of all learners together")] = None,
    seed: Annotated[int | None, arg(help="seed of weights, exploration and worlds")] = None,
    out: Annotated[Path | None, arg(help="folder for the run, new or empty")] = None,
    resume: Annotated[Path | None, arg(help="folder of a run to continue, as it was configured")] = None,
    config: Annotated[Path | None, arg(help="YAML file with what differs from the defaults")] = None,
    knowledge: Annotated[
        Literal["own", "poses", "picture", "white_box"] | None, arg(help="what agents observe")
    ] = None,
    wrapper: Annotated[
        str | None, arg(help="what a learner's action means: phantoms(n=2), grid, raw")
    ] = None,
    others: Annotated[
        Assigned,
        arg(metavar="ROLE=POLICY", help="policy of a role or an agent that does not learn; repeatable"),
    ] = (),
    settings: Annotated[
        Assigned,
        arg(
            name="set",
            metavar="FIELD=VALUE",
            help="set a field of the configuration, as in ppo.gamma=0.95; repeatable",
        ),
    ] = (),
    as_json: Json = False,
) -> int:
    """Train a policy against a defense, or go on with a run. Defaults: training/learning/defaults.yaml."""
    from trust_env.training.cli.evaluate import settings_of
    from trust_env.training.learning.train import train as run

    try:
        found = run(
            scenario,
            defense,
            steps,
            seed,
            out,
            resume,
            config,
            knowledge,
            wrapper,
            policies_of(others),
            settings_of(settings),
        )
    except (KeyboardInterrupt, OSError):
        folder = resume if resume is not None else out
        if folder is not None and (folder / "config.yaml").is_file():
            print(f"trust-env: to continue: trust-env train --resume {folder}", file=sys.stderr)
        raise
    print(json.dumps(found.to_dict(), indent=2) if as_json else found.describe())
    return 0


def exploit(
    scenario: Annotated[str, arg(help="name, name(field=value, ...), or a YAML file")] = "patrol",
    defense: Annotated[str, arg(help="what is exploited: trust, my_file.py:MyDefense")] = "trust",
    attack: Annotated[
        str | None,
        arg(
            help="attacks with commas, search(false_positive) among them; default: all, as they are and tuned"
        ),
    ] = None,
    steps: Annotated[int | None, arg(help="frames of all learners in a training run")] = None,
    seeds: Annotated[int, arg(help="training runs, of seed 0 and on; 0: none")] = 3,
    generations: Annotated[int, arg(help="of a search")] = 12,
    population: Annotated[int, arg(help="attacks in a generation of a search")] = 24,
    search_episodes: Annotated[int, arg(help="in which a search plays each attack")] = 32,
    episodes: Annotated[int, arg(help="held-out episodes, the same ones for all")] = 200,
    seed: Annotated[int, arg(help="seed of the held-out episodes")] = 0,
    out: Annotated[Path | None, arg(help="folder for all parts, new or empty")] = None,
    resume: Annotated[bool, arg(help="continue what was begun in --out")] = False,
    knowledge: Annotated[
        Literal["own", "poses", "picture", "white_box"] | None, arg(help="what agents observe")
    ] = None,
    config: Annotated[Path | None, arg(help="YAML file for the training runs, as in train")] = None,
    settings: Annotated[
        Assigned,
        arg(name="set", metavar="FIELD=VALUE", help="a field of the training configuration; repeatable"),
    ] = (),
    as_json: Json = False,
) -> int:
    """Tune and train attacks against a defense; the worst of each kind, and a row to quote."""
    from rich.console import Console

    from trust_env.training.cli.evaluate import settings_of
    from trust_env.training.exploitation.exploit import exploit as run

    if out is None:
        raise ValueError("exploit: expected --out, a new or empty folder for all that it finds")
    try:
        found = run(
            scenario,
            defense,
            out,
            attack,
            steps,
            seeds,
            episodes,
            seed,
            knowledge,
            {"generations": generations, "population": population, "episodes": search_episodes},
            config,
            settings_of(settings),
            resume,
        )
    except (KeyboardInterrupt, OSError):
        if (out / "parts.json").is_file():
            print(f"trust-env: the finished parts are in {out}; --resume continues", file=sys.stderr)
        raise
    if as_json:
        print(json.dumps(found.to_dict(), indent=2, allow_nan=False))
    else:
        found.print(Console())
    return 0


def policies_of(texts: tuple[str, ...]) -> dict[str, str]:
    """{"benign": "honest"} from benign=honest."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, policy = text.partition("=")
        if not (equals and name.strip() and policy.strip()):
            raise ValueError(f"--others {text}: expected ROLE=POLICY, such as benign=honest")
        if name.strip() in found:
            raise ValueError(f"--others {text}: {name.strip()} is given twice")
        found[name.strip()] = policy.strip()
    return found
