"""Checks between the fields of a scenario; each problem names the field to change and what was expected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from pydantic import BaseModel, ValidationError

from trust_env.scenario.agents import AgentEntry, Sensor
from trust_env.scenario.errors import MISSING, Location, Problem, problems_of
from trust_env.scenario.fov import Fov
from trust_env.scenario.memory import memory_problems
from trust_env.scenario.schema import ScenarioFields
from trust_env.scenario.types import DENSITY, LENGTH, MAX_AGENTS

_TEAM: tuple[Location, ...] = (("agents",), ("team", "n_adversaries"), ("team", "n_benign"))
MAX_CLUTTER = 500  # a scan, on average: Poisson numbers are drawn by inversion, and exp(-745) is 0


def agent_problems(scenario: ScenarioFields) -> list[Problem]:
    """Problems of the number of agents and of platforms, and of FOVs and sensors after the differences."""
    if scenario.agents is None and scenario.team.platforms is not None:
        count, agents = len(scenario.team.platforms), len(scenario.team.roles)
        if count != agents:
            text = f"expected one platform type for each of the {agents} agents; there are {count}"
            return [Problem(("team", "platforms"), list(scenario.team.platforms), text, _TEAM[1:])]
    if not 1 <= scenario.n_agents <= MAX_AGENTS:
        at: Location = ("team", "n_benign") if scenario.agents is None else ("agents",)
        value = scenario.team.n_benign if scenario.agents is None else MISSING
        text = f"there are {scenario.n_agents} agents; expected 1 to {MAX_AGENTS} in all"
        return [Problem(at, value, text, _TEAM)]
    problems: list[Problem] = []
    for k, entry in enumerate(scenario.agents or ()):
        problems += _difference_problems(scenario.fov_of, entry, Fov, ("agents", k, "fov"))
        problems += _difference_problems(scenario.sensor_of, entry, Sensor, ("agents", k, "sensor"))
    return problems


def _difference_problems(
    resolve: Callable[[AgentEntry], BaseModel], entry: AgentEntry, model: type[BaseModel], at: Location
) -> list[Problem]:
    try:
        resolve(entry)
    except ValidationError as error:
        return [problem.within(at) for problem in problems_of(error, model)]
    return []


def problems_between_fields(scenario: ScenarioFields) -> list[Problem]:
    """Problems of fields that contradict one another, where `agent_problems` found none."""
    checks = (_area, _recording, _detections, _clutter, _false_positive_density, _injections, _suppressions)
    return [problem for check in (*checks, memory_problems) for problem in check(scenario)]


def _area(scenario: ScenarioFields) -> list[Problem]:
    x_min, x_max, y_min, y_max = scenario.area
    text = "expected [x_min, x_max, y_min, y_max] with x_min < x_max and y_min < y_max, or the area is zero"
    least = min(x_max - x_min, y_max - y_min)
    if 0 < least < LENGTH.least:
        text = f"expected an area at least {LENGTH.least:g} m wide and high"
    return [] if least >= LENGTH.least else [Problem(("area",), list(scenario.area), text)]


def _recording(scenario: ScenarioFields) -> list[Problem]:
    recording = scenario.recording()
    traffic = scenario.team.placement == "traffic"
    if recording is None:
        text = "expected a recording in targets.data to place the agents by"
        return [Problem(("team", "placement"), "traffic", text, (("targets", "data"),))] if traffic else []
    problems: list[Problem] = []
    of: tuple[Location, ...] = (("dt",), ("targets", "data"))
    if scenario.horizon > (frames := len(recording.times)):
        text = f"expected at most {frames}, the frames of the recording, or null for all of them"
        problems.append(Problem(("horizon",), scenario.horizon, text, of))
    if traffic and recording.n_positions < scenario.n_agents:
        text = f"expected a recording of at least {scenario.n_agents} different positions, one per agent"
        problems.append(Problem(("team", "placement"), "traffic", text, (*of, *_TEAM)))
    return problems


def _detections(scenario: ScenarioFields) -> list[Problem]:
    slots, detections = scenario.injection.slots, scenario.sensor.max_detections
    text = f"expected at least injection.slots ({slots})"
    return (
        []
        if detections >= slots
        else [Problem(("sensor", "max_detections"), detections, text, (("injection", "slots"),))]
    )


def _clutter(scenario: ScenarioFields) -> list[Problem]:
    detections = scenario.sensor.max_detections
    most = min(detections, MAX_CLUTTER)
    limit = f"sensor.max_detections ({most})" if most == detections else f"{most}"
    for k, entry in enumerate(scenario.entries):
        density, area = scenario.sensor_of(entry).clutter_density, scenario.fov_of(entry).area
        if density * area > most:
            text = (
                f"the FOV of agent {k} has {area:.6g} m^2, so that a scan holds {density * area:.6g} false "
                f"positives on average; expected at most {limit}"
            )
            own = entry.sensor is not None and entry.sensor.clutter_density is not None
            above: Location = ("agents", k) if own else ()
            judged_by: tuple[Location, ...] = (("fov",), ("sensor", "max_detections"), *_TEAM)
            return [Problem((*above, "sensor", "clutter_density"), density, text, judged_by)]
    return []


def _false_positive_density(scenario: ScenarioFields) -> list[Problem]:
    if scenario.tracker.beta_fp is not None:
        return []
    for k, entry in enumerate(scenario.entries):
        believed = entry.belief is not None and entry.belief.beta_fp is not None
        density = scenario.sensor_of(entry).clutter_density
        if not believed and density < DENSITY.least:
            which = f"above 0, as the clutter density of agent {k} is 0"
            if density > 0:
                which = f"from {DENSITY.least:g} on, as the clutter density of agent {k} is {density:g}"
            text = f"expected false positives per m^2 {which}"
            return [Problem(("tracker", "beta_fp"), None, text, (("sensor", "clutter_density"), ("agents",)))]
    return []


def _roster(scenario: ScenarioFields) -> tuple[Location, ...]:
    """The fields that say who the agents are, and what they may do."""
    if scenario.agents is None:
        return (*_TEAM, ("team", "order"))
    return tuple(("agents", k, name) for k in range(len(scenario.agents)) for name in ("role", "budget"))


def _count(scenario: ScenarioFields) -> tuple[Location, ...]:
    """The fields that say how many agents there are: those of the team, or how long the list is."""
    return _TEAM if scenario.agents is None else (("agents", "count"),)


def _injections(scenario: ScenarioFields) -> list[Problem]:
    agents = [injection.agent for injection in scenario.injections]
    return _listed_agents(scenario, "injections", agents, ("injection",))


def _suppressions(scenario: ScenarioFields) -> list[Problem]:
    problems = _listed_agents(scenario, "suppressions", [s.agent for s in scenario.suppressions], ("suppression",))
    positions = len(scenario.targets.positions or ())
    text = f"expected the index of one of targets.positions, 0 to {positions - 1}"
    if not positions:
        text = "expected targets.positions, which this is the index in"
    for i, suppression in enumerate(scenario.suppressions):
        if suppression.target >= positions:
            at, judged_by = ("suppressions", i, "target"), (("targets", "positions"),)
            problems.append(Problem(at, suppression.target, text, judged_by))
    return problems


def _listed_agents(scenario: ScenarioFields, kind: str, agents: list[int], rules: Location) -> list[Problem]:
    """Problems of the agents that the scenario's own injections or suppressions name: `kind` is which."""
    problems: list[Problem] = []
    given, roster = Counter[int](), _roster(scenario)
    for i, k in enumerate(agents):
        given[k] += 1
        if k >= scenario.n_agents:
            text = f"expected the index of an agent, 0 to {scenario.n_agents - 1}"
            problems.append(Problem((kind, i, "agent"), k, text, _count(scenario)))
        elif given[k] > (budget := getattr(scenario.budget_of(scenario.entries[k]), kind)):
            text = f"expected at most {budget} {kind} of {scenario.agent_names[k]}, its budget per frame"
            problems.append(Problem((kind, i, "agent"), k, text, (*roster, rules)))
    return problems
