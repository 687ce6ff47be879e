"""YAML files read with the line of every field; `1e-6` is a number, and a field given twice is an error."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

from trust_env.scenario.errors import Location, ScenarioError

MAX_ENTRIES = 50_000  # of a file: names, values, mappings, lists; what an alias repeats counts again
MAX_DEPTH = 20


class _Loader(yaml.SafeLoader):
    """Refuses what is too large or too deep before it is built."""

    def __init__(self, text: str, file: str):
        super().__init__(text)
        self._file, self._nodes, self._depth = file, 0, 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        self._nodes, self._depth = self._nodes + 1, self._depth + 1
        if self._nodes > MAX_ENTRIES or self._depth > MAX_DEPTH:
            raise _too_much(self._file, self.line + 1, self._depth > MAX_DEPTH)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _too_much(file: str, line: int, deep: bool) -> ScenarioError:
    text = f"nested deeper than {MAX_DEPTH} levels" if deep else f"more than {MAX_ENTRIES} entries, aliases repeated"
    return ScenarioError([f"{file}, line {line}: {text}"])


# YAML 1.1 takes `1e-6` and `1.5e6` for text, as the point or the sign is missing.
_EXPONENT = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)[eE][-+]?[0-9]+$")
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+.0123456789"))


_NAMES = ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge")


class _Dumper(yaml.SafeDumper):
    def represent_values(self, values: list[Any]) -> yaml.Node:
        """Numbers and rows of numbers in one line; lists of mappings one below the other."""
        flow = not any(isinstance(v, dict) for v in values)
        return self.represent_sequence("tag:yaml.org,2002:seq", values, flow_style=flow)


_Dumper.add_representer(list, _Dumper.represent_values)


def write_yaml(fields: dict[str, Any]) -> str:
    return yaml.dump(fields, Dumper=_Dumper, sort_keys=False, width=100, allow_unicode=True)


def read_yaml(text: str, file: str) -> tuple[dict[str, Any], dict[Location, int]]:
    """The mapping that a file holds, and the line (from 1) of each of its fields."""
    try:
        return _read(text, file)
    except yaml.MarkedYAMLError as fault:
        mark = fault.problem_mark or fault.context_mark
        where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        context = f" ({fault.context})" if fault.context else ""
        raise ScenarioError([f"{file}{where}: not valid YAML: {fault.problem}{context}"]) from None
    except (yaml.YAMLError, ValueError) as fault:
        if isinstance(fault, ScenarioError):
            raise
        raise ScenarioError([f"{file}: not valid YAML: {str(fault).splitlines()[0]}"]) from None


def _read(text: str, file: str) -> tuple[dict[str, Any], dict[Location, int]]:
    loader = _Loader(text, file)
    root = loader.get_single_node()
    if not isinstance(root, yaml.MappingNode):
        found = {yaml.ScalarNode: "a single value", yaml.SequenceNode: "a list"}.get(type(root), "nothing")
        text = f"{file}: expected a mapping of fields such as `base: patrol`, found {found}"
        raise ScenarioError([text])
    lines: dict[Location, int] = {}
    for n, (location, line) in enumerate(_lines(root, (), file, ())):
        if n > MAX_ENTRIES:
            raise _too_much(file, line, deep=False)
        lines[location] = line
    return loader.construct_document(root), lines


def _lines(node: yaml.Node, at: Location, file: str, above: tuple[yaml.Node, ...]) -> Iterator[tuple[Location, int]]:
    if node in above:
        raise ScenarioError([f"{file}, line {node.start_mark.line + 1}: an alias contains itself"])
    for key, line, value in _entries(node, file):
        yield (*at, key), line
        yield from _lines(value, (*at, key), file, (*above, node))


def _describe(node: yaml.Node) -> str:
    return node.value if isinstance(node, yaml.ScalarNode) else "a list or a mapping"


def _entries(node: yaml.Node, file: str) -> Iterator[tuple[str | int, int, yaml.Node]]:
    """Key, line and value of the entries of a mapping or a list."""
    if isinstance(node, yaml.SequenceNode):
        yield from ((i, item.start_mark.line + 1, item) for i, item in enumerate(node.value))
    elif isinstance(node, yaml.MappingNode):
        first: dict[str, int] = {}
        for key, value in node.value:
            name, line = key.value, key.start_mark.line + 1
            if key.tag not in _NAMES:
                text = f"{file}, line {line}: expected the name of a field, found {_describe(key)}"
                raise ScenarioError([text])
            if name in first:
                text = f"{file}, line {line}: {name} is given twice (first in line {first[name]})"
                raise ScenarioError([text])
            first[name] = line
            yield name, line, value
