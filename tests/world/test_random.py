"""The random streams: the published generator, the right distributions, draws that depend on keys alone."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from kernels import entry
from scipy import special, stats

from trust_env.world import random
from trust_env.world.random import Key, uniforms

MASK = 0xFFFFFFFF


@entry
def run_philox(counter, key, out):
    out[0], out[1], out[2], out[3] = random.philox(counter[0], counter[1], counter[2], counter[3], key[0], key[1])


@entry
def run_uniform_pairs(seed, world, episode, stream, frame, first, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = random.uniform_pair(Key(seed, world, episode), stream, frame, first + i)


@entry
def run_normal_pairs(seed, world, episode, stream, frame, first, out):
    for i in range(out.shape[0]):
        first_word, second_word, _, _ = random.words(Key(seed, world, episode), stream, frame, first + i)
        out[i, 0], out[i, 1] = random.normal(first_word), random.normal(second_word)


@entry
def run_normal(words, out):
    for i in range(out.shape[0]):
        out[i] = random.normal(words[i])


@entry
def run_poisson(mean, u, out):
    for i in range(out.shape[0]):
        out[i] = random.poisson(mean, u[i])


def philox_by_the_paper(counter: list[int], key: list[int]) -> list[int]:
    """Salmon et al. 2011, Sec. 3.3, in Python integers."""
    (a, b, c, d), (k0, k1) = counter, key
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * a, 1 << 32)
        high1, low1 = divmod(0xCD9E8D57 * c, 1 << 32)
        a, b, c, d = high1 ^ b ^ k0, low1, high0 ^ d ^ k1, low0
        k0, k1 = (k0 + 0x9E3779B9) & MASK, (k1 + 0xBB67AE85) & MASK
    return [a, b, c, d]


def philox(counter: list[int], key: list[int]) -> list[int]:
    out = np.zeros(4, dtype=np.uint64)
    run_philox(np.array(counter, dtype=np.uint64), np.array(key, dtype=np.uint64), out)
    return [int(word) for word in out]


def draws(run, n: int, *, seed=1, world=0, episode=0, stream=random.POLICY, frame=0, first=0) -> np.ndarray:
    out = np.empty((n, 2))
    run(*(np.int64(v) for v in (seed, world, episode, stream, frame, first)), out)
    return out


# --- the generator ------------------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        # Random123, kat_vectors: philox4x32 10
        ([0] * 4, [0] * 2, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
        ([MASK] * 4, [MASK] * 2, [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            [0xA4093822, 0x299F31D0],
            [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
        ),
    ],
)
def test_philox_gives_the_published_vectors(counter, key, words):
    assert philox(counter, key) == words
    assert philox_by_the_paper(counter, key) == words


def test_philox_agrees_with_python_integers():
    rng = np.random.default_rng(0)
    for _ in range(200):
        counter, key = rng.integers(0, 2**32, 4).tolist(), rng.integers(0, 2**32, 2).tolist()
        assert philox(counter, key) == philox_by_the_paper(counter, key)


@pytest.mark.core
@pytest.mark.nojit
def test_a_uniform_is_53_bits_of_the_block_that_its_key_names():
    seed, world, episode, stream, frame, index = 2**63 - 5, 2**32 - 3, 2**32 - 7, 5, 2**31, 2**24 - 1
    words = philox_by_the_paper([(stream << 24) | index, frame, episode, world], [seed & MASK, seed >> 32])
    expected = [(high >> 5 << 26) | (low >> 6) for high, low in (words[:2], words[2:])]
    (pair,) = draws(
        run_uniform_pairs, 1, seed=seed, world=world, episode=episode, stream=stream, frame=frame, first=index
    )
    assert pair.tolist() == [bits / 2**53 for bits in expected]


# --- keys ---------------------------------------------------------------------------------------------------


def test_every_part_of_the_key_matters():
    parts = {
        "seed": [1, 2, 1 + 2**32, 1 + 2**62],
        "world": [0, 1, 2**16, 2**32 - 1],
        "episode": [0, 1, 2**16, 2**32 - 1],
        "stream": list(range(8)),
        "frame": [0, 1, 2**16, 2**31],
        "first": [0, 1, 2**12, 2**24 - 1],
    }
    seen = {draws(run_uniform_pairs, 1, **{name: value})[0, 0] for name in parts for value in parts[name]}
    # Each list but `stream` names the default draw once, and so does `stream` (POLICY).
    assert len(seen) == sum(len(values) for values in parts.values()) - len(parts) + 1


def test_no_two_streams_share_their_numbers():
    streams = {getattr(random, name) for name in dir(random) if name.isupper() and len(name) > 1 and name[0] != "_"}
    assert streams == set(range(9))
    blocks = [draws(run_uniform_pairs, 500, stream=s)[:, 0] for s in streams]
    assert len(np.unique(np.concatenate(blocks))) == 9 * 500


@pytest.mark.core
@pytest.mark.nojit
def test_draws_do_not_depend_on_the_batch():
    worlds, episodes, frames = [5, 0, 9, 5], [0, 3, 1, 1], [7, 0, 2, 7]
    together = uniforms(3, worlds, episodes, random.POLICY, frames, 6)
    for w in range(4):
        alone = uniforms(3, worlds[w : w + 1], episodes[w : w + 1], random.POLICY, frames[w : w + 1], 4, first=2)
        assert (together[w, 2:] == alone[0]).all()


# --- distributions ------------------------------------------------------------------------------------------

N = 100_000


@pytest.fixture(scope="module")
def uniform_sample() -> np.ndarray:
    return draws(run_uniform_pairs, N)


@pytest.fixture(scope="module")
def normal_sample() -> np.ndarray:
    return draws(run_normal_pairs, N)


def test_uniforms_are_uniform(uniform_sample):
    assert uniform_sample.min() >= 0.0 and uniform_sample.max() < 1.0
    for column in uniform_sample.T:
        assert stats.kstest(column, "uniform").pvalue > 1e-3
    squares = np.histogram2d(*uniform_sample.T, bins=16, range=[[0, 1], [0, 1]])[0]
    assert stats.chisquare(squares.ravel()).pvalue > 1e-3
    low_bits = (uniform_sample * 2**53).astype(np.int64) & 0xFF
    assert stats.chisquare(np.bincount(low_bits.ravel(), minlength=256)).pvalue > 1e-3


def test_normals_are_normal(normal_sample):
    assert np.isfinite(normal_sample).all()
    for column in normal_sample.T:
        assert stats.kstest(column, "norm").pvalue > 1e-3
        moments = column.mean(), column.var(), stats.skew(column), stats.kurtosis(column)
        errors = 1 / math.sqrt(N), math.sqrt(2 / N), math.sqrt(6 / N), math.sqrt(24 / N)
        for moment, expected, error in zip(moments, (0.0, 1.0, 0.0, 0.0), errors, strict=True):
            assert abs(moment - expected) < 4 * error
    # The radius of a pair of independent normals has a chi distribution with two degrees of freedom.
    assert stats.kstest(np.hypot(*normal_sample.T), "chi", args=(2,)).pvalue > 1e-3


@pytest.mark.core
@pytest.mark.nojit
def test_normals_invert_the_distribution_as_scipy_does():
    edges = [0, 1, 2, 2**31 - 1, 2**31, MASK - 1, MASK, int(0.075 * 2**32), int(0.075 * 2**32) - 1]
    words = np.array(edges + np.random.default_rng(0).integers(0, 2**32, 2000).tolist(), dtype=np.uint64)
    out = np.empty(len(words))
    run_normal(words, out)
    expected = special.ndtri((words.astype(np.float64) + 0.5) / 2**32)
    np.testing.assert_allclose(out, expected, rtol=1e-14, atol=1e-15)
    assert out[0] == -out[6] and np.abs(out).max() < 6.5


@pytest.mark.parametrize("mean", [1e-6, 0.3, 1.0, 4.5, 38.0])
def test_poisson_inverts_its_distribution(mean, uniform_sample):
    u = uniform_sample[:, 0].copy()
    out = np.zeros(N, dtype=np.int64)
    run_poisson(mean, u, out)
    expected = stats.poisson.ppf(u, mean).astype(np.int64)
    assert np.mean(out != expected) < 1e-4  # rounding of the cumulative sum, at its steps only
    assert abs(out.mean() - mean) < 4 * math.sqrt(mean / N)


@pytest.mark.core
@pytest.mark.nojit
def test_poisson_of_nothing_is_nothing():
    out = np.ones(3, dtype=np.int64)
    run_poisson(0.0, np.array([0.0, 0.5, 1.0 - 2.0**-53]), out)
    assert out.tolist() == [0, 0, 0]


def test_poisson_of_many_stays_sane():
    out = np.zeros(1000, dtype=np.int64)
    run_poisson(400.0, draws(run_uniform_pairs, 1000)[:, 0].copy(), out)
    assert abs(out.mean() - 400.0) < 4 * math.sqrt(400 / 1000)


def test_streams_worlds_episodes_frames_and_indices_are_independent():
    base = dict.fromkeys(("seed", "world", "episode", "stream", "frame"), 3)
    samples = [draws(run_normal_pairs, 20_000, **base).ravel()]
    samples += [draws(run_normal_pairs, 20_000, **(base | {name: 4})).ravel() for name in base]
    samples.append(draws(run_normal_pairs, 20_000, **base, first=20_000).ravel())
    for a, b in itertools.combinations(samples, 2):
        assert abs(np.corrcoef(a, b)[0, 1]) < 4 / math.sqrt(len(a))
    for lag in (1, 2, 3, 4, 8):  # within a stream, from index to index
        assert abs(np.corrcoef(samples[0][:-lag], samples[0][lag:])[0, 1]) < 4 / math.sqrt(len(samples[0]))


def test_short_streams_are_as_good_as_long_ones():
    """A world draws a few numbers per frame: the first of many (world, frame) must be uniform too."""
    worlds, frames = (axis.ravel() for axis in np.meshgrid(np.arange(200), np.arange(100)))
    sample = uniforms(0, worlds, np.zeros_like(worlds), random.DETECTION, frames, 1)[:, 0]
    assert stats.kstest(sample, "uniform").pvalue > 1e-3
    grid = sample.reshape(100, 200)
    for a, b in ((grid[1:], grid[:-1]), (grid[:, 1:], grid[:, :-1])):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 4 / math.sqrt(a.size)
