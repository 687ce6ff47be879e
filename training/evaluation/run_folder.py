"""The folder of an evaluation: results.parquet with every finished cell, and results.json.

A finished cell survives whatever happens next: each file is written beside its place, brought to the disk and
moved there in one step. The configuration stands in the file, so that a run is only continued as what it was.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trust_env.training.evaluation.results import Cell, Results, cells_of

if TYPE_CHECKING:
    import pyarrow as pa

ROWS, SUMMARY = "results.parquet", "results.json"
_CONFIGURATION = b"trust_env.configuration"
UNFINISHED = ".unfinished"  # a file that is being written
_BYTES_PER_EPISODE = 1024  # of results.parquet, generously


class RunFolder:
    """`cells`: those that an earlier run of the same configuration has finished."""

    def __init__(
        self, path: str | Path, configuration: Mapping[str, Any], episodes: int, resume: bool = False
    ):
        """ValueError for a folder that may not be used, OSError for one that cannot be written."""
        self.path = Path(path).expanduser()
        self._configuration = json.loads(json.dumps(configuration))  # as it will be read back
        self.cells: list[Cell] = []
        self._prepare(resume)
        self._require_space(episodes)

    def _prepare(self, resume: bool) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise ValueError(f"{self.path}: expected a folder for the results, this is a file")
        self.path.mkdir(parents=True, exist_ok=True)
        found = sorted(p.name for p in self.path.iterdir() if not p.name.endswith(UNFINISHED))
        if found and not resume:
            raise ValueError(
                f"{self.path}: the folder is not empty (it holds {found[0]}) and nothing is overwritten; "
                f"expected a new or empty folder, or --resume to continue the run in it"
            )
        if ROWS in found:
            self.cells = self._load()
        elif found:
            raise ValueError(
                f"{self.path}: there is no {ROWS} to resume from, but other files ({found[0]}, ...)"
            )

    def _load(self) -> list[Cell]:
        """The finished cells of a run of this very configuration."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        file = self.path / ROWS
        try:
            table = pq.read_table(file)
            there, cells = json.loads((table.schema.metadata or {})[_CONFIGURATION]), cells_of(table)
        except (pa.ArrowInvalid, KeyError, ValueError) as fault:
            raise ValueError(f"{file}: not the results of an evaluation: {fault}") from None
        check_same(self.path, there, self._configuration)
        return cells

    def _require_space(self, episodes: int) -> None:
        needed, free = 2**20 + 2 * episodes * _BYTES_PER_EPISODE, shutil.disk_usage(self.path).free
        if free < needed:
            raise OSError(
                errno.ENOSPC, f"{needed / 2**20:.0f} MiB needed, {free / 2**20:.1f} free", str(self.path)
            )

    def save(self, results: Results) -> None:
        """Put down all cells of `results`; what stood there before stays until the new file is complete."""
        table = results.to_arrow()
        metadata = {_CONFIGURATION: json.dumps(self._configuration)}
        replace_file(
            self.path / ROWS, lambda file: _write_table(table.replace_schema_metadata(metadata), file)
        )
        text = json.dumps(results.to_dict(), indent=2, allow_nan=False) + "\n"
        replace_file(self.path / SUMMARY, lambda file: file.write_text(text, encoding="utf-8"))


def check_same(folder: Path, there: Mapping[str, Any], here: Mapping[str, Any]) -> None:
    """ValueError, naming what differs, if a folder's configuration is not the one to go on with."""
    differing = list(_differences(there, here))
    if differing:
        raise ValueError(
            f"{folder}: the folder belongs to another configuration, so it cannot be resumed: "
            + "; ".join(differing[:5])
            + (f"; and {len(differing) - 5} more" if differing[5:] else "")
        )


def replace_file(file: Path, write: Callable[[Path], Any]) -> None:
    """Let `write` make a file under another name, bring it to the disk, and move it to its place.

    What stood there before stays until the new file is complete. OSError: it could not be written.
    """
    unfinished = file.with_name(file.name + UNFINISHED)
    try:
        write(unfinished)
        sync(unfinished)
        os.replace(unfinished, file)
        sync(file.parent)
    except OSError as fault:
        unfinished.unlink(missing_ok=True)
        raise OSError(fault.errno, fault.strerror or str(fault), str(file)) from None


def _write_table(table: pa.Table, file: Path) -> None:
    import pyarrow.parquet as pq

    pq.write_table(table, file)


def sync(path: Path) -> None:
    """Wait until a file, or the list of a folder's files, is on the disk."""
    if path.is_dir() and os.name == "nt":
        return  # folders cannot be opened there
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _differences(there: Any, here: Any, name: str = "") -> Iterator[str]:
    """What two configurations disagree about, by dotted name."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys([*there, *here]):
            yield from _differences(there.get(key), here.get(key), f"{name}.{key}" if name else str(key))
    elif there != here:
        yield f"{name} is {_shown(there)} there, {_shown(here)} here"


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
