"""YAML with the line of every field, `1e-6` as a number, and no field given twice."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

from trust_env.scenario_errors import Location, ScenarioError


class _Loader(yaml.SafeLoader):
    """YAML 1.1 wants `1.0e-6`; people write `1e-6`."""


_Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+"), list("-+0123456789"))


def read_yaml(text: str, file: str) -> tuple[dict[str, Any], dict[Location, int]]:
    """The mapping that a file holds, and the line (from 1) of each of its fields."""
    loader = _Loader(text)
    try:
        root = loader.get_single_node()
        if not isinstance(root, yaml.MappingNode):
            found = "nothing" if root is None else f"a {root.id}"
            raise ScenarioError([f"{file}: expected a mapping of fields such as `base: patrol`, found {found}"])
        lines = dict(_lines(root, (), file))
        return loader.construct_document(root), lines  # type: ignore[no-untyped-call]
    except yaml.MarkedYAMLError as fault:
        mark = fault.problem_mark or fault.context_mark
        where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        context = f" ({fault.context})" if fault.context else ""
        raise ScenarioError([f"{file}{where}: not valid YAML: {fault.problem}{context}"]) from None
    except (yaml.YAMLError, ValueError) as fault:
        if isinstance(fault, ScenarioError):
            raise
        raise ScenarioError([f"{file}: not valid YAML: {str(fault).splitlines()[0]}"]) from None
    finally:
        loader.dispose()


def _lines(node: yaml.Node, location: Location, file: str) -> Iterator[tuple[Location, int]]:
    if isinstance(node, yaml.MappingNode):
        seen: dict[Any, int] = {}
        for key, value in node.value:
            line = key.start_mark.line + 1
            if key.value in seen:
                raise ScenarioError([f"{file}, line {line}: {key.value} is given twice (first in line {seen[key.value]})"])
            seen[key.value] = line
            yield (*location, key.value), line
            yield from _lines(value, (*location, key.value), file)
    elif isinstance(node, yaml.SequenceNode):
        for i, item in enumerate(node.value):
            yield (*location, i), item.start_mark.line + 1
            yield from _lines(item, (*location, i), file)
