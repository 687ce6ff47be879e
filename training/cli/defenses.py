"""Command line: defenses list, show."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Group, Json


def list_defenses(as_json: Json = False) -> None:
    """The built-in defenses."""
    from trust_env.defenses import DEFENSES
    from trust_env.training.cli.catalogue import descriptions, print_names

    print_names(descriptions(DEFENSES), as_json)


def show_defense(
    name: Annotated[Positional[str], arg(help="a defense, or my_file.py:MyDefense")], as_json: Json = False
) -> None:
    """What a defense does, its parameters with their defaults, and its presets."""
    from trust_env.defenses import DEFENSES
    from trust_env.training.cli.catalogue import describe_entry, print_entry

    print_entry(describe_entry("defense", name, DEFENSES), as_json)


COMMANDS = Group("What judges tracks and agents: list, show.", {"list": list_defenses, "show": show_defense})
