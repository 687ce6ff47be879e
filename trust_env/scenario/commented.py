"""A scenario's fields as YAML with the comment of every field behind it, units first."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any

from trust_env.scenario.comments import comment_of
from trust_env.scenario.errors import Location
from trust_env.scenario.yaml_lines import read_yaml, write_yaml

_COLUMN, _WIDTH = 40, 120  # where comments begin, and where they end


def commented_yaml(fields: dict[str, Any]) -> str:
    """All fields as YAML that `load_scenario` reads, each with its unit and what it is."""
    text = write_yaml(fields)
    by_line = {line: at for at, line in read_yaml(text, "scenario")[1].items() if isinstance(at[-1], str)}
    return "\n".join(
        annotated
        for number, line in enumerate(text.splitlines(), 1)
        for annotated in _annotated(line, by_line.get(number))
    )


def _annotated(line: str, at: Location | None) -> Iterator[str]:
    """A line with the comment of the field that it begins; text, which a comment could end up in, stays bare."""
    comment = comment_of(tuple(name for name in at if isinstance(name, str))) if at else ""
    if not comment or at in (("name",), ("description",), ("targets", "data")):
        yield line
        return
    column = max(_COLUMN, len(line) + 1)
    first, *others = textwrap.wrap(comment, max(40, _WIDTH - column - 2))
    yield f"{line:{column}}# {first}"
    yield from (f"{'':{column}}# {other}" for other in others)
