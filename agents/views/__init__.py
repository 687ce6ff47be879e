"""Action views: what the actions of a learner mean, and what it sees. One file per view; here the registry.

A false track needs the same phantom reported frame after frame, which raw actions make a needle in a
haystack: a policy that draws its actions reports another place in every frame. A view keeps the phantoms, and
the learner says what becomes of them.
"""

from __future__ import annotations

from typing import Any

from agents.parameters import made
from agents.views.grid import Grid
from agents.views.phantoms import Phantoms
from agents.views.raw import Raw
from agents.views.view import View
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
        raise TypeError(f"a view is a name ({', '.join(VIEWS)}) or an `agents.views.View`; got {view!r}")
    return view
