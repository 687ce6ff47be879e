"""Action wrappers: what the actions of a learner mean, and what it sees. One file each; here the registry.

A false track needs the same phantom reported frame after frame, which exploration with raw actions hardly
ever does: a policy that draws its actions reports another place in every frame. A wrapper keeps the phantoms
where they are, and the learner places, steers and withdraws them.

Damage per frame on `patrol` at knowledge level `own` after 500,000 steps (half a minute), seeds 0 and 1:

    wrapper     against score    against trust
    raw         1.05, 1.06       1.44, 1.31
    phantoms    8.14, 8.18       6.44, 6.49
    grid        8.85, 8.89       6.72, 7.34
    by_need     12.2, 12.1       12.1, 12.2

`python -m trust_env.training.learning.compare_wrappers --out FOLDER` repeats it; the numbers lie beside it.
What raised the damage most:

- phantoms that stay where they appear, instead of following where the learner points (400,000 steps against
  trust, one seed: grid 4.07 -> 6.52, phantoms 2.07 -> 5.38);
- more phantoms than slots, each reported only when its track needs it: by_need;
- episodes of 40 frames in training: once all phantoms are placed, nothing that is chosen changes much (at level
  `poses` against score, 230,000 steps, one seed: by_need 9.1 -> 11.8);
- one choice for who may see new phantoms, instead of learning for every cell of the grid who sees it (at level
  `poses` against trust, 230,000 steps, one seed: by_need 9.2 -> 13.3).
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
