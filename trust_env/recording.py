"""Recorded trajectories, read from CSV and resampled on the grid of frames.

Two forms are read: OpenSky state vectors (columns time, icao24, lat, lon, ...), projected onto the plane about their
centre, and plain columns t, id, x, y in seconds and metres.
"""

from __future__ import annotations

import csv
import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Samples = dict[str, NDArray[np.float64]]  # trajectory -> [n, 3]: time s, then x, y m or longitude, latitude degrees
_OPENSKY = ("time", "icao24", "lon", "lat")
_PLAIN = ("t", "id", "x", "y")
_MOST_CELLS = 50_000_000


@dataclass(frozen=True, eq=False)
class Recording:
    """Trajectories on a grid of frames; NaN where a trajectory is absent."""

    times: NDArray[np.float64]  # [T], s, as the recording counts them
    ids: tuple[str, ...]  # N trajectories
    positions: NDArray[np.float64]  # [T, N, 2], m
    left_out: tuple[str, ...] = ()  # trajectories of a single position, which say nothing of motion

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """m, the box [x_min, x_max, y_min, y_max] around all positions."""
        low, high = np.nanmin(self.positions, axis=(0, 1)), np.nanmax(self.positions, axis=(0, 1))
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    @property
    def velocities(self) -> NDArray[np.float64]:
        """[T, N, 2], m/s: to the next frame, or from the last one where there is no next; NaN where absent, 0 if alone."""
        step = np.diff(self.positions, axis=0) / np.diff(self.times)[:, None, None]
        gap = np.full_like(self.positions[:1], np.nan)
        ahead, behind = np.concatenate([step, gap]), np.concatenate([gap, step])
        found = np.where(np.isnan(ahead), behind, ahead)
        return np.where(np.isnan(self.positions), np.nan, np.nan_to_num(found))


@functools.lru_cache(maxsize=8)
def _read_once(path: str, mtime_ns: int, size: int, dt: float) -> Recording:
    return read_recording(path, dt)


def cached_recording(path: str, dt: float) -> Recording:
    """`read_recording`, once for as long as the file does not change."""
    try:
        stat = Path(path).stat()
    except OSError:
        return read_recording(path, dt)  # says what is wrong
    return _read_once(path, stat.st_mtime_ns, stat.st_size, dt)


def read_recording(path: str | Path, dt: float, max_gap: float = 60.0) -> Recording:
    """Read a CSV file; positions between samples at most `max_gap` seconds apart are interpolated linearly."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            samples, geographic = _samples(csv.reader(file), str(path))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected a CSV file in UTF-8") from None
    except OSError as fault:
        reason = "there is no such file" if isinstance(fault, FileNotFoundError) else fault.strerror
        raise ValueError(f"{path}: {reason}; expected a CSV file of recorded trajectories") from None
    # Receivers repeat an aircraft's last position until they hear a new one; an object of a plain file may stand still.
    samples = {name: _ordered(rows, drop_repeated=geographic) for name, rows in samples.items()}
    kept = {name: rows for name, rows in samples.items() if len(rows) > 1}
    left_out = tuple(sorted(samples.keys() - kept.keys()))
    if not kept:
        raise ValueError(f"{path}: every trajectory has one position only ({_listed(left_out)}); expected at least two of one id")
    if geographic:
        kept = _projected(kept)
    return _resampled(kept, left_out, dt, max_gap, str(path))


def _samples(rows: Iterable[list[str]], path: str) -> tuple[Samples, bool]:
    lines = enumerate(rows, 1)
    _, header = next(lines, (0, []))
    names = [name.strip().lower() for name in header]
    if not any(names):
        raise ValueError(f"{path}: the file is empty; expected a header such as {','.join(_PLAIN)}")
    columns, geographic = _columns(names, path)
    found: dict[str, list[tuple[float, float, float]]] = {}
    for line, row in lines:
        if not any(cell.strip() for cell in row):
            continue
        cells = [row[c].strip() if c < len(row) else "" for c in columns]
        if geographic and not cells[2] and not cells[3]:
            continue  # OpenSky leaves both blank for an aircraft that it has not located
        if not cells[1]:
            raise ValueError(f"{path}, line {line}: {names[columns[1]]} is blank; expected the name of a trajectory")
        numbers = [_number(cells[i], names[columns[i]], path, line) for i in (0, 2, 3)]
        found.setdefault(cells[1], []).append((numbers[0], numbers[1], numbers[2]))
    if not found:
        raise ValueError(f"{path}: no rows below the header; expected at least two positions of one id")
    return {name: np.array(values) for name, values in found.items()}, geographic


def _columns(names: list[str], path: str) -> tuple[list[int], bool]:
    for form in (_OPENSKY, _PLAIN):
        if set(form) <= set(names):
            return [names.index(name) for name in form], form is _OPENSKY
    nearest = max((_OPENSKY, _PLAIN), key=lambda form: len(set(form) & set(names)))
    lacking = ", ".join(name for name in nearest if name not in names)
    raise ValueError(
        f"{path}, line 1: the column {lacking} is missing; expected {', '.join(_OPENSKY)} (OpenSky state vectors) or "
        f"{', '.join(_PLAIN)}, found {', '.join(names)}"
    )


_BOUNDS = {"lat": 90.0, "lon": 180.0}


def _number(cell: str, column: str, path: str, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{path}, line {line}: {column} = {cell!r}: expected a finite number")
    if abs(value) > _BOUNDS.get(column, math.inf):
        raise ValueError(f"{path}, line {line}: {column} = {cell}: expected degrees from -{_BOUNDS[column]:g} to {_BOUNDS[column]:g}")
    return value


def _ordered(rows: NDArray[np.float64], drop_repeated: bool) -> NDArray[np.float64]:
    """Sorted by time; of rows at one time the last written counts."""
    rows = rows[::-1][np.unique(rows[::-1, 0], return_index=True)[1]]
    if not drop_repeated:
        return rows
    moved = np.any(rows[1:, 1:] != rows[:-1, 1:], axis=1)
    return rows[np.concatenate([[True], moved])]


def _projected(samples: Samples) -> Samples:
    """Azimuthal equidistant plane about the centre of all positions; x east, y north, m."""
    from pyproj import CRS, Transformer

    lon, lat = np.radians(np.concatenate([rows[:, 1:] for rows in samples.values()])).T
    # The mean direction, as the mean of longitudes fails where they wrap around.
    x, y, z = np.mean([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
    lat_0, lon_0 = math.degrees(math.atan2(z, math.hypot(x, y))), math.degrees(math.atan2(y, x))
    plane = CRS.from_proj4(f"+proj=aeqd +lat_0={lat_0!r} +lon_0={lon_0!r} +datum=WGS84 +units=m")
    transform = Transformer.from_crs("EPSG:4326", plane, always_xy=True).transform
    return {name: np.column_stack([rows[:, 0], *transform(rows[:, 1], rows[:, 2])]) for name, rows in samples.items()}


def _resampled(samples: Samples, left_out: tuple[str, ...], dt: float, max_gap: float, path: str) -> Recording:
    start = min(rows[0, 0] for rows in samples.values())
    duration = max(rows[-1, 0] for rows in samples.values()) - start
    count = math.floor(duration / dt + 1e-9) + 1
    if count < 2:
        raise ValueError(f"{path}: the recording lasts {duration:g} s; expected at least one frame of dt = {dt:g} s")
    if count * len(samples) > _MOST_CELLS:
        raise ValueError(f"{path}: the recording lasts {duration:g} s, {count} frames; expected seconds in the column of times")
    grid = np.arange(count) * dt
    positions = np.stack([_on_grid(rows - [start, 0, 0], grid, max_gap) for rows in samples.values()], axis=1)
    times = start + grid
    for array in (times, positions):
        array.flags.writeable = False
    return Recording(times, tuple(samples), positions, left_out)


def _on_grid(rows: NDArray[np.float64], grid: NDArray[np.float64], max_gap: float) -> NDArray[np.float64]:
    """[T, 2]: linear between samples at most `max_gap` apart, NaN elsewhere."""
    times, tolerance = rows[:, 0], 1e-6 * (grid[1] - grid[0])
    values = np.column_stack([np.interp(grid, times, rows[:, 1]), np.interp(grid, times, rows[:, 2])])
    after = np.clip(np.searchsorted(times, grid), 1, len(times) - 1)
    before = after - 1
    inside = (grid >= times[0] - tolerance) & (grid <= times[-1] + tolerance)
    bridged = times[after] - times[before] <= max_gap + tolerance
    sampled = np.minimum(abs(grid - times[before]), abs(grid - times[after])) <= tolerance
    return np.where((inside & (bridged | sampled))[:, None], values, np.nan)


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
