"""Scenarios that play recorded trajectories."""

from __future__ import annotations

from typing import Any

from trust_env.scenario import scenario_fields


def needs_recording(scenario: Any) -> bool:
    """Whether a recording, `targets.data`, decides fields of the scenario, and is not given."""
    fields = scenario_fields(scenario)
    return fields["targets"]["data"] is None and (fields["horizon"] is None or fields["area"] is None)
