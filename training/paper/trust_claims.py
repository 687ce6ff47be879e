"""The paper's claims about trust (Secs. IV-A and V-B), judged for the authors' own numbers and for ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

from trust_env.training.paper import trust_checks as checks
from trust_env.training.paper.published import Panel, PanelKey
from trust_env.training.paper.trust_checks import Case, Check
from trust_env.training.paper.verdicts import Verdict

EXPLAINING = "paper*"  # a source that shows why `paper` fails


class Claim(NamedTuple):
    """A claim of the paper about trust, and how it is checked.

    fails: by source, why it is known not to bear the claim out. What the published numbers fail, `cdc2024`
    fails for the same reason.
    """

    section: str
    case: str
    text: str
    check: Check
    fails: Mapping[str, str] = {}

    def known_failure(self, source: str) -> str:
        """Why a source is known to fail the claim; empty: it bears it out."""
        return self.fails.get("published" if source == "cdc2024" else source, "")


def trust_verdicts(sources: Mapping[str, Mapping[PanelKey, Panel]]) -> list[Verdict]:
    """Every claim for every source; for `paper*`, only those that the figures bear out and `paper` does not."""
    return [
        _verdict(claim, source, panels)
        for claim in CLAIMS
        for source, panels in sources.items()
        if source != EXPLAINING or ("paper" in claim.fails and "published" not in claim.fails)
    ]


def _verdict(claim: Claim, source: str, panels: Mapping[PanelKey, Panel]) -> Verdict:
    holds, numbers = claim.check(Case(claim.case, panels))
    note = claim.known_failure(source)
    return Verdict(claim.section, claim.case, claim.text, source, bool(holds), not note, numbers, note)


def claims_of(source: str, verdicts: Sequence[Verdict]) -> tuple[int, int]:
    """How many of the paper's claims about trust a source bears out, and how many there are."""
    found = [verdict.holds for verdict in verdicts if verdict.source == source]
    return sum(found), len(found)


# Why a source fails:
_PSMS = (
    "the figures take only the PSM of least value of an agent's frame; with all of them, the tracks that it "
    "shares with others outweigh its FPs"
)
_PRIOR = "with all PSMs of a frame the prior is soon outweighed, whatever its precision"
_MISSES = "misses of a young or a far track hardly count, so that FPs begin as trusted, and their agents with them"
_CLOSE = "it moves that way, but stays within 0.1 of 0.5, which counts as undecided"

# By which sources.
_BY_MATE, _BY_PAPER = {"mate": _MISSES}, {"paper": _PSMS}
_BY_BOTH, _OUTWEIGHED = {**_BY_PAPER, **_BY_MATE}, {"paper": _PRIOR, **_BY_MATE}
_TOO_CLOSE, _ALSO_PAPER = {"published": _CLOSE, **_BY_MATE}, {"paper": _CLOSE}
_LITTLE = {"published": "lower by less than 0.02, which counts as no difference"}

_one, _two = partial(Claim, "V-B", "case1"), partial(Claim, "V-B", "case2")
CLAIMS = (
    Claim("IV-A", "case1", "trust converges rapidly", checks.converges, _BY_MATE),
    Claim("IV-A", "case2", "trust converges rapidly", checks.converges, _BY_MATE),
    _one("targets that two agents see become trusted", checks.targets_are_trusted),
    _one("the FP that two agents contradict becomes distrusted", checks.outvoted_distrusted, _BY_MATE),
    _one("a track that one agent sees keeps its prior", checks.keeps_prior),
    _one("without a prior the even split stays undecided", checks.split_stays_undecided, _BY_MATE),
    _one("without a prior agents 0 and 1 are hard to determine", checks.agents_0_and_1_undecided, _BY_PAPER),
    _one("without a prior agent 2 ends lowest", checks.agent_2_is_lowest, _BY_BOTH),
    _one("agent 2 tends towards distrusted", checks.agent_2_distrusted, _BY_BOTH),
    _one("the prior on agent 1 accelerates the distrust of FPs", checks.prior_accelerates, _BY_MATE),
    _one("the prior on agent 1 decides the even split", checks.prior_decides_split, _OUTWEIGHED),
    _one("with the prior agent 0 falls", checks.falls_with_prior(0), _OUTWEIGHED),
    _one("with the prior agent 0 must be untrustworthy", checks.distrusted_with_prior(0), _TOO_CLOSE | _OUTWEIGHED),
    _one("with the prior agent 2 falls further", checks.falls_with_prior(2), _OUTWEIGHED),
    _one("agent 1 stays trusted", checks.trusted_agent_stays_so, _BY_MATE),
    _two("targets that two or three agents see become trusted", checks.targets_are_trusted),
    _two("the FP that two agents contradict becomes distrusted", checks.outvoted_distrusted, _BY_MATE),
    _two("both FP tracks tend towards distrusted", checks.false_positives_distrusted, _TOO_CLOSE | _ALSO_PAPER),
    _two("a track that one agent sees keeps its prior", checks.keeps_prior),
    _two("agents 0 and 1 tend towards trusted", checks.benign_tend_to_trusted, _TOO_CLOSE),
    _two("without a prior trust falls from agent 0 over 1 to 2", checks.agents_are_ordered, _BY_MATE),
    _two("agent 2 tends towards distrusted", checks.agent_2_distrusted, _BY_BOTH),
    _two("agent 2 is easier to determine than in case 1", checks.agent_2_is_easier, _BY_BOTH | _LITTLE),
    _two("the prior on agent 1 accelerates the distrust of FPs", checks.prior_accelerates, _BY_MATE),
    _two("the prior on agent 1 decides the even split", checks.prior_decides_split, _OUTWEIGHED),
    _two("trusted agents become more trusted with the prior", checks.benign_rise_with_prior, _OUTWEIGHED),
    _two("with the prior agent 2 falls further", checks.falls_with_prior(2), _OUTWEIGHED),
    _two("agent 1 stays trusted", checks.trusted_agent_stays_so, _BY_MATE),
)  # fmt: skip
