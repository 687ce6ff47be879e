"""`quorum`: a track is shown once more agents than may lie have hit it."""

from __future__ import annotations

from typing import Any, ClassVar

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import BuiltIn
from trust_env.defenses.checks import choice, whole
from trust_env.defenses.looks import forget_all, looks_at
from trust_env.world.tracking.track_store import list_confirmed

_NEVER = -1_000_000_000  # the frame of what has not happened


class Quorum(BuiltIn):
    """Shown once `l` + 1 agents have hit the track; hidden when `l` + 1 of its watchers miss it. No numbers.

    A hit is an assigned one within the last `window` frames, so that `l` liars alone get nothing shown:
    `detected` is set by clutter and by neighbours too. A track is hidden while `l` + 1 agents were expected to
    see it at their last `misses` looks and did not detect it; then it waits for a new quorum. strict: what has had
    no quorum is not shown, else tracks pass at which at most `l` agents have looked within the window.

    l, misses: whole numbers, from 0 and from 1; window: frames, from 1 to 1000; strict: True or False. Raises
    ValueError for anything else.
    """

    parameters: ClassVar = {"l": "i8", "window": "i8 | frames", "misses": "i8", "strict": "i8"}
    memory: ClassVar = {
        "track_id": "i8 J",
        "last_hit": "i8 K J | frame",
        "last_look": "i8 K J | frame",
        "missed": "i8 K J | looks in a row",
        "shown": "b1 J",
    }

    def __init__(self, l: int = 1, window: int = 20, misses: int = 4, strict: bool = True):  # noqa: E741
        self._params = {
            "l": whole("quorum", "l", l, 0, 255),
            "window": whole("quorum", "window", window, 1, 1000),
            "misses": whole("quorum", "misses", misses, 1, 1000),
            "strict": bool(choice("quorum", "strict", strict, (False, True))),
        }

    def params(self) -> dict[str, Any]:
        return dict(self._params)

    def values(self, n_agents: int) -> dict[str, Any]:
        return self._params

    @staticmethod
    @kernel
    def reset(world):
        """No track is known."""
        forget_all(world.quorum)

    @staticmethod
    @kernel
    def judge(world):
        """Which confirmed tracks are shown."""
        for c in range(list_confirmed(world)):
            j = world.scratch.listing[c]
            _note_looks(world, j)
            watchers, supporters, deniers = _count(world, j)
            if deniers > world.quorum.l:
                world.quorum.shown[j] = False
            elif supporters > world.quorum.l:
                world.quorum.shown[j] = True
            passes = world.quorum.strict == 0 and watchers <= world.quorum.l
            world.verdict.publish[j] = world.quorum.shown[j] or passes


@kernel
def _note_looks(world, j):
    """Who looks at the track, who hits it, who misses it. What is detected, but hit by nothing, says neither."""
    memory, evidence, now = world.quorum, world.evidence, world.clock.frame
    is_new = memory.track_id[j] != world.tracks.id[j]
    if is_new:
        memory.track_id[j], memory.shown[j] = world.tracks.id[j], False
    for k in range(memory.missed.shape[0]):
        if is_new:
            memory.last_hit[k, j], memory.last_look[k, j], memory.missed[k, j] = _NEVER, _NEVER, 0
        if looks_at(world, k, j):
            memory.last_look[k, j] = now
        if evidence.hit[k, j]:
            memory.last_hit[k, j], memory.missed[k, j] = now, 0
        elif evidence.expected[k, j] and not evidence.detected[k, j]:
            memory.missed[k, j] += 1


@kernel
def _count(world, j):
    """How many agents have looked at the track within the window, how many have hit it, and how many keep
    missing it.
    """
    memory, watchers, supporters, deniers = world.quorum, 0, 0, 0
    since = world.clock.frame - memory.window
    for k in range(memory.missed.shape[0]):
        watchers += memory.last_look[k, j] > since
        supporters += memory.last_hit[k, j] > since
        deniers += memory.missed[k, j] >= memory.misses and memory.last_look[k, j] > since
    return watchers, supporters, deniers
