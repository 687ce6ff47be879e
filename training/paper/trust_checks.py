"""Checks of the paper's claims about trust, on the panels of a case: whether a claim holds, with numbers.

One criterion for tracks and agents alike: trusted above 0.5 + DECIDED, distrusted below 0.5 - DECIDED, undecided
between the two. The paper names no numbers, so all thresholds here are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from trust_env.training.paper.published import TRUSTED, Panel, PanelKey, TrackedObject, objects

DECIDED = 0.1  # a trust farther than this from 0.5 is decided: trusted above, distrusted below
CLEAR = 0.02  # a smaller difference between two trusts is none
SETTLED, SOON = 0.1, 10  # rapid: within 0.1 of its end after at most 10 frames, half an episode
EARLY = 4  # index of the fifth frame


@dataclass(frozen=True)
class Case:
    """The panels of one case, without the prior on agent 1 (False) and with it (True)."""

    name: str
    panels: Mapping[PanelKey, Panel]

    def curves(self, chosen: Callable[[TrackedObject], bool], prior: bool) -> np.ndarray:
        """Trust in the tracks of the chosen objects, [tracks, T]."""
        rows = [j for j, obj in enumerate(objects(self.name)) if chosen(obj)]
        return self.panels[self.name, prior].tracks[rows]

    def tracks(self, chosen: Callable[[TrackedObject], bool], prior: bool, frame: int = -1) -> np.ndarray:
        return self.curves(chosen, prior)[:, frame]

    def agents(self, prior: bool) -> np.ndarray:
        return self.panels[self.name, prior].agents[:, -1]


def trusted(trust: np.ndarray | float) -> bool:
    """Whether all of these trusts are decided for the better."""
    return bool(np.min(trust) > 0.5 + DECIDED)


def distrusted(trust: np.ndarray | float) -> bool:
    """Whether all of these trusts are decided for the worse."""
    return bool(np.max(trust) < 0.5 - DECIDED)


def undecided(trust: np.ndarray | float) -> bool:
    """Whether none of these trusts is decided."""
    return bool(np.max(np.abs(np.asarray(trust) - 0.5)) <= DECIDED)


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


def _both(trust: Callable[[bool], np.ndarray]) -> tuple[np.ndarray, str]:
    """Trusts without and then with the prior on agent 1, and the same as text."""
    without, given = (trust(prior) for prior in (False, True))
    numbers = f"{_format_trusts(without)}; with the prior {_format_trusts(given)}"
    return np.concatenate([without, given]), numbers


def converges(case: Case) -> Finding:
    panels = [case.panels[case.name, prior] for prior in (False, True)]
    tracks = max(_frames_to_settle(curve) for panel in panels for curve in panel.tracks)
    agents = max(_frames_to_settle(curve) for panel in panels for curve in panel.agents)
    return max(tracks, agents) <= SOON, f"slowest track {tracks} frames, slowest agent {agents}"


def _frames_to_settle(curve: np.ndarray) -> int:
    """Frames, from a track's or an agent's first, until its trust stays within SETTLED of where it ends."""
    known = curve[~np.isnan(curve)]
    away = np.flatnonzero(np.abs(known - known[-1]) > SETTLED)
    return int(away[-1]) + 2 if away.size else 1


def targets_are_trusted(case: Case) -> Finding:
    least = [case.tracks(_shared_target, prior).min() for prior in (False, True)]
    return trusted(min(least)), f"least {least[0]:.2f}; with the prior {least[1]:.2f}"


def outvoted_distrusted(case: Case) -> Finding:
    trust, numbers = _both(lambda prior: case.tracks(_outvoted, prior))
    return distrusted(trust), numbers


def false_positives_distrusted(case: Case) -> Finding:
    trust, numbers = _both(lambda prior: case.tracks(_false, prior))
    return distrusted(trust), numbers


def keeps_prior(case: Case) -> Finding:
    curves = [case.curves(_seen_by_one, prior) for prior in (False, True)]
    away = max(float(np.nanmax(np.abs(curve - 0.5))) for curve in curves)
    return away < 1e-9, f"at most {away:.2g} from 0.5 in any frame"


def split_stays_undecided(case: Case) -> Finding:
    trust = case.tracks(_split, False)
    return undecided(trust), _format_trusts(trust)


def prior_decides_split(case: Case) -> Finding:
    without, given = (case.tracks(_split, prior) for prior in (False, True))
    return distrusted(given), _format_change(without, given)


def prior_accelerates(case: Case) -> Finding:
    without, given = (case.tracks(_false, prior, EARLY) for prior in (False, True))
    return bool((given < without - CLEAR).all()), f"FPs after 5 frames: {_format_change(without, given)}"


def falls_with_prior(agent: int) -> Check:
    def check(case: Case) -> Finding:
        without, given = (case.agents(prior)[[agent]] for prior in (False, True))
        return bool((given < without - CLEAR).all()), _format_change(without, given)

    return check


def benign_rise_with_prior(case: Case) -> Finding:
    without, given = (case.agents(prior)[:2] for prior in (False, True))
    return bool((given > without + CLEAR).all()), f"agents 0, 1: {_format_change(without, given)}"


def distrusted_with_prior(agent: int) -> Check:
    def check(case: Case) -> Finding:
        trust = float(case.agents(True)[agent])
        return distrusted(trust), f"{trust:.2f}"

    return check


def trusted_agent_stays_so(case: Case) -> Finding:
    trust = float(case.agents(True)[TRUSTED])
    return trusted(trust), f"{trust:.2f}"


def agents_0_and_1_undecided(case: Case) -> Finding:
    trust = case.agents(False)[:2]
    return undecided(trust), _format_trusts(trust)


def agent_2_is_lowest(case: Case) -> Finding:
    trust = case.agents(False)
    return bool(trust[2] < trust[:2].min() - CLEAR), f"agents 0, 1, 2: {_format_trusts(trust)}"


def agents_are_ordered(case: Case) -> Finding:
    trust = case.agents(False)
    return bool((np.diff(trust) < -CLEAR).all()), f"agents 0, 1, 2: {_format_trusts(trust)}"


def agent_2_distrusted(case: Case) -> Finding:
    trust, numbers = _both(lambda prior: case.agents(prior)[[2]])
    return distrusted(trust), numbers


def agent_2_is_easier(case: Case) -> Finding:
    """Easier to determine than in case 1: trust in it is lower here, and decided."""
    before = np.array([Case("case1", case.panels).agents(prior)[2] for prior in (False, True)])
    here = np.array([case.agents(prior)[2] for prior in (False, True)])
    numbers = f"case 1 → 2: {_format_change(before, here)} with the prior"
    return bool((here < before - CLEAR).all()) and distrusted(here), numbers


def benign_tend_to_trusted(case: Case) -> Finding:
    trust, numbers = _both(lambda prior: case.agents(prior)[:2])
    return trusted(trust), f"agents 0, 1: {numbers}"
