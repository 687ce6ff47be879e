"""`ansi`: the map as characters, and the numbers that stand beside the image."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trust_env.render.scene import Agent, Extent, Scene, Track, read_scene

if TYPE_CHECKING:
    from trust_env.batch import Batch

COLUMNS, ROWS = 64, 30  # characters are about twice as high as wide
_BAR_WIDTH = 20
_TRACK_CHARACTERS = {"published": "#", "hidden": "%", "tentative": "~"}
_DETECTION_CHARACTERS = {"honest": "'", "clutter": ":", "injected": "x"}
_LEGEND = (
    "A adversary   B benign agent   o target in the picture   ? missing from it   . in no FOV",
    "# track published   ! published but false   % hidden by the defense   ~ tentative",
    "' detection   : clutter   x injected",
)


class TextRenderer:
    """Draws the present frame as text."""

    def __init__(self, worlds: Batch):
        self._worlds = worlds

    def draw(self) -> str:
        scene = read_scene(self._worlds)
        lines = [*_head(scene), *_map(scene), *_LEGEND, "", *_agent_table(scene), *_track_table(scene)]
        return "\n".join(lines) + "\n"

    def close(self) -> None:
        """Nothing to release."""


def _head(scene: Scene) -> list[str]:
    m = scene.metrics
    return [
        f"{scene.scenario}, defense {scene.defense}: frame {scene.frame} of {scene.horizon}"
        f" ({scene.frame * scene.dt:.5g} s)",
        f"picture {m['published_tracks']:g}, false {m['false_tracks']:g} (injected {m['injected_tracks']:g}),"
        f" missing {m['missing_targets']:g} of {m['visible_targets']:g}",
    ]


def _map(scene: Scene) -> list[str]:
    """The framed map, a character per cell; the last one in a cell is shown."""
    cells = np.full((ROWS, COLUMNS), " ")
    for position, character in _characters(scene):
        row, column = _cell(scene.extent, position)
        if 0 <= row < ROWS and 0 <= column < COLUMNS:
            cells[row, column] = character
    edge = "+" + "-" * COLUMNS + "+"
    return [edge, *("|" + "".join(line) + "|" for line in cells), edge]


def _characters(scene: Scene) -> list[tuple[np.ndarray, str]]:
    """Position (m) and character of everything on the map, from the bottom to the top."""
    detections = [(d.position, _DETECTION_CHARACTERS[d.kind], d.kind == "injected") for d in scene.detections]
    return [
        *((position, character) for position, character, injected in detections if not injected),
        *((t.position, "!" if t.false else _TRACK_CHARACTERS[t.kind]) for t in scene.tracks),
        *((t.position, "o" if t.shown else "?" if t.visible else ".") for t in scene.targets),
        *((position, character) for position, character, injected in detections if injected),
        *((a.position, "A" if a.adversary else "B") for a in scene.agents),
    ]


def _cell(extent: Extent, position: np.ndarray) -> tuple[int, int]:
    """Row and column."""
    x_min, x_max, y_min, y_max = extent
    width = max((x_max - x_min) / COLUMNS, (y_max - y_min) / ROWS / 2)  # of a column, m; a row is twice as high
    column = COLUMNS / 2 + (position[0] - (x_min + x_max) / 2) / width
    row = ROWS / 2 - (position[1] - (y_min + y_max) / 2) / (2 * width)
    return math.floor(row), math.floor(column)


def _agent_table(scene: Scene) -> list[str]:
    """Per agent its trust and how many detections it reported, honest and injected."""
    width = max(len(agent.name) for agent in scene.agents)
    counts = [[0, 0] for _ in scene.agents]
    for detection in scene.detections:
        counts[detection.agent][detection.kind == "injected"] += 1
    return [f"{'agent':{width}}  trust  {'':{_BAR_WIDTH}}  detections  injected"] + [
        f"{agent.name:{width}}  {_format_trust(agent.trust)}  {_bar(agent)}  {honest:10d}  {injected:8d}"
        for agent, (honest, injected) in zip(scene.agents, counts, strict=True)
    ]


def _bar(agent: Agent) -> str:
    if math.isnan(agent.trust):
        return f"{'no opinion':{_BAR_WIDTH}}"
    return f"{'=' * round(_BAR_WIDTH * agent.trust):.<{_BAR_WIDTH}}"


def _track_table(scene: Scene) -> list[str]:
    """Per confirmed track its trust, whether it is published, and where it is; empty without any."""
    confirmed = sorted((t for t in scene.tracks if t.kind != "tentative"), key=lambda track: track.id)
    if not confirmed:
        return []
    return ["", "track  trust  picture          x          y", *(_track_row(track) for track in confirmed)]


def _track_row(track: Track) -> str:
    picture = ("false" if track.false else "shown") if track.kind == "published" else "hidden"
    x, y = track.position
    return f"{track.id:5d}  {_format_trust(track.trust)}  {picture:7}  {x:9.5g}  {y:9.5g}"


def _format_trust(trust: float) -> str:
    return "    –" if math.isnan(trust) else f"{trust:5.2f}"
