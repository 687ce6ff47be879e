"""From the JSON of a command to the lines of a Markdown table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from trust_env.training.console import format_number

DAMAGE = "damage_per_frame"


def damage(found: dict[str, Any]) -> list[str]:
    """Mean damage: a row for every attack, a column for every defense."""
    return _grid(found, "mean")


def worst(found: dict[str, Any]) -> list[str]:
    """The same of the worst tenth."""
    return _grid(found, "worst_decile")


def _grid(found: dict[str, Any], value: str) -> list[str]:
    cells = {(c["attack"], c["defense"]): c["metrics"][DAMAGE][value] for c in found["cells"]}
    attacks, defenses = (list(dict.fromkeys(names)) for names in zip(*cells, strict=True))
    body = [[f"`{a}`", *(_number(cells[a, d]) for d in defenses)] for a in attacks]
    means = [_number(sum(cells[a, d] for a in attacks) / len(attacks)) for d in defenses]
    return markdown(["attack", *(f"`{d}`" for d in defenses)], [*body, ["mean of the rows", *means]])


def against(defense: str) -> Callable[[dict[str, Any]], list[str]]:
    """Mean damage under every defense, and of one of them the ratio to and the difference from the reference."""

    def lines(found: dict[str, Any]) -> list[str]:
        cells = {(c["attack"], c["defense"]): c["metrics"] for c in found["cells"]}
        attacks, defenses = (list(dict.fromkeys(names)) for names in zip(*cells, strict=True))
        compared = {row["attack"]: row for row in found["against"] if row["defense"] == defense}
        body = []
        for a in attacks:
            row = compared[a]
            low, high = row["difference"]["low"], row["difference"]["high"]
            accused = cells[a, defense].get("false_accusation_rate", {}).get("mean")
            numbers = [_number(cells[a, d][DAMAGE]["mean"]) for d in defenses]
            body.append([f"`{a}`", *numbers, _number(row["ratio"]), f"{low:+.2f} to {high:+.2f}", _number(accused)])
        extra = ["ratio", "difference", "benign agents accused"]
        return markdown(["attack", *(f"`{d}`" for d in defenses), *extra], body)

    return lines


def calibration(found: dict[str, Any]) -> list[str]:
    """Brier score and calibration error of every defense, of tracks and of agents, over all attacks."""
    body = []
    for pooled in found["pooled"]:
        for kind, name in (("track_trust", "tracks"), ("agent_trust", "agents")):
            if kind in pooled:
                scores = pooled[kind]
                body.append(
                    [f"`{pooled['defense']}`", name, _number(scores["brier"]), _number(scores["calibration_error"])]
                )
    return markdown(["defense", "trust in", "Brier score", "calibration error"], body)


def curve(found: dict[str, Any]) -> list[str]:
    """The metric of a curve: a row for every attack and defense, a column for every value, means with intervals."""
    points = {p["value"]: {(c["attack"], c["defense"]): c for c in p["results"]["cells"]} for p in found["points"]}
    keys = list(next(iter(points.values())))
    several = len({d for _, d in keys}) > 1
    body = []
    for key in keys:
        summaries = [points[value][key]["metrics"].get(found["metric"]) for value in points]
        names = [f"`{key[0]}`", *([f"`{key[1]}`"] if several else [])]
        body.append([*names, *(_interval(summary) for summary in summaries)])
    return markdown(["attack", *(["defense"] if several else []), *map(str, points)], body)


def markdown(headings: Sequence[str], body: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table."""
    return [_line(headings), _line(["---"] * len(headings)), *map(_line, body)]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _interval(summary: dict[str, Any] | None) -> str:
    if summary is None or summary["mean"] is None:
        return "–"
    return f"{_number(summary['mean'])} ({_number(summary['mean_low'])}–{_number(summary['mean_high'])})"


def _number(value: float | None) -> str:
    return "–" if value is None or math.isnan(value) else format_number(value)
