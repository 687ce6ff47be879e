"""`joint_posterior`: which agents are compromised and which tracks are real, together, by exact enumeration.

Hypotheses are sets A of adversaries times behaviours g of the coalition; given both, tracks are independent and
sum out in closed form. The parts stand in `trust_env.defenses.joint`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from trust_env.compiled.kernels import kernel
from trust_env.defenses.base import ACCEPT, BuiltIn
from trust_env.defenses.joint.areas import (
    RATE,
    count_alone,
    count_gone,
    count_tracks,
    learn_dispersion,
    survey,
    weigh_counts,
)
from trust_env.defenses.joint.hypotheses import (
    EXACT,
    MOST_AGENTS,
    MOST_EXACT,
    MOST_SETS,
    PLAIN,
    STANDING,
    Behaviours,
    adversary_sets,
    all_sets,
    behaviours,
    count_sets,
    weigh_priors,
)
from trust_env.defenses.joint.looks import compare_motions, count_absence, count_looks, forget_track
from trust_env.defenses.joint.motions import FIT_RATE, MOVING, SCALES, learn_fit, weigh_fit, weigh_motion
from trust_env.defenses.joint.patterns import note_watchers, weigh_patterns
from trust_env.defenses.joint.posterior import (
    multiply_track,
    probability_of_real,
    remember_track,
    take_logarithms,
    weigh_hypotheses,
    weigh_track,
)
from trust_env.defenses.joint.settings import check_settings
from trust_env.world.coverage import CELLS
from trust_env.world.tracking.track_store import list_confirmed

_LEAST_EXPONENT = -250.0  # a product over all agents stays above 10 to this


class JointPosterior(BuiltIn):
    """Posterior probability of every set of adversaries and of every track, from all looks together.

    A set A of agents has the prior Π π_k (`pi`, or the scenario's own prior of an agent), with `platform_prior` and
    `platform_share` for agents of one platform type: a type is compromised as a whole with probability
    `platform_prior`, each of its agents then with `platform_share`. Its behaviour g says which share of the tracks
    that only A watches is false (`alone`), which of those that A and others watch (`together`), how often an
    adversary withholds a target (`withheld`), and how false tracks differ from targets (mode: not at all, they stand
    still, they fit too well); the behaviour that does least has the prior `dormant`, the others share the rest.
    Exact for up to ten agents; of more, sets of at most `most` adversaries are considered, which a warning says
    when the worlds are built; more than 8192 such sets or 62 agents raise ValueError then.

    Each term rests on an assumption, and can be switched off:

    looks          hits are independent and occur with the tracker's P_D, on a false track with probability `eps`,
                   an adversary mimics a target with probability `r` (0: off) on a false track; with `kappa` (0: off)
                   any rate of hits. `gamma` forgets looks; below 1 they become fewer than they were
    edges          a look counts as far as the track lies in the FOV, by its mean and covariance
    kinematics     few tracks stand still unless many do that agents outside A vouch for: `standing`, with a weight of
                   `standing_weight` tracks; the tracker's velocity variance is about right
    exactness      honest hits scatter about as on tracks that several agents hit; with the share `tau` of that d²
                   they are too good
    counts         tracks are spread over what is covered, as unevenly as they are where several agents watch
    departures     a target that has left is missed by those who watch; one look in `gap` is the first of such
    memory         tracks that are gone still say what they said, and still count (0: off); a factor per frame
    cap_track      no track outweighs this many nats (60: off); cap_dead, cap_motion, cap_fit and cap_count are the
                   same of a track that is gone, of the motion, of the fit and of the count

    `natural` is the share of false tracks where nobody of A watches. Track trust is the posterior probability that a
    track is real, agent trust that of being benign; variances are p(1 - p). For the paper's cases, where the places
    of tracks say nothing and targets stand still, use counts=False, kinematics=False, exactness=False.

    Raises ValueError for a parameter out of its range.
    """

    parameters: ClassVar = {
        "members": "i8 Sets | bit k: agent k is in the set",
        "parent": "i8 Sets | the set without its lowest agent",
        "lowest": "i8 Sets | that agent",
        "levels": "f8 Levels | s",
        "first": "i8 4 | the first case of each class",
        "case": "i8 Behaviours 3 | by class",
        "alone": "i8 Behaviours | the place of its φ_alone",
        "prior": "f8 Behaviours | p(g)",
        "modes": "i8 Modes",
        "shares": "i8 3 | how many φ by class",
        "natural": "f8 | φ where nobody of the set watches",
        "together_share": "f8 SharedShares | φ_together",
        "alone_share": "f8 Shares | φ_alone",
        "scales": "f8 Scales | σ_c² as shares of the velocity variance of a new track",
        "urn_prior": "f8 Scales | tracks",
        "most_motion": "f8 | likelihood ratio",
        "least": "f8 | of an agent's likelihood, in units of its greatest",
        "ln_eps": "f8 | ln ε",
        "ln_not_eps": "f8 | ln(1 - ε)",
        **dict.fromkeys(
            ("pi", "kappa", "r", "gamma", "memory", "tau", "gap", "platform_prior", "platform_share"), "f8"
        ),
        **dict.fromkeys(("cap_track", "cap_dead", "cap_motion", "cap_fit", "cap_count"), "f8 | nats"),
        **dict.fromkeys(("counts", "edges", "departures"), "f8 | 1: on"),
    }
    memory: ClassVar = {
        "set_prior": "f8 Sets | ln p(A)",
        "track_id": "i8 J | whose memory this is",
        "was_listed": "b1 J | the track was judged in the frame before",
        "hits": "f8 K J | h",
        "looks": "f8 K J | n",
        "seen": "f8 K J | nats, log-likelihood of the looks at a real track",
        "fit": "f8 K J | Σ min(d², 9) of hits",
        "fits": "f8 K J | how many",
        "absent": "f8 J | u, looks",
        "stands": "f8 J | nats, log-likelihood ratio of standing still",
        "mean_position": "f8 J 2 | m, of the hits",
        "mean_hits": "f8 J | how many",
        "motion": "f8 J Scales | likelihood by scale",
        "exact": "f8 J | likelihood ratio",
        "past": "f8 Sets Cases | nats, of tracks that are gone",
        "urn": "f8 Sets Scales | tracks, gone ones",
        "pose": "f8 K 3 | m, m, rad: the poses of these areas",
        "regions": "i8 | how many",
        "region": "i8 Regions | who covers it, as bits",
        "region_area": "f8 Regions | share of what is covered",
        "alone_area": "f8 Sets | that only the set covers",
        "others_area": "f8 Sets | that somebody else covers",
        "alone_count": "f8 Sets | tracks that only the set watches",
        "others_count": "f8 Sets | real tracks that somebody else watches",
        "gone_alone": "f8 Sets | tracks that are gone, which only the set watched",
        "gone_others": "f8 Sets | real ones, which somebody else watched",
        "gone_region": "f8 Regions | tracks that are gone",
        "region_count": "f8 Regions | tracks, gone ones too",
        "alone_found": "f8 Sets | tracks in regions that only the set covers",
        "last_trust": "f8 J | P(real)",
        "dispersion": "f8 3 | of counts: (n - μ)², μ, μ²",
        "frames": "f8",
        "usual_fit": "f8 | Σ d²/2",
        "usual_fits": "f8 | hits",
    }
    scratch: ClassVar = {
        "false_ratio": "f8 J K | a0/b0 of a listed track",
        "real_ratio": "f8 J K Levels | a1/b1",
        "real": "f8 J | L1 of the empty set",
        "false": "f8 J | L0 of the empty set",
        "watchers": "i8 J | as bits",
        "hitters": "i8 J | as bits",
        "real_likelihood": "f8 Sets Levels | L1 of the track in hand",
        "false_likelihood": "f8 Sets | L0",
        "mark": "f8 J Sets 3 | σ by mode",
        "likelihood": "f8 Sets Cases",
        "product": "f8 Sets Cases",
        "log_product": "f8 Sets Cases | nats",
        "urn_now": "f8 Sets Scales",
        "count_ratio": "f8 Sets Shares",
        "weight": "f8 Sets | w(A)",
        "case_weight": "f8 Sets Cases",
        "others_now": "f8 Sets",
        "share_now": "f8 Sets MostShares | φ of the track in hand",
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
        alone: Sequence[float] = (0.005, 0.25, 0.8),
        together: Sequence[float] = (0.005, 0.1, 0.5),
        withheld: Sequence[float] = (0.005, 0.5),
        standing: float = 0.02,
        standing_weight: float = 4.0,
        tau: float = 0.05,
        gap: float = 0.01,
        platform_prior: float = 0.1,
        platform_share: float = 0.9,
        most: int = 3,
        counts: bool = True,
        kinematics: bool = True,
        exactness: bool = True,
        departures: bool = True,
        edges: bool = True,
        cap_track: float = 6.0,
        cap_dead: float = 2.0,
        cap_motion: float = 6.0,
        cap_fit: float = 12.0,
        cap_count: float = 8.0,
    ):
        self._given = {name: value for name, value in locals().items() if name != "self"}
        check_settings(self._given)

    def params(self) -> dict[str, Any]:
        return dict(self._given)

    def lengths(self, n_agents: int) -> dict[str, int]:
        tables, sets = self._behaviours(), count_sets(n_agents, self._given["most"])
        if n_agents > MOST_AGENTS:
            raise ValueError(f"joint_posterior: there are {n_agents} agents; expected at most {MOST_AGENTS}")
        if sets > MOST_SETS:
            raise ValueError(
                f"joint_posterior: most = {self._given['most']}: {n_agents} agents have {sets} sets of at most so many "
                f"adversaries; expected at most {MOST_SETS} sets"
            )
        given = self._given
        return {
            "Sets": sets,
            "Cases": int(tables.first[-1]),
            "Behaviours": len(tables.prior),
            "Levels": len(given["withheld"]),
            "Modes": len(self._modes),
            "Shares": len(given["alone"]),
            "MostShares": max(len(given["alone"]), len(given["together"])),
            "SharedShares": len(given["together"]),
            "Scales": len(SCALES),
            "Regions": min(2**n_agents, CELLS),
        }

    def values(self, n_agents: int) -> dict[str, Any]:
        given, most = self._given, self._given["most"]
        if not all_sets(n_agents, most):
            text = f"joint_posterior considers at most {most} adversaries among {n_agents} agents"
            warnings.warn(f"{text}; it is exact for up to {MOST_EXACT} agents", stacklevel=2)
        standing = given["standing"]
        scales = np.array([standing, *((1.0 - standing) * share for share in MOVING)])
        tables = adversary_sets(n_agents, most)._asdict() | self._behaviours()._asdict()
        return tables | {
            **{name: given[name] for name in self.parameters if name in given and name not in tables},
            "levels": given["withheld"],
            "shares": (1, len(given["together"]), len(given["alone"])),
            "modes": self._modes,
            "together_share": given["together"],
            "alone_share": given["alone"],
            "most_motion": math.exp(given["cap_motion"]),
            "scales": SCALES,
            "urn_prior": given["standing_weight"] * scales,
            "least": 10.0 ** (_LEAST_EXPONENT / n_agents),
            "ln_eps": math.log(given["eps"]),
            "ln_not_eps": math.log1p(-given["eps"]),
        }

    @property
    def _modes(self) -> list[int]:
        return [PLAIN, *[STANDING] * self._given["kinematics"], *[EXACT] * self._given["exactness"]]

    def _behaviours(self) -> Behaviours:
        alone, together, levels = (len(self._given[name]) for name in ("alone", "together", "withheld"))
        return behaviours(alone, together, levels, len(self._modes), self._given["dormant"])

    @staticmethod
    @kernel
    def reset(world):
        """No looks, nothing remembered, nothing surveyed."""
        joint = world.joint_posterior
        weigh_priors(world)
        for j in range(joint.track_id.shape[0]):
            forget_track(world, j)
        for a in range(joint.members.shape[0]):
            joint.alone_count[a], joint.others_count[a] = np.nan, np.nan
            joint.gone_alone[a], joint.gone_others[a] = 0.0, 0.0
            for y in range(joint.first[3]):
                joint.past[a, y] = 0.0
            for s in range(joint.scales.shape[0]):
                joint.urn[a, s] = joint.urn_prior[s]
        for k in range(joint.pose.shape[0]):
            joint.pose[k, 0] = np.nan
        for i in range(3):
            joint.dispersion[i] = 0.0
        joint.frames, joint.usual_fit, joint.usual_fits = 0.0, 0.0, 0.0

    @staticmethod
    @kernel
    def judge(world):
        """Take the frame's looks, weigh all hypotheses, and conclude."""
        survey(world)
        _fade(world)
        _bury_tracks(world)
        count_looks(world)
        compare_motions(world)
        listed = list_confirmed(world)
        for c in range(listed):
            note_watchers(world, c, world.scratch.listing[c])
        count_tracks(world, listed)
        learn_dispersion(world, listed)
        count_alone(world, listed)
        _weigh_tracks(world, listed)
        weigh_counts(world)
        weigh_hypotheses(world)
        _conclude_on_agents(world)
        _conclude_on_tracks(world, listed)


@kernel
def _fade(world):
    """What was learnt fades; sums begin anew."""
    joint = world.joint_posterior
    for a in range(joint.members.shape[0]):
        joint.others_now[a] = 0.0
        joint.gone_alone[a] *= joint.memory
        joint.gone_others[a] *= joint.memory
        for y in range(joint.first[3]):
            joint.past[a, y] *= joint.memory
            joint.product[a, y], joint.log_product[a, y] = 1.0, 0.0
        for s in range(joint.scales.shape[0]):
            joint.urn_now[a, s] = joint.urn_prior[s] + joint.memory * (joint.urn[a, s] - joint.urn_prior[s])
    for q in range(joint.regions):
        joint.gone_region[q] *= joint.memory
    joint.usual_fit, joint.usual_fits = (1.0 - FIT_RATE) * joint.usual_fit, (1.0 - FIT_RATE) * joint.usual_fits


@kernel
def _bury_tracks(world):
    """Tracks that are gone leave what they said; new ones begin with nothing."""
    joint = world.joint_posterior
    for j in range(joint.track_id.shape[0]):
        if joint.track_id[j] != world.tracks.id[j]:
            if joint.was_listed[j] and joint.memory > 0.0:
                note_watchers(world, 0, j)
                weigh_patterns(world, 0, j)
                remember_track(world, 0, weigh_track(world, 0, j))
                count_gone(world, 0, joint.last_trust[j])
            forget_track(world, j)
    for a in range(joint.members.shape[0]):
        for s in range(joint.scales.shape[0]):
            joint.urn[a, s] = joint.urn_now[a, s]


@kernel
def _weigh_tracks(world, listed):
    """The sums of logarithms over all listed tracks, by set and case."""
    joint = world.joint_posterior
    together = int(600.0 / joint.cap_track)  # tracks whose product cannot underflow
    for c in range(listed):
        j = world.scratch.listing[c]
        weigh_patterns(world, c, j)
        weigh_motion(world, j)
        weigh_fit(world, j)
        multiply_track(world, c, weigh_track(world, c, j))
        if c % together == together - 1:
            take_logarithms(world)


@kernel
def _conclude_on_agents(world):
    """Agent trust: the weight of the sets without the agent."""
    joint, verdict = world.joint_posterior, world.verdict
    for k in range(verdict.agent_trust.shape[0]):
        compromised = 0.0
        for a in range(joint.members.shape[0]):
            if (joint.members[a] >> k) & 1 == 1:
                compromised += joint.weight[a]
        trust = min(1.0, max(0.0, 1.0 - compromised))
        verdict.agent_trust[k], verdict.agent_trust_var[k] = trust, trust * (1.0 - trust)


@kernel
def _conclude_on_tracks(world, listed):
    """Track trust: the probability of being real and still there; who is shown; what is learnt from it."""
    joint, verdict = world.joint_posterior, world.verdict
    for j in range(world.tracks.count):
        count_absence(world, j)
    for c in range(listed):
        j = world.scratch.listing[c]
        real = min(1.0, max(0.0, probability_of_real(world, c)))
        learn_fit(world, c, j, real)
        joint.last_trust[j] = real
        trust = real * _still_there(world, j)
        verdict.track_trust[j], verdict.track_trust_var[j] = trust, trust * (1.0 - trust)
        verdict.publish[j], joint.was_listed[j] = trust >= ACCEPT, True
    for a in range(joint.members.shape[0]):
        joint.others_count[a] += RATE * (joint.others_now[a] - joint.others_count[a])


@kernel
def _still_there(world, j):
    """1/(1 + gap (1 - P_D)^-u): the probability that the target has not left, after u missed looks."""
    joint = world.joint_posterior
    if joint.departures == 0.0 or joint.absent[j] == 0.0:
        return 1.0
    return 1.0 / (1.0 + joint.gap * math.exp(-world.agents.miss_gain[0] * joint.absent[j]))
