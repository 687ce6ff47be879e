"""Worlds give what they gave when the numbers in `reference/same_worlds.json` were recorded."""

from __future__ import annotations

import json

import pytest
from paths import REFERENCE
from same_worlds import CASES, name_of, sums

RECORDED = json.loads((REFERENCE / "same_worlds.json").read_text())


def test_every_case_is_recorded():
    assert list(RECORDED) == [name_of(case) for case in CASES]


@pytest.mark.core
@pytest.mark.parametrize("case", CASES, ids=name_of)
def test_worlds_are_what_they_were(case, tmp_path):
    recorded = RECORDED[name_of(case)]
    assert sums(case, tmp_path) == {name: pytest.approx(value, rel=1e-9, abs=1e-9) for name, value in recorded.items()}
