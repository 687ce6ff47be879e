"""Counter-based random streams: a draw is a function of (seed, world, episode, stream, frame, index) and of
nothing else.

Philox4x32-10 (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011). The seed
is the key; world, episode, frame, stream and index are the counter. So one seed gives the same worlds
whatever the batch, the threads, the attack or the defense.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Sequence

import numpy as np

from trust_env.compiled.entry import Entry
from trust_env.compiled.kernels import inlined, kernel
from trust_env.compiled.structs import floats_at, ints_at

# Streams: the high byte of the counter's first word. 8 bits of stream, 24 bits of index.
TARGET_START, TARGET_MOTION, TARGET_LIFE, DETECTION, CLUTTER_COUNT, CLUTTER, PLACEMENT, POLICY, DEFENSE = range(9)

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
        c1, c3 = (product1 >> _SHIFT) ^ c1 ^ k0, (product0 >> _SHIFT) ^ c3 ^ k1
        c0, c1, c2, c3 = c1, product1 & _LOW, c3, product0 & _LOW
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@inlined
def _unit(high, low):
    """A float in [0, 1) from 53 of 64 random bits."""
    return (np.float64(high >> np.uint64(5)) * 67108864.0 + np.float64(low >> np.uint64(6))) / _TWO_53


@kernel
def words(key, stream, frame, index):
    """Four independent words of 32 bits (as uint64)."""
    seed = np.uint64(key.seed)
    return philox(
        np.uint64(index) | (np.uint64(stream) << np.uint64(24)),
        np.uint64(frame) & _LOW,
        np.uint64(key.episode) & _LOW,
        np.uint64(key.world) & _LOW,
        seed & _LOW,
        seed >> _SHIFT,
    )


@kernel
def uniform_pair(key, stream, frame, index):
    """Two independent U[0, 1) draws."""
    w0, w1, w2, w3 = words(key, stream, frame, index)
    return _unit(w0, w1), _unit(w2, w3)


@kernel
def uniform(key, stream, frame, index):
    """One U[0, 1) draw."""
    return uniform_pair(key, stream, frame, index)[0]


@inlined
def unit(word):
    """A float in (0, 1) from 32 random bits."""
    return (np.float64(word) + 0.5) / _TWO_32


# Wichura 1988, AS 241: numerators and denominators of Φ⁻¹, in the middle and the tails, highest power first.
_MIDDLE_ABOVE = (
    2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4, 4.5921953931549871457e4,
    1.3731693765509461125e4, 1.9715909503065514427e3, 1.3314166789178437745e2, 3.3871328727963666080e0,
)  # fmt: skip
_MIDDLE_BELOW = (
    5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4, 2.1213794301586595867e4,
    5.3941960214247511077e3, 6.8718700749205790830e2, 4.2313330701600911252e1, 1.0,
)  # fmt: skip
_TAIL_ABOVE = (
    7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1, 1.27045825245236838258e0,
    3.64784832476320460504e0, 5.76949722146069140550e0, 4.63033784615654529590e0, 1.42343711074968357734e0,
)  # fmt: skip
_TAIL_BELOW = (
    1.05075007164441684324e-9, 5.475938084995344946e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
    6.89767334985100004550e-1, 1.67638483018380384940e0, 2.05319162663775882187e0, 1.0,
)  # fmt: skip


@inlined
def _polynomial(coefficients, x):
    value = 0.0
    for coefficient in coefficients:
        value = value * x + coefficient
    return value


@kernel
def normal(word):
    """A N(0, 1) draw from 32 random bits, by inversion: Φ⁻¹ to 16 digits (Wichura 1988, AS 241).

    Its third range, beyond 6.6 standard deviations, is out of reach of 32 bits.
    """
    q = unit(word) - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        return q * _polynomial(_MIDDLE_ABOVE, r) / _polynomial(_MIDDLE_BELOW, r)
    r = math.sqrt(-math.log(0.5 - abs(q))) - 1.6
    return math.copysign(_polynomial(_TAIL_ABOVE, r) / _polynomial(_TAIL_BELOW, r), q)


@kernel
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
    return Key(world.clock.seed, world.clock.world_id, world.clock.episode)


def _uniforms(seed, worlds, episodes, stream, frames, first, rows, count, out):
    for w in range(rows):
        key = Key(seed, ints_at(worlds, rows)[w], ints_at(episodes, rows)[w])
        frame, draws = ints_at(frames, rows)[w], floats_at(out + 8 * count * w, count)
        for index in range(count):
            draws[index] = uniform(key, stream, frame, first + index)


_fill_uniforms = Entry(_uniforms)


def uniforms(seed: int, worlds, episodes, stream: int, frames, count: int, first: int = 0) -> np.ndarray:
    """U[0, 1) draws `[W, count]`, row w a function of (seed, worlds[w], episodes[w], stream, frames[w], first
    + index).
    """
    return uniform_sets(seed, worlds, episodes, stream, frames, count, (first,))[0]


def uniform_sets(seed: int, worlds, episodes, stream: int, frames, count: int, firsts: Sequence[int]) -> np.ndarray:
    """U[0, 1) draws `[len(firsts), W, count]`: those of `uniforms` from each of the indices `firsts` on."""
    columns = [np.ascontiguousarray(a, dtype=np.int64) for a in (worlds, episodes, frames)]
    rows = len(columns[0])
    if any(column.shape != (rows,) for column in columns):
        raise ValueError(f"worlds, episodes and frames must be as long as each other; got {columns}")
    out = np.empty((len(firsts), rows, count))
    w, e, f, to = (array.ctypes.data for array in (*columns, out))
    for i, first in enumerate(firsts):
        _fill_uniforms(int(seed), w, e, int(stream), f, int(first), rows, int(count), to + 8 * rows * count * i)
    return out
