"""Threads that share the work on many worlds, inside compiled code."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from trust_env.compiled import atomic
from trust_env.compiled.entry import Entry
from trust_env.compiled.mode import CHECKED, INTERPRETED, PLAIN
from trust_env.compiled.structs import ints_at

_PER_THREAD = 16  # fewer worlds are not worth another thread
_MOST, _LEAST = 32, 2  # worlds that a thread takes at a time: what stays in its cache, what is worth asking
_PATIENCE = 20_000  # turns that a thread waits before it goes to sleep, about half a millisecond
_NAP = 1e-4  # s

# What the threads share, int64[7]: what is to be done in how many worlds, and how far it is; then each one's
# own numbers, which the kernel is called with.
TASK, WORLDS, THREADS, LEAST, MOST, TAKEN, DONE, OWN = range(8)


def threads_available() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share_work(run_worlds: Any, numbers: int) -> Entry:
    """An entry `(shared, thread, task, patience)`: one thread's part in doing a task in all worlds.

    `run_worlds(own, first, last, task)` is a kernel that does it in a range of worlds, with a thread's own
    int64[numbers]. Thread 0 gives the task (not 0), takes part, and returns when all worlds are done; the
    others (task 0) take part in one task after another. Either gives up after waiting in vain for `patience`
    turns.
    """

    def advance(shared, thread, task, patience):
        orders = ints_at(shared, OWN)
        own, waited = ints_at(shared + 8 * (OWN + numbers * thread), numbers), 0
        if task != 0:
            orders[TASK] = task
            atomic.store(shared + 8 * DONE, 0)
            atomic.store(shared + 8 * TAKEN, 0)
        while waited < patience:
            left = orders[WORLDS] - atomic.load(shared + 8 * TAKEN)
            if left > 0:
                # Ever fewer worlds at a time, so that no thread waits long for another (guided
                # self-scheduling, Polychronopoulos & Kuck 1987).
                part = max(orders[LEAST], min(orders[MOST], left // (2 * orders[THREADS])))
                first = atomic.add(shared + 8 * TAKEN, part)
                last = min(first + part, orders[WORLDS])
                if first < last:
                    run_worlds(own, first, last, orders[TASK])
                    atomic.add(shared + 8 * DONE, last - first)
                waited = 0
            elif thread == 0 and atomic.load(shared + 8 * DONE) == orders[WORLDS]:
                return
            else:
                atomic.pause()
                waited += 1

    return Entry(advance, slow=True)


def threads_for(worlds: int, wanted: int) -> int:
    """How many threads are worth having."""
    # Without the compiler, threads only take turns; with checks, an error must reach the caller.
    return 1 if INTERPRETED or CHECKED or PLAIN else min(wanted, -(-worlds // _PER_THREAD))


class WorkerThreads:
    """Does tasks in all of a number of worlds, on one thread for each of `own`, numbers for the kernel.

    advance: the entry that `share_work` made; it is compiled at the first run. memory: what the numbers are
    addresses of; it lives as long as a thread may be at work on it.

    To wake a thread takes as long as a dozen worlds. So whoever runs out of work stays awake for a moment:
    the caller until all worlds are done, the others until the next task.
    """

    def __init__(self, advance: Entry, worlds: int, own: Sequence[Sequence[int]], memory: Any):
        self.threads, self._advance, self._memory = len(own), advance, memory
        self._shared = np.concatenate([np.zeros(OWN, dtype=np.int64), np.ravel(own)]).astype(np.int64)
        self._shared[[WORLDS, TAKEN, DONE]] = worlds
        self._shared[[THREADS, LEAST, MOST]] = self.threads, _LEAST, _MOST
        self._address = self._shared.ctypes.data
        self._awake = [threading.Lock() for _ in own]  # each one's own numbers are for one thread
        self._pool: ThreadPoolExecutor | None = None
        self._process = os.getpid()

    def run(self, task: int) -> None:
        """Do the task in all worlds. Others are at work no longer when it returns, nor when it is interrupted,
        unless it is so twice; then the next run waits for them.
        """
        if self.threads == 1:
            self._advance(self._address, 0, task, _PATIENCE)
            return
        self._wake()
        try:
            self._wait()
            self._advance(self._address, 0, task, _PATIENCE)
            self._wait()
        except BaseException:
            self._wait()
            raise

    def _wait(self) -> None:
        """Until the worlds that other threads have in hand are done."""
        while self._shared[DONE] < self._shared[WORLDS]:
            time.sleep(_NAP)

    def _wake(self) -> None:
        if self._process != os.getpid():
            self._forget_threads()
        if self._pool is None:
            self._advance.prepare()
            self._pool = ThreadPoolExecutor(self.threads - 1, thread_name_prefix="trust-env")
        try:
            for thread in range(1, self.threads):
                if not self._awake[thread].locked():
                    self._pool.submit(self._help, thread)
        except BaseException:
            self._dismiss(wait=False)  # it may not know of a thread that it has started
            raise

    def _forget_threads(self) -> None:
        """They do not survive a fork, nor does what they had in hand."""
        self._shared[[TAKEN, DONE]] = self._shared[WORLDS]
        self._awake = [threading.Lock() for _ in self._awake]
        self._pool, self._process = None, os.getpid()

    def _help(self, thread: int) -> None:
        if self._awake[thread].acquire(blocking=False):
            try:
                self._advance(self._address, thread, 0, _PATIENCE)
            finally:
                self._awake[thread].release()

    def close(self) -> None:
        """Send the threads home; another `run` calls them again."""
        self._dismiss(wait=True)

    def _dismiss(self, wait: bool) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=wait)
