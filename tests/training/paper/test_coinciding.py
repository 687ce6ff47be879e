"""Figures of the paper: curves that coincide can all be seen, and the figures say what their symbols are."""

import numpy as np
import pytest

from trust_env.training.paper.coinciding import draw_lines, turns

pytestmark = pytest.mark.extra("plot")

RED, BLUE = "#ff0000", "#0000ff"


def test_curves_that_are_near_one_another_everywhere_take_turns():
    rising = np.linspace(0.0, 1.0, 5)
    curves = np.array([rising, np.full(5, 0.5), rising + 0.002, [np.nan, *rising[1:]], rising[::-1]])
    assert turns(curves, height=1.0) == [(0, 3), (0, 1), (1, 3), (2, 3), (0, 1)]
    assert turns(curves + 0.05 * np.eye(5)[:, 2:3], height=1.0)[2] == (0, 1)
    assert turns(np.array([[9.0, 1.0], [20.0, 1.0]]), height=8.0) == [(0, 2), (1, 2)]  # what the axis cuts off


@pytest.mark.parametrize(("second", "least"), [(0.5, 0.35), (0.7, 0.45)])
def test_both_of_two_curves_show_whether_or_not_they_coincide(second, least):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4, 3))
    axis = figure.add_axes((0, 0, 1, 1))
    axis.set(xlim=(0, 1), ylim=(0, 1))
    axis.set_axis_off()
    draw_lines(axis, np.array([0.0, 1.0]), np.array([[0.5, 0.5], [second, second]]), ["a", "b"], [RED, BLUE], 1.0)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba()).astype(int)
    red = ((image[..., 0] > 200) & (image[..., 2] < 80)).sum()
    blue = ((image[..., 2] > 200) & (image[..., 0] < 80)).sum()
    assert min(red, blue) / (red + blue) > least


def test_figures_of_the_theorem_say_what_eta_is():
    from trust_env.training.paper.surface_figure import surface_figure
    from trust_env.training.paper.theorem import TheoremRow
    from trust_env.training.paper.theorem_figure import theorem_figure

    teams = [(a, b, order) for a in (1, 2, 3) for b in range(7) for order in ("first", "last")]
    rows = [TheoremRow(*team, 2.0, 3.0, 3.0, 3.0, 3.0, "none", 0.0) for team in teams]
    for figure in (theorem_figure(rows), surface_figure(rows)):
        assert "dimension of a measurement" in figure.get_supxlabel()
        assert [rf"\eta = {n}" in axis.get_title() for axis, n in zip(figure.axes, (3, 2))] == [True, True]
