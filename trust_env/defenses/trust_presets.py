"""The switches of the trust estimator, and the three presets: the paper's text, the code that drew its
figures, the authors' later library.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from trust_env.errors import unknown_name

ORDERS = {"tracks_first": 0, "agents_first": 1}
AGENT_TRACKS = {
    "all": 0,
    "previous": 1,
}  # judge agents on all tracks, or on those known in the previous frame
PSMS = {"all": 0, "least": 1}  # all agent PSMs of a frame, or the one of least value
FORGETTING = {"decay": 0, "prior": 1, "return": 2, "none": 3}
CONFIDENCES = {"variance": 0, "deviation": 1}
PSM_WEIGHTS = {"none": 0, "mate": 1}
_CHOICES = {
    "order": ORDERS,
    "agent_tracks": AGENT_TRACKS,
    "agent_psms": PSMS,
    "track_forgetting": FORGETTING,
    "agent_forgetting": FORGETTING,
    "agent_confidence": CONFIDENCES,
    "psm_weights": PSM_WEIGHTS,
}

_PAPER: dict[str, Any] = {
    "order": "tracks_first",
    "agent_tracks": "all",
    "agent_psms": "all",
    "track_forgetting": "decay",  # λ ← max(λ_prior, (1 - epsilon) λ), the mean stays
    "agent_forgetting": "decay",
    "epsilon": 0.01,
    "prior_rate": 0.2,  # forgetting `prior`: (α, β) ← (1 - rate) (α, β) + rate prior
    "dt_return": 10.0,  # forgetting `return`: toward Beta(0.5, 0.5), completely after this many seconds
    "agent_confidence": "variance",  # 1 - Var; `deviation`: clip(w (1 - 2 std), 1e-4, 0.9999)
    "psm_weights": "none",
    "held_outside_fov": False,  # also judge an agent on tracks that it holds outside its FOV
    "agent_negativity_bias": None,
    "track_negativity_bias": None,
    "negativity_threshold": 0.4,
    "agent_prior": (0.5, 1.0),
    "track_prior": (0.5, 1.0),
    "strong_precision": 10.0,
    "agent_priors": {},
    "trusted": (),
    "distrusted": (),
}

PRESETS: dict[str, dict[str, Any]] = {
    "paper": _PAPER,
    "cdc2024": _PAPER
    | {
        "order": "agents_first",
        "agent_tracks": "previous",
        "agent_psms": "least",
        "track_forgetting": "prior",
        "agent_forgetting": "none",
        "held_outside_fov": True,
        "strong_precision": 100.0,
    },
    "mate": _PAPER
    | {
        "order": "agents_first",
        "track_forgetting": "return",
        "agent_forgetting": "return",
        "agent_confidence": "deviation",
        "psm_weights": "mate",
        "held_outside_fov": True,
        "agent_negativity_bias": 4.0,
    },
}


def check_switches(preset: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The preset with the given switches put in. ValueError names what is unknown or out of range."""
    if preset not in PRESETS:
        raise unknown_name("trust preset", preset, PRESETS)
    for name in given:
        if name not in _PAPER:
            raise unknown_name("switch of trust", name, _PAPER)
    switches = PRESETS[preset] | dict(given)
    for name, choices in _CHOICES.items():
        if switches[name] not in choices:
            raise unknown_name(f"value of trust's {name}", switches[name], choices)
    for name in ("agent_prior", "track_prior"):
        _check_prior(name, switches[name])
    if not isinstance(switches["agent_priors"], Mapping):
        raise ValueError(
            "trust: agent_priors must map agent indices to (mean, precision), "
            f"not {switches['agent_priors']!r}"
        )
    for k, prior in switches["agent_priors"].items():
        _check_prior(f"agent_priors[{k}]", prior)
    for name in ("trusted", "distrusted"):
        if not isinstance(switches[name], (list, tuple)):
            raise ValueError(f"trust: {name} must be a list of agent indices, not {switches[name]!r}")
    _check_number("epsilon", switches["epsilon"], 0.0, 1.0)
    _check_number("prior_rate", switches["prior_rate"], 0.0, 1.0)
    _check_number("negativity_threshold", switches["negativity_threshold"], 0.0, 1.0)
    for name in ("dt_return", "strong_precision", "agent_negativity_bias", "track_negativity_bias"):
        if switches[name] is not None:
            _check_number(name, switches[name], 0.0, math.inf, open_low=True)
    return switches


def _check_prior(name: str, prior: Any) -> None:
    expected = "(mean, precision) with 0 < mean < 1 and precision > 0"
    if (
        not isinstance(prior, (list, tuple))
        or len(prior) != 2
        or not all(isinstance(v, (int, float)) for v in prior)
    ):
        raise ValueError(f"trust: {name} must be {expected}, not {prior!r}")
    if not (0.0 < prior[0] < 1.0 and 0.0 < prior[1] < math.inf):
        raise ValueError(f"trust: {name} must be {expected}, not {prior!r}")


def _check_number(name: str, value: Any, low: float, high: float, open_low: bool = False) -> None:
    fine = (
        isinstance(value, (int, float))
        and low <= value <= high
        and not (open_low and value == low)
        and value != math.inf
    )
    if not fine:
        raise ValueError(
            f"trust: {name} must be a number {'above' if open_low else 'from'} {low:g}"
            f"{'' if high == math.inf else f' to {high:g}'}, not {value!r}"
        )
