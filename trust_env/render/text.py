"""`ansi`: the map as characters, and the same numbers as beside the image."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trust_env.render.scene import Agent, Scene, Track, read_scene

if TYPE_CHECKING:
    from trust_env.parallel import TrustEnv

COLUMNS, ROWS = 64, 30  # characters are about twice as high as wide
_BAR = 20
_TRACK_SIGNS = {"published": "#", "hidden": "%", "tentative": "~"}
_DETECTION_SIGNS = {"honest": "'", "clutter": ":", "injected": "x"}
_LEGEND = (
    "A adversary   B benign agent   o target in the picture   ? missing from it   . in no FOV",
    "# track published   ! published but false   % hidden by the defense   ~ tentative",
    "' detection   : clutter   x injected",
)


class TextRenderer:
    """Draws the present frame as text."""

    def __init__(self, env: TrustEnv):
        self._env = env

    def draw(self) -> str:
        scene = read_scene(self._env)
        return "\n".join([*_head(scene), *_map(scene), *_LEGEND, "", *_agents(scene), *_tracks(scene)]) + "\n"

    def close(self) -> None:
        """Nothing to give back."""


def _head(scene: Scene) -> list[str]:
    m = scene.metrics
    return [
        f"{scene.scenario}, defense {scene.defense}: frame {scene.frame} of {scene.horizon}"
        f" ({scene.frame * scene.dt:.5g} s)",
        f"picture {m['published_tracks']:g}, false {m['false_tracks']:g} (injected {m['injected_tracks']:g}),"
        f" missing {m['missing_targets']:g} of {m['visible_targets']:g}",
    ]


def _map(scene: Scene) -> list[str]:
    """Later signs lie above earlier ones."""
    cells = np.full((ROWS, COLUMNS), " ")
    signs = [(d.position, _DETECTION_SIGNS[d.kind]) for d in scene.detections if d.kind != "injected"]
    signs += [(t.position, _TRACK_SIGNS[t.kind] if not t.false else "!") for t in scene.tracks]
    signs += [(t.position, "o" if t.shown else "?" if t.visible else ".") for t in scene.targets]
    signs += [(d.position, _DETECTION_SIGNS[d.kind]) for d in scene.detections if d.kind == "injected"]
    signs += [(a.position, "A" if a.adversary else "B") for a in scene.agents]
    for position, sign in signs:
        row, column = _cell(scene.extent, position)
        if 0 <= row < ROWS and 0 <= column < COLUMNS:
            cells[row, column] = sign
    edge = "+" + "-" * COLUMNS + "+"
    return [edge, *("|" + "".join(line) + "|" for line in cells), edge]


def _cell(extent: tuple[float, float, float, float], position: np.ndarray) -> tuple[int, int]:
    x0, x1, y0, y1 = extent
    metres = max((x1 - x0) / COLUMNS, (y1 - y0) / ROWS / 2)  # of a column; a row is twice as much
    column = COLUMNS / 2 + (position[0] - (x0 + x1) / 2) / metres
    row = ROWS / 2 - (position[1] - (y0 + y1) / 2) / (2 * metres)
    return math.floor(row), math.floor(column)


def _agents(scene: Scene) -> list[str]:
    width = max(len(agent.name) for agent in scene.agents)
    reports = [(0, 0)] * len(scene.agents)
    for detection in scene.detections:
        honest, injected = reports[detection.agent]
        fake = detection.kind == "injected"
        reports[detection.agent] = (honest + (not fake), injected + fake)
    return [f"{'agent':{width}}  trust  {'':{_BAR}}  detections  injected"] + [
        f"{agent.name:{width}}  {_number(agent.trust)}  {_bar(agent)}  {honest:10d}  {injected:8d}"
        for agent, (honest, injected) in zip(scene.agents, reports, strict=True)
    ]


def _bar(agent: Agent) -> str:
    if math.isnan(agent.trust):
        return f"{'no opinion':{_BAR}}"
    return f"{'=' * round(_BAR * agent.trust):.<{_BAR}}"


def _tracks(scene: Scene) -> list[str]:
    confirmed = sorted((t for t in scene.tracks if t.kind != "tentative"), key=lambda track: track.id)
    if not confirmed:
        return []
    return ["", "track  trust  picture          x          y", *(_track(track) for track in confirmed)]


def _track(track: Track) -> str:
    shown = ("false" if track.false else "shown") if track.kind == "published" else "hidden"
    x, y = track.position
    return f"{track.id:5d}  {_number(track.trust)}  {shown:7}  {x:9.5g}  {y:9.5g}"


def _number(trust: float) -> str:
    return "    –" if math.isnan(trust) else f"{trust:5.2f}"
