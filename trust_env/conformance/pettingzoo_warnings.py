"""Which warnings of PettingZoo's tests are failures."""

from __future__ import annotations

import re
import textwrap
import warnings

from trust_env.conformance.report import Failed

# Warnings (regular expressions) that are no failures, and why: PettingZoo exempts its own environments from
# them, by name, and others cannot comply without becoming different environments.
RECOMMENDATIONS = {
    r"space for each \w+ probably should be": "others than Box and Discrete are part of the API",
    r"^Observation is not a NumPy array": "nor are those of a Discrete space or a Dict with an action mask",
    r"^Agents have different|^Observations (are|have) different|^The class of": "agents may differ",
    r"^Observation numpy array is all zeros": "an empty board is a valid observation",
    r"is a single number": "so is a single number",
    r"in the shape of a graphical observation": "a guess: not every matrix is an image",
    r"^State is a single number|^State numpy array is all zeros": "as for observations",
    r"does not have possible_agents defined": "optional, for environments that make up agents as they go",
    r"does not have a `render_mode` defined|has not defined a render\(\)": "rendering is optional",
}

# PettingZoo and NumPy warn with these two; deprecations and the like concern libraries, not the environment.
_FAILING = (UserWarning, RuntimeWarning)


def remark_on_warnings(caught: list[warnings.WarningMessage], allowed: tuple[str, ...]) -> str:
    """The allowed warnings and the reasons; raises Failed for all others. allowed: regular expressions."""
    texts = dict.fromkeys(_shorten(str(w.message)) for w in caught if issubclass(w.category, _FAILING))
    reasons = {text: _reason_to_allow(text, allowed) for text in texts}
    failing = [text for text, reason in reasons.items() if not reason]
    if failing:
        raise Failed("warns: " + "; ".join(failing))
    return "; ".join(f"warns: {text} ({reason})" for text, reason in reasons.items())


def _shorten(text: str) -> str:
    """A warning on one line, without terminal colours; some of PettingZoo's take six lines."""
    return textwrap.shorten(re.sub(r"\x1b\[[0-9;]*m", "", text), 240, placeholder=" ...")


def _reason_to_allow(text: str, allowed: tuple[str, ...]) -> str | None:
    if any(re.search(pattern, text) for pattern in allowed):
        return "allowed"
    return next((reason for pattern, reason in RECOMMENDATIONS.items() if re.search(pattern, text)), None)
