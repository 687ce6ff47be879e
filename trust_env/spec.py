"""One way to name things: `trust`, `trust(preset=cdc2024)`, `my_file.py:MyDefense(window=9)`.

A spec is a Python call expression with literal arguments. It is read, never evaluated: bare names are strings, and a
nested spec such as `inner=false_positive(n=2)` stays text for whoever receives it. Only `load_object` runs code, and
only the file that the user named.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from trust_env.errors import unknown_name

_FORM = "name, name(key=value, ...) or file.py:Name(key=value, ...)"
_HEAD = re.compile(r"(?:(?P<path>[^()\"']+\.py):)?(?P<name>[A-Za-z_]\w*)\s*(?:\((?P<arguments>.*)\))?", re.DOTALL)
_ARGUMENT = re.compile(r"([A-Za-z_][\w.]*)\s*=(?!=)(.*)", re.DOTALL)
_CLOSING = {"(": ")", "[": "]", "{": "}"}


@dataclass(frozen=True)
class Spec:
    """A name with parameters, and the file that defines it where the user gave one. `str` gives text that parses back."""

    name: str
    params: dict[str, Any] = field(default_factory=dict)
    path: str | None = None

    def __str__(self) -> str:
        head = f"{self.path}:{self.name}" if self.path else self.name
        arguments = ", ".join(f"{key}={_written(value)}" for key, value in self.params.items())
        return f"{head}({arguments})" if arguments else head


def parse(text: str) -> Spec:
    """Read one spec; ValueError says what is wrong with it."""
    if not isinstance(text, str):
        raise ValueError(f"{text!r}: expected a text such as 'trust(window=9)'")
    head = _HEAD.fullmatch(text.strip())
    if head is None:
        raise ValueError(f"{text!r}: expected {_FORM}{_closing_fault(text)}")
    params: dict[str, Any] = {}
    for argument in _split(head["arguments"] or "", text):
        key, value = _argument(argument, text)
        if key in params:
            raise ValueError(f"{text!r}: {key} is given twice")
        params[key] = value
    return Spec(head["name"], params, head["path"])


def split_specs(text: str) -> list[str]:
    """`honest,false_positive(n=2, start=3)` -> its specs; commas inside brackets and quotes do not split."""
    return _split(text, text)


def _split(text: str, whole: str) -> list[str]:
    pieces = [text[start:stop].strip() for start, stop in _spans(text, whole)]
    if pieces and not pieces[-1]:
        pieces.pop()  # nothing at all, or a comma at the end as Python allows it
    if not all(pieces):
        raise ValueError(f"{whole!r}: nothing stands before a comma")
    return pieces


def _spans(text: str, whole: str) -> Iterator[tuple[int, int]]:
    """Start and stop of the pieces between the commas that lie outside all brackets and quotes."""
    start, expected, quote, escaped = 0, [], "", False
    for i, char in enumerate(text):
        if quote:
            quote = "" if char == quote and not escaped else quote
            escaped = char == "\\" and not escaped
        elif char in "\"'":
            quote = char
        elif char in _CLOSING:
            expected.append(_CLOSING[char])
        elif char in ")]}":
            if not expected or expected.pop() != char:
                raise ValueError(f"{whole!r}: {char!r} closes nothing")
        elif char == "," and not expected:
            yield start, i
            start = i + 1
    if quote or expected:
        raise ValueError(f"{whole!r}: expected {quote or expected[-1]} before the end")
    yield start, len(text)


def _closing_fault(text: str) -> str:
    try:
        list(_spans(text, text))
    except ValueError as fault:
        return "; " + str(fault).removeprefix(f"{text!r}: ")
    return ""


def _argument(text: str, whole: str) -> tuple[str, Any]:
    found = _ARGUMENT.fullmatch(text)
    if found is None:
        raise ValueError(f"{whole!r}: {text!r} has no name; expected key=value")
    key, source = found[1], found[2].strip()
    try:
        return key, _value(source)
    except (ValueError, SyntaxError) as fault:
        reason = f" ({fault})" if type(fault) is ValueError else ""
        expected = "expected a number, a name, a quoted text, True, False, None, a list, a dict or a spec"
        raise ValueError(f"{whole!r}: {key}={source}: {expected}{reason}") from None


def _value(source: str) -> Any:
    head = _HEAD.fullmatch(source)
    if head and (head["path"] or head["arguments"] is not None):
        parse(source)  # a nested spec stays text, but a broken one is refused here
        return source
    return _literal(ast.parse(source, mode="eval").body, source)


def _literal(node: ast.expr, source: str) -> Any:
    match node:
        case ast.Name() | ast.Attribute() | ast.Call():
            return _name_or_spec(node, source)
        case ast.List(items) | ast.Tuple(items):
            values = [_literal(item, source) for item in items]
            return values if isinstance(node, ast.List) else tuple(values)
        case ast.Dict(keys, values) if all(keys):
            entries = {_literal(k, source): _literal(v, source) for k, v in zip(keys, values, strict=True) if k}
            if not all(isinstance(k, (str, int)) for k in entries):
                raise ValueError("the keys of a dict are names or whole numbers")
            return entries
    value = ast.literal_eval(node)
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError("the number is not finite")
    if not isinstance(value, (str, int, float, bool, type(None))):
        raise ValueError(f"{type(value).__name__} is not allowed")
    return value


def _name_or_spec(node: ast.expr, source: str) -> str:
    text = ast.get_source_segment(source, node) or ""
    if isinstance(node, ast.Call):
        parse(text)
    elif not re.fullmatch(r"\w+(\.\w+)*", text):
        raise ValueError(f"{text!r} is not a name")
    return text


def _written(value: Any) -> str:
    """Text that `_value` reads back as `value`."""
    match value:
        case str():
            return value if _reads_as(value, value) else repr(value)
        case list():
            return f"[{', '.join(map(_written, value))}]"
        case tuple():
            return f"({', '.join(map(_written, value))}{',' * (len(value) == 1)})"
        case dict():
            return "{" + ", ".join(f"{_written(k)}: {_written(v)}" for k, v in value.items()) + "}"
    return repr(value)


def _reads_as(source: str, value: str) -> bool:
    # Inside a list only Python syntax is read, so a name with a file is written in quotes to be safe anywhere.
    try:
        return "," not in source.split("(")[0] and _literal(ast.parse(source, mode="eval").body, source) == value
    except (ValueError, SyntaxError):
        return False


def load_object(spec: Spec) -> Any:
    """The object that a spec with a file names; runs that file, once for as long as it does not change."""
    if spec.path is None:
        raise ValueError(f"{spec.name!r} names no file; expected file.py:{spec.name}")
    path = Path(spec.path).expanduser().resolve()
    if not path.is_file():
        raise ValueError(f"{spec}: there is no file {path}")
    module = _module(path, path.stat().st_mtime_ns)
    if not hasattr(module, spec.name):
        public = [n for n in vars(module) if not n.startswith("_")]
        raise unknown_name(f"name in {spec.path}:", spec.name, public)
    return getattr(module, spec.name)


@functools.lru_cache(maxsize=None)
def _module(path: Path, mtime_ns: int) -> ModuleType:
    digest = hashlib.sha256(f"{path}:{mtime_ns}".encode()).hexdigest()[:12]
    name = f"{path.stem}_{digest}"
    found = importlib.util.spec_from_file_location(name, path)
    if found is None or found.loader is None:
        raise ValueError(f"{path}: expected a Python file")
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module  # dataclasses and pickle look their module up by name
    try:
        found.loader.exec_module(module)
    except Exception as fault:
        del sys.modules[name]
        raise ValueError(f"{path}: could not be imported: {type(fault).__name__}: {fault}") from fault
    return module
