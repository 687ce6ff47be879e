"""The switches of the trust estimator, each with its value in the three presets: the paper's text, the code that
drew its figures, the authors' later library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from trust_env.errors import unknown_name

# The numbers of names in kernels.
TRACKS_FIRST, AGENTS_FIRST = range(2)
ALL_TRACKS, PREVIOUS_TRACKS = range(2)
ALL_PSMS, LEAST_PSM = range(2)
DECAY, TOWARD_PRIOR, RETURN, NO_FORGETTING = range(4)
BY_VARIANCE, BY_DEVIATION = range(2)
UNWEIGHTED, BY_VIEW = range(2)


class Switch(NamedTuple):
    """A switch: its values by preset (paper, cdc2024, mate), and what they may be.

    choices: names, whose places are their numbers; check: raises ValueError for what is no value.
    """

    paper: Any
    cdc2024: Any
    mate: Any
    choices: tuple[str, ...] = ()
    check: Callable[[str, Any], None] | None = None


def _number(low: float, high: float = math.inf, above: bool = False, optional: bool = False) -> Any:
    def check(name: str, value: Any) -> None:
        if optional and value is None:
            return
        number = isinstance(value, (int, float)) and low <= value <= high and value != math.inf
        if not number or (above and value == low):
            limit = "" if high == math.inf else f" to {high:g}"
            expected = f"a number {'above' if above else 'from'} {low:g}{limit}"
            raise ValueError(f"trust: {name} must be {expected}, not {value!r}")

    return check


def _check_prior(name: str, prior: Any) -> None:
    pair = isinstance(prior, (list, tuple)) and len(prior) == 2
    if (
        not pair
        or not all(isinstance(v, (int, float)) for v in prior)
        or not (0.0 < prior[0] < 1.0 and 0.0 < prior[1] < math.inf)
    ):
        expected = "(mean, precision) with 0 < mean < 1 and precision > 0"
        raise ValueError(f"trust: {name} must be {expected}, not {prior!r}")


def _check_priors(name: str, priors: Any, keys: str = "agent indices") -> None:
    if not isinstance(priors, Mapping):
        raise ValueError(f"trust: {name} must map {keys} to (mean, precision), not {priors!r}")
    for k, prior in priors.items():
        _check_prior(f"{name}[{k}]", prior)


def _check_track_priors(name: str, priors: Any) -> None:
    _check_priors(name, priors, "track ids")
    for i in priors:
        if isinstance(i, bool) or not isinstance(i, int) or i < 0:
            raise ValueError(f"trust: {name} must map track ids, whole numbers from 0, to priors, not {i!r}")


def _check_indices(name: str, indices: Any) -> None:
    if not isinstance(indices, (list, tuple)):
        raise ValueError(f"trust: {name} must be a list of agent indices, not {indices!r}")


_FORGETTING = ("decay", "prior", "return", "none")
SWITCHES = {
    "order": Switch("tracks_first", "agents_first", "agents_first", choices=("tracks_first", "agents_first")),
    # agents are judged on all tracks, or on those that were known in the frame before
    "agent_tracks": Switch("all", "previous", "all", choices=("all", "previous")),
    # with all pseudomeasurements (PSMs) of a frame, or the one of least value
    "agent_psms": Switch("all", "least", "all", choices=("all", "least")),
    # decay: λ ← max(λ_prior, (1 - epsilon) λ), the mean stays; prior: (α, β) ← (1 - prior_rate) (α, β) +
    # prior_rate prior; return: toward Beta(0.5, 0.5), completely after dt_return seconds
    "track_forgetting": Switch("decay", "prior", "return", choices=_FORGETTING),
    "agent_forgetting": Switch("decay", "none", "return", choices=_FORGETTING),
    "epsilon": Switch(0.01, 0.01, 0.01, check=_number(0.0, 1.0)),
    "prior_rate": Switch(0.2, 0.2, 0.2, check=_number(0.0, 1.0)),
    "dt_return": Switch(10.0, 10.0, 10.0, check=_number(0.0, above=True, optional=True)),
    # variance: 1 - Var; deviation: clip(w (1 - 2 std), 1e-4, 0.9999)
    "agent_confidence": Switch("variance", "variance", "deviation", choices=("variance", "deviation")),
    # mate: a miss weighs w_fov w_dist w_age
    "psm_weights": Switch("none", "none", "mate", choices=("none", "mate")),
    # whether an agent is also judged on tracks that it holds outside its FOV
    "held_outside_fov": Switch(False, True, True),
    "agent_negativity_bias": Switch(None, None, 4.0, check=_number(0.0, above=True, optional=True)),
    "track_negativity_bias": Switch(None, None, None, check=_number(0.0, above=True, optional=True)),
    "negativity_threshold": Switch(0.4, 0.4, 0.4, check=_number(0.0, 1.0)),
    # priors are (mean, precision)
    "agent_prior": Switch((0.5, 1.0), (0.5, 1.0), (0.5, 1.0), check=_check_prior),
    "track_prior": Switch((0.5, 1.0), (0.5, 1.0), (0.5, 1.0), check=_check_prior),
    "strong_precision": Switch(10.0, 100.0, 10.0, check=_number(0.0, above=True, optional=True)),
    "agent_priors": Switch({}, {}, {}, check=_check_priors),
    "track_priors": Switch({}, {}, {}, check=_check_track_priors),
    # how many times likelier a false positive is, a priori, than a false negative, where agents contradict one another
    "false_positive_odds": Switch(1.0, 1.0, 1.0, check=_number(0.0, above=True)),
    "trusted": Switch((), (), (), check=_check_indices),
    "distrusted": Switch((), (), (), check=_check_indices),
}

NUMBERS = tuple(n for n, switch in SWITCHES.items() if not isinstance(switch.paper, (tuple, dict)))
"""The switches that are names or numbers."""
PRESETS: dict[str, dict[str, Any]] = {
    preset: {name: getattr(switch, preset) for name, switch in SWITCHES.items()}
    for preset in ("paper", "cdc2024", "mate")
}
DEFAULT_PRESET = next(iter(PRESETS))


def check_switches(preset: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The preset with the given switches put in. ValueError names what is unknown or out of range."""
    if preset not in PRESETS:
        raise unknown_name("trust preset", preset, PRESETS)
    for name in given:
        if name not in SWITCHES:
            raise unknown_name("switch of trust", name, SWITCHES)
    values = PRESETS[preset] | dict(given)
    for name, switch in SWITCHES.items():
        if switch.choices and values[name] not in switch.choices:
            raise unknown_name(f"value of trust's {name}", values[name], switch.choices)
        if switch.check is not None:
            switch.check(name, values[name])
    return values


def as_number(name: str, value: Any) -> float:
    """A switch's value as kernels read it: the place of a name, 0 for none."""
    choices = SWITCHES[name].choices
    return float(choices.index(value)) if choices else float(value or 0.0)
