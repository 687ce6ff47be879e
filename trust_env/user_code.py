"""Calls of what users wrote, defenses and policies: whatever goes wrong there is a ValueError of one line that names
the file, the class and what was expected.
"""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Mapping
from typing import Any


def call(thing: Any, method: str, *args: Any) -> Any:
    """What a method returns; ValueError, with the original one as its cause, for an exception in it."""
    try:
        return getattr(thing, method)(*args)
    except Exception as error:
        if _says_enough(thing, error):
            raise
        raise ValueError(f"{source_of(thing)}.{method} raised {_summary(thing, error)}") from error


def construct(make: Callable[..., Any], params: Mapping[str, Any]) -> Any:
    """`make(**params)`; ValueError, with the original one as its cause, for an exception in it."""
    try:
        return make(**params)
    except Exception as error:
        if _says_enough(make, error):
            raise
        takes = f"it takes {_signature(make)}"
        raise ValueError(f"{source_of(make)}: its construction raised {_summary(make, error)}; {takes}") from error


def missing_methods(thing: Any, *methods: str) -> str:
    """What an object lacks of methods such as `update(evidence)`, as the end of a sentence; empty: nothing."""
    if isinstance(thing, type):
        return f"{source_of(thing)} is a class; expected an object, such as {thing.__name__}()"
    missing = [m for m in methods if not callable(getattr(thing, m.partition("(")[0], None))]
    return f"{source_of(thing)} has no method {' and no method '.join(missing)}" if missing else ""


def source_of(thing: Any) -> str:
    """`/path/my_file.py:MyDefense`: an object's class, or the class or function itself, after its file; of what is
    built in, the class alone.
    """
    file, name = _file_of(thing), _named(thing).__name__
    return f"{file}:{name}" if file else name


def _named(thing: Any) -> Any:
    """A class or a function itself, the class of another object."""
    return thing if hasattr(thing, "__name__") else type(thing)


def _file_of(thing: Any) -> str | None:
    """The file of a user's class or function, if it has one."""
    module = sys.modules.get(_named(thing).__module__ or "")
    return None if _is_built_in(thing) else getattr(module, "__file__", None)


def _is_built_in(thing: Any) -> bool:
    return str(_named(thing).__module__).partition(".")[0] == "trust_env"


def _says_enough(thing: Any, error: Exception) -> bool:
    """A ValueError of a class of ours names the parameter, its value and what was expected."""
    return isinstance(error, ValueError) and _is_built_in(thing)


def _summary(thing: Any, error: Exception) -> str:
    """`KeyError: 'x' (line 7)`, where the line is that of the thing's file if it is among those that were run."""
    text, file = " ".join(str(error).split()), _file_of(thing)
    places = traceback.extract_tb(error.__traceback__)
    place = next((p for p in reversed(places) if p.filename == file), places[-1])
    where = f"line {place.lineno}" if place.filename == file else f"{place.filename}, line {place.lineno}"
    return f"{type(error).__name__}{': ' if text else ''}{text} ({where})"


def _signature(make: Callable[..., Any]) -> str:
    try:
        return str(inspect.signature(make))
    except (TypeError, ValueError):
        return "other arguments"
