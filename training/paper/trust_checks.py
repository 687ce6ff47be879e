"""Checks of the paper's claims about trust, on the panels of a case: whether a claim holds, with numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from trust_env.training.paper.published import TRUSTED, Panel, PanelKey, TrackedObject, objects

DECIDED = 0.1  # a trust this far from 0.5 leans to one side
CLEAR = 0.02  # a smaller difference between two trusts is none
SETTLED, SOON = 0.1, 10  # a trust within 0.1 of its end has converged; 10 frames are 1 s, half an episode
EARLY = 4  # index of the fifth frame


@dataclass(frozen=True)
class Case:
    """The panels of one case, without the prior on agent 1 (False) and with it (True)."""

    name: str
    panels: Mapping[PanelKey, Panel]

    def curves(self, chosen: Callable[[TrackedObject], bool], trusted: bool) -> np.ndarray:
        """Trust in the tracks of the chosen objects, [tracks, T]."""
        rows = [j for j, obj in enumerate(objects(self.name)) if chosen(obj)]
        return self.panels[self.name, trusted].tracks[rows]

    def tracks(self, chosen: Callable[[TrackedObject], bool], trusted: bool, frame: int = -1) -> np.ndarray:
        return self.curves(chosen, trusted)[:, frame]

    def agents(self, trusted: bool) -> np.ndarray:
        return self.panels[self.name, trusted].agents[:, -1]


Finding = tuple[bool, str]  # whether a claim holds, and the numbers behind it
Check = Callable[[Case], Finding]


def _seen_by_one(obj: TrackedObject) -> bool:
    return obj.seen_by_one


def _shared_target(obj: TrackedObject) -> bool:
    return obj.kind == "true" and not obj.seen_by_one


def _false(obj: TrackedObject) -> bool:
    return obj.kind == "fp"


def _outvoted(obj: TrackedObject) -> bool:
    return _false(obj) and not obj.even_split


def _split(obj: TrackedObject) -> bool:
    return _false(obj) and obj.even_split


def _format_trusts(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _format_change(without: np.ndarray, given: np.ndarray) -> str:
    return "; ".join(f"{a:.2f} → {b:.2f}" for a, b in zip(without, given, strict=True))


def converges(case: Case) -> Finding:
    panels = [case.panels[case.name, trusted] for trusted in (False, True)]
    tracks = max(_frames_to_settle(curve) for panel in panels for curve in panel.tracks)
    agents = max(_frames_to_settle(curve) for panel in panels for curve in panel.agents)
    return max(tracks, agents) <= SOON, f"slowest track {tracks} frames, slowest agent {agents}"


def _frames_to_settle(curve: np.ndarray) -> int:
    """Frames, from a track's or an agent's first, until its trust stays within SETTLED of where it ends."""
    known = curve[~np.isnan(curve)]
    away = np.flatnonzero(np.abs(known - known[-1]) > SETTLED)
    return int(away[-1]) + 2 if away.size else 1


def targets_are_trusted(case: Case) -> Finding:
    least = [case.tracks(_shared_target, trusted).min() for trusted in (False, True)]
    return min(least) > 0.8, f"least {least[0]:.2f}; with the prior {least[1]:.2f}"


def outvoted_distrusted(case: Case) -> Finding:
    trust = [case.tracks(_outvoted, trusted) for trusted in (False, True)]
    numbers = f"{_format_trusts(trust[0])}; with the prior {_format_trusts(trust[1])}"
    return bool(np.max(trust) < 0.5 - DECIDED), numbers


def keeps_prior(case: Case) -> Finding:
    curves = [case.curves(_seen_by_one, trusted) for trusted in (False, True)]
    away = max(float(np.nanmax(np.abs(curve - 0.5))) for curve in curves)
    return away < 1e-9, f"at most {away:.2g} from 0.5 in any frame"


def split_stays_undecided(case: Case) -> Finding:
    trust = case.tracks(_split, False)
    return bool((np.abs(trust - 0.5) < DECIDED).all()), _format_trusts(trust)


def prior_decides_split(case: Case) -> Finding:
    without, given = (case.tracks(_split, trusted) for trusted in (False, True))
    return bool((given < 0.5 - DECIDED).all()), _format_change(without, given)


def prior_accelerates(case: Case) -> Finding:
    without, given = (case.tracks(_false, trusted, EARLY) for trusted in (False, True))
    return bool((given < without - CLEAR).all()), f"FPs after 5 frames: {_format_change(without, given)}"


def falls_with_prior(agent: int) -> Check:
    def check(case: Case) -> Finding:
        without, given = (case.agents(trusted)[[agent]] for trusted in (False, True))
        return bool((given < without - CLEAR).all()), _format_change(without, given)

    return check


def trusted_agent_stays_so(case: Case) -> Finding:
    trust = case.agents(True)[TRUSTED]
    return bool(trust > 0.5 + DECIDED), f"{trust:.2f}"


def agent_2_is_lowest(case: Case) -> Finding:
    trust = case.agents(False)
    return bool(trust[2] < trust[:2].min() - CLEAR), f"agents 0, 1, 2: {_format_trusts(trust)}"


def agents_are_ordered(case: Case) -> Finding:
    trust = case.agents(False)
    return bool((np.diff(trust) < -CLEAR).all()), f"agents 0, 1, 2: {_format_trusts(trust)}"


def agent_2_distrusted(case: Case) -> Finding:
    trust = [float(case.agents(trusted)[2]) for trusted in (False, True)]
    return max(trust) < 0.5 - DECIDED, f"{trust[0]:.2f}; with the prior {trust[1]:.2f}"


def benign_tend_to_trusted(case: Case) -> Finding:
    trust = [case.agents(trusted)[:2] for trusted in (False, True)]
    numbers = f"agents 0, 1: {_format_trusts(trust[0])}; with the prior {_format_trusts(trust[1])}"
    return bool(np.min(trust) > 0.5), numbers
