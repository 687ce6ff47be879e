"""One thread at a time: who uses an environment, and whether the last change of its worlds came to its end."""

from __future__ import annotations

import sys
from _thread import get_ident

THREAD = "thread"


class ExclusiveUse:
    """The use of some worlds by one thread, a context manager; RuntimeError for a second thread.

    unfinished: worlds are being changed. It is set before the first change and taken back after the last, so
    that it stays set when an interrupt or an error comes between.

    A thread uses the worlds from `holder.setdefault` to `holder.clear`, which are atomic (steps write both out:
    a context manager takes twice as long). An interrupt may come before `clear`; so the same thread may enter
    again, and any thread may when that one has ended, as all others have in the child of a fork.
    """

    def __init__(self) -> None:
        self.holder: dict[str, int] = {}
        self.unfinished = False

    def __enter__(self) -> None:
        thread = get_ident()
        if self.holder.setdefault(THREAD, thread) != thread:
            self.take_over()

    def __exit__(self, *_: object) -> None:
        self.holder.clear()

    def take_over(self) -> None:
        """Use what a thread that has ended left behind. RuntimeError while it runs."""
        self.check_free()
        self.holder[THREAD] = get_ident()

    def check_free(self) -> None:
        """RuntimeError if another thread uses the worlds."""
        thread = self.holder.get(THREAD)
        if thread is not None and thread != get_ident() and thread in sys._current_frames():
            raise RuntimeError(
                "another thread is using this environment, which is for one thread at a time; "
                "give each thread an environment of its own, or a lock around this one"
            )

    def check_finished(self) -> None:
        """RuntimeError after a change that broke off."""
        if self.unfinished:
            raise RuntimeError(
                "a step or a reset broke off (an interrupt, or an error in it) and left its worlds half changed: "
                "call reset()"
            )
