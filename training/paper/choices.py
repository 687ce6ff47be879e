"""Every choice that the paper's text leaves open, or that its figures were drawn with another one: one table."""

from __future__ import annotations

from typing import NamedTuple


class Choice(NamedTuple):
    """What the text says, what the presets `paper` and `cdc2024` do, and what changes it ("": nothing does)."""

    choice: str
    text: str
    paper: str
    cdc2024: str
    set_by: str


_SAME = "the same"
CHOICES = (
    Choice("order of a frame", "open", "tracks, then agents", "agents, then tracks", "`order`"),
    Choice("tracks that an agent is judged on", "open", "all of the frame", "those of the frame before",
           "`agent_tracks`"),
    Choice("PSMs of an agent in a frame", "all", "all", "the one of least value", "`agent_psms`"),
    Choice("process noise", "precision decays, the mean stays", "of tracks and agents",
           "tracks only: (α, β) ← 0.8 (α, β) + 0.2 prior", "`track_forgetting`, `agent_forgetting`"),
    Choice("ε of the process noise", "open", "0.01 a frame", "none", "`epsilon`"),
    Choice("floor of the process noise", "none: a belief that nothing feeds decays to Beta(0, 0)",
           "the prior's precision", "the prior itself", ""),
    Choice("strong prior", "mean 0.8, precision 10", "as printed", "mean 0.8, precision 100", "`strong_precision`"),
    Choice("prior on a single track", "in the Discussion", "none", _SAME, "`track_priors`"),
    Choice("false positives against false negatives in the prior", "in the Discussion", "as likely", _SAME,
           "`false_positive_odds`"),
    Choice("an agent detects a track (Alg. 1)", "open", "a detection in the track's gate, or near it", _SAME,
           "the scenario's `evidence.near_distance`"),
    Choice("an agent's track matches a central one (Alg. 2)", "open",
           "a confirmed local track, assigned one to one, near it", _SAME, "the scenario's `evidence.hold_distance`"),
    Choice("where a track is, when an FOV is asked whether it holds it", "open",
           "its posterior mean, after all updates of the frame", _SAME, ""),
    Choice("tracks that an agent holds outside its FOV", "open", "do not judge it", "judge it", "`held_outside_fov`"),
    Choice("a track that one agent sees", "keeps its prior", "as printed, and judges the agent all the same", _SAME,
           ""),
    Choice("deletion of a track", "score below T_1: at birth, of what a single agent sees",
           "score far below the track's own maximum", _SAME,
           "the scenario's `tracker.deletion`"),
)  # fmt: skip
