"""Scenarios at the ends of what their schema accepts: every numeric field over its whole range."""

from __future__ import annotations

import math
import typing
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from trust_env.scenario import Scenario, ScenarioError, load_scenario, scenario_fields
from trust_env.scenario.memory import bytes_by_field
from trust_env.scenario.types import Within

BUILT_IN = ("patrol", "trio", "case1", "theorem")
_DRAWN_AS_A_WHOLE = (
    "name",
    "description",
    "agents",
    "injections",
    "suppressions",
    "area",
    "noise_cov",
    "vertices",
    "data",
)
_DRAWN_AS_A_WHOLE += ("positions", "velocities", "speed")


def draw_scenario(rng: np.random.Generator, most_bytes: float, most_pairs: float) -> Scenario:
    """A scenario whose fields, all or a few of them, lie anywhere in their ranges; as small as is asked for."""
    while True:
        try:
            scenario = load_scenario(_draw_fields(rng))
        except ScenarioError:  # fields that contradict one another
            continue
        t, d = scenario.tracker, scenario.sensor.max_detections
        pairs = scenario.n_agents * (d + scenario.targets.slots) * (t.max_tracks + t.max_local_tracks)
        if sum(bytes_by_field(scenario).values()) <= most_bytes and pairs <= most_pairs:
            return scenario


def numeric_fields() -> dict[str, Within]:
    """The range of every numeric field, by dotted path."""
    return {".".join(at): within for at, within in _walk(Scenario) if isinstance(within, Within)}


def _draw_fields(rng: np.random.Generator) -> dict[str, Any]:
    base = str(rng.choice(BUILT_IN))
    fields: dict[str, Any] = {}
    often = rng.choice([0.05, 0.2, 1.0])  # how many of the fields are drawn
    for at, kind in _walk(Scenario):
        if rng.random() < often:
            _set(fields, at, draw_number(rng, kind) if isinstance(kind, Within) else str(rng.choice(kind)))
    _draw_wholes(rng, fields, often)
    _reconcile(fields, scenario_fields(base))
    return {"base": base, **fields}


def draw_number(rng: np.random.Generator, within: Within) -> float:
    """Often an end, else evenly over the orders of magnitude."""
    least, most = within.least, within.most
    if within.below:
        most = float(np.nextafter(most, least))
    end = rng.random()
    if end < 0.3:
        return least if end < 0.15 else most
    smallest = least if least > 0 else min(1e-12, most) if isinstance(most, float) else 1
    size = math.exp(rng.uniform(math.log(smallest), math.log(most)))
    value = min(most, max(least, -size if least < 0 and rng.random() < 0.5 else size))
    return int(value) if isinstance(within.most, int) else value


def _walk(model: type[BaseModel], above: tuple[str, ...] = ()) -> typing.Iterator[tuple[tuple[str, ...], Any]]:
    """Location of every single field, with its range or its choices."""
    for name, field in model.model_fields.items():
        if name in _DRAWN_AS_A_WHOLE:
            continue
        kinds = [*field.metadata, *_flat(field.annotation)]
        inner = next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)
        choices = next((typing.get_args(k) for k in kinds if typing.get_origin(k) is Literal), None)
        within = next((k for k in kinds if isinstance(k, Within)), None)
        if inner is not None:
            yield from _walk(inner, (*above, name))
        elif choices or within:
            yield (*above, name), choices or within


def _flat(annotation: Any) -> list[Any]:
    """An annotation and all that it is made of."""
    if typing.get_origin(annotation) is Literal:
        return [annotation]
    inner = [*typing.get_args(annotation), *getattr(annotation, "__metadata__", ())]
    return [annotation, *(part for each in inner for part in _flat(each))]


def _draw_wholes(rng: np.random.Generator, fields: dict[str, Any], often: float) -> None:
    """The fields whose numbers have to fit one another."""
    length, place, speed = Within(1e-6, 1e9), Within(-1e9, 1e9), Within(0.0, 1e9)
    draw = lambda within: draw_number(rng, within)  # noqa: E731
    if rng.random() < often:
        (x0, x1), (y0, y1) = (sorted((draw(place), draw(place))) for _ in range(2))
        fields["area"] = [x0, x1, y0, y1]
    if rng.random() < often:
        _set(fields, ("targets", "speed"), sorted((draw(speed), draw(speed))))
    if rng.random() < often:
        xx, yy, correlation = draw(length), draw(length), rng.choice([0.0, 0.5, -0.99, 0.9999989])
        fields.setdefault("sensor", {}).pop("sigma", None)
        fields["sensor"]["noise_cov"] = [[xx * xx, correlation * xx * yy], [correlation * xx * yy, yy * yy]]
    n, radius, x, y = int(rng.integers(3, 9)), draw(length), draw(place), draw(place)
    turn = rng.uniform(0, 7) + np.arange(n) * 2 * math.pi / n
    corners = np.stack([radius * np.cos(turn) + x * (radius > 1), radius * np.sin(turn) + y * (radius > 1)], axis=-1)
    _set(fields, ("fov", "vertices"), np.clip(corners, -1e9, 1e9).tolist())
    if rng.random() < 0.3 * often:
        count = int(rng.integers(1, 20))
        for name, range_of in (("positions", place), ("velocities", place)):
            _set(fields, ("targets", name), [[draw(range_of), draw(range_of)] for _ in range(count)])
    if rng.random() < 0.5 * often:
        position = lambda: [draw(place), draw(place)] if rng.random() < 0.7 else None  # noqa: E731
        fields["agents"] = [
            {"role": str(rng.choice(["adversary", "benign"])), "position": position(), "heading": draw(place) / 1e3}
            for _ in range(rng.integers(1, 7))
        ]


def _reconcile(fields: dict[str, Any], base: Mapping[str, Any]) -> None:
    """Change what contradicts another field, where two draws seldom agree."""
    team, sensor, tracker, fov = (fields.setdefault(name, {}) for name in ("team", "sensor", "tracker", "fov"))
    benign, adversaries = (team.get(n, base["team"][n]) for n in ("n_benign", "n_adversaries"))
    team["n_benign"] = max(int(adversaries == 0), min(benign, 64 - adversaries))
    if "positions" in fields.get("targets", {}):
        fields["targets"].pop("slots", None)
    elif base["targets"]["positions"] is not None and "slots" in fields.get("targets", {}):
        fields["targets"]["positions"] = None
    if "agents" in fields or base["agents"] is not None:
        fields["injections"] = []
    if team.get("placement") == "traffic":
        team["placement"] = "random"
    if tracker.get("alpha", 0.0) + tracker.get("beta", 0.0) > 0.9:
        tracker["beta"] = 1e-3
    n = tracker.get("confirm_n", base["tracker"]["confirm_n"])
    tracker["confirm_m"] = min(n, tracker.get("confirm_m", base["tracker"]["confirm_m"]))
    fov["radius"], fov["width"] = abs(fov.get("radius", 1.0)) or 1e9, min(6.28, abs(fov.get("width", 1.0)) or 1e-3)
    fov["radius"] = max(1e-6, fov["radius"])
    detections = sensor.get("max_detections", base["sensor"]["max_detections"])
    fields["injection"] = {**fields.get("injection", {}), "slots": min(4, detections)}
    if "clutter_density" in sensor:
        most = min(detections, 500) / 20.0 / max(1.0, 4.0 * fov["radius"] ** 2)
        sensor["clutter_density"] = min(sensor["clutter_density"], most)
    if sensor.get("clutter_density", base["sensor"]["clutter_density"]) < 1e-30:
        tracker.setdefault("beta_fp", 1e-6)


def _set(fields: dict[str, Any], at: tuple[str, ...], value: Any) -> None:
    for name in at[:-1]:
        fields = fields.setdefault(name, {})
    fields[at[-1]] = value
