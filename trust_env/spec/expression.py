"""One way to name things: `trust`, `trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)`.

A spec is a Python call expression with literal arguments. It is read, never evaluated: bare names are
strings, and a nested spec such as `inner=false_positive(n=2)` stays text for whoever receives it.
"""

from __future__ import annotations

import ast
import math
import re
from dataclasses import dataclass, field
from typing import Any

from trust_env.spec.files import load_from_file
from trust_env.spec.splitting import fault_of, pieces

_FORM = "name, name(key=value, ...) or file.py:Name(key=value, ...)"
_SPEC = re.compile(
    r"""(?: (?P<path> [^()"',=]+ \.py ) : )?   # the file of the user's that defines it
        (?P<name> [A-Za-z_]\w* )
        \s* (?: \( (?P<arguments> .* ) \) )?""",
    re.DOTALL | re.VERBOSE,
)
_ARGUMENT = re.compile(r"([A-Za-z_][\w.]*)\s*=(?!=)(.*)", re.DOTALL)
_VALUES = "a number, a name, a quoted text, True, False, None, a list, a dict or a spec"


@dataclass(frozen=True)
class Spec:
    """A name, its parameters, and the file that defines it if the user named one; `str` parses back."""

    name: str
    params: dict[str, Any] = field(default_factory=dict)
    path: str | None = None

    def __str__(self) -> str:
        head = f"{self.path}:{self.name}" if self.path else self.name
        arguments = ", ".join(f"{key}={_written(value, _value)}" for key, value in self.params.items())
        return f"{head}({arguments})" if arguments else head


def parse(text: str) -> Spec:
    """Read one spec; the ValueError says what is wrong and what was expected."""
    if not isinstance(text, str):
        raise ValueError(f"{text!r}: expected a text: {_FORM}")
    found = _SPEC.fullmatch(text.strip())
    if found is None or fault_of(text):
        raise ValueError(f"{text!r}: expected {_FORM}" + (f"; {fault_of(text)}" if fault_of(text) else ""))
    params: dict[str, Any] = {}
    for argument in _pieces(found["arguments"] or "", text):
        key, value = _argument(argument, text)
        if key in params:
            raise ValueError(f"{text!r}: {key} is given twice")
        params[key] = value
    return Spec(found["name"], params, found["path"])


def split_specs(text: str) -> list[str]:
    """`honest,false_positive(n=2, start=3)` -> its specs; commas in brackets and quotes do not split."""
    return _pieces(text, text)


def load_object(spec: Spec) -> Any:
    """The object that a spec with a file names; runs that file, once for as long as it stays the same."""
    if spec.path is None:
        raise ValueError(f"{spec.name!r} names no file; expected file.py:{spec.name}")
    return load_from_file(spec.path, spec.name)


def _pieces(text: str, whole: str) -> list[str]:
    fault, found = fault_of(text), pieces(text)
    if found and not found[-1]:
        found.pop()  # nothing at all, or a comma at the end, which Python allows
    if fault or not all(found):
        raise ValueError(f"{whole!r}: {fault or 'nothing stands before a comma'}")
    return found


def _argument(text: str, whole: str) -> tuple[str, Any]:
    found = _ARGUMENT.fullmatch(text)
    if found is None:
        raise ValueError(f"{whole!r}: {text!r} has no name; expected key=value")
    key, source = found[1], found[2].strip()
    try:
        return key, _value(source)
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f"{whole!r}: {key}={source}: expected {_VALUES}; put other text in quotes") from None
    except ValueError as fault:
        raise ValueError(f"{whole!r}: {key}={source}: expected {_VALUES}; {fault}") from None


def _value(source: str) -> Any:
    nested = _SPEC.fullmatch(source)
    if nested and (nested["path"] or nested["arguments"] is not None):
        parse(source)  # stays text, but is refused here when it is broken
        return source
    return _literal(source)


def _literal(source: str) -> Any:
    return _of_node(ast.parse(source, mode="eval").body, source)


def _of_node(node: ast.expr | None, source: str) -> Any:
    """The value of a literal, in which names and calls stand for their own text."""
    match node:
        case ast.Name() | ast.Attribute() | ast.Call():
            return _name_or_spec(node, source)
        case ast.List(items):
            return [_of_node(item, source) for item in items]
        case ast.Tuple(items):
            return tuple(_of_node(item, source) for item in items)
        case ast.Dict(keys, values):
            return {_key(k, source): _of_node(v, source) for k, v in zip(keys, values)}
        case ast.Constant(value):
            return _scalar(value)
        case ast.UnaryOp(ast.UAdd() | ast.USub(), ast.Constant(value)) if type(value) in (int, float):
            return _scalar(ast.literal_eval(node))
    raise ValueError("expressions are not evaluated")


def _scalar(value: object) -> str | float | bool | None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError("a number is not finite")
    if not isinstance(value, (str, int, float, type(None))):
        raise ValueError(f"a value is of type {type(value).__name__}")
    return value


def _key(node: ast.expr | None, source: str) -> str | int:
    key = _of_node(node, source)
    if not isinstance(key, (str, int)):
        raise ValueError("the keys of a dict are names or whole numbers")
    return key


def _name_or_spec(node: ast.Name | ast.Attribute | ast.Call, source: str) -> str:
    text = ast.get_source_segment(source, node) or ""
    if isinstance(node, ast.Call):
        parse(text)
    elif not re.fullmatch(r"\w+(\.\w+)*", text):
        raise ValueError(f"{text!r} is no name")
    return text


def _written(value: Any, read: Any = _literal) -> str:
    """Text that `read` takes back to the value."""
    match value:
        case str():
            try:
                return value if read(value) == value else repr(value)
            except (ValueError, SyntaxError, RecursionError, MemoryError):
                return repr(value)
        case list():
            return f"[{', '.join(map(_written, value))}]"
        case tuple():
            return f"({', '.join(map(_written, value))}{',' if len(value) == 1 else ''})"
        case dict():
            return "{" + ", ".join(f"{_written(k)}: {_written(v)}" for k, v in value.items()) + "}"
    return repr(value)
