"""Counter-based random streams: a draw is a function of (seed, world, episode, stream, frame, index) and of
nothing else.

Philox4x32-10 (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011). The seed
is the key; world, episode, frame, stream and index are the counter. So one seed gives the same worlds
whatever the batch, the threads, the attack or the defense.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from trust_env.core.jit import Entry, compiled, inlined
from trust_env.core.layout import F, whole

# Streams: the high byte of the counter's first word. 8 bits of stream, 24 bits of index.
TARGET_START, TARGET_MOTION, TARGET_LIFE, DETECTION, NOISE, CLUTTER_COUNT, CLUTTER, PLACEMENT, POLICY = range(
    9
)

Key = namedtuple("Key", "seed world episode")

_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_TWO_32, _TWO_53 = 2.0**32, 2.0**53


@inlined
def philox(c0, c1, c2, c3, k0, k1):
    """Philox4x32-10: four 32-bit words (as uint64) from a counter of four and a key of two."""
    for _ in range(10):
        product0, product1 = _M0 * c0, _M1 * c2
        c0, c1, c2, c3 = (
            (product1 >> _SHIFT) ^ c1 ^ k0,
            product1 & _LOW,
            (product0 >> _SHIFT) ^ c3 ^ k1,
            product0 & _LOW,
        )
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@inlined
def _unit(high, low):
    """A float in [0, 1) from 53 of 64 random bits."""
    return (np.float64(high >> np.uint64(5)) * 67108864.0 + np.float64(low >> np.uint64(6))) / _TWO_53


@compiled
def uniform_pair(key, stream, frame, index):
    """Two independent U[0, 1) draws."""
    seed = np.uint64(key.seed)
    w0, w1, w2, w3 = philox(
        np.uint64(index) | (np.uint64(stream) << np.uint64(24)),
        np.uint64(frame) & _LOW,
        np.uint64(key.episode) & _LOW,
        np.uint64(key.world) & _LOW,
        seed & _LOW,
        seed >> _SHIFT,
    )
    return _unit(w0, w1), _unit(w2, w3)


@compiled
def uniform(key, stream, frame, index):
    """One U[0, 1) draw."""
    return uniform_pair(key, stream, frame, index)[0]


@compiled
def normal_pair(key, stream, frame, index):
    """Two independent N(0, 1) draws (Box & Muller 1958)."""
    u, v = uniform_pair(key, stream, frame, index)
    radius = math.sqrt(-2.0 * math.log(1.0 - u))
    return radius * math.cos(2.0 * math.pi * v), radius * math.sin(2.0 * math.pi * v)


@compiled
def poisson(mean, u):
    """Poisson draw by inversion of one uniform `u` (Devroye 1986, X.3)."""
    if mean <= 0.0:
        return 0
    count, probability = 0, math.exp(-mean)
    cumulative = probability
    while u >= cumulative and count < 1000:
        count += 1
        probability *= mean / count
        cumulative += probability
    return count


@inlined
def key_of(world):
    """The key of a world's present episode."""
    return Key(whole(world, F.seed), whole(world, F.world_id), whole(world, F.episode))


def _uniforms(seed, worlds, episodes, stream, frames, first, out):
    for w in range(out.shape[0]):
        key = Key(seed, worlds[w], episodes[w])
        for index in range(out.shape[1]):
            out[w, index] = uniform(key, stream, frames[w], first + index)


_fill_uniforms = Entry(_uniforms)


def uniforms(seed: int, worlds, episodes, stream: int, frames, count: int, first: int = 0) -> np.ndarray:
    """U[0, 1) draws `[W, count]`, row w a function of (seed, worlds[w], episodes[w], stream, frames[w], first
    + index).
    """
    columns = [np.ascontiguousarray(a, dtype=np.int64) for a in (worlds, episodes, frames)]
    out = np.empty((len(columns[0]), count))
    _fill_uniforms(np.int64(seed), columns[0], columns[1], np.int64(stream), columns[2], np.int64(first), out)
    return out
