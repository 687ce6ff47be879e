"""The JSON schema of scenario files, for editors, and what it says of a single field."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from trust_env.errors import unknown_name
from trust_env.scenario.comments import Path, comment_of, unit_of
from trust_env.scenario.load import scenario_fields
from trust_env.scenario.scenario import Scenario
from trust_env.scenario.sources import scenarios

Node = dict[str, Any]

_DECIDED = (("horizon",), ("area",), ("targets", "slots"))  # null in a file: by the recording, or by the positions
_KEPT = ("type", "enum", "minimum", "maximum", "exclusiveMaximum", "minItems", "maxItems", "minLength", "maxLength")


class FieldInfo(NamedTuple):
    """What is known of a field of scenarios: where it stands, what it is, and which values it takes."""

    name: str  # dotted: tracker.gate; of an entry of a list: agents[].role
    unit: str
    default: Any  # None: null, or there is none, as of most fields of an agent's entry
    values: str
    comment: str


def scenario_schema() -> Node:
    """A JSON schema (2020-12) that scenario files fit: every field with its comment, default, type and bounds.

    It knows no rules between fields: those that `load_scenario` checks beside.
    """
    full = Scenario.model_json_schema()
    schema = _node(full, full.get("$defs", {}), ())
    base = {"type": "string", "description": "name of a built-in scenario, or path of a file, that this one changes"}
    schema["properties"] = {"base": base | {"examples": list(scenarios()), "default": "base"}, **schema["properties"]}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "trust-env scenario"}
    return head | schema


def field_infos() -> dict[str, FieldInfo]:
    """All fields of scenarios by dotted name, mappings and the fields of lists' entries included."""
    schema = scenario_schema()
    return {info.name: info for info in _infos(schema["properties"], "") if info.name != "base"}


def find_field(name: str) -> FieldInfo:
    """A field by its dotted name, `agents.fov.radius` as well as `agents[].fov.radius`, or by a last name that fits
    one field of the scenario only. ValueError: there is none, or several.
    """
    known = {key.replace("[]", ""): info for key, info in field_infos().items()}
    found = [info for key, info in known.items() if key == name.replace("[]", "")]
    ends = [key for key in known if key.rpartition(".")[2] == name and not key.startswith("agents.")]
    if not found and len(ends) > 1:
        raise ValueError(f"{name}: several fields are called that; expected one of {', '.join(ends)}")
    if not found and not ends:
        raise unknown_name("field", name, known)
    return found[0] if found else known[ends[0]]


def _node(node: Mapping[str, Any], parts: Mapping[str, Any], path: Path, in_list: bool = False) -> Node:
    """A node with what it refers to in its place, with comments and defaults; only entries of lists need fields."""
    if "$ref" in node:
        node = parts[node["$ref"].rpartition("/")[2]]
    found: Node = {key: node[key] for key in _KEPT if key in node}
    if "anyOf" in node:
        found["anyOf"] = [_node(choice, parts, path) for choice in node["anyOf"]]
    if "items" in node:
        found["items"] = _node(node["items"], parts, path, in_list=True)
    if "prefixItems" in node:
        found["prefixItems"] = [_node(item, parts, path) for item in node["prefixItems"]]
    if "properties" in node:
        properties = node["properties"].items()
        found["properties"] = {name: _field(child, parts, (*path, name)) for name, child in properties}
        found |= {"additionalProperties": False}
        found |= {"required": node["required"]} if in_list and "required" in node else {}
    return found


def _field(node: Mapping[str, Any], parts: Mapping[str, Any], path: Path) -> Node:
    found = _node(node, parts, path)
    if path in _DECIDED:
        found = {"anyOf": [found, {"type": "null"}]}
    default = {"default": node["default"]} if "default" in node else _default(path)
    return found | {"description": comment_of(path)} | default


def _default(path: Path) -> Node:
    """{"default": value} where `base.yaml` has one that is no mapping."""
    value: Any = scenario_fields("base")
    for name in path:
        if not isinstance(value, dict) or name not in value:
            return {}
        value = value[name]
    return {} if isinstance(value, dict) else {"default": value}


def _infos(properties: Mapping[str, Node], above: str) -> Iterator[FieldInfo]:
    for name, node in properties.items():
        full, text = above + name, node["description"]
        yield FieldInfo(full, unit_of(text), node.get("default"), values_of(node), text)
        for choice in node.get("anyOf", [node]):
            yield from _infos(choice.get("properties", {}), f"{full}.")
            yield from _infos(choice.get("items", {}).get("properties", {}), f"{full}[].")


def values_of(node: Mapping[str, Any]) -> str:
    """The values that a node of the schema accepts, in words."""
    if "anyOf" in node:
        return " or ".join(values_of(choice) for choice in node["anyOf"])
    if "enum" in node:
        return " | ".join(map(str, node["enum"]))
    kind = node.get("type")
    if kind in ("number", "integer"):
        return _number(node, "whole number" if kind == "integer" else "number")
    if kind == "array":
        return _list(node)
    return {"object": "mapping", "string": "text", "null": "null"}[str(kind)]


def _number(node: Mapping[str, Any], noun: str) -> str:
    below = "exclusiveMaximum" in node
    most = node["exclusiveMaximum" if below else "maximum"]
    return f"{noun} from {node['minimum']:g} to {'below ' if below else ''}{most:g}"


def _list(node: Mapping[str, Any]) -> str:
    if "prefixItems" in node:
        return f"list of {node['minItems']}: {values_of(node['prefixItems'][0])}"
    return f"list of at most {node['maxItems']}: {values_of(node['items'])}"
