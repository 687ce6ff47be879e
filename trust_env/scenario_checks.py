"""Checks between the fields of a scenario; each finding names the field to change and what was expected."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pydantic import BaseModel, ValidationError

from trust_env.scenario_errors import Location, Problem, problems_of
from trust_env.scenario_parts import AgentEntry, Fov, Sensor

if TYPE_CHECKING:
    from trust_env.scenario import Scenario

MAX_AGENTS = 64  # the agents that have seen a track are the bits of one integer


def agent_problems(scenario: Scenario) -> list[Problem]:
    """What is wrong with the number of agents, or with what an agent's differences make of its FOV and sensor."""
    field: Location = ("team",) if scenario.agents is None else ("agents",)
    if not 1 <= scenario.n_agents <= MAX_AGENTS:
        return [Problem(field, f"{scenario.n_agents} agents", f"expected 1 to {MAX_AGENTS} agents")]
    found: list[Problem] = []
    for k, entry in enumerate(scenario.agents or ()):
        found += _resolved(scenario.fov_of, entry, Fov, ("agents", k, "fov"))
        found += _resolved(scenario.sensor_of, entry, Sensor, ("agents", k, "sensor"))
    return found


def _resolved(
    resolve: Callable[[AgentEntry], BaseModel], entry: AgentEntry, model: type[BaseModel], at: Location
) -> list[Problem]:
    try:
        resolve(entry)
    except ValidationError as error:
        return [problem.within(at) for problem in problems_of(error, model)]
    return []


def problems(scenario: Scenario) -> list[Problem]:
    """Everything that only shows when several fields are seen together; the agents can be resolved."""
    return [*_area(scenario), *_places(scenario), *_capacities(scenario), *_beliefs(scenario), *_injections(scenario)]


def _area(scenario: Scenario) -> list[Problem]:
    x_min, x_max, y_min, y_max = scenario.area
    if x_min < x_max and y_min < y_max:
        return []
    text = "expected [x_min, x_max, y_min, y_max] with x_min < x_max and y_min < y_max, or the area is zero"
    return [Problem(("area",), list(scenario.area), text)]


def _places(scenario: Scenario) -> list[Problem]:
    targets, found = scenario.targets, []
    if scenario.team.placement == "traffic" and targets.data is None:
        found.append(Problem(("team", "placement"), "traffic", "expected a recording in targets.data to place agents by"))
    recording = scenario.recording()
    if recording is not None and scenario.horizon > len(recording.times):
        text = f"expected at most the {len(recording.times)} frames of the recording, or null for all of them"
        found.append(Problem(("horizon",), scenario.horizon, text))
    return found


def _capacities(scenario: Scenario) -> list[Problem]:
    detections, found = scenario.sensor.max_detections, []
    if detections < scenario.injection.slots:
        text = f"expected at least injection.slots ({scenario.injection.slots})"
        found.append(Problem(("sensor", "max_detections"), detections, text))
    for k in range(scenario.n_agents):
        entry = scenario.agents[k] if scenario.agents is not None else AgentEntry(role=scenario.roles[k])
        sensor, area = scenario.sensor_of(entry), scenario.fov_of(entry).area
        clutter = sensor.clutter_density * area
        if clutter > detections:
            text = (
                f"expected less clutter than sensor.max_detections ({detections}) in a scan: "
                f"in the FOV of agent {k}, {area:.6g} m^2, there are {clutter:.6g} on average"
            )
            own = entry.sensor is not None and entry.sensor.clutter_density is not None
            at: Location = ("agents", k, "sensor", "clutter_density") if own else ("sensor", "clutter_density")
            return [*found, Problem(at, sensor.clutter_density, text)]
    return found


def _beliefs(scenario: Scenario) -> list[Problem]:
    if scenario.tracker.beta_fp is not None:
        return []
    entries = scenario.agents if scenario.agents is not None else (AgentEntry(role="benign"),)
    for entry in entries:
        believed = entry.belief is not None and entry.belief.beta_fp is not None
        if not believed and scenario.sensor_of(entry).clutter_density == 0:
            text = "expected a number above 0 (false positives per m^2), as the sensor's clutter density is 0"
            return [Problem(("tracker", "beta_fp"), None, text)]
    return []


def _injections(scenario: Scenario) -> list[Problem]:
    found: list[Problem] = []
    names, count = scenario.agent_names, [0] * scenario.n_agents
    for i, injection in enumerate(scenario.injections):
        at: Location = ("injections", i, "agent")
        if injection.agent >= scenario.n_agents:
            text = f"expected the index of an agent, 0 to {scenario.n_agents - 1}"
            found.append(Problem(at, injection.agent, text))
            continue
        count[injection.agent] += 1
        budget = scenario.agent(injection.agent).budget.injections if not _beliefs(scenario) else scenario.injection.slots
        if count[injection.agent] > min(budget, scenario.injection.slots):
            text = f"expected at most {min(budget, scenario.injection.slots)} injections of {names[injection.agent]} (its budget)"
            found.append(Problem(at, injection.agent, text))
    return found
