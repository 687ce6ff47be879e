"""A user's verdict, checked and written into the worlds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trust_env.defenses.base import Verdict, fits_publication
from trust_env.defenses.evidence import Evidence
from trust_env.user_code import source_of
from trust_env.world.tracking.score import CONFIRMED


def apply_verdict(defense: Any, verdict: Any, evidence: Evidence, arrays: Mapping[str, np.ndarray]) -> None:
    """Write what a defense's `update` returned into `arrays`, with what it leaves out filled in.

    ValueError, naming the defense with its file, for what is no verdict, and with the field for an array of a
    wrong shape or a number outside [0, 1].
    """
    if not isinstance(verdict, Verdict):
        raise ValueError(f"{source_of(defense)}.update must return a trust_env.Verdict, not {_described(verdict)}")
    for field in ("track_trust", "track_trust_var", "agent_trust", "agent_trust_var"):
        value = getattr(verdict, field)
        if value is not None:
            arrays[field][...] = _checked(defense, field, value, arrays[field].shape, probabilities=True)
    if verdict.keep is not None:
        arrays["keep"][...] = _checked(defense, "keep", verdict.keep, arrays["keep"].shape).astype(bool)
    kept = evidence.confirmed | ((evidence.status == CONFIRMED) & arrays["keep"])
    publish = verdict.publish
    if publish is None:
        publish = fits_publication(kept, arrays["track_trust"])
    arrays["publish"][...] = _checked(defense, "publish", publish, kept.shape).astype(bool) & kept
    weight = arrays["agent_trust"] if verdict.agent_weight is None else verdict.agent_weight
    weight = _checked(defense, "agent_weight", weight, arrays["agent_weight"].shape, probabilities=True)
    arrays["agent_weight"][...] = np.nan_to_num(weight, nan=1.0)


def _described(verdict: Any) -> str:
    """What was returned instead: its type, of an array the shape too."""
    if isinstance(verdict, type):
        return f"the class {verdict.__name__}"
    return f"an array of shape {list(verdict.shape)}" if isinstance(verdict, np.ndarray) else type(verdict).__name__


def _checked(defense: Any, field: str, value: Any, shape: tuple[int, ...], probabilities: bool = False) -> np.ndarray:
    def invalid(fault: str) -> ValueError:
        return ValueError(f"{source_of(defense)}: {field} must {fault}")

    try:
        array = np.asarray(value)
    except Exception as error:
        raise invalid(f"be an array of shape {list(shape)}: {error}") from error
    if array.shape != shape:
        axes = "agents" if field.startswith("agent") else "tracks"
        raise invalid(f"have shape {list(shape)} (worlds, {axes}), not {list(array.shape)}")
    if array.dtype.kind not in "fiub":
        raise invalid(f"hold numbers or truth values, not {array.dtype}")
    fits = np.isnan(array) | ((array >= 0.0) & (array <= 1.0))
    if probabilities and not fits.all():
        raise invalid(f"lie in [0, 1] (NaN: no opinion); found {array[~fits][0]}")
    return array
