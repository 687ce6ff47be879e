"""What the checks found."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from rich.table import Table

    from trust_env.conformance.subject import Subject

Status = Literal["passed", "failed", "skipped"]

# A check returns a remark (or None) when the environment passes, and raises one of the two below otherwise.
Check = Callable[["Subject"], str | None]

_COLOURS = {"passed": "green", "failed": "bold red", "skipped": "yellow"}


class Failed(Exception):
    """The environment does not pass; the text says what differed, and where."""


class Skipped(Exception):
    """The environment lacks what the check is about; the text says what."""


def described(error: Exception) -> str:
    """The exception and the place that raised it; of a bare assert, which says nothing, the line itself."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    said = str(error) or place.line or ""
    return f"{type(error).__name__}: {said} ({Path(place.filename).name}:{place.lineno}, {place.name})"


@dataclass(frozen=True)
class Result:
    """One check's outcome; `detail` is the fault, the reason for skipping, or a remark."""

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
        """Whether nothing failed; what was skipped does not count against the environment."""
        return not self.failed

    @property
    def failed(self) -> tuple[str, ...]:
        return self._named("failed")

    @property
    def skipped(self) -> tuple[str, ...]:
        return self._named("skipped")

    @property
    def passed(self) -> tuple[str, ...]:
        return self._named("passed")

    def __getitem__(self, name: str) -> Result:
        for result in self.results:
            if result.name == name:
                return result
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return {
            "environment": self.environment,
            "seed": self.seed,
            "ok": self.ok,
            "checks": [asdict(result) for result in self.results],
        }

    def summary(self) -> str:
        """One line: the counts."""
        counts = (len(self.passed), len(self.failed), len(self.skipped))
        return f"{self.environment}: {counts[0]} passed, {counts[1]} failed, {counts[2]} skipped"

    def __str__(self) -> str:
        width = max((len(result.name) for result in self.results), default=0)
        lines = [
            f"{r.status:7}  {r.name:{width}}  {r.seconds:6.2f} s  {r.detail}".rstrip() for r in self.results
        ]
        return "\n".join([*lines, self.summary()])

    def __rich__(self) -> Table:
        from rich.table import Table
        from rich.text import Text

        table = Table("check", "status", "seconds", "detail", title=self.summary())
        for r in self.results:
            table.add_row(r.name, Text(r.status, _COLOURS[r.status]), f"{r.seconds:.2f}", Text(r.detail))
        return table

    def _named(self, status: Status) -> tuple[str, ...]:
        return tuple(result.name for result in self.results if result.status == status)
