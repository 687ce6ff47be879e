"""Samples of trajectories from a CSV file; every error names the line."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trust_env.scenario.types import LENGTH

Samples = dict[str, NDArray[np.float64]]  # id -> [n, 3]: s, then x, y in m, or longitude, latitude in degrees
Rows = Iterator[tuple[int, list[str]]]  # line in the file, cells

_OPENSKY = ("time", "icao24", "lon", "lat")
_PLAIN = ("t", "id", "x", "y")
_LIMITS = {"lat": 90.0, "lon": 180.0, "x": LENGTH.most, "y": LENGTH.most, "t": 1e15, "time": 1e15}  # either side of 0
_UNITS = {"lat": "degrees", "lon": "degrees", "x": "metres", "y": "metres", "t": "seconds", "time": "seconds"}
_LINE = 1_000_000  # characters, of one line at most: a file of zeros has no other


def read_samples(path: str | Path) -> tuple[Samples, bool]:
    """Samples in the order of the file, and whether they are longitude and latitude."""
    try:
        if (found := Path(path)).exists() and not (found.is_file() or found.is_dir()):
            raise ValueError(f"{path}: expected a CSV file, not a pipe or device")
        with open(path, newline="", encoding="utf-8-sig") as file:
            return _samples(_rows(iter(lambda: file.readline(_LINE), "")), str(path))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected a CSV file in UTF-8") from None
    except csv.Error as fault:
        raise ValueError(f"{path}: expected a CSV file: {fault}") from None
    except OSError as fault:
        reason = "there is no such file" if isinstance(fault, FileNotFoundError) else fault.strerror
        raise ValueError(f"{path}: {reason}; expected a CSV file of recorded trajectories") from None


def _rows(file: Iterator[str]) -> Rows:
    reader = csv.reader(file)
    for row in reader:
        cells = [cell.strip() for cell in row]
        if any(cells):
            yield reader.line_num, cells


def _samples(rows: Rows, path: str) -> tuple[Samples, bool]:
    header_line, header = next(rows, (0, []))
    if not header:
        raise ValueError(f"{path}: the file is empty; expected a header such as {','.join(_PLAIN)}")
    names = [name.lower() for name in header]
    form = _columns_of(names, f"{path}, line {header_line}")
    columns = [names.index(name) for name in form]
    found: dict[str, list[list[float]]] = {}
    for line, row in rows:
        time, name, x, y = (row[c] if c < len(row) else "" for c in columns)
        if form is _OPENSKY and not x and not y:
            continue  # an aircraft that is heard but not located
        if not name:
            raise ValueError(f"{path}, line {line}: {form[1]} is blank; expected the name of a trajectory")
        cells = ((form[0], time), (form[2], x), (form[3], y))
        found.setdefault(name, []).append([_number(c, cell, f"{path}, line {line}") for c, cell in cells])
    if not found:
        raise ValueError(f"{path}: no positions below the header; expected two or more of one id")
    return {name: np.array(values) for name, values in found.items()}, form is _OPENSKY


def _columns_of(names: list[str], where: str) -> tuple[str, ...]:
    """The columns to read: those of the form that a header has."""
    for form in (_OPENSKY, _PLAIN):
        if set(form) <= set(names):
            if twice := [name for name in form if names.count(name) > 1]:
                raise ValueError(f"{where}: column {', '.join(twice)} is there more than once")
            return form
    closest = max((_OPENSKY, _PLAIN), key=lambda form: len(set(form) & set(names)))
    missing = ", ".join(name for name in closest if name not in names)
    forms = f"{', '.join(_OPENSKY)} (OpenSky state vectors) or {', '.join(_PLAIN)} (seconds, metres)"
    # What the columns are called stays unsaid: the file may be another, and secret.
    raise ValueError(f"{where}: no column {missing} among {len(names)}; expected {forms}, separated by commas")


def _number(column: str, cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{where}: {column} = {cell[:40]!r}: expected a finite number")
    if abs(value) > (limit := _LIMITS[column]):
        raise ValueError(f"{where}: {column} = {cell:.40}: expected {_UNITS[column]} from -{limit:g} to {limit:g}")
    return value
