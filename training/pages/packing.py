"""Numbers packed into a page: arrays as small integers, compressed, in base64; `unpack.js` reads them."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from typing import Any

import numpy as np

ABSENT = 65535  # of a quantised array: NaN
_STEPS = ABSENT - 1


def pack(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """`fields` (name, type, length, lowest value, step) and `data`, the bytes of all fields, one after the other.

    Integers become the least unsigned type that holds them and stay exact. Floats are quantised to 65535 values from
    their least to their greatest, so that what is read is off by (greatest - least) / 131068 at most; NaN stays NaN.
    Shapes are not kept. ValueError: a negative integer, or an infinite number.
    """
    packed = {name: _packed(name, np.asarray(array).ravel()) for name, array in arrays.items()}
    ordered = sorted(packed.items(), key=lambda item: -item[1][0].itemsize)  # so that each begins at a whole number
    fields = [[name, a.dtype.name, len(a), low, step] for name, (a, low, step) in ordered]
    return {"fields": fields, "data": compressed(b"".join(a.tobytes() for _, (a, _, _) in ordered))}


def _packed(name: str, values: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Integers, and what gives the values: low + step * integer; step 0: the integers themselves."""
    if values.dtype.kind in "biu":
        if values.size and values.min() < 0:
            raise ValueError(f"{name}: expected no negative integer; got {values.min()}")
        return values.astype(np.min_scalar_type(int(values.max(initial=0))), copy=False), 0.0, 0.0
    if np.isinf(values).any():
        raise ValueError(f"{name}: expected finite numbers or NaN")
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    step = (high - low) / _STEPS or 1.0
    steps = np.where(np.isnan(values), ABSENT, np.rint((values - low) / step))
    return steps.astype(np.uint16), low, step


def compressed(data: bytes) -> str:
    """Bytes as gzip in base64; equal bytes give equal text."""
    return base64.b64encode(gzip.compress(data, compresslevel=9, mtime=0)).decode("ascii")
