"""Colours as (red, green, blue). Blue is benign, red adversary; injections and false tracks are magenta."""

from __future__ import annotations

import colorsys

Colour = tuple[int, int, int]

BACKGROUND: Colour = (252, 252, 253)
PANEL_BACKGROUND: Colour = (243, 245, 248)
GRID: Colour = (229, 233, 239)
DIVIDER: Colour = (209, 215, 224)
INK: Colour = (31, 41, 55)
MUTED: Colour = (124, 134, 149)
BENIGN: Colour = (37, 99, 175)
ADVERSARY: Colour = (200, 50, 45)
INJECTED: Colour = (214, 0, 170)
PUBLISHED: Colour = (15, 135, 80)
HIDDEN: Colour = (222, 132, 0)
TENTATIVE: Colour = (150, 158, 170)
IN_PICTURE: Colour = (214, 220, 229)
MISSING: Colour = (252, 210, 40)
NO_OPINION: Colour = (190, 196, 206)

_BENIGN_HUES, _ADVERSARY_HUES = (0.50, 0.72), (0.97, 1.09)  # of a turn: teal to violet, red to orange


def role_colour(adversary: bool) -> Colour:
    """The colour of an agent's symbol, name and FOV."""
    return ADVERSARY if adversary else BENIGN


def agent_colour(adversary: bool, index: int, count: int) -> Colour:
    """The colour of one agent's detections: number `index` of the `count` agents of its role."""
    first, last = _ADVERSARY_HUES if adversary else _BENIGN_HUES
    return _from_hue((first + (last - first) * (index + 0.5) / max(count, 1)) % 1.0, saturation=0.72)


def trust_colour(trust: float) -> Colour:
    """From red (0) over amber (0.5) to green (1)."""
    return _from_hue(0.38 * trust**1.6, saturation=0.68)


def _from_hue(hue: float, saturation: float) -> Colour:
    red, green, blue = colorsys.hls_to_rgb(hue, 0.42, saturation)
    return (round(255 * red), round(255 * green), round(255 * blue))
