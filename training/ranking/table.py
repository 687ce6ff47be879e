"""The Markdown tables of a ranking, one for every scenario and threat model."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from trust_env.training.console import format_number
from trust_env.training.published.rows import markdown

COLUMNS = (
    "defense", "honest", "mean of attacks", "worst attack", "its damage", "worst tenth", "placed", "falsely accused",
    "calibration: tracks", "agents", "time",
)  # fmt: skip
MEANING = (
    "Damage is false tracks shown plus targets missing, per frame; in brackets 95 % bootstrap intervals. The worst "
    "attack is that of most damage in episodes apart from those reported; worst tenth: in the worst tenth of the "
    "episodes of that attack. Placed: that damage where `oracle` has 0 and `blank` has 1 under the same attack. "
    "Falsely accused: share of the benign agents, adversaries that have done nothing among them. Calibration: "
    "expected calibration error of trust, pooled over the attacks, the control among them. Time: of a step, as a ratio "
    "to `score`. References stand last."
)

Rows = list[dict[str, Any]]


def table_of(fields: Mapping[str, Any], groups: Sequence[tuple[str, str, Rows]]) -> str:
    """What is ranked how, and the tables."""
    parts = [f"# Ranking, version {fields['version']}, {fields['kind']}", f"{_sentence(fields['claim'])} {MEANING}"]
    for scenario, threat, rows in groups:
        parts += [f"## {scenario}, {threat}", "\n".join(markdown(COLUMNS, map(_cells, rows)))]
    parts.append(f"{fields['environment']}, made on {fields['processor']} by\n\n```sh\n{command(fields)}\n```")
    return "\n\n".join(parts) + "\n"


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."


def command(fields: Mapping[str, Any]) -> str:
    options = [word for option, names in fields["options"].items() for word in (f"--{option}", ",".join(names))]
    return shlex.join(["trust-env", "rank", f"--{fields['kind']}", *options, "--out", "RUN"])


def _cells(row: Mapping[str, Any]) -> list[str]:
    worst, calibration = row["worst"], row["calibration"]
    return [
        f"`{row['defense']}`",
        _bounds(row["honest"]["mean"]),
        _bounds(row["mean"]),
        f"`{worst['attack']}`",
        _bounds(worst["mean"]),
        _bounds(worst["worst_decile"]),
        _bounds(row["placed"]),
        _number(row["false_accusations"]),
        *(_number(calibration.get(kind, {}).get("calibration_error")) for kind in ("track_trust", "agent_trust")),
        _number(row["time_ratio"]),
    ]


def _bounds(bounds: Mapping[str, float | None] | None) -> str:
    if bounds is None:
        return "–"
    return f"{_number(bounds['value'])} ({_number(bounds['low'])}–{_number(bounds['high'])})"


def _number(value: float | None) -> str:
    return "–" if value is None else format_number(value)
