"""The built-in defenses once more, slow and plain, on the evidence of a batch: what their kernels are compared with.

A world's judge is given a frame's confirmed tracks, `Frame`, and returns track trust [n], agent trust [K] and
what is shown, bool[n].
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict, deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binom, chi2

import trust_env


@dataclass
class Frame:
    """Evidence of one world's confirmed tracks: track ids, and arrays [K, n]."""

    now: int
    ids: list[int]
    expected: np.ndarray
    detected: np.ndarray
    hit: np.ndarray
    distance2: np.ndarray
    p_detect: np.ndarray
    prior: np.ndarray
    roles: np.ndarray

    @property
    def looks(self) -> np.ndarray:
        return self.expected | self.hit


class Plain:
    """A judge for every world, as a user's own defense."""

    def __init__(self, judge: Any, roles: Any = (), **parameters: Any):
        self.judge, self.roles, self.parameters = judge, np.array(roles), parameters

    def reset(self, shape: trust_env.Shape, worlds: np.ndarray) -> None:
        if not hasattr(self, "judges"):
            self.judges: list[Any] = [None] * shape.W
        for w in np.flatnonzero(worlds):
            self.judges[w] = self.judge(shape.K, **self.parameters)

    def update(self, e: trust_env.Evidence) -> trust_env.Verdict:
        tracks, publish = np.full(e.status.shape, np.nan), np.zeros(e.status.shape, dtype=bool)
        agents = np.full(e.expected.shape[:2], np.nan)
        for w, judge in enumerate(self.judges):
            columns = np.flatnonzero(e.confirmed[w])
            arrays = (getattr(e, name)[w][:, columns] for name in ("expected", "detected", "hit", "distance2"))
            belief = e.belief.p_detect, e.belief.prior_compromised
            frame = Frame(int(e.frame[w]), e.track_id[w, columns].tolist(), *arrays, *belief, self.roles)
            tracks[w, columns], agents[w], publish[w, columns] = judge.judge(frame)
        return trust_env.Verdict(track_trust=tracks, agent_trust=agents, publish=publish)


def shown(trust: np.ndarray) -> np.ndarray:
    return np.isnan(trust) | (trust >= 0.5)


class Quorum:
    def __init__(self, K: int, l: int = 1, window: int = 20, misses: int = 4, strict: bool = True):  # noqa: E741
        self.K, self.l, self.window, self.misses, self.strict = K, l, window, misses, strict
        self.hits, self.looks, self.missed = defaultdict(list), defaultdict(list), defaultdict(int)
        self.shown: set[int] = set()

    def judge(self, f: Frame) -> Any:
        for k, (j, i) in itertools.product(range(self.K), enumerate(f.ids)):
            if f.looks[k, j]:
                self.looks[k, i].append(f.now)
            if f.hit[k, j]:
                self.hits[k, i].append(f.now)
                self.missed[k, i] = 0
            elif f.expected[k, j] and not f.detected[k, j]:
                self.missed[k, i] += 1
        publish = [self.is_shown(f.now, i) for i in f.ids]
        return np.full(len(f.ids), np.nan), np.full(self.K, np.nan), np.array(publish, dtype=bool)

    def is_shown(self, now: int, i: int) -> bool:
        def recent(what: Any, k: int) -> bool:
            return any(now - self.window < frame <= now for frame in what[k, i])

        watchers = [k for k in range(self.K) if recent(self.looks, k)]
        if sum(self.missed[k, i] >= self.misses for k in watchers) >= self.l + 1:
            self.shown.discard(i)
        elif sum(recent(self.hits, k) for k in range(self.K)) >= self.l + 1:
            self.shown.add(i)
        return i in self.shown or (not self.strict and len(watchers) <= self.l)


class Votes:
    """What the defenses share that weigh hits by trust."""

    def __init__(self, K: int, window: int = 10, trust: float = 0.5):
        self.K, self.window, self.trust = K, window, np.full(K, trust)
        self.share: dict[int, float] = {}

    def agreement(self, f: Frame) -> np.ndarray:
        """[K, 2]: with and against the weighted vote of the others."""
        found = np.zeros((self.K, 2))
        for j, k in itertools.product(range(len(f.ids)), range(self.K)):
            others = [o for o in range(self.K) if o != k and f.looks[o, j]]
            total, ayes = sum(self.trust[others]), sum(self.trust[o] for o in others if f.hit[o, j])
            if f.looks[k, j] and abs(2 * ayes - total) > 1e-8 * total:
                found[k, int(f.hit[k, j] != (2 * ayes > total))] += 1
        return found

    def tracks(self, f: Frame) -> np.ndarray:
        trust = []
        for j, i in enumerate(f.ids):
            watchers = np.flatnonzero(f.looks[:, j])
            total = self.trust[watchers].sum()
            if len(watchers) >= 2 and total > 0:
                share = (self.trust[watchers] * f.hit[watchers, j]).sum() / total
                before = self.share.get(i, share)
                self.share[i] = (1 - 1 / self.window) * before + share / self.window
            trust.append(self.share.get(i, np.nan))
        return np.array(trust)

    def verdict(self, f: Frame, agents: np.ndarray) -> Any:
        tracks = self.tracks(f)
        return tracks, agents, shown(tracks)


class BinaryBeta(Votes):
    def __init__(self, K: int, window: int = 10):
        super().__init__(K, window, 1.0)
        self.s, self.f = np.zeros(K), np.zeros(K)

    def judge(self, f: Frame) -> Any:
        for j in range(len(f.ids)):
            watchers = np.flatnonzero(f.looks[:, j])
            hits = int(f.hit[:, j].sum())
            if len(watchers) > 1 and 2 * hits != len(watchers):
                agree = f.hit[watchers, j] == (2 * hits > len(watchers))
                self.s[watchers] += agree
                self.f[watchers] += ~agree
        return self.verdict(f, (self.s + 1) / (self.s + self.f + 2))


class RfsnBeta(Votes):
    def __init__(self, K: int, w: float = 0.98, window: int = 10):
        super().__init__(K, window)
        self.w, self.belief = w, np.zeros((K, 2))

    def judge(self, f: Frame) -> Any:
        self.belief = self.w * self.belief + self.agreement(f)
        self.trust = (self.belief[:, 0] + 1) / (self.belief.sum(axis=1) + 2)
        return self.verdict(f, self.trust.copy())


class Cusum(Votes):
    def __init__(self, K: int, h: float = 7.0, window: int = 10):
        super().__init__(K, window, 1.0)
        self.h, self.g, self.last = h, np.zeros(K), [deque(maxlen=30) for _ in range(K)]

    def judge(self, f: Frame) -> Any:
        alarm = np.zeros(self.K, dtype=bool)
        for k in range(self.K):
            self.last[k].extend(f.distance2[k][~np.isnan(f.distance2[k])])
            tail = chi2.cdf(sum(self.last[k]), 60)
            alarm[k] = len(self.last[k]) == 30 and not 1e-4 <= tail <= 1 - 1e-4
        for k, j in itertools.product(range(self.K), range(len(f.ids))):
            others = sum(f.hit[o, j] and not alarm[o] for o in range(self.K) if o != k)
            if others >= 2 and f.looks[k, j]:
                p, q = f.p_detect[k], f.p_detect[k] / 2
                self.g[k] = max(0.0, self.g[k] + math.log(q / p if f.hit[k, j] else (1 - q) / (1 - p)))
        self.trust = np.where(alarm, 0.0, 1 - np.minimum(1, self.g / (2 * self.h)))
        return self.verdict(f, self.trust.copy())


class PathTrust(Votes):
    def __init__(self, K: int, anchor: int, ageing: float = 0.99, window: int = 10):
        super().__init__(K, window)
        self.anchor, self.ageing = anchor, ageing
        self.n, self.alike = np.zeros((K, K)), np.zeros((K, K))

    def judge(self, f: Frame) -> Any:
        both = f.looks[:, None] & f.looks[None]
        self.n = self.ageing * self.n + both.sum(axis=-1)
        self.alike = self.ageing * self.alike + (both & (f.hit[:, None] == f.hit[None])).sum(axis=-1)
        t, c = (self.alike + 1) / (self.n + 2), self.n / (self.n + 20)
        agents, weight = np.full(self.K, np.nan), np.zeros(self.K)
        agents[self.anchor] = weight[self.anchor] = 1.0
        for k in set(range(self.K)) - {self.anchor}:
            confidence, trust = max(self.paths(k, t, c))
            if confidence > 0:
                agents[k], weight[k] = trust, trust * confidence
        self.trust = weight
        return self.verdict(f, agents)

    def paths(self, k: int, t: np.ndarray, c: np.ndarray) -> Any:
        """(confidence, trust) of every path from the anchor to k."""
        between = [o for o in range(self.K) if o not in (k, self.anchor)]
        for steps in range(len(between) + 1):
            for chosen in itertools.permutations(between, steps):
                edges = list(itertools.pairwise((self.anchor, *chosen, k)))
                yield math.prod(c[edge] for edge in edges), math.prod(t[edge] for edge in edges)


class Counts:
    """What the defenses share that count looks and hits which are forgotten."""

    def __init__(self, K: int, gamma: float):
        self.K, self.gamma = K, gamma
        self.n: dict[int, np.ndarray] = defaultdict(lambda: np.zeros(K))
        self.h: dict[int, np.ndarray] = defaultdict(lambda: np.zeros(K))

    def count(self, f: Frame) -> None:
        for j, i in enumerate(f.ids):
            looks = f.looks[:, j]
            self.n[i] = np.where(looks, self.gamma * self.n[i] + 1, self.n[i])
            self.h[i] = np.where(looks, self.gamma * self.h[i] + f.hit[:, j], self.h[i])

    def rounded(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        return np.floor(self.n[i] + 0.5), np.floor(self.h[i] + 0.5)


class ScoreAsymmetry(Counts):
    def __init__(self, K: int, l: int = 0, a: float = 1e-3, gamma: float = 0.95):  # noqa: E741
        super().__init__(K, gamma)
        self.l, self.a = l, a

    def judge(self, f: Frame) -> Any:
        self.count(f)
        publish = np.ones(len(f.ids), dtype=bool)
        for j, i in enumerate(f.ids):
            n, h = self.rounded(i)
            p = np.sort(binom.cdf(h, n, f.p_detect)[n >= 3])
            publish[j] = len(p) <= self.l or p[self.l] >= self.a / (2 * len(p))
        return np.full(len(f.ids), np.nan), np.full(self.K, np.nan), publish


class DawidSkene(Counts):
    def __init__(
        self, K: int, p: float = 0.8, rho: float = 0.98, gamma: float = 0.9, real: Any = (9, 1), fake: Any = (0.5, 9.5)
    ):
        super().__init__(K, gamma)
        self.p, self.rho, self.priors, self.sums = p, rho, np.array([real, fake]), np.zeros((2, 2, K))

    def judge(self, f: Frame) -> Any:
        self.count(f)
        a, b = self.rates()
        z = np.zeros(len(f.ids))
        for j, i in enumerate(f.ids):
            n, h = self.n[i], self.h[i]
            logit = math.log(self.p / (1 - self.p)) + (h * np.log(a / b) + (n - h) * np.log((1 - a) / (1 - b))).sum()
            z[j] = 1 / (1 + math.exp(-logit))
        self.sums *= self.rho
        misses = f.looks & ~f.hit
        for real, weight in enumerate((z, 1 - z)):
            self.sums[real, 0] += (f.hit * weight).sum(axis=1)
            self.sums[real, 1] += (misses * weight).sum(axis=1)
        a, b = self.rates()
        return z, np.clip(a - b, 0, 1), shown(z)

    def rates(self) -> np.ndarray:
        """a and b, [2, K]."""
        totals = self.sums + self.priors[..., None]
        return totals[:, 0] / totals.sum(axis=1)


class Parsimony(Counts):
    def __init__(self, K: int, a: float = 1e-3, epsilon: float = 0.02, gamma: float = 0.95, pi: float = 0.25):
        super().__init__(K, gamma)
        self.a, self.epsilon, self.pi = a, epsilon, pi

    def judge(self, f: Frame) -> Any:
        self.count(f)
        claims, denials = [], []
        for i in f.ids:
            n, h = self.rounded(i)
            up = (n > 0) & (binom.sf(h - 1, n, self.epsilon) < self.a)
            claims.append(set(np.flatnonzero(up)))
            denials.append(set(np.flatnonzero((n > 0) & ~up & (binom.cdf(h, n, f.p_detect) < self.a))))
        pi = np.where(np.isnan(f.prior), self.pi, f.prior)
        conflicts = {pair for c, d in zip(claims, denials) for pair in itertools.product(c, d)}
        sets = [set(s) for r in range(self.K + 1) for s in itertools.combinations(range(self.K), r)]
        covers = [s for s in sets if all(k in s or o in s for k, o in conflicts)]
        weights = [sum(math.log((1 - pi[k]) / pi[k]) for k in s) for s in covers]
        self.best = [s for s, weight in zip(covers, weights) if weight < min(weights) + 1e-8]
        agents = np.array([np.mean([k not in s for s in self.best]) for k in range(self.K)])
        tracks = np.array([self.trust(c, d) for c, d in zip(claims, denials)])
        return tracks, agents, shown(tracks)

    def trust(self, claims: set[int], denials: set[int]) -> float:
        if not claims | denials:
            return math.nan
        return float(np.mean([1.0 if claims - s else 0.0 if denials - s else 0.5 for s in self.best]))


class Oracle:
    def __init__(self, K: int, lone: str = "hide", epsilon: float = 0.02):
        self.lone, self.epsilon = lone, epsilon
        self.L: dict[int, float] = {}

    def judge(self, f: Frame) -> Any:
        for j, i in enumerate(f.ids):
            gains = [
                math.log(f.p_detect[k] / self.epsilon if f.hit[k, j] else (1 - f.p_detect[k]) / (1 - self.epsilon))
                for k in np.flatnonzero(f.looks[:, j] & (f.roles < 0))
            ]
            if gains:
                self.L[i] = float(np.clip(self.L.get(i, 0.0) + sum(gains), -5, 5))
        lone = 0.0 if self.lone == "hide" else 0.5
        tracks = np.array([1 / (1 + math.exp(-self.L[i])) if i in self.L else lone for i in f.ids])
        return tracks, np.where(f.roles < 0, 1.0, 0.0), shown(tracks)
