"""The paper's claims about trust (Secs. IV-A, V-B, V-C), judged for the authors' own numbers and for ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from trust_env.training.paper import trust_checks as checks
from trust_env.training.paper.published import Panel, PanelKey
from trust_env.training.paper.trust_checks import Case, Check
from trust_env.training.paper.verdicts import Verdict

EXPLAINING = "paper*"  # a source that shows why `paper` fails


class Claim(NamedTuple):
    """A claim of the paper about trust, and how it is checked."""

    section: str
    case: str
    text: str
    check: Check
    why_paper_fails: str = ""  # why the preset `paper` is known not to bear it out; "": it does


def trust_verdicts(sources: Mapping[str, Mapping[PanelKey, Panel]]) -> list[Verdict]:
    """Every claim for every source; for `paper*`, which explains them, only those that `paper` fails."""
    return [
        _verdict(claim, source, panels)
        for claim in CLAIMS
        for source, panels in sources.items()
        if source != EXPLAINING or claim.why_paper_fails
    ]


def _verdict(claim: Claim, source: str, panels: Mapping[PanelKey, Panel]) -> Verdict:
    holds, numbers = claim.check(Case(claim.case, panels))
    note = claim.why_paper_fails if source == "paper" else ""
    return Verdict(claim.section, claim.text, source, bool(holds), not note, numbers, note)


# Why `paper` fails:
_PSMS = (
    "the figures take only the PSM of least value of an agent's frame; with all of them, the tracks that it "
    "shares with others outweigh its FPs"
)
_PRIOR = "with all PSMs of a frame the prior is soon outweighed, whatever its precision"

CLAIMS = (
    Claim("IV-A", "case1", "Case 1: trust converges within 1 s", checks.converges),
    Claim("IV-A", "case2", "Case 2: trust converges within 1 s", checks.converges),
    Claim("V-B", "case1", "targets that two agents see become trusted", checks.targets_are_trusted),
    Claim("V-B", "case1", "the FP that two agents contradict becomes distrusted", checks.outvoted_distrusted),
    Claim("V-B", "case1", "a track that one agent sees keeps its prior", checks.keeps_prior),
    Claim("V-B", "case1", "without a prior the even split stays undecided", checks.split_stays_undecided),
    Claim("V-B", "case1", "without a prior agent 2 ends lowest", checks.agent_2_is_lowest, _PSMS),
    Claim("V-B", "case1", "agent 2 tends towards distrusted", checks.agent_2_distrusted, _PSMS),
    Claim("V-B", "case1", "the prior on agent 1 accelerates the distrust of FPs", checks.prior_accelerates),
    Claim("V-B", "case1", "the prior on agent 1 decides the even split", checks.prior_decides_split, _PRIOR),
    Claim("V-B", "case1", "with the prior agent 0 falls", checks.falls_with_prior(0), _PRIOR),
    Claim("V-B", "case1", "with the prior agent 2 falls further", checks.falls_with_prior(2), _PRIOR),
    Claim("V-B", "case1", "agent 1 stays trusted", checks.trusted_agent_stays_so),
    Claim("V-C", "case2", "targets that two or three agents see become trusted", checks.targets_are_trusted),
    Claim("V-C", "case2", "the FP that two agents contradict becomes distrusted", checks.outvoted_distrusted),
    Claim("V-C", "case2", "a track that one agent sees keeps its prior", checks.keeps_prior),
    Claim("V-C", "case2", "without a prior the even split stays undecided", checks.split_stays_undecided),
    Claim("V-C", "case2", "agents 0 and 1 tend towards trusted", checks.benign_tend_to_trusted),
    Claim("V-C", "case2", "without a prior, trust falls from agent 0 over 1 to 2", checks.agents_are_ordered),
    Claim("V-C", "case2", "agent 2 tends towards distrusted", checks.agent_2_distrusted, _PSMS),
    Claim("V-C", "case2", "the prior on agent 1 accelerates the distrust of FPs", checks.prior_accelerates),
    Claim("V-C", "case2", "the prior on agent 1 decides the even split", checks.prior_decides_split, _PRIOR),
    Claim("V-C", "case2", "with the prior agent 2 falls further", checks.falls_with_prior(2), _PRIOR),
    Claim("V-C", "case2", "agent 1 stays trusted", checks.trusted_agent_stays_so),
)  # fmt: skip
