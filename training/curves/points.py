"""The points of a curve: the results of an evaluation at every value of a condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from trust_env.errors import unknown_name
from trust_env.training.evaluation.results import Results
from trust_env.training.evaluation.summary import Summary

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, eq=False)
class Curve:
    """`points`: the results of an evaluation at every value of the condition, all on the same episodes."""

    over: str
    meaning: str
    metric: str
    points: tuple[tuple[Any, Results], ...]

    @property
    def values(self) -> list[Any]:
        return [value for value, _ in self.points]

    @property
    def lines(self) -> list[tuple[str, str]]:
        """Attack and defense of every line."""
        return [cell.key for cell in self.points[0][1].cells]

    def summary(self, attack: str, defense: str, value: Any) -> Summary | None:
        """The metric of a line at a value; None where no episode defines it."""
        for known, results in self.points:
            if known == value:
                return results[attack, defense].summary.get(self.metric)
        raise unknown_name("value", str(value), map(str, self.values))

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, as in curve.json."""
        points = [{"value": value, "results": results.to_dict()} for value, results in self.points]
        return {"over": self.over, "meaning": self.meaning, "metric": self.metric, "points": points}

    def to_arrow(self) -> pa.Table:
        """A row per value and episode, as in curve.parquet: the value as text, and the columns of results.parquet."""
        import pyarrow as pa

        tables = []
        for value, results in self.points:
            table = results.to_arrow()
            tables.append(table.add_column(0, self.over, pa.array([str(value)] * table.num_rows, pa.string())))
        return pa.concat_tables(tables)
