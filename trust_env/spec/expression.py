"""Specs, names with parameters: `trust`, `trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)`.

A spec is a Python call expression with literal arguments. It is parsed, never evaluated: bare names are
strings, and a nested spec such as `inner=false_positive(n=2)` stays text, for its receiver to parse.
"""

from __future__ import annotations

import ast
import math
import re
from dataclasses import dataclass, field
from typing import Any

from trust_env.spec.files import load_from_file
from trust_env.spec.splitting import bracket_fault, split_at_commas

_FORM = "name, name(key=value, ...) or file.py:Name(key=value, ...)"
_SPEC = re.compile(
    r"""(?: (?P<path> [^()"',=]+ \.py ) : )?   # the user's file that defines it
        (?P<name> [A-Za-z_]\w* )
        \s* (?: \( (?P<arguments> .* ) \) )?""",
    re.DOTALL | re.VERBOSE,
)
_ARGUMENT = re.compile(r"([A-Za-z_][\w.]*)\s*=(?!=)(.*)", re.DOTALL)
_SHOWN = 200  # characters of a text, in messages
_VALUES = "a number, a name, a quoted text, True, False, None, a list, a dict or a spec"


class _Fault(ValueError):
    """What is wrong with a text; of nested specs the outermost is shown, with the fault of the innermost."""

    def __init__(self, text: str, reason: str):
        shown = repr(text) if len(text) <= _SHOWN else f"{text[:_SHOWN]!r}..."
        super().__init__(f"{shown}: {reason}")
        self.reason = reason


@dataclass(frozen=True)
class Spec:
    """A name, its parameters, and the file that defines it if the user named one; `str` parses back."""

    name: str
    params: dict[str, Any] = field(default_factory=dict)
    path: str | None = None

    def __str__(self) -> str:
        head = f"{self.path}:{self.name}" if self.path else self.name
        arguments = ", ".join(f"{key}={_format_value(v, _parse_value)}" for key, v in self.params.items())
        return f"{head}({arguments})" if arguments else head


def parse(text: str) -> Spec:
    """The spec that a text holds; the ValueError says what is wrong and what was expected."""
    if not isinstance(text, str):
        raise ValueError(f"{text!r}: expected a text: {_FORM}")
    match, fault = _SPEC.fullmatch(text.strip()), bracket_fault(text)
    if match is None or fault:
        raise _Fault(text, f"expected {_FORM}" + (f"; {fault}" if fault else ""))
    params: dict[str, Any] = {}
    for argument in _split(match["arguments"] or "", text):
        key, value = _parse_argument(argument, text)
        if key in params:
            raise _Fault(text, f"{key} is given twice")
        params[key] = value
    return Spec(match["name"], params, match["path"])


def split_specs(text: str) -> list[str]:
    """The specs of a list such as `honest,false_positive(n=2, start=3)`, each as text."""
    return _split(text, text)


def load_object(spec: Spec) -> Any:
    """The object that a spec with a file names; the file runs once for as long as it does not change."""
    if spec.path is None:
        raise ValueError(f"{spec.name!r} names no file; expected file.py:{spec.name}")
    return load_from_file(spec.path, spec.name)


def _split(text: str, whole: str) -> list[str]:
    fault, parts = bracket_fault(text), split_at_commas(text)
    if parts and not parts[-1]:
        parts.pop()  # an empty text, or a comma at the end, which Python allows
    if fault or not all(parts):
        raise _Fault(whole, fault or "nothing stands before a comma")
    return parts


def _parse_argument(text: str, whole: str) -> tuple[str, Any]:
    match = _ARGUMENT.fullmatch(text)
    if match is None:
        raise _Fault(whole, f"{text[:_SHOWN]!r} has no name; expected key=value")
    key, source = match[1], match[2].strip()
    argument = f"{key}={source[:_SHOWN]}"
    try:
        return key, _parse_value(source)
    except (SyntaxError, RecursionError, MemoryError):
        raise _Fault(whole, f"{argument}: expected {_VALUES}; put other text in quotes") from None
    except _Fault as fault:
        raise _Fault(whole, fault.reason) from None
    except ValueError as fault:
        raise _Fault(whole, f"{argument}: expected {_VALUES}; {fault}") from None


def _parse_value(source: str) -> Any:
    nested = _SPEC.fullmatch(source)
    if nested and (nested["path"] or nested["arguments"] is not None):
        parse(source)  # stays text, but has to be valid
        return source
    return _parse_literal(source)


def _parse_literal(source: str) -> Any:
    return _node_value(ast.parse(source, mode="eval").body, source)


def _node_value(node: ast.expr | None, source: str) -> Any:
    """The value of a literal, in which names and calls are their own text."""
    match node:
        case ast.Name() | ast.Attribute() | ast.Call():
            return _node_text(node, source)
        case ast.List(items):
            return [_node_value(item, source) for item in items]
        case ast.Tuple(items):
            return tuple(_node_value(item, source) for item in items)
        case ast.Dict(keys, values):
            return {_node_key(k, source): _node_value(v, source) for k, v in zip(keys, values)}
        case ast.Constant(value):
            return _check_scalar(value)
        case ast.UnaryOp(ast.UAdd() | ast.USub(), ast.Constant(value)) if type(value) in (int, float):
            return _check_scalar(ast.literal_eval(node))
    raise ValueError("expressions are not evaluated")


def _check_scalar(value: object) -> str | float | bool | None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError("a number is not finite")
    if not isinstance(value, (str, int, float, type(None))):
        raise ValueError(f"a value is of type {type(value).__name__}")
    return value


def _node_key(node: ast.expr | None, source: str) -> str | int:
    key = _node_value(node, source)
    if not isinstance(key, (str, int)):
        raise ValueError("the keys of a dict are names or whole numbers")
    return key


def _node_text(node: ast.Name | ast.Attribute | ast.Call, source: str) -> str:
    text = ast.get_source_segment(source, node) or ""
    if isinstance(node, ast.Call):
        parse(text)
    elif not re.fullmatch(r"\w+(\.\w+)*", text):
        raise ValueError(f"{text!r} is no name")
    return text


def _format_value(value: Any, parse_back: Any = _parse_literal) -> str:
    """Text from which `parse_back` returns the same value."""
    match value:
        case str():
            try:
                return value if parse_back(value) == value else repr(value)
            except (ValueError, SyntaxError, RecursionError, MemoryError):
                return repr(value)
        case list():
            return f"[{', '.join(map(_format_value, value))}]"
        case tuple():
            return f"({', '.join(map(_format_value, value))}{',' if len(value) == 1 else ''})"
        case dict():
            return "{" + ", ".join(f"{_format_value(k)}: {_format_value(v)}" for k, v in value.items()) + "}"
    return repr(value)
