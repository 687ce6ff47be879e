"""The folder of an evaluation: results.parquet with every finished cell, courses.parquet with the course of their
frames, and results.json. Lock it first.

A finished cell survives whatever happens next, as each file is written whole or not at all. The configuration
stands among the metadata of results.parquet, so that a run is resumed with the same one only; so do the strata, which
are of cells and not of episodes. courses.parquet is written first, so that it lacks no cell of results.parquet, and
holds the command that began the run.
"""

from __future__ import annotations

import errno
import json
import shlex
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trust_env.files import folder_contents, remove_unfinished, require_empty, write_atomically
from trust_env.training.evaluation.cell import Cell
from trust_env.training.evaluation.details import Details, Key, details_in, to_arrow
from trust_env.training.evaluation.results import Results, cells_of

if TYPE_CHECKING:
    import pyarrow as pa

ROWS, SUMMARY, DETAILS = "results.parquet", "results.json", "courses.parquet"
_CONFIGURATION = b"trust_env.configuration"
_STRATA = b"trust_env.strata"
_COMMAND = b"trust_env.command"
_BYTES_PER_EPISODE = 1024  # of results.parquet, generously


class RunFolder:
    """`cells`: those that an earlier run of the same configuration has finished."""

    def __init__(self, path: Path, configuration: Mapping[str, Any], episodes: int, resume: bool = False):
        """ValueError for a folder that may not be used, OSError for one that cannot be written."""
        self.path = path
        self._configuration = json.loads(json.dumps(configuration))  # as it will be read back
        self.cells: list[Cell] = []
        self._command = shlex.join(sys.argv)
        self._prepare(resume)
        self._require_space(episodes)

    def _prepare(self, resume: bool) -> None:
        if not resume:
            require_empty(self.path, "--resume to continue the run in it")
        found = folder_contents(self.path)
        if ROWS in found:
            self.cells = self._load()
        elif found:
            raise ValueError(f"{self.path}: there is no {ROWS} to resume from, but other files ({found[0]}, ...)")
        remove_unfinished(self.path)

    def _load(self) -> list[Cell]:
        """The finished cells of a run of the same configuration."""
        table, saved, strata = read_run(self.path)
        require_same_configuration(self.path, saved, self._configuration)
        details, self._command = read_details(self.path)
        return [replace(cell, details=details.get(cell.key)) for cell in cells_of(table, strata)]

    def _require_space(self, episodes: int) -> None:
        needed, free = 2**20 + 2 * episodes * _BYTES_PER_EPISODE, shutil.disk_usage(self.path).free
        if free < needed:
            raise OSError(errno.ENOSPC, f"{needed / 2**20:.0f} MiB needed, {free / 2**20:.1f} free", str(self.path))

    def save(self, results: Results) -> None:
        """Write all cells of `results` to the files."""
        import pyarrow.parquet as pq

        courses = to_arrow({cell.key: cell.details for cell in results.cells if cell.details is not None})
        courses = courses.replace_schema_metadata({**(courses.schema.metadata or {}), _COMMAND: self._command})
        write_atomically(self.path / DETAILS, lambda file: pq.write_table(courses, file))
        metadata = {_CONFIGURATION: json.dumps(self._configuration), _STRATA: json.dumps(results.strata())}
        table = results.to_arrow().replace_schema_metadata(metadata)
        write_atomically(self.path / ROWS, lambda file: pq.write_table(table, file))
        text = json.dumps(results.to_dict(), indent=2, allow_nan=False) + "\n"
        write_atomically(self.path / SUMMARY, lambda file: file.write_text(text, encoding="utf-8"))


def read_run(folder: Path) -> tuple[pa.Table, dict[str, Any], list[Any]]:
    """The table of results.parquet, the configuration that it was played with, and the strata of its cells.

    ValueError: the file is no such table.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = folder / ROWS
    try:
        table = pq.read_table(file)
        saved, strata = (json.loads((table.schema.metadata or {})[key]) for key in (_CONFIGURATION, _STRATA))
        cells_of(table, strata)
    except (pa.ArrowInvalid, KeyError, ValueError) as fault:
        raise ValueError(f"{file}: not the results of an evaluation: {fault}") from None
    return table, saved, strata


def read_details(folder: Path) -> tuple[dict[Key, Details], str]:
    """The details of the finished cells, and the command that began the run; nothing for a folder without them.

    ValueError: courses.parquet is none.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = folder / DETAILS
    if not file.is_file():
        return {}, ""
    try:
        table = pq.read_table(file)
        return details_in(table), table.schema.metadata[_COMMAND].decode()
    except (pa.ArrowInvalid, KeyError, TypeError, ValueError) as fault:
        raise ValueError(f"{file}: not the courses of an evaluation: {fault}") from None


def require_same_configuration(folder: Path, saved: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    """ValueError, naming what differs, where the configuration saved in a folder is not the given one."""
    differing = list(_differences(saved, given))
    if differing:
        raise ValueError(
            f"{folder}: the folder belongs to another configuration, so it cannot be resumed: "
            + "; ".join(differing[:5])
            + (f"; and {len(differing) - 5} more" if differing[5:] else "")
        )


def _differences(saved: Any, given: Any, name: str = "") -> Iterator[str]:
    """What two configurations disagree about, by dotted name."""
    if isinstance(saved, dict) and isinstance(given, dict):
        for key in dict.fromkeys([*saved, *given]):
            yield from _differences(saved.get(key), given.get(key), f"{name}.{key}" if name else str(key))
    elif saved != given:
        yield f"{name} is {_shortened(saved)} there, {_shortened(given)} here"


def _shortened(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
