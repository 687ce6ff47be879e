"""How much memory a world of a scenario takes, from the counts that decide it."""

from __future__ import annotations

from trust_env.scenario.errors import Location, Problem
from trust_env.scenario.schema import ScenarioFields

MAX_WORLD_BYTES = 2 * 10**9
_OBSERVED_PER_TRACK = {"own": 0, "poses": 0, "picture": 5, "white_box": 13}  # entries
_AGENTS: tuple[Location, ...] = (("agents",), ("team", "n_adversaries"), ("team", "n_benign"))
_DETECTIONS, _TRACKS, _LOCAL_TRACKS, _TARGETS = (
    ("sensor", "max_detections"),
    ("tracker", "max_tracks"),
    ("tracker", "max_local_tracks"),
    ("targets", "slots"),
)


def bytes_by_field(scenario: ScenarioFields) -> dict[Location, float]:
    """About how many bytes of a world, and of what a frame is computed on, each field answers for."""
    k, n, d = scenario.n_agents, scenario.targets.slots, scenario.sensor.max_detections
    kept = 1.0 + 0.4 * scenario.retro_window * (scenario.actuation == "retro")  # lists of detections, of 60 bytes each
    j, local = scenario.tracker.max_tracks, scenario.tracker.max_local_tracks
    shared = 1 + k * (scenario.coordination == "shared")
    observed = {_DETECTIONS: 6 * d * shared, _TRACKS: j * _OBSERVED_PER_TRACK[scenario.knowledge]}
    return {
        _DETECTIONS: k * (1600 + 60 * d * kept + 4 * observed[_DETECTIONS]) + 16 * d * max(j, n, local),
        _TRACKS: j * (350 + 140 * k + 16 * n) + 4 * k * observed[_TRACKS],
        _LOCAL_TRACKS: local * (240 * k + 16 * j),
        _TARGETS: 70.0 * n,
    }


def memory_problems(scenario: ScenarioFields) -> list[Problem]:
    """The field that takes most, where a world would take more than there should be of memory."""
    found = bytes_by_field(scenario)
    total, at = sum(found.values()), max(found, key=lambda location: found[location])
    if total <= MAX_WORLD_BYTES:
        return []
    counts = {
        "agents": scenario.n_agents,
        "targets.slots": scenario.targets.slots,
        "sensor.max_detections": scenario.sensor.max_detections,
        "tracker.max_tracks": scenario.tracker.max_tracks,
        "tracker.max_local_tracks": scenario.tracker.max_local_tracks,
    }
    sizes = ", ".join(f"{name} {count}" for name, count in counts.items())
    text = f"a world would take {total / 1e9:.1f} GB ({sizes}); expected at most {MAX_WORLD_BYTES / 1e9:g} GB"
    value = getattr(getattr(scenario, str(at[0])), str(at[1]))
    return [Problem(at, value, text, (*_AGENTS, *found, ("knowledge",), ("coordination",)))]
