"""`score`: the track score alone.

Every confirmed track is believed; this is what the paper shows to be vulnerable.
"""

from __future__ import annotations

from trust_env.defenses.base import BuiltIn


class Score(BuiltIn):
    """The track score alone (Hallyburton & Pajic 2024, Sec. III): no opinion on tracks or agents."""
