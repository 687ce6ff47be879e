"""A user's verdict, checked and written into the worlds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.defenses.base import Evidence, Verdict, fits_publication
from trust_env.world.tracking.score import CONFIRMED


def apply_verdict(defense: Any, verdict: Any, evidence: Evidence, arrays: Mapping[str, np.ndarray]) -> None:
    """Write what a defense's `update` returned into `arrays`, with what it leaves out filled in.

    TypeError for what is no verdict; ValueError, naming the defense and the field, for arrays of a wrong shape
    or numbers outside [0, 1].
    """
    name = type(defense).__name__
    if not isinstance(verdict, Verdict):
        found = type(verdict).__name__
        raise TypeError(f"{name}.update must return a trust_env.Verdict, not {found}")
    for field in ("track_trust", "track_trust_var", "agent_trust", "agent_trust_var"):
        value = getattr(verdict, field)
        if value is not None:
            arrays[field][...] = _checked(name, field, value, arrays[field].shape, probabilities=True)
    if verdict.keep is not None:
        arrays["keep"][...] = _checked(name, "keep", verdict.keep, arrays["keep"].shape).astype(bool)
    kept = evidence.confirmed | ((evidence.status == CONFIRMED) & arrays["keep"])
    publish = verdict.publish
    if publish is None:
        publish = fits_publication(kept, arrays["track_trust"])
    arrays["publish"][...] = _checked(name, "publish", publish, kept.shape).astype(bool) & kept
    weight = arrays["agent_trust"] if verdict.agent_weight is None else verdict.agent_weight
    weight = _checked(name, "agent_weight", weight, arrays["agent_weight"].shape, probabilities=True)
    arrays["agent_weight"][...] = np.nan_to_num(weight, nan=1.0)


def _checked(defense: str, field: str, value: Any, shape: tuple[int, ...], probabilities: bool = False) -> np.ndarray:
    what = f"{defense}: {field}"
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{what} must be an array of shape {list(shape)}: {error}") from None
    if array.shape != shape:
        axes = "agents" if field.startswith("agent") else "tracks"
        raise ValueError(f"{what} must have shape {list(shape)} (worlds, {axes}), not {list(array.shape)}")
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{what} must hold numbers or truth values, not {array.dtype}")
    fits = np.isnan(array) | ((array >= 0.0) & (array <= 1.0))
    if probabilities and not fits.all():
        raise ValueError(f"{what} must lie in [0, 1] (NaN: no opinion); found {array[~fits][0]}")
    return array
