"""How kernels run here: which compiler there is, and what it is asked for."""

from __future__ import annotations

import re
from typing import Any

import numba
from numba.core import config

CONFIG: Any = config
INTERPRETED = bool(CONFIG.DISABLE_JIT)  # NUMBA_DISABLE_JIT=1: as plain Python
CHECKED = bool(CONFIG.BOUNDSCHECK) and not INTERPRETED  # NUMBA_BOUNDSCHECK=1: every index is checked

# The versions of Numba whose private parts `kernels` and `entry` know. On others kernels are compiled by plain
# `numba.njit`, at every start and more slowly, and give the same numbers.
OLDEST_KNOWN, NEWEST_KNOWN = (0, 62), (0, 68)
_VERSION = tuple(int(number) for number in re.findall(r"\d+", numba.__version__)[:2])
KNOWN = OLDEST_KNOWN <= _VERSION <= NEWEST_KNOWN
PLAIN = not KNOWN and not INTERPRETED

# Of fast-math only what keeps `isnan` and the order of sums (fused multiply-add, reciprocals); no Python errors
# inside; the interpreter's lock is released.
OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "arcp"},
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "_nrt": False,
}


def unknown_version() -> str:
    """What to say of a Numba whose private parts are not known; empty where they are."""
    if KNOWN or INTERPRETED:
        return ""
    known = " to ".join(f"{major}.{minor}" for major, minor in (OLDEST_KNOWN, NEWEST_KNOWN))
    return f"Numba {numba.__version__} is none of those known here ({known}): compiling takes longer, at every start"
