"""`joint_posterior` in plain NumPy: every hypothesis written out, logarithms throughout, one world at a time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from typing import Any

import numpy as np
from scipy.special import betaln, gammaln, logsumexp

from trust_env import Evidence, Shape, Verdict
from trust_env.defenses.joint_posterior import JointPosterior

SCALES, MOVING = (0.0, 0.1, 1.0, 4.0), (0.1, 0.8, 0.1)


class JointInNumPy:
    """As a user's own defense. platforms: the number of each agent's platform type, -1 for none."""

    def __init__(self, platforms: tuple[int, ...] = (), **given: Any):
        self.given = JointPosterior(**given).params()
        self.platforms = platforms

    def reset(self, shape: Shape, worlds: np.ndarray) -> None:
        if worlds.all():
            self.worlds: list[OneWorld | None] = [None] * shape.W
        for w in np.flatnonzero(worlds):
            self.worlds[w] = None

    def update(self, evidence: Evidence) -> Verdict:
        shape = evidence.expected.shape
        track_trust, agent_trust = np.full((shape[0], shape[2]), np.nan), np.zeros(shape[:2])
        for w in range(shape[0]):
            world = self.worlds[w]
            if world is None:
                platforms = self.platforms or (-1,) * shape[1]
                world = self.worlds[w] = OneWorld(self.given, shape[1], shape[2], evidence, platforms)
            world.judge(evidence, w, track_trust[w], agent_trust[w])
        return Verdict(track_trust=track_trust, agent_trust=agent_trust)


class OneWorld:
    """Memory and verdict of one world. A sets, G behaviours (φ_alone, φ_together, s, mode)."""

    def __init__(self, given: dict[str, Any], n_agents: int, columns: int, evidence: Evidence, platforms: Any):
        self.g, self.belief, self.agents = given, evidence.belief, range(n_agents)
        size = n_agents if n_agents <= 10 else given["most"]
        self.sets = [frozenset(a) for n in range(size + 1) for a in combinations(self.agents, n)]
        modes = [0] + [1] * given["kinematics"] + [2] * given["exactness"]
        self.behaviours = list(product(given["alone"], given["together"], given["withheld"], modes))
        idle = np.array(
            [x == given["alone"][0] and i == given["together"][0] and s == given["withheld"][0]
             for x, i, s, _ in self.behaviours]
        )  # fmt: skip
        weights = np.where(idle, given["dormant"] / idle.sum(), (1 - given["dormant"]) / max(1, (~idle).sum()))
        with np.errstate(divide="ignore"):
            self.log_g = np.log(weights / weights.sum())
        self.log_a = np.array([self.set_prior(a, platforms) for a in self.sets])
        self.hits, self.looks, self.seen, self.fit, self.fits = np.zeros((5, n_agents, columns))
        self.absent, self.stands, self.mean_hits = np.zeros((3, columns))
        self.mean = np.zeros((columns, 2))
        self.ids, self.listed = np.full(columns, -1), np.zeros(columns, bool)
        self.past = np.zeros((len(self.sets), len(self.behaviours)))
        self.last_motion, self.last_exact = np.zeros((columns, len(SCALES))), np.ones(columns)
        standing = given["standing"]
        moving = [(1 - standing) * share for share in MOVING]
        self.urn_prior = given["standing_weight"] * np.array([standing, *moving])
        self.urn = np.tile(self.urn_prior, (len(self.sets), 1))
        self.pose = np.full((n_agents, 3), np.nan)
        self.gone_alone, self.gone_others = np.zeros((2, len(self.sets)))
        self.gone: dict[frozenset[int], float] = {}
        self.last_trust, self.counted = np.zeros(columns), dict[frozenset[int], float]()
        self.alone_count, self.others_count = np.full((2, len(self.sets)), np.nan)
        self.dispersion, self.frames, self.usual = np.zeros(3), 0, np.zeros(2)

    def set_prior(self, a: frozenset[int], platforms: Any) -> float:
        q, share = self.g["platform_prior"], self.g["platform_share"]
        prior = np.where(np.isnan(self.belief.prior_compromised), self.g["pi"], self.belief.prior_compromised)
        total = sum(np.log(prior[k] if k in a else 1 - prior[k]) for k in self.agents if platforms[k] < 0)
        for platform in {p for p in platforms if p >= 0}:
            own = [k for k in self.agents if platforms[k] == platform]
            alone = np.prod([prior[k] if k in a else 1 - prior[k] for k in own])
            together = np.prod([share if k in a else 1 - share for k in own])
            total += np.log((1 - q) * alone + q * together)
        return float(total)

    def judge(self, e: Evidence, w: int, track_trust: np.ndarray, agent_trust: np.ndarray) -> None:
        g = self.g
        self.survey(e, w)
        self.past *= g["memory"]
        self.urn = self.urn_prior + g["memory"] * (self.urn - self.urn_prior)
        self.usual *= 0.98
        self.gone_alone, self.gone_others = g["memory"] * self.gone_alone, g["memory"] * self.gone_others
        self.gone = {region: g["memory"] * n for region, n in self.gone.items()}
        for j in np.flatnonzero(self.ids != e.track_id[w]).tolist():
            self.bury(j)
            self.ids[j] = e.track_id[w, j]
        self.look(e, w)
        urn, total, tracks = self.urn.copy(), np.zeros_like(self.past), {}
        self.counted = dict(self.gone)
        for j in np.flatnonzero(e.confirmed[w]).tolist():
            region = frozenset(self.watchers(j))
            if region in self.regions:
                self.counted[region] = self.counted.get(region, 0.0) + 1
        for j in np.flatnonzero(e.confirmed[w]).tolist():
            self.last_motion[j] = self.motion(e, w, j)
            self.last_exact[j] = self.exactness(j)
            log, real, watchers, hitters = self.track(j, urn)
            total += np.logaddexp(log - log.max(), -g["cap_track"])
            tracks[j] = real, watchers, hitters
        log_w = self.past + total + self.log_a[:, None] + self.log_g + self.counting(tracks)
        weight = np.exp(log_w - logsumexp(log_w))  # [A, G]
        of_set = weight.sum(axis=1)
        agent_trust[:] = [1 - sum(p for p, a in zip(of_set, self.sets) if k in a) for k in self.agents]
        agent_trust[:] = np.clip(agent_trust, 0, 1)
        seen = np.zeros(len(self.sets))
        self.count_absence(e, w, agent_trust)
        for j, (real, watchers, hitters) in tracks.items():
            trust = self.last_trust[j] = min(1.0, (weight * real).sum())
            within = logsumexp(log_w, axis=1, keepdims=True)
            seen += (np.exp(log_w - within) * real).sum(axis=1) * [bool(watchers - a) for a in self.sets]
            if len(hitters) >= 2 and e.age[w, j] >= 3:
                d2 = e.distance2[w, e.hit[w, :, j], j]
                self.usual += trust * np.array([np.minimum(d2, 9).sum() / 2, d2.size])
            if g["departures"] and self.absent[j] > 0:
                trust /= 1 + g["gap"] * (1 - self.belief.p_detect[0]) ** -self.absent[j]
            track_trust[j] = trust
        self.others_count += 0.1 * (seen - self.others_count)
        self.listed |= e.confirmed[w]

    def bury(self, j: int) -> None:
        if self.listed[j] and self.g["memory"] > 0:
            log, _, watchers, _ = self.track(j, self.urn)
            region = frozenset(watchers)
            self.gone_alone += [bool(watchers) and watchers <= a for a in self.sets]
            self.gone_others += self.last_trust[j] * np.array([bool(watchers - a) for a in self.sets])
            if region in self.regions:
                self.gone[region] = self.gone.get(region, 0.0) + 1
            said = np.logaddexp(log - log.max(), -self.g["cap_track"])
            self.past += np.maximum(said, -self.g["cap_dead"])
        self.listed[j] = False
        for array in (self.hits, self.looks, self.seen, self.fit, self.fits):
            array[:, j] = 0
        self.absent[j] = self.stands[j] = self.mean_hits[j] = 0

    def look(self, e: Evidence, w: int) -> None:
        gamma, p_detect = self.g["gamma"], self.belief.p_detect
        for k, j in product(self.agents, np.flatnonzero(e.status[w] > 0)):
            hit, inside, gain, weight = e.hit[w, k, j], e.inside[w, k, j], 0.0, 1.0
            if not self.g["edges"]:
                inside = float(e.expected[w, k, j] or hit)
            missed = not hit and not e.detected[w, k, j] and inside > 0.01
            if hit:
                gain = np.log(p_detect[k] * max(inside, 0.01))
            elif missed:
                gain = np.log(1 - p_detect[k] * inside**2)
                weight = gain / np.log(1 - p_detect[k])
            if hit or missed:
                self.hits[k, j] = gamma * self.hits[k, j] + hit
                self.looks[k, j] = gamma * self.looks[k, j] + weight
                self.seen[k, j] = gamma * self.seen[k, j] + gain
            if hit and e.age[w, j] >= 3:
                self.fit[k, j] = gamma * self.fit[k, j] + min(e.distance2[w, k, j], 9)
                self.fits[k, j] = gamma * self.fits[k, j] + 1
        for k in self.agents:
            for d in range(e.detection_count[w, k]):
                if e.assignment[w, k, d] >= 0:
                    self.compare(e, w, k, e.assignment[w, k, d], e.detections[w, k, d])

    def compare(self, e: Evidence, w: int, k: int, j: int, z: np.ndarray) -> None:
        n = self.mean_hits[j]
        if n > 0:
            still = gaussian(z - self.mean[j], self.belief.noise_cov[k] * (1 + 1 / n))
            moving = gaussian(e.innovation[w, k, j], e.innovation_cov[w, k, j])
            self.stands[j] = np.clip(self.stands[j] + max(-3, still - moving), -10, 10)
        self.mean_hits[j] = min(50, n + 1)
        self.mean[j] = z if n == 0 else self.mean[j] + (z - self.mean[j]) / self.mean_hits[j]

    def motion(self, e: Evidence, w: int, j: int) -> np.ndarray:
        v = self.belief.velocity_variance
        p = e.track_cov[w, j, 2:, 2:].trace() / 2
        known = max(1 - p / v, 1e-3)
        velocity, variance = e.track_mean[w, j, 2:] / known, p / known
        moving = [gaussian(velocity, (variance + s * v) * np.eye(2)) for s in SCALES[1:]]
        usual = gaussian(velocity, (variance + v) * np.eye(2))
        logs = np.array([self.stands[j], *(m - usual for m in moving)])
        return np.exp(logs - logs.max())

    def exactness(self, j: int) -> float:
        tau, usual = self.g["tau"], (self.usual[0] + 20) / (self.usual[1] + 20)
        ratio = self.fit[:, j].sum() / 2 / usual * (1 - 1 / tau) - self.fits[:, j].sum() * np.log(tau)
        return float(np.exp(np.clip(ratio, -self.g["cap_fit"], self.g["cap_fit"])))

    def patterns(self, j: int) -> Iterator[tuple[float, float, float]]:
        """ln of (1-κ) P, (1-κ) S and κ O by agent."""
        eps, kappa = self.g["eps"], self.g["kappa"]
        for k in self.agents:
            h, n = self.hits[k, j], self.looks[k, j]
            m, rest = max(0, n - h), np.log1p(-kappa)
            with np.errstate(divide="ignore"):
                yield (
                    self.seen[k, j] + rest,
                    h * np.log(eps) + m * np.log1p(-eps) + rest,
                    betaln(h + 1, m + 1) + gammaln(h + m + 2) - gammaln(n + 2) + np.log(kappa),
                )

    def watchers(self, j: int) -> set[int]:
        return {k for k in self.agents if self.looks[k, j] > 0.3 * self.looks[:, j].max()}

    def share_alone(self, share: float, a: int, region: frozenset[int]) -> float:
        """φ in a region of a share φ of all tracks that only set a watches."""
        if share == self.g["alone"][0] or not self.counted.get(region):
            return share
        found = sum(n for r, n in self.counted.items() if r <= self.sets[a])
        area = (self.regions[region] + 0.02) / (self.alone_area[a] + 0.02)
        return float(np.clip(1 - (1 - share) * found * area / self.counted[region], self.g["alone"][0], 0.95))

    def track(self, j: int, urn: np.ndarray) -> tuple[np.ndarray, np.ndarray, set[int], set[int]]:
        """ln of the track's likelihood, P(real) [A, G]; who watches; who has certainly hit. The urns learn."""
        g, watchers = self.g, self.watchers(j)
        hitters = {k for k in watchers if self.hits[k, j] > 3}
        patterns = [np.exp(np.array(p) - max(p)) for p in self.patterns(j)]
        log, real = np.zeros_like(self.past), np.zeros_like(self.past)
        for a, members in enumerate(self.sets):
            share_of = urn[a] / urn[a].sum()
            usual = share_of @ self.last_motion[j]
            limit = np.exp(g["cap_motion"])
            standing = np.clip(self.last_motion[j, 0] / max(usual, 1e-300), 1 / limit, limit)
            marks = (1.0, 0.1 + 0.9 * standing, 0.1 + 0.9 * self.last_exact[j])
            false = sum(
                np.log(g["r"] * p + (1 - g["r"]) * s + o if k in members else s + o)
                for k, (p, s, o) in enumerate(patterns)
            )
            by_level = {
                level: sum(
                    np.log((1 - level) * p + level * s + o if k in members else p + o)
                    for k, (p, s, o) in enumerate(patterns)
                )
                for level in g["withheld"]
            }
            own, others = bool(watchers & members), bool(watchers - members)
            for b, (alone, together, level, mode) in enumerate(self.behaviours):
                share = together if others else self.share_alone(alone, a, frozenset(watchers))
                share = share if own else g["natural"]
                mark = marks[mode] if own else 1.0
                terms = np.log1p(-share) + by_level[level], np.log(share) + false + np.log(mark)
                log[a, b] = np.logaddexp(*terms)
                real[a, b] = np.exp(terms[0] - log[a, b])
            if len(hitters - members) >= 2:
                urn[a] += urn[a] * self.last_motion[j] / (urn[a] @ self.last_motion[j])
        return log, real, watchers, hitters

    def survey(self, e: Evidence, w: int) -> None:
        if np.array_equal(self.pose, e.pose[w]):
            return
        self.pose, covered = e.pose[w].copy(), e.covered[w]
        anywhere = covered.any(axis=0).sum()
        self.others_area = np.array(
            [covered[[k for k in self.agents if k not in a]].any(axis=0).sum() / anywhere for a in self.sets]
        )
        self.alone_area = 1 - self.others_area
        regions, counts = np.unique(covered[:, covered.any(axis=0)].T, axis=0, return_counts=True)
        self.regions = {frozenset(np.flatnonzero(r).tolist()): n / anywhere for r, n in zip(regions, counts)}

    def counting(self, tracks: dict[int, Any]) -> np.ndarray:
        """ln of how much better shares of false tracks explain the counts of tracks that only A watches; [A, G]."""
        watched = [frozenset(watchers) for _, watchers, _ in tracks.values()]
        shared = {r: area for r, area in self.regions.items() if len(r) >= 2}
        gone = sum(n for r, n in self.gone.items() if len(r) >= 2)
        density = (sum(len(x) >= 2 for x in watched) + gone + 0.5) / (sum(shared.values()) + 0.05)
        used = [(self.counted.get(r, 0.0), density * area) for r, area in shared.items() if area > 0.01]
        now = np.array([[(n - mu) ** 2, mu, mu**2] for n, mu in used]).reshape(-1, 3).sum(axis=0)
        self.frames += 1
        self.dispersion += max(0.02, 1 / self.frames) * (now - self.dispersion)
        inverse = np.clip((self.dispersion[0] - self.dispersion[1] + 1) / (self.dispersion[2] + 2), 0.1, 10)
        alone = np.array([sum(bool(x) and x <= a for x in watched) for a in self.sets], float)
        others = np.array([sum(bool(x - a) for x in watched) for a in self.sets], float)
        if np.isnan(self.alone_count).any():
            self.alone_count, self.others_count = alone, others
        else:
            self.alone_count = self.alone_count + 0.1 * (alone - self.alone_count)
        others, alone = self.others_count + self.gone_others, self.alone_count + self.gone_alone
        mean = (others + 1) / (self.others_area + 0.1) * (self.alone_area + 0.02)
        k = 1 / (inverse + 1 / (others + 1))
        gain = np.zeros_like(self.past)
        for b, (share, _, _, _) in enumerate(self.behaviours):
            if self.g["counts"] and share > self.g["alone"][0]:
                ratio = negative_binomial((1 - share) * alone, k, mean) - negative_binomial(alone, k, mean)
                gain[:, b] = np.clip(ratio, -self.g["cap_count"], self.g["cap_count"])
        return gain

    def count_absence(self, e: Evidence, w: int, agent_trust: np.ndarray) -> None:
        for j in np.flatnonzero(e.status[w] > 0):
            hit = e.hit[w, :, j]
            missed = e.expected[w, :, j] & ~hit & ~e.detected[w, :, j]
            best = agent_trust[hit].max(initial=0.0)
            more = self.absent[j] + agent_trust[missed].sum() * (1 - best)
            self.absent[j] = 0.0 if best > 0.5 else min(8.0, more)


def gaussian(x: np.ndarray, cov: np.ndarray) -> float:
    """ln N(x; 0, cov) without -ln 2π."""
    return float(-0.5 * (x @ np.linalg.solve(cov, x) + np.log(np.linalg.det(cov))))


def negative_binomial(n: Any, k: Any, mean: Any) -> Any:
    """ln NB(n) with this mean and variance mean + mean²/k."""
    return gammaln(n + k) - gammaln(k) - gammaln(n + 1) + k * np.log(k / (k + mean)) + n * np.log(mean / (k + mean))
