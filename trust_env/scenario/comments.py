"""What `builtin/base.yaml` says of every field: its comments, by the field's path."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence
from importlib import resources

Path = tuple[str, ...]  # a field's names, without the indices of lists: ("agents", "fov", "radius")

_FIELD = re.compile(r"(?P<indent> *)(?P<name>\w+):(?:\s[^#]*?)?(?:\s*#\s*(?P<comment>.*))?")
_UNIT = re.compile(r"(?:a list of )?(\(m/s\)\^2|m\^2/s\^3|m\^2|m/s|m|s|rad|nats|frames|hits)(?=[ ,;]|$)")
_EXAMPLE = "   "  # after the #: fields of the entries of a list, commented out


@functools.cache
def field_comments() -> dict[Path, str]:
    """The comment of every field of `base.yaml`, and of the entries of its lists, in their order."""
    text = (resources.files("trust_env.scenario") / "builtin" / "base.yaml").read_text(encoding="utf-8")
    return dict(_comments(text.splitlines(), ()))


def comment_of(path: Path) -> str:
    """What `base.yaml` says of a field; of an agent's own sensor, view or belief what it says of all agents'."""
    known = field_comments()
    of_all = ("tracker", *path[2:]) if path[:2] == ("agents", "belief") else path[1:]
    return known.get(path, known.get(of_all, "") if path[0] == "agents" else "")


def unit_of(comment: str) -> str:
    """The unit that a comment begins with, or names as a density; empty for numbers without unit."""
    found = _UNIT.match(comment)
    return found.group(1) if found else "1/m^2" if " per m^2" in comment else ""


def _comments(lines: Sequence[str], above: Path) -> Iterator[tuple[Path, str]]:
    """Fields and their comments: what stands above a field at the margin, behind it, and indented below it."""
    parents: list[tuple[int, str]] = []
    block: list[str] = []
    for at, line in enumerate(lines):
        field = _FIELD.fullmatch(line)
        if line.startswith("#"):
            block.append(line[1:])
        elif not line.strip():
            block = []
        elif field:
            indent = len(field["indent"])
            parents = [*(p for p in parents if p[0] < indent), (indent, field["name"])]
            path = (*above, *(name for _, name in parents))
            text = [part for part in block if not part.startswith(_EXAMPLE)]
            yield path, _joined([*text, field["comment"] or "", *_continued(lines[at + 1 :])])
            yield from _comments([part for part in block if part.startswith(_EXAMPLE)], path)
            block = []


def _continued(lines: Sequence[str]) -> Iterator[str]:
    """The indented comments that follow a field."""
    for line in lines:
        text = line.strip()
        if not (line.startswith(" ") and text.startswith("#")):
            return
        yield text[1:]


def _joined(parts: Sequence[str]) -> str:
    return " ".join(part.strip() for part in parts if part.strip())
