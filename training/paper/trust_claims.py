"""The paper's claims about trust (Secs. IV-A, V-B, V-C), judged for the authors' own numbers and for ours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from trust_env.training.paper.published import TRUSTED, Object, Panel, PanelKey, objects
from trust_env.training.paper.verdicts import Verdict

DECIDED = 0.1  # a trust this far from 0.5 leans to one side
CLEAR = 0.02  # a smaller difference between two trusts is none
SETTLED, SOON = 0.1, 10  # a trust within 0.1 of its end has converged; 10 frames are 1 s, half an episode
EARLY = 4  # index of the fifth frame


@dataclass(frozen=True)
class Case:
    """The panels of one case, without the prior on agent 1 (False) and with it (True)."""

    name: str
    panels: Mapping[PanelKey, Panel]

    def curves(self, chosen: Callable[[Object], bool], trusted: bool) -> np.ndarray:
        """Trust in the tracks of the chosen objects, [tracks, T]."""
        rows = [j for j, thing in enumerate(objects(self.name)) if chosen(thing)]
        return self.panels[self.name, trusted].tracks[rows]

    def tracks(self, chosen: Callable[[Object], bool], trusted: bool, frame: int = -1) -> np.ndarray:
        return self.curves(chosen, trusted)[:, frame]

    def agents(self, trusted: bool) -> np.ndarray:
        return self.panels[self.name, trusted].agents[:, -1]


Found = tuple[bool, str]  # whether it holds, and the numbers
Check = Callable[[Case], Found]


def trust_verdicts(sources: Mapping[str, Mapping[PanelKey, Panel]]) -> list[Verdict]:
    """Every claim for every source; for `paper*`, which explains them, only those that `paper` fails."""
    verdicts = []
    for section, case, text, check, fails_with, why in CLAIMS:
        for source, panels in sources.items():
            if source == EXPLAINING and not fails_with:
                continue
            holds, numbers = check(Case(case, panels))
            known = source in fails_with
            verdicts.append(
                Verdict(section, text, source, bool(holds), not known, numbers, why if known else "")
            )
    return verdicts


def _lone(thing: Object) -> bool:
    return thing.lone


def _shared_target(thing: Object) -> bool:
    return thing.kind == "true" and not thing.lone


def _false(thing: Object) -> bool:
    return thing.kind == "fp"


def _outvoted(thing: Object) -> bool:
    return _false(thing) and not thing.even_split


def _split(thing: Object) -> bool:
    return _false(thing) and thing.even_split


def _shown(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _change(without: np.ndarray, given: np.ndarray) -> str:
    return "; ".join(f"{a:.2f} → {b:.2f}" for a, b in zip(without, given, strict=True))


# --- the checks -----------------------------------------------------------------------------------------


def _converges(case: Case) -> Found:
    panels = [case.panels[case.name, trusted] for trusted in (False, True)]
    tracks = max(_frames_to_settle(curve) for panel in panels for curve in panel.tracks)
    agents = max(_frames_to_settle(curve) for panel in panels for curve in panel.agents)
    return max(tracks, agents) <= SOON, f"slowest track {tracks} frames, slowest agent {agents}"


def _frames_to_settle(curve: np.ndarray) -> int:
    """Frames, from a track's or an agent's first, until its trust stays within SETTLED of where it ends."""
    known = curve[~np.isnan(curve)]
    away = np.flatnonzero(np.abs(known - known[-1]) > SETTLED)
    return int(away[-1]) + 2 if away.size else 1


def _targets_are_trusted(case: Case) -> Found:
    least = [case.tracks(_shared_target, trusted).min() for trusted in (False, True)]
    return min(least) > 0.8, f"least {least[0]:.2f}; with the prior {least[1]:.2f}"


def _outvoted_is_distrusted(case: Case) -> Found:
    trust = [case.tracks(_outvoted, trusted) for trusted in (False, True)]
    return bool(np.max(trust) < 0.5 - DECIDED), f"{_shown(trust[0])}; with the prior {_shown(trust[1])}"


def _lone_keeps_prior(case: Case) -> Found:
    away = max(float(np.nanmax(np.abs(case.curves(_lone, trusted) - 0.5))) for trusted in (False, True))
    return away < 1e-9, f"at most {away:.2g} from 0.5 in any frame"


def _split_stays_undecided(case: Case) -> Found:
    trust = case.tracks(_split, False)
    return bool((np.abs(trust - 0.5) < DECIDED).all()), _shown(trust)


def _prior_decides_split(case: Case) -> Found:
    without, given = (case.tracks(_split, trusted) for trusted in (False, True))
    return bool((given < 0.5 - DECIDED).all()), _change(without, given)


def _prior_accelerates(case: Case) -> Found:
    without, given = (case.tracks(_false, trusted, EARLY) for trusted in (False, True))
    return bool((given < without - CLEAR).all()), f"FPs after 5 frames: {_change(without, given)}"


def _falls_with_prior(agent: int) -> Check:
    def check(case: Case) -> Found:
        without, given = (case.agents(trusted)[[agent]] for trusted in (False, True))
        return bool((given < without - CLEAR).all()), _change(without, given)

    return check


def _trusted_agent_stays_so(case: Case) -> Found:
    trust = case.agents(True)[TRUSTED]
    return bool(trust > 0.5 + DECIDED), f"{trust:.2f}"


def _agent_2_is_lowest(case: Case) -> Found:
    trust = case.agents(False)
    return bool(trust[2] < trust[:2].min() - CLEAR), f"agents 0, 1, 2: {_shown(trust)}"


def _agents_are_ordered(case: Case) -> Found:
    trust = case.agents(False)
    return bool((np.diff(trust) < -CLEAR).all()), f"agents 0, 1, 2: {_shown(trust)}"


def _agent_2_tends_to_distrusted(case: Case) -> Found:
    trust = [float(case.agents(trusted)[2]) for trusted in (False, True)]
    return max(trust) < 0.5 - DECIDED, f"{trust[0]:.2f}; with the prior {trust[1]:.2f}"


def _benign_tend_to_trusted(case: Case) -> Found:
    trust = [case.agents(trusted)[:2] for trusted in (False, True)]
    return bool(np.min(trust) > 0.5), f"agents 0, 1: {_shown(trust[0])}; with the prior {_shown(trust[1])}"


# --- the claims -----------------------------------------------------------------------------------------

_PAPER, EXPLAINING = ("paper",), "paper*"
_WHY_AGENT = (
    "the figures take only the PSM of least value of an agent's frame; with all of them, the tracks that it "
    "shares with others outweigh its FPs"
)
_WHY_PRIOR = "with all PSMs of a frame the prior is soon outweighed, whatever its precision"

CLAIMS: tuple[tuple[str, str, str, Check, tuple[str, ...], str], ...] = (
    ("IV-A", "case1", "Case 1: trust converges within 1 s", _converges, (), ""),
    ("IV-A", "case2", "Case 2: trust converges within 1 s", _converges, (), ""),
    ("V-B", "case1", "targets that two agents see become trusted", _targets_are_trusted, (), ""),
    ("V-B", "case1", "the FP that two agents contradict becomes distrusted", _outvoted_is_distrusted, (), ""),
    ("V-B", "case1", "a track that one agent sees keeps its prior", _lone_keeps_prior, (), ""),
    ("V-B", "case1", "without a prior the even split stays undecided", _split_stays_undecided, (), ""),
    ("V-B", "case1", "without a prior agent 2 ends lowest", _agent_2_is_lowest, _PAPER, _WHY_AGENT),
    ("V-B", "case1", "agent 2 tends towards distrusted", _agent_2_tends_to_distrusted, _PAPER, _WHY_AGENT),
    ("V-B", "case1", "the prior on agent 1 accelerates the distrust of FPs", _prior_accelerates, (), ""),
    ("V-B", "case1", "the prior on agent 1 decides the even split", _prior_decides_split, _PAPER, _WHY_PRIOR),
    ("V-B", "case1", "with the prior agent 0 falls", _falls_with_prior(0), _PAPER, _WHY_PRIOR),
    ("V-B", "case1", "with the prior agent 2 falls further", _falls_with_prior(2), _PAPER, _WHY_PRIOR),
    ("V-B", "case1", "agent 1 stays trusted", _trusted_agent_stays_so, (), ""),
    ("V-C", "case2", "targets that two or three agents see become trusted", _targets_are_trusted, (), ""),
    ("V-C", "case2", "the FP that two agents contradict becomes distrusted", _outvoted_is_distrusted, (), ""),
    ("V-C", "case2", "a track that one agent sees keeps its prior", _lone_keeps_prior, (), ""),
    ("V-C", "case2", "without a prior the even split stays undecided", _split_stays_undecided, (), ""),
    ("V-C", "case2", "agents 0 and 1 tend towards trusted", _benign_tend_to_trusted, (), ""),
    ("V-C", "case2", "without a prior, trust falls from agent 0 over 1 to 2", _agents_are_ordered, (), ""),
    ("V-C", "case2", "agent 2 tends towards distrusted", _agent_2_tends_to_distrusted, _PAPER, _WHY_AGENT),
    ("V-C", "case2", "the prior on agent 1 accelerates the distrust of FPs", _prior_accelerates, (), ""),
    ("V-C", "case2", "the prior on agent 1 decides the even split", _prior_decides_split, _PAPER, _WHY_PRIOR),
    ("V-C", "case2", "with the prior agent 2 falls further", _falls_with_prior(2), _PAPER, _WHY_PRIOR),
    ("V-C", "case2", "agent 1 stays trusted", _trusted_agent_stays_so, (), ""),
)  # fmt: skip
"""Section, case, text, check, the sources for which it is known not to hold, and why."""
