"""Command line: attacks list, show."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Group, Json


def list_attacks(as_json: Json = False) -> None:
    """The built-in attacks."""
    from trust_env.agents import POLICIES
    from trust_env.training.cli.catalogue import descriptions, print_names

    print_names(descriptions(POLICIES), as_json)


def show_attack(
    name: Annotated[Positional[str], arg(help="an attack, my_file.py:MyPolicy, or the folder of a training run")],
    as_json: Json = False,
) -> None:
    """What an attack does, what it must know, and its parameters with their defaults."""
    from trust_env.agents import POLICIES
    from trust_env.training.cli.catalogue import describe_entry, print_entry

    print_entry(describe_entry("attack", name, POLICIES), as_json)


COMMANDS = Group("What adversaries do: list, show.", {"list": list_attacks, "show": show_attack})
