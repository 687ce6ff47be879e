"""Colours, as (red, green, blue). Blue is benign, red adversary; injections and false tracks are magenta."""

from __future__ import annotations

import colorsys

Colour = tuple[int, int, int]

PAPER: Colour = (252, 252, 253)
PANEL: Colour = (243, 245, 248)
GRID: Colour = (229, 233, 239)
INK: Colour = (31, 41, 55)
FAINT: Colour = (124, 134, 149)
RULE: Colour = (209, 215, 224)
BENIGN: Colour = (37, 99, 175)
ADVERSARY: Colour = (200, 50, 45)
INJECTED: Colour = (214, 0, 170)
PUBLISHED: Colour = (15, 135, 80)
HIDDEN: Colour = (222, 132, 0)
COVERED: Colour = (214, 220, 229)
MISSING: Colour = (252, 210, 40)
TENTATIVE: Colour = (150, 158, 170)
NO_OPINION: Colour = (190, 196, 206)

_BENIGN_HUES, _ADVERSARY_HUES = (0.50, 0.72), (0.97, 1.09)  # of a turn: teal to violet, red to orange


def role_colour(adversary: bool) -> Colour:
    return ADVERSARY if adversary else BENIGN


def agent_colour(adversary: bool, index: int, count: int) -> Colour:
    """The colour of one agent's detections: number `index` of the `count` agents of its role."""
    first, last = _ADVERSARY_HUES if adversary else _BENIGN_HUES
    hue = first + (last - first) * (index + 0.5) / max(count, 1)
    red, green, blue = colorsys.hls_to_rgb(hue % 1.0, 0.42, 0.72)
    return (round(255 * red), round(255 * green), round(255 * blue))


def trust_colour(trust: float) -> Colour:
    """From red (0) over amber (0.5) to green (1)."""
    red, green, blue = colorsys.hls_to_rgb(0.38 * trust**1.6, 0.42, 0.68)
    return (round(255 * red), round(255 * green), round(255 * blue))
