"""Command line: threats list, show."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Group, Json, print_json


def list_threats(as_json: Json = False) -> None:
    """The threat models, each in a line."""
    from trust_env.training.cli.catalogue import print_names
    from trust_env.training.exploitation.threat_models import THREATS

    print_names({label: model.description for label, model in THREATS.items()}, as_json)


def show_threat(
    name: Annotated[Positional[str], arg(help="a threat model: own@1, or own for its latest version")],
    as_json: Json = False,
) -> None:
    """How many agents are adversaries under a threat model, and what these observe and may do."""
    from trust_env.training.exploitation.threat_models import threat_model

    model = threat_model(name)
    if as_json:
        print_json(model.to_dict())
        return
    print(f"{model.label}\n\n{model.description}\n")
    print(f"adversaries: {model.share:.0%} of the agents, at least one")
    print(f"knowledge: {model.knowledge}\ncoordination: {model.coordination}")
    print(f"injections of an adversary in a frame: {_most(model.injections, 'all slots')}")
    print(f"suppressions of an adversary in a frame: {_most(model.suppressions, 'all detections')}")


def _most(budget: int | None, unbounded: str) -> str:
    return unbounded if budget is None else f"at most {budget}" if budget else "none"


COMMANDS = Group("What adversaries are, know and may do: list, show.", {"list": list_threats, "show": show_threat})
