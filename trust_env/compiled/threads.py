"""The threads that share the work on the worlds of a batch."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from trust_env import frame as engine
from trust_env.compiled.jit import BOUNDSCHECK, JIT_OFF
from trust_env.parameters import Pack
from trust_env.world.fields import aligned_zeros

_PER_THREAD = 16  # fewer worlds are not worth another thread
_MOST, _LEAST = 32, 2  # worlds that a thread takes at a time: what stays in its cache, what is worth asking
_PATIENCE = 20_000  # turns that a thread waits before it goes to sleep, about half a millisecond
_NAP = 1e-4  # s


class Crew:
    """Runs stages of a frame in all worlds of `rows[W, ·]`, on several threads at once.

    To wake a thread takes as long as a dozen worlds. So whoever runs out of work stays awake for a moment:
    the caller until all worlds are done, the others until the next frame.
    """

    def __init__(self, pack: Pack, rows: np.ndarray, threads: int):
        num_worlds, layout = len(rows), pack.layout
        # Without the compiler, threads only take turns; with checks, an error must reach the caller.
        self.threads = 1 if JIT_OFF or BOUNDSCHECK else min(threads, -(-num_worlds // _PER_THREAD))
        self.scratch = aligned_zeros(self.threads, layout.scratch_bytes)
        self._buffers = rows, pack.params, layout.table  # they live as long as a thread may use them
        first, params, table = (buffer.ctypes.data for buffer in self._buffers)
        batches = [(first, layout.row_bytes, params, s.ctypes.data, table) for s in self.scratch]
        self._words = np.zeros(engine.BATCHES + engine.BATCH * self.threads, dtype=np.int64)
        self._words[engine.BATCHES :] = np.ravel(batches)
        self._words[[engine.WORLDS, engine.TAKEN, engine.DONE]] = num_worlds
        self._words[[engine.THREADS, engine.LEAST, engine.MOST]] = self.threads, _LEAST, _MOST
        self._address = self._words.ctypes.data
        self._asleep = [True] * self.threads
        self._pool: ThreadPoolExecutor | None = None
        self._owner = 0

    def run(self, stages: int) -> None:
        """Run the stages in all active worlds."""
        if self.threads == 1:
            engine.advance(self._address, 0, stages, _PATIENCE)
            return
        self._wake()
        self._wait()  # for what an interrupt may have left unfinished
        engine.advance(self._address, 0, stages, _PATIENCE)
        self._wait()

    def _wait(self) -> None:
        """Until the worlds that other threads have in hand are done."""
        while self._words[engine.DONE] < self._words[engine.WORLDS]:
            time.sleep(_NAP)

    def _wake(self) -> None:
        if self._pool is None or self._owner != os.getpid():  # threads do not survive a fork
            engine.advance.prepare()
            self._pool = ThreadPoolExecutor(self.threads - 1, thread_name_prefix="trust-env")
            self._owner, self._asleep = os.getpid(), [True] * self.threads
            self._words[[engine.TAKEN, engine.DONE]] = self._words[engine.WORLDS]
        for thread in range(1, self.threads):
            if self._asleep[thread]:
                self._asleep[thread] = False
                self._pool.submit(self._help, thread)

    def _help(self, thread: int) -> None:
        engine.advance(self._address, thread, 0, _PATIENCE)
        self._asleep[thread] = True

    def close(self) -> None:
        """Send the threads home; another `run` calls them again."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
