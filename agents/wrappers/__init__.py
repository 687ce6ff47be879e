"""Action wrappers: what the actions of a learner mean, and what it sees. One file each; here the registry.

A false track needs the same phantom reported frame after frame, which exploration with raw actions hardly
ever does: a policy that draws its actions reports another place in every frame. A wrapper keeps the phantoms
where they are, and the learner places, steers and withdraws them.

Damage per frame on `patrol` at knowledge level `own` after 1,000,000 steps (a minute), seeds 0 and 1,
where the worst scripted attack does 4.34 and 1.93, and at level `poses` 4.34 and 4.33:

    wrapper     against score    against trust
    raw         1.07, 1.03       1.39, 1.32
    phantoms    8.17, 8.13       6.79, 6.65
    grid        8.87, 8.79       6.85, 7.20

`python -m trust_env.training.learning.compare_wrappers --out FOLDER` repeats it; the numbers lie beside it.
What raised the damage most (one seed, 400,000 steps against trust): phantoms that stay where they appear,
instead of following where the learner points: grid 4.07 -> 6.52, phantoms 2.07 -> 5.38. With phantoms that
follow, after twice as many steps: grid 2.75 in the area's frame, 4.85 in the outward one with normalised
observations.
"""

from __future__ import annotations

from typing import Any

from trust_env.agents.parameters import construct
from trust_env.agents.wrappers.by_need import ByNeed
from trust_env.agents.wrappers.grid import Grid
from trust_env.agents.wrappers.phantoms import Phantoms
from trust_env.agents.wrappers.raw import Raw
from trust_env.agents.wrappers.wrapper import ActionWrapper
from trust_env.errors import unknown_name
from trust_env.spec import parse

WRAPPERS: dict[str, type[ActionWrapper]] = {"raw": Raw, "phantoms": Phantoms, "grid": Grid, "by_need": ByNeed}
DEFAULT_WRAPPER = "by_need"

__all__ = ["DEFAULT_WRAPPER", "WRAPPERS", "ActionWrapper", "build_wrapper"]


def build_wrapper(wrapper: Any = DEFAULT_WRAPPER) -> ActionWrapper:
    """A wrapper from its name, `phantoms(n=2)`, or an object that is one.

    Raises ValueError for an unknown name or a parameter that does not fit, TypeError for what is no wrapper.
    """
    if isinstance(wrapper, str):
        spec = parse(wrapper)
        if spec.path is not None or spec.name not in WRAPPERS:
            raise unknown_name("wrapper", spec.name if spec.path is None else wrapper, WRAPPERS)
        wrapper = construct("wrapper", spec.name, WRAPPERS[spec.name], spec.params)
    if not isinstance(wrapper, ActionWrapper):
        known = ", ".join(WRAPPERS)
        raise TypeError(f"a wrapper is a name ({known}) or an `ActionWrapper`; got {wrapper!r}")
    return wrapper
