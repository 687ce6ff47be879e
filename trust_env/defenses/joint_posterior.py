"""`joint_posterior`: which agents are compromised and which tracks are real, together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import ACCEPT, BuiltIn
from trust_env.defenses.joint.areas import count_alone, learn_dispersion, survey, weigh_counts
from trust_env.defenses.joint.hypotheses import (
    MOST_SETS,
    adversary_sets,
    behaviours,
    count_sets,
)
from trust_env.defenses.joint.looks import compare_motions, count_absence, count_looks, forget_track
from trust_env.defenses.joint.patterns import note_watchers, weigh_patterns
from trust_env.defenses.joint.posterior import (
    judge_track,
    multiply_track,
    remember_track,
    take_logarithms,
    weigh_hypotheses,
    weigh_track,
)
from trust_env.defenses.joint.velocities import weigh_fit, weigh_velocity
from trust_env.world.tracking.track_store import list_confirmed

_OFF = 60.0


class JointPosterior(BuiltIn):
    """Posterior over the sets of compromised agents, with every track real or false."""

    parameters: ClassVar = {
        "members": "i8 Sets | bit k: agent k is in the set",
        "parent": "i8 Sets | the set without its lowest agent",
        "lowest": "i8 Sets | that agent",
        "set_prior": "f8 Sets | ln p(A)",
        "share": "f8 Cases | φ of a case",
        "withheld": "i8 Cases | the place of its s",
        "mode": "i8 Cases",
        "levels": "f8 Levels | s",
        "first": "i8 4 | cases by who watches",
        "case": "i8 Behaviours 3 | of a behaviour",
        "alone": "i8 Behaviours | the place of its φ_alone",
        "prior": "f8 Behaviours | ln p(g)",
        "modes": "i8",
        "scales": "f8 Scales | σ_c² as shares of the velocity variance of a new track",
        "scale_prior": "f8 Scales | tracks",
        "least": "f8 | of a pattern's likelihood",
        **dict.fromkeys(
            ("eps", "kappa", "r", "gamma", "memory", "tau", "gap", "fit_weight", "marked_share", "urn_weight"), "f8"
        ),
        **dict.fromkeys(("cap_track", "cap_dead", "cap_velocity", "cap_fit", "cap_count", "count_cost"), "f8"),
        **dict.fromkeys(("counts", "kinematics", "exactness", "departures", "edges", "proper"), "f8"),
    }
    memory: ClassVar = {
        "track_id": "i8 J",
        "was_listed": "b1 J",
        "hits": "f8 K J | h",
        "looks": "f8 K J | n",
        "seen": "f8 K J | nats",
        "fit": "f8 K J | Σ min(d², 9)",
        "fits": "f8 K J",
        "absent": "f8 J | u",
        "stands": "f8 J | nats",
        "spot": "f8 J 2 | m",
        "spot_hits": "f8 J",
        "velocity": "f8 J Scales",
        "standing": "f8 J",
        "exact": "f8 J",
        "past": "f8 Sets Cases | nats",
        "urn": "f8 Sets Scales | tracks",
        "pose": "f8 K 3",
        "regions": "i8",
        "region": "i8 Regions",
        "region_area": "f8 Regions",
        "alone_area": "f8 Sets",
        "others_area": "f8 Sets",
        "alone_count": "f8 Sets",
        "others_count": "f8 Sets",
        "dispersion": "f8 3",
        "frames": "f8",
        "fit_sum": "f8",
        "fit_count": "f8",
    }
    scratch: ClassVar = {
        "false_ratio": "f8 J K",
        "real_ratio": "f8 J K Levels",
        "real": "f8 J",
        "false": "f8 J",
        "watchers": "i8 J",
        "hitters": "i8 J",
        "real_likelihood": "f8 Sets Levels",
        "false_likelihood": "f8 Sets",
        "mark": "f8 J Sets 3",
        "likelihood": "f8 Sets Cases",
        "product": "f8 Sets Cases",
        "log_product": "f8 Sets Cases",
        "urn_now": "f8 Sets Scales",
        "count_gain": "f8 Sets Shares",
        "weight": "f8 Sets",
        "behaviour": "f8 Behaviours",
        "case_weight": "f8 Sets Cases",
        "others_seen": "f8 Sets",
        "region_count": "f8 Regions",
    }
    needs: ClassVar = ("innovations", "inside", "coverage")

    def __init__(
        self,
        pi: float = 0.25,
        eps: float = 0.02,
        kappa: float = 0.005,
        r: float = 0.8,
        gamma: float = 0.97,
        memory: float = 0.995,
        dormant: float = 0.1,
        natural: float = 0.02,
        together=(0.005, 0.1, 0.5),
        alone=(0.005, 0.25, 0.8),
        levels=(0.005, 0.5),
        tau=0.05,
        gap=0.01,
        fit_weight=20.0,
        marked_share=0.9,
        scales=(0.0, 0.1, 1.0, 4.0),
        scale_prior=(0.02, 0.1, 0.78, 0.1),
        scale_weight=4.0,
        urn_weight=1.0,
        cap_track=6.0,
        cap_dead=12.0,
        cap_velocity=6.0,
        cap_fit=12.0,
        cap_count=8.0,
        count_cost=0.0,
        counts=True,
        kinematics=True,
        exactness=True,
        departures=True,
        edges=True,
        proper=False,
        most: int = 3,
    ):
        self._given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        self.given = self._given

    def params(self) -> dict[str, Any]:
        return dict(self._given)

    def _behaviours(self):
        g = self.given
        modes = [0] + [1] * bool(g["kinematics"]) + [2] * bool(g["exactness"])
        return behaviours(g["natural"], g["together"], g["alone"], g["levels"], modes, g["dormant"])

    def lengths(self, n_agents: int) -> dict[str, int]:
        tables = self._behaviours()
        sets = count_sets(n_agents, self.given["most"])
        if sets > MOST_SETS:
            raise ValueError("too many")
        return {
            "Sets": sets,
            "Cases": len(tables.share),
            "Levels": len(tables.levels),
            "Behaviours": len(tables.prior),
            "Shares": len(self.given["alone"]),
            "Scales": len(self.given["scales"]),
            "Regions": min(2**n_agents, 1600),
        }

    def values(self, n_agents: int) -> dict[str, Any]:
        g, tables = self.given, self._behaviours()
        sets = adversary_sets(n_agents, g["most"])
        pi = np.full(n_agents, g["pi"])
        size = np.array([bin(m).count("1") for m in sets.members])
        numbers = {name: g[name] for name in self.parameters if name in g and self.parameters[name] == "f8"}
        return (
            sets._asdict()
            | tables._asdict()
            | numbers
            | {
                "set_prior": size * math.log(g["pi"] / (1 - g["pi"])),
                "modes": 1 + bool(g["kinematics"]) + bool(g["exactness"]),
                "scales": g["scales"],
                "scale_prior": np.array(g["scale_prior"]) * g["scale_weight"],
                "least": 10.0 ** (-250 / n_agents),
            }
        )

    @staticmethod
    @kernel
    def reset(world):
        joint = world.joint_posterior
        for j in range(joint.track_id.shape[0]):
            forget_track(world, j)
        for a in range(joint.members.shape[0]):
            for y in range(joint.share.shape[0]):
                joint.past[a, y] = 0.0
            for s in range(joint.scales.shape[0]):
                joint.urn[a, s] = joint.scale_prior[s]
            joint.alone_count[a], joint.others_count[a] = np.nan, np.nan
        for k in range(joint.pose.shape[0]):
            joint.pose[k, 0] = np.nan
        for i in range(3):
            joint.dispersion[i] = 0.0
        joint.frames, joint.fit_sum, joint.fit_count = 0.0, 0.0, 0.0

    @staticmethod
    @kernel
    def judge(world):
        joint = world.joint_posterior
        survey(world)
        _begin(world)
        _bury(world)
        count_looks(world)
        compare_motions(world)
        listed = list_confirmed(world)
        block = int(600.0 / joint.cap_track)
        for c in range(listed):
            j = world.scratch.listing[c]
            note_watchers(world, c, j)
            weigh_patterns(world, c, j)
            weigh_velocity(world, j)
            weigh_fit(world, j)
            multiply_track(world, c, weigh_track(world, c, j))
            if c % block == block - 1:
                take_logarithms(world)
        take_logarithms(world)
        learn_dispersion(world, listed)
        count_alone(world, listed)
        weigh_counts(world)
        weigh_hypotheses(world)
        _judge_agents(world)
        _judge_tracks(world, listed)


@kernel
def _begin(world):
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        joint.others_seen[a] = 0.0
        for y in range(joint.share.shape[0]):
            joint.past[a, y] *= joint.memory
            joint.product[a, y], joint.log_product[a, y] = 1.0, 0.0
        for s in range(joint.scales.shape[0]):
            joint.urn_now[a, s] = joint.scale_prior[s] + joint.memory * (joint.urn[a, s] - joint.scale_prior[s])


@kernel
def _bury(world):
    """Tracks that are gone leave what they said; new ones begin with nothing."""
    joint = world.joint_posterior
    for j in range(joint.track_id.shape[0]):
        if joint.track_id[j] != world.tracks.id[j]:
            if joint.was_listed[j]:
                note_watchers(world, 0, j)
                weigh_patterns(world, 0, j)
                remember_track(world, 0, weigh_track(world, 0, j))
            forget_track(world, j)
    for a in range(joint.members.shape[0]):
        for s in range(joint.scales.shape[0]):
            joint.urn[a, s] = joint.urn_now[a, s]


@kernel
def _judge_agents(world):
    joint, verdict = world.joint_posterior, world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        guilt = 0.0
        for a in range(joint.members.shape[0]):
            if (joint.members[a] >> k) & 1 == 1:
                guilt += joint.weight[a]
        trust = min(1.0, max(0.0, 1.0 - guilt))
        verdict.agent_trust[k], verdict.agent_trust_var[k] = trust, trust * (1.0 - trust)


@kernel
def _judge_tracks(world, listed):
    joint, verdict = world.joint_posterior, world.verdict
    joint.fit_sum *= 0.98
    joint.fit_count *= 0.98
    for j in range(world.tracks.count):
        count_absence(world, j)
    for c in range(listed):
        j = world.scratch.listing[c]
        trust = judge_track(world, c)
        _learn_fit(world, c, j, trust)
        if joint.departures != 0.0 and joint.absent[j] > 0.0:
            trust *= 1.0 / (1.0 + joint.gap * math.exp(-world.agents.miss_gain[0] * joint.absent[j]))
        trust = min(1.0, max(0.0, trust))
        verdict.track_trust[j], verdict.track_trust_var[j] = trust, trust * (1.0 - trust)
        verdict.publish[j] = trust >= ACCEPT
    for j in range(world.tracks.count):
        joint.was_listed[j] = False
    for c in range(listed):
        joint.was_listed[world.scratch.listing[c]] = True
    for a in range(joint.members.shape[0]):
        joint.others_count[a] += 0.1 * (joint.others_seen[a] - joint.others_count[a])


@kernel
def _learn_fit(world, c, j, trust):
    joint = world.joint_posterior
    hitters = joint.hitters[c]
    if hitters & (hitters - 1) != 0 and world.tracks.age[j] >= 3:
        for k in range(joint.hits.shape[0]):
            distance2 = world.evidence.distance2[k, j]
            if not np.isnan(distance2):
                joint.fit_sum += trust * 0.5 * min(distance2, 9.0)
                joint.fit_count += trust
