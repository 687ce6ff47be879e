"""Text split at its commas, except those inside brackets and quotes."""

from __future__ import annotations

from itertools import pairwise

MAX_DEPTH = 20  # of brackets
_CLOSING = {"(": ")", "[": "]", "{": "}"}


def split_at_commas(text: str) -> list[str]:
    """The parts between the commas that are outside all brackets and quotes, stripped."""
    cuts = [-1, *_scan(text)[0], len(text)]
    return [text[start + 1 : stop].strip() for start, stop in pairwise(cuts)]


def bracket_fault(text: str) -> str:
    """What is wrong with the brackets and quotes; empty when all are closed."""
    return _scan(text)[1]


def _scan(text: str) -> tuple[list[int], str]:
    """Positions of the separating commas, and the first fault; empty when there is none."""
    commas: list[int] = []
    expected: list[str] = []
    quote, escaped = "", False
    for i, char in enumerate(text):
        if quote:
            quote = "" if char == quote and not escaped else quote
            escaped = char == "\\" and not escaped
        elif char in "\"'":
            quote = char
        elif char in _CLOSING:
            expected.append(_CLOSING[char])
            if len(expected) > MAX_DEPTH:
                return commas, f"brackets are nested deeper than {MAX_DEPTH}"
        elif char in ")]}" and (not expected or expected.pop() != char):
            return commas, f"a {char} closes nothing"
        elif char == "," and not expected:
            commas.append(i)
    missing = quote or (expected[-1] if expected else "")
    return commas, f"a {missing} is missing at the end" if missing else ""
