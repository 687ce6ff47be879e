"""The outcome of each check, and how it is printed."""

from __future__ import annotations

import traceback
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from rich.table import Table

Status = Literal["passed", "failed", "skipped"]

_COLOURS = {"passed": "green", "failed": "bold red", "skipped": "yellow"}


class Failed(Exception):
    """Raised by a check that the environment does not pass; the text says what is wrong, and where."""


class Skipped(Exception):
    """Raised by a check that does not apply to the environment; the text says why."""


def describe_error(error: Exception) -> str:
    """The exception and where it was raised; for an assert without a message, the line of code."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    message = str(error) or place.line or ""
    return f"{type(error).__name__}: {message} ({Path(place.filename).name}:{place.lineno}, {place.name})"


@dataclass(frozen=True)
class Result:
    """The outcome of one check; `detail`: what is wrong, why it was skipped, or a remark."""

    name: str
    status: Status
    detail: str
    seconds: float


@dataclass(frozen=True)
class Report:
    """All results, in the order the checks ran."""

    environment: str
    seed: int
    results: tuple[Result, ...]

    @property
    def ok(self) -> bool:
        """Whether no check failed; skipped checks do not count."""
        return not self.failed

    @property
    def failed(self) -> tuple[str, ...]:
        return self._with_status("failed")

    @property
    def skipped(self) -> tuple[str, ...]:
        return self._with_status("skipped")

    @property
    def passed(self) -> tuple[str, ...]:
        return self._with_status("passed")

    def __getitem__(self, name: str) -> Result:
        for result in self.results:
            if result.name == name:
                return result
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """Strings, numbers, booleans, dicts and lists only, ready for JSON."""
        return {
            "environment": self.environment,
            "seed": self.seed,
            "ok": self.ok,
            "checks": [asdict(result) for result in self.results],
        }

    def summary(self) -> str:
        """One line: the counts."""
        passed, failed, skipped = len(self.passed), len(self.failed), len(self.skipped)
        return f"{self.environment}: {passed} passed, {failed} failed, {skipped} skipped"

    def __str__(self) -> str:
        width = max((len(result.name) for result in self.results), default=0)
        lines = [f"{r.status:7}  {r.name:{width}}  {r.seconds:6.2f} s  {r.detail}".rstrip() for r in self.results]
        return "\n".join([*lines, self.summary()])

    def __rich__(self) -> Table:
        from rich.table import Table
        from rich.text import Text

        table = Table("check", "status", "seconds", "detail", title=self.summary())
        for r in self.results:
            table.add_row(r.name, Text(r.status, _COLOURS[r.status]), f"{r.seconds:.2f}", Text(r.detail))
        return table

    def _with_status(self, status: Status) -> tuple[str, ...]:
        return tuple(result.name for result in self.results if result.status == status)
