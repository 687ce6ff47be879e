"""Action views: what the actions of a learner mean, and what it sees. One file per view; here the registry.

A false track needs the same phantom reported frame after frame, which raw actions make a needle in a
haystack: a policy that draws its actions reports another place in every frame. A view keeps the phantoms, and
the learner says what becomes of them.

Damage per frame on `patrol` at knowledge level `own` after 1,000,000 steps (a minute), seeds 0 and 1,
where the worst scripted attack does 4.34 and 1.93, and at level `poses` 4.34 and 4.33:

    view        against score    against trust
    raw         1.07, 1.03       1.39, 1.32
    phantoms    8.17, 8.13       6.79, 6.65
    grid        8.87, 8.79       6.85, 7.20

`python -m trust_env.training.learning.compare_wrappers --out FOLDER` repeats it; the numbers lie beside it.
What made the difference, one seed of 400,000 steps against trust, before -> after: phantoms that follow where
the learner points -> that stay where they appear, grid 4.07 -> 6.52, phantoms 2.07 -> 5.38 (pointing matters
when a phantom appears and hardly later, so that nothing taught those that were there where to stay). Twice
that many steps with phantoms that follow: grid 2.75 in the area's frame, 4.85 in the outward one and with
normalised observations.
"""

from __future__ import annotations

from typing import Any

from trust_env.agents.parameters import made
from trust_env.agents.wrappers.grid import Grid
from trust_env.agents.wrappers.phantoms import Phantoms
from trust_env.agents.wrappers.raw import Raw
from trust_env.agents.wrappers.wrapper import View
from trust_env.errors import unknown_name
from trust_env.spec import parse

VIEWS: dict[str, type[View]] = {"raw": Raw, "phantoms": Phantoms, "grid": Grid}
DEFAULT_VIEW = "grid"

__all__ = ["DEFAULT_VIEW", "VIEWS", "View", "build_view"]


def build_view(view: Any = DEFAULT_VIEW) -> View:
    """A view from its name, `phantoms(n=2)`, or an object that is one.

    Raises ValueError for an unknown name or a parameter that does not fit, TypeError for what is no view.
    """
    if isinstance(view, str):
        spec = parse(view)
        if spec.path is not None or spec.name not in VIEWS:
            raise unknown_name("view", spec.name if spec.path is None else view, VIEWS)
        view = made("view", spec.name, VIEWS[spec.name], spec.params)
    if not isinstance(view, View):
        raise TypeError(f"a view is a name ({', '.join(VIEWS)}) or a `View`; got {view!r}")
    return view
