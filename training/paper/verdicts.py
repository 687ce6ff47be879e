"""The verdict on a claim of the paper."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

OURS = "ours"  # in place of a section: what this project adds


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds for a source: "theory", "published" (the authors' numbers), an estimator of ours.

    section: of the paper, or `OURS`; case: "case1", "case2", or "" for none.
    expected: whether it is known to hold; where it is known not to, `note` says why, and nothing is wrong
    with the reproduction.
    """

    section: str
    case: str
    claim: str
    source: str
    holds: bool
    expected: bool
    numbers: str
    note: str = ""

    @property
    def as_expected(self) -> bool:
        return self.holds == self.expected

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"verdict": "holds" if self.holds else "does not hold"}
