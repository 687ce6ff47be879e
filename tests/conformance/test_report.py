"""The report of `check`, in every form."""

from __future__ import annotations

import json

import faulty_envs
import pytest
from rich.console import Console

from trust_env.conformance import check


def test_a_report_prints_as_text_table_and_json() -> None:
    seen: list[str] = []
    report = check(
        faulty_envs.RewardsAreArrays,
        seed=1,
        checks=["value_types", "close_twice"],
        on_result=lambda result: seen.append(result.name),
    )
    assert seen == ["value_types", "close_twice"]
    read = json.loads(json.dumps(report.to_dict()))
    assert (read["environment"], read["seed"], read["ok"]) == ("walkers_v0", 1, False)
    assert [entry["status"] for entry in read["checks"]] == ["failed", "passed"]
    assert "failed   value_types" in str(report)
    assert str(report).endswith("walkers_v0: 1 passed, 1 failed, 0 skipped")
    console = Console(width=120)
    with console.capture() as printed:
        console.print(report)
    assert "value_types" in printed.get()
    with pytest.raises(KeyError):
        report["memory"]
