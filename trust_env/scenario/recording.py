"""Recorded trajectories, read from CSV and resampled on the grid of frames.

Two forms are read: OpenSky state vectors (columns time, icao24, lat, lon, ...), projected onto the plane
about their centre, and plain columns t, id, x, y in seconds and metres.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trust_env.scenario.recording_csv import Samples, read_samples
from trust_env.scenario.types import MAX_TARGETS

MAX_POSITIONS = 50_000_000
TIME_TOLERANCE = 1e-4  # frames: times since 1970 are rounded


@dataclass(frozen=True, eq=False)
class Recording:
    """Trajectories on a grid of frames; NaN where one is absent."""

    times: NDArray[np.float64]  # [T], s, as the recording counts them
    ids: tuple[str, ...]  # N trajectories
    positions: NDArray[np.float64]  # [T, N, 2], m
    left_out: tuple[str, ...]  # trajectories that no frame shows or that have one position only

    @property
    def area(self) -> tuple[float, float, float, float]:
        """m, [x_min, x_max, y_min, y_max] around all positions, at least 1 m wide and high."""
        low, high = np.nanmin(self.positions, axis=(0, 1)), np.nanmax(self.positions, axis=(0, 1))
        margin = np.maximum(0.0, 1.0 - (high - low)) / 2
        (x_min, y_min), (x_max, y_max) = (low - margin).tolist(), (high + margin).tolist()
        return x_min, x_max, y_min, y_max

    @property
    def n_positions(self) -> int:
        """Number of different positions."""
        present = self.positions[~np.isnan(self.positions[..., 0])]
        return len(np.unique(present, axis=0))


def cached_recording(path: str, dt: float) -> Recording:
    """`read_recording`, once for as long as the file does not change."""
    try:
        stat = Path(path).stat()
    except (OSError, ValueError):
        return read_recording(path, dt)  # raises the error that explains it
    return _read_once(path, stat.st_mtime_ns, stat.st_size, dt)


@functools.lru_cache(maxsize=8)
def _read_once(path: str, mtime_ns: int, size: int, dt: float) -> Recording:
    return read_recording(path, dt)


def read_recording(path: str | Path, dt: float, max_gap: float = 60.0) -> Recording:
    """Read a CSV file; between samples at most `max_gap` seconds apart positions are interpolated."""
    samples, geographic = read_samples(path)
    # Receivers repeat an aircraft's last position until they hear a new one; in a plain file things may rest.
    samples = {name: _sort_by_time(rows, drop_repeated=geographic) for name, rows in samples.items()}
    trajectories = {name: rows for name, rows in samples.items() if len(rows) > 1}
    if not trajectories:
        text = f"every trajectory has one position only ({_first_names(samples)})"
        raise ValueError(f"{path}: {text}; expected two or more of one id")
    if len(trajectories) > MAX_TARGETS:
        raise ValueError(f"{path}: {len(trajectories)} trajectories; expected at most {MAX_TARGETS}")
    grid = _grid(trajectories, dt, str(path))
    if geographic:
        trajectories = _project(trajectories)
    resampled = {name: _resample(rows, grid, max_gap) for name, rows in trajectories.items()}
    visible = {name: positions for name, positions in resampled.items() if not np.isnan(positions).all()}
    positions = np.stack(list(visible.values()), axis=1)
    for array in (grid, positions):
        array.flags.writeable = False
    return Recording(grid, tuple(visible), positions, tuple(sorted(samples.keys() - visible.keys())))


def _sort_by_time(rows: NDArray[np.float64], drop_repeated: bool) -> NDArray[np.float64]:
    """Rows by time; of several at one time the one written last, of repeated positions the first."""
    newest_first = rows[::-1]
    rows = newest_first[np.unique(newest_first[:, 0], return_index=True)[1]]
    moved = np.any(np.diff(rows[:, 1:], axis=0) != 0, axis=1)
    return rows[np.concatenate([[True], moved])] if drop_repeated else rows


def _project(samples: Samples) -> Samples:
    """Azimuthal equidistant plane about the centre of all positions: x east, y north, m."""
    from pyproj import CRS, Transformer

    lon, lat = np.radians(np.concatenate([rows[:, 1:] for rows in samples.values()])).T
    # The mean direction: longitudes themselves have no mean where they wrap around.
    x, y, z = np.mean([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
    lat_0, lon_0 = math.degrees(math.atan2(z, math.hypot(x, y))), math.degrees(math.atan2(y, x))
    plane = CRS.from_proj4(f"+proj=aeqd +lat_0={lat_0!r} +lon_0={lon_0!r} +datum=WGS84 +units=m")
    project = Transformer.from_crs("EPSG:4326", plane, always_xy=True).transform
    return {name: np.column_stack([r[:, 0], *project(r[:, 1], r[:, 2])]) for name, r in samples.items()}


def _grid(samples: Samples, dt: float, path: str) -> NDArray[np.float64]:
    """[T], s, from the first sample on."""
    start = min(rows[0, 0] for rows in samples.values())
    duration = max(rows[-1, 0] for rows in samples.values()) - start
    frames = math.floor(duration / dt + TIME_TOLERANCE) + 1
    if frames < 2:
        raise ValueError(f"{path}: the recording lasts {duration:g} s; expected at least one dt ({dt:g} s)")
    if frames * len(samples) > MAX_POSITIONS:
        text = f"the recording lasts {duration:g} s, {frames} frames of dt = {dt:g} s"
        raise ValueError(f"{path}: {text}; expected less (are the times in seconds?)")
    return start + np.arange(frames) * dt


def _resample(rows: NDArray[np.float64], grid: NDArray[np.float64], max_gap: float) -> NDArray[np.float64]:
    """[T, 2], m: linear between samples at most `max_gap` apart, NaN elsewhere."""
    times, tolerance = rows[:, 0], TIME_TOLERANCE * (grid[1] - grid[0])
    values = np.column_stack([np.interp(grid, times, rows[:, 1]), np.interp(grid, times, rows[:, 2])])
    after = np.clip(np.searchsorted(times, grid), 1, len(times) - 1)
    earlier, later = times[after - 1], times[after]
    inside = (grid >= times[0] - tolerance) & (grid <= times[-1] + tolerance)
    bridged = later - earlier <= max_gap + tolerance
    sampled = np.minimum(abs(grid - earlier), abs(grid - later)) <= tolerance
    return np.where((inside & (bridged | sampled))[:, None], values, np.nan)


def _first_names(names: Samples) -> str:
    first = list(names)[:5]
    return ", ".join(first) + (f" and {len(names) - len(first)} more" if len(names) > len(first) else "")
