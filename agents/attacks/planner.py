"""An attack that tries what it could do next in copies of the worlds, and does what did the most damage there."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np

from trust_env.agents.attacks.by_turns import ByTurns
from trust_env.agents.attacks.outward import Outward
from trust_env.agents.attacks.phantoms import Phantoms
from trust_env.agents.base import Policy, PolicyContext
from trust_env.agents.copied_worlds import CopiedWorlds
from trust_env.agents.parameters import whole_number
from trust_env.agents.track_forecast import TrackForecast
from trust_env.spaces.action import ActionTable

BY_TURNS, OUTWARD = range(2)  # the sets of phantoms
_CONFIRMED = 0.75  # of `tracks_status`, where 0.5 is tentative and 1 confirmed


class Plan(NamedTuple):
    """What the coalition does in a frame."""

    reported: int | None  # the set of phantoms that is reported; None: they are withdrawn
    moves: bool  # whether the phantoms of that set go one step on
    withholds: bool  # all own detections


# Of plans that do as much damage the first is taken.
PLANS = (
    Plan(BY_TURNS, False, False), Plan(BY_TURNS, False, True), Plan(BY_TURNS, True, False), Plan(BY_TURNS, True, True),
    Plan(OUTWARD, False, False), Plan(OUTWARD, False, True), Plan(None, False, False), Plan(None, False, True),
)  # fmt: skip


class Directed(Phantoms):
    """Phantoms that are reported, go on, and come with withheld detections only in the worlds where that is said."""

    reported: np.ndarray  # bool[W]
    moves: np.ndarray  # bool[W]
    withholds: np.ndarray  # bool[W]

    def reporting(self) -> np.ndarray:
        return super().reporting() & self.reported

    def _move(self, seen: dict[str, np.ndarray]) -> None:
        before = self.position, self.velocity
        super()._move(seen)
        moves = self.moves[:, None, None, None]
        self.position = np.where(moves, self.position, before[0])
        self.velocity = np.where(moves, self.velocity, before[1])

    def _withheld(self, mask: np.ndarray) -> np.ndarray | None:
        return mask & self.withholds[:, None, None]


class DirectedByTurns(Directed, ByTurns):
    """More phantoms than slots, out of sight of honest agents."""


class DirectedOutward(Directed, Outward):
    """Phantoms on the FOVs' rims."""


class PhantomSets:
    """The phantoms of `by_turns` and those of `outward`, of which one set at a time is reported."""

    def __init__(self, per_slot: int, speed: float | None, noise: float | None, hit_rate: float | None):
        self.sets: list[Directed] = [
            DirectedByTurns(per_slot, motion="pace", speed=speed, noise=noise, hit_rate=hit_rate),
            DirectedOutward(noise=noise, hit_rate=hit_rate),
        ]

    def reset(self, context: PolicyContext) -> None:
        for phantoms in self.sets:
            phantoms.reset(context)

    def twin(self) -> PhantomSets:
        """Phantoms in the same state, which go their own way."""
        twin = copy.copy(self)
        twin.sets = [_twin(phantoms) for phantoms in self.sets]
        return twin

    def act(self, plans: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """Actions float32[W, n, A] of the plans int[W], of PLANS, on observations[W, n, O]."""
        reported = np.array([BY_TURNS if plan.reported is None else plan.reported for plan in PLANS])[plans]
        actions = [self._act_of(number, plans, observations) for number in range(len(self.sets))]
        return np.where((reported == BY_TURNS)[:, None, None], *actions)

    def _act_of(self, number: int, plans: np.ndarray, observations: np.ndarray) -> np.ndarray:
        """What one set does, which knows by that whether its phantoms are reported."""
        phantoms = self.sets[number]
        phantoms.reported = np.array([plan.reported == number for plan in PLANS])[plans]
        phantoms.moves = np.array([plan.moves for plan in PLANS])[plans] & phantoms.reported
        phantoms.withholds = np.array([plan.withholds for plan in PLANS])[plans]
        return phantoms.act(observations)

    def near(self, tracks: np.ndarray, distance: float) -> np.ndarray:
        """Whether a phantom is within a distance (m) of tracks[W, J, 4], bool[W, J]."""
        found = np.zeros(tracks.shape[:2], dtype=bool)
        for phantoms in self.sets:
            offset = tracks[:, :, None, None, :2] - phantoms.position[:, None]  # [W, J, n, P, 2]
            is_near = (offset**2).sum(axis=-1) <= distance**2
            found |= (is_near & phantoms.reports[:, None]).any(axis=(2, 3))
        return found


def _twin(thing: Any) -> Any:
    """A copy with arrays of its own."""
    twin = copy.copy(thing)
    for name, value in vars(thing).items():
        if isinstance(value, (np.ndarray, TrackForecast)):
            setattr(twin, name, value.copy() if isinstance(value, np.ndarray) else _twin(value))
    return twin


class Planner(Policy):
    """In every frame what does the most damage in copies of the worlds, which are played some frames ahead.

    The plans: to report phantoms as `by_turns` does, resting or moving like targets, or as `outward` does, or none at
    all; each with the own detections reported or withheld. A plan is kept up to the end of the copies; in the next
    frame all are tried again. The copies begin with all that the fusion centre works with; targets are the confirmed
    tracks that are no phantom's, and what others sense of them is drawn anew, as is all that chance decides. A
    reference for what phantoms can do in a frame, no bound, and slow: every frame plays 8 plans x lookahead x samples
    frames of copies.

    lookahead    frames that every plan is played on
    samples      draws of what is not known, over which the damage is averaged
    per_slot     phantoms of each adversary for every injection that its budget allows
    speed        m/s, of the phantoms that move; None: as fast as targets
    noise        m, standard deviation of x and of y added to each report; None: the sensor's own noise
    hit_rate     probability that a phantom that is due is reported; None: the sensor's P_D
    """

    name = "planner"
    knowledge = "white_box"
    reads = ("tracks", "tracks_status")
    unsearched = ("lookahead", "samples", "per_slot", "speed", "noise", "hit_rate")  # a search would take days

    def __init__(
        self,
        lookahead: int = 12,
        samples: int = 1,
        per_slot: int = 3,
        speed: float | None = None,
        noise: float | None = 0.0,
        hit_rate: float | None = 1.0,
    ):
        self.lookahead = whole_number(self.name, "lookahead", lookahead, 1)
        self.samples = whole_number(self.name, "samples", samples, 1)
        self.per_slot, self.speed, self.noise, self.hit_rate = per_slot, speed, noise, hit_rate
        self.phantoms = PhantomSets(per_slot, speed, noise, hit_rate)

    def reset(self, context: PolicyContext) -> None:
        if context.copies is None:
            raise ValueError("planner: expected worlds to copy, which a Player gives in a scenario with white_box")
        super().reset(context)
        self.phantoms.reset(context)

    @property
    def missing_phantoms(self) -> np.ndarray:
        """Those of `by_turns`; every FOV has a rim."""
        return self.phantoms.sets[BY_TURNS].missing_phantoms

    def act(self, observations: np.ndarray) -> np.ndarray:
        seen = self.context.observation_table.read(observations, self.context.agents, self.reads)
        plans = self.expected_damage(seen, observations).argmax(axis=0)
        self.frame += 1
        return self.phantoms.act(plans, observations)

    def expected_damage(self, seen: dict[str, np.ndarray], observations: np.ndarray) -> np.ndarray:
        """Damage [PLANS, W] of every plan, summed over the frames ahead and the samples."""
        targets, present = self.imagined_targets(seen)
        damage = np.zeros((len(PLANS), len(present)))
        for sample in range(self.samples):
            self._copies.prepare(self.context.agents, targets, present, sample)
            for plan in range(len(PLANS)):
                damage[plan] += self._try(plan, observations)
        return damage

    def imagined_targets(self, seen: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """States [W, J, 4] (m, m/s) by track, and which are there: the confirmed ones that are no phantom's."""
        tracks, confirmed = seen["tracks"][:, 0], seen["tracks_status"][:, 0] > _CONFIRMED
        return tracks, confirmed & ~self.phantoms.near(tracks, self.context.scenario.metrics.match_distance)

    def _try(self, plan: int, observations: np.ndarray) -> np.ndarray:
        """The damage [W] that a plan does in the copies, from the present observations on."""
        copies, phantoms, scenario = self._copies, self.phantoms.twin(), self.context.scenario
        plans, damage = np.full(len(self.frame), plan), np.zeros(len(self.frame))
        actions = ActionTable(scenario).zero_actions(len(plans), scenario.n_agents)
        copies.restore()
        for _ in range(self.lookahead):
            actions[:, self.context.agents] = phantoms.act(plans, observations)
            observations = copies.step(actions)[:, self.context.agents]
            damage += copies.damage()
        return damage

    @property
    def _copies(self) -> CopiedWorlds:
        assert self.context.copies is not None
        return self.context.copies
