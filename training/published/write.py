"""Make the published tables again, or some of them.

    python -m trust_env.training.published.write --out docs/tables --only patrol,trio

A table that is there is kept when --keep is given, so that what was broken off goes on.
"""

from __future__ import annotations

import contextlib
import io
import json
import shlex
import time
from pathlib import Path
from typing import Annotated, Any

import tyro

from trust_env.errors import unknown_name
from trust_env.files import write_atomically
from trust_env.training.cli.main import main
from trust_env.training.published.tables import RECORDING, TABLES, Table


def write(
    out: Annotated[Path, tyro.conf.arg(help="folder for a Markdown file per table")] = Path("docs/tables"),
    only: Annotated[str | None, tyro.conf.arg(help="names of tables, separated by commas; default: all")] = None,
    data: Annotated[Path | None, tyro.conf.arg(help="recorded trajectories, for the tables that need some")] = None,
    keep: Annotated[bool, tyro.conf.arg(help="leave out tables whose file is there")] = False,
) -> None:
    """Run the command of every table and write what it prints as Markdown."""
    tables = {table.name: table for table in TABLES}
    names = list(tables) if only is None else only.split(",")
    for name in names:
        if name not in tables:
            raise unknown_name("table", name, tables)
    out.mkdir(parents=True, exist_ok=True)
    found: dict[tuple[str, ...], Any] = {}  # two tables may come from one command
    for name in names:
        table, file, start = tables[name], out / f"{name}.md", time.perf_counter()
        if keep and file.exists():
            continue
        if RECORDING in table.command and data is None:
            print(f"{file}: left out, as it needs --data")
            continue
        if table.command not in found:
            found[table.command] = run(table.command, data)
        text = "\n".join(page(table, found[table.command])) + "\n"
        write_atomically(file, lambda path, text=text: path.write_text(text, encoding="utf-8"))
        print(f"{file}: {time.perf_counter() - start:.0f} s")


def run(command: tuple[str, ...], data: Path | None = None) -> Any:
    """What a command prints with --json, on the recording where it names one. RuntimeError: it failed."""
    words = [str(data) if word == RECORDING else word for word in command]
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        code = main([*words, "--json"])
    if code:
        raise RuntimeError(f"trust-env {shlex.join(command)} failed")
    return json.loads(printed.getvalue())


def page(table: Table, found: Any) -> list[str]:
    """The Markdown of a table: title, what it says, the rows, the command."""
    command = f"trust-env {shlex.join(table.command)}"
    return [f"## {table.title}", "", table.text, "", *table.lines(found), "", "```sh", command, "```"]


if __name__ == "__main__":
    tyro.cli(write)
