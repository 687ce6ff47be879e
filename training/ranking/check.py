"""Whether a ranking played anew is the one of a file: exactly on the same type of processor, else to 1e-9."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from trust_env.training.ranking.ranking import Ranking

TOLERANCE = 1e-9  # relative and absolute: compilers order sums differently on other processors
NOT_COMPARED = "time_ratio"


@dataclass(frozen=True)
class Check:
    """`differences`: a line for every value that is another one. `exact`: whether to the bit was asked."""

    rows: int
    exact: bool
    differences: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        return {"rows": self.rows, "exact": self.exact, "differences": list(self.differences)}

    def print(self, console: Any) -> None:
        """Print what was compared, how, and every difference."""
        how = "to the bit" if self.exact else f"to {TOLERANCE:g}, as the processors differ"
        outcome = f"{len(self.differences)} values differ" if self.differences else "all the same"
        console.print(f"{self.rows} rows compared {how}, but for times: {outcome}", markup=False)
        for line in self.differences[:20]:
            console.print(line, markup=False)


def check_ranking(saved: Ranking, anew: Ranking) -> Check:
    """Compare every row played anew with that of the file."""
    exact = saved.fields["processor"] == anew.fields["processor"]
    known = {_key(row): row for row in saved.rows}
    found: list[str] = []
    for row in anew.rows:
        found += _differences(_key(row), known.get(_key(row)), row, exact)
    return Check(len(anew.rows), exact, tuple(found))


def _key(row: dict[str, Any]) -> str:
    return f"{row['scenario']}, {row['threat']}, {row['defense']}"


def _differences(name: str, saved: Any, anew: Any, exact: bool) -> Iterator[str]:
    if isinstance(saved, dict) and isinstance(anew, dict):
        for key in dict.fromkeys([*saved, *anew]):
            if key != NOT_COMPARED:
                yield from _differences(f"{name}: {key}", saved.get(key), anew.get(key), exact)
    elif not _equal(saved, anew, exact):
        yield f"{name} is {saved} in the file, {anew} here"


def _equal(a: Any, b: Any, exact: bool) -> bool:
    if exact or not (isinstance(a, float) and isinstance(b, float)):
        return a == b
    return math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=TOLERANCE)
