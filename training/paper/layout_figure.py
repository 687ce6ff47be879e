"""The figure of the cases' layout: agents, their FOVs, targets, and what the adversaries report or hide."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trust_env.scenario import load_scenario
from trust_env.training.paper.panel_figure import AGENT_COLOURS
from trust_env.training.paper.published import CASES, SUPPRESSED, TrackedObject, objects

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS = {"true": ("o", "target"), "fp": ("X", "false positive"), "hidden": ("D", "hidden target")}
_GREY = "#4b5563"


def layout_figure() -> Figure:
    """The paper's cases, and the same with suppressions; adversaries are named, and colour what they do."""
    from matplotlib.figure import Figure

    cases = [*CASES, *(case + SUPPRESSED for case in CASES)]
    figure = Figure(figsize=(14.0, 3.7), layout="constrained")
    axes = figure.subplots(1, len(cases), sharex=True, sharey=True)
    figure.suptitle("The cases: agents, their fields of view, targets, false positives, hidden targets")
    for axis, case in zip(axes, cases, strict=True):
        _draw_case(axis, case)
        axis.set(title=case, aspect="equal", xlabel="x, m")
    axes[0].set_ylabel("y, m")
    for kind, (mark, label) in _MARKS.items():
        axes[-1].plot([], [], mark, color=_GREY, mfc="none" if kind == "hidden" else _GREY, label=label)
    axes[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _draw_case(axis: Axes, case: str) -> None:
    from matplotlib.patches import Circle

    scenario = load_scenario(case)
    for k, colour in enumerate(AGENT_COLOURS):
        agent = scenario.agent(k)
        x, y = agent.position or (0.0, 0.0)
        axis.add_patch(Circle((x, y), scenario.fov.radius, fc=colour, ec=colour, alpha=0.09))
        axis.plot(x, y, "^", ms=9, color=colour)
        name = f"agent {k}" + (", adversary" if agent.role == "adversary" else "")
        above = 8 if y > 0 else -13
        axis.annotate(name, (x, y), xytext=(0, above), textcoords="offset points", ha="center", fontsize=7)
    for obj in objects(case):
        _draw_object(axis, obj)
    axis.autoscale_view()


def _draw_object(axis: Axes, obj: TrackedObject) -> None:
    """In grey, or in the colour of the adversary that reports it or hides it."""
    mark = _MARKS[obj.kind][0]
    liars = {"true": (), "fp": obj.detected_by, "hidden": tuple(k for k in obj.in_fov_of if k not in obj.detected_by)}
    colour = AGENT_COLOURS[liars[obj.kind][0]] if liars[obj.kind] else _GREY
    axis.plot(*obj.position, mark, ms=6, color=colour, mfc="none" if obj.kind == "hidden" else colour)
