"""Trackers, evidence and trust against the plain reference, frame by frame, over whole episodes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kernels import fov_of, reach_of
from oracle import OracleCentre, OracleEvidence, OracleFrame, OracleTracker, OracleTrust, TrackerParams
from paths import TRAFFIC

import trust_env
from trust_env.defenses.trust import Trust
from trust_env.scenario import Scenario
from trust_env.spaces.action import ActionTable
from trust_env.theory import score_optimal_frames
from trust_env.vector import VectorEnv

EMPTY, TENTATIVE, CONFIRMED = 0, 1, 2
TOLERANCE = 1e-9


class Reference(OracleCentre):
    """The oracle with this scenario's parameters; frames in view count from a track's confirmation on."""

    def __init__(self, scenario: Scenario, pose: np.ndarray, trust: OracleTrust):
        t = scenario.tracker
        params = TrackerParams(
            process_noise=t.process_noise,
            initial_velocity_variance=t.initial_velocity_variance,
            gate=t.gate,
            alpha=t.alpha,
            beta=t.beta,
            confirmation=t.confirmation,
            confirm_m=t.confirm_m,
            confirm_n=t.confirm_n,
            confirm_hits=t.confirm_hits,
            deletion=t.deletion,
            confirmed_drop=t.confirmed_drop,
            tentative_drop=t.tentative_drop,
            max_unseen=t.max_unseen,
            capacity=t.max_tracks,
        )
        super().__init__(
            params,
            trust,
            hold_distance=scenario.evidence.hold_distance,
            near_distance=scenario.evidence.near_distance,
            local_capacity=t.max_local_tracks,
        )
        agents = [scenario.agent(k) for k in range(scenario.n_agents)]
        self.dt = scenario.dt
        self.fovs = [fov_of(scenario, k, pose[k]) for k in range(len(agents))]
        self.positions = [place[:2].copy() for place in pose]
        self.radius = [reach_of(scenario, k) for k in range(len(agents))]
        self.noise = [np.array(agent.sensor.covariance) for agent in agents]
        self.beliefs = {
            name: [getattr(agent.belief, name) for agent in agents] for name in ("p_detect", "beta_fp", "beta_nt")
        }

    def with_view(self, evidence: OracleEvidence, contains, positions, radius) -> OracleEvidence:
        known = self.in_a_row
        self.in_a_row = {}
        in_a_row, distance = np.zeros(evidence.expected.shape, dtype=int), np.zeros(evidence.expected.shape)
        for j, track in enumerate(self.central.confirmed):
            for k in range(len(contains)):
                in_a_row[k, j] = known.get((k, track.id), 0) + 1 if evidence.expected[k, j] else 0
                self.in_a_row[k, track.id] = in_a_row[k, j]
                distance[k, j] = math.hypot(*(track.position - self.positions[k])) / self.radius[k]
        return replace(evidence, distance=distance, in_a_row=in_a_row)

    def take(self, reports: list[np.ndarray], weights: np.ndarray | None) -> OracleFrame:
        return self.update(
            reports,
            self.fovs,
            self.noise,
            self.dt,
            weights=None if weights is None else weights.tolist(),
            positions=self.positions,
            radius=self.radius,
            **self.beliefs,
        )

    def remove_distrusted(self) -> None:
        beliefs = self.trust.track_beliefs
        distrusted = {i for i, (a, b) in beliefs.items() if a / (a + b) < 0.5}
        self.central.tracks = [track for track in self.central.tracks if track.id not in distrusted]


class Actions:
    """Injections that stay for some frames (so that they become tracks), and some suppressions."""

    def __init__(self, env: VectorEnv, seed: int, fire: float = 0.4, suppress: float = 0.1):
        self.rng, self.fire, self.suppress = np.random.default_rng(seed), fire, suppress
        self.slots, self.shape = env.scenario.injection.slots, env.arrays.action.shape
        self.action = np.zeros(self.shape)

    def __call__(self, frame: int) -> np.ndarray:
        injections = self.action[..., : 3 * self.slots].reshape(*self.shape[:2], self.slots, 3)
        if frame % 12 == 0:
            injections[..., 1:] = self.rng.uniform(-1.2, 1.2, injections[..., 1:].shape)
            injections[..., 0] = self.rng.uniform(-1, 1, injections.shape[:-1]) + 2 * self.fire - 1
        self.action[..., : 3 * self.slots] = injections.reshape(*self.shape[:2], -1)
        entries = self.action[..., 3 * self.slots :]
        entries[...] = self.rng.uniform(0, 1, entries.shape) < self.suppress
        return self.action


class Comparison:
    """Runs an environment and the reference side by side, and counts what happened in it."""

    def __init__(self, scenario: Mapping[str, Any], switches: Mapping[str, Any] | None = None, worlds: int = 2):
        self.loaded = trust_env.load_scenario(dict(scenario))
        preset, kernel, oracle = "paper", {}, {}
        if switches is not None:
            preset, kernel, oracle = (
                switches["preset"],
                switches.get("kernel", {}),
                switches.get("oracle", {}),
            )
        defense = Trust(preset=preset, **kernel)
        self.env = trust_env.vector_env(self.loaded, defense, num_worlds=worlds, threads=1, autoreset=False)
        self.preset, self.oracle_switches = preset, oracle
        names = ["births", "confirmed", "deleted", "evicted", "dropped", "false", "held", "injected"]
        self.seen = dict.fromkeys(names, 0)
        self.worst = 0.0
        self.makers: list[dict[int, int]] = []  # per world: track id -> hits that were injections

    def run(self, frames: int, seed: int, **actions: float) -> Comparison:
        env, arrays = self.env, self.env.arrays
        env.reset(seed=seed)
        references = [
            Reference(
                self.loaded,
                arrays.pose[w],
                OracleTrust(
                    self.preset,
                    n_agents=self.loaded.n_agents,
                    dt=self.loaded.dt,
                    **self.oracle_switches,
                ),
            )
            for w in range(env.num_worlds)
        ]
        act = Actions(env, seed, **actions)
        self.makers = [{} for _ in references]
        for frame in range(frames):
            weights = arrays.agent_weight.copy()
            env.step(act(frame))
            for w, reference in enumerate(references):
                self.compare_world(w, reference, weights[w])
        for w, reference in enumerate(references):
            self.compare_counters(w, reference)
        return self

    def compare_world(self, w: int, reference: Reference, weights: np.ndarray) -> None:
        arrays = self.env.arrays
        counts = arrays.report_count[w]
        reports = [arrays.report_detections[w, k, : counts[k]].copy() for k in range(len(counts))]
        frame = reference.take(reports, weights if self.loaded.actuation == "weight" else None)
        self.compare_beliefs(w, frame)
        self.compare_makers(w, reference.central)
        self.compare_assignment(w, reference.central)
        if self.loaded.actuation == "remove":
            reference.remove_distrusted()
        self.compare_tracker(f"world {w}, centre", "track", w, (), reference.central)
        for k, local in enumerate(reference.local):
            self.compare_tracker(f"world {w}, agent {k}", "local", w, (k,), local)
        self.compare_evidence(w, frame.evidence)

    def columns(self, prefix: str, w: int, which: tuple[int, ...]) -> dict[int, int]:
        """Track id -> column."""
        ids, status = self.env.arrays[f"{prefix}_id"][w][which], self.env.arrays[f"{prefix}_status"][w][which]
        assert ((ids >= 0) == (status != EMPTY)).all()
        return {int(ids[j]): int(j) for j in np.flatnonzero(status)}

    def compare_tracker(self, name: str, prefix: str, w: int, which: tuple[int, ...], tracker: OracleTracker) -> None:
        columns = self.columns(prefix, w, which)
        assert set(columns) == {track.id for track in tracker.tracks}, name
        view = {
            field: self.env.arrays[f"{prefix}_{field}"][w][which]
            for field in ("mean", "cov", "score", "peak", "initial", "status", "age", "hits", "unseen")
        }
        for track in tracker.tracks:
            j = columns[track.id]
            self.close(f"{name}, mean of track {track.id}", view["mean"][j], track.mean)
            self.close(f"{name}, covariance of track {track.id}", view["cov"][j], track.cov)
            scores = (track.score, track.peak, track.birth_score)
            ours = (view["score"][j], view["peak"][j], view["initial"][j])
            self.close(f"{name}, scores of track {track.id}", ours, scores)
            status = CONFIRMED if track.confirmed else TENTATIVE
            counts = [view[field][j] for field in ("status", "age", "hits", "unseen")]
            assert counts == [status, track.age, track.hits, track.unseen], f"{name}, track {track.id}"
            self.seen["confirmed"] += track.confirmed
            if prefix == "track":
                agents = self.env.arrays.agent_score[w, :, j]
                contributed = [track.contributed.get(k, 0.0) for k in range(len(agents))]
                self.close(f"{name}, contributions to track {track.id}", agents, contributed)
        if prefix == "track":
            assert self.env.arrays.track_next_id[w] == tracker.next_id
            self.seen["births"] = max(self.seen["births"], tracker.next_id)
            self.seen["deleted"] = max(self.seen["deleted"], tracker.next_id - len(tracker.tracks))

    def compare_makers(self, w: int, central: OracleTracker) -> None:
        """A track is injected when more of its hits were injections than not."""
        for k, assignment in enumerate(central.assignment):
            for d, i in enumerate(assignment.tolist()):
                if i >= 0 and self.env.arrays.report_origin[w, k, d] <= -2:
                    self.makers[w][i] = self.makers[w].get(i, 0) + 1
        columns = self.columns("track", w, ())
        for track in central.tracks:
            if track.id in columns:
                injected = 2 * self.makers[w].get(track.id, 0) > track.hits
                assert self.env.arrays.track_injected[w, columns[track.id]] == injected
                self.seen["injected"] += injected

    def compare_assignment(self, w: int, central: OracleTracker) -> None:
        """Which detection hit which track (births are no hits); of tracks that are still there."""
        arrays, columns = self.env.arrays, self.columns("track", w, ())
        hits = {(k, d): i for k, i, d in central.hits}
        for k, count in enumerate(arrays.report_count[w]):
            for d, column in enumerate(arrays.assignment[w, k, :count].tolist()):
                hit = columns.get(hits.get((k, d), -1), -1)
                gone = column >= 0 and arrays.track_status[w, column] == EMPTY
                assert column == hit or (gone and hit == -1), f"world {w}, agent {k}, detection {d}"

    def compare_evidence(self, w: int, evidence: OracleEvidence) -> None:
        columns = self.columns("track", w, ())
        there = [(j, columns[int(i)]) for j, i in enumerate(evidence.track_id) if int(i) in columns]
        for name in ("expected", "detected", "held"):
            for j, column in there:
                ours, theirs = self.env.arrays[name][w, :, column], getattr(evidence, name)[:, j]
                assert (ours == theirs).all(), f"world {w}, {name} of track {evidence.track_id[j]}"
        self.seen["held"] += int(evidence.held.sum())

    def compare_beliefs(self, w: int, frame: OracleFrame) -> None:
        arrays, columns = self.env.arrays, self.columns("track", w, ())
        self.close(f"world {w}, agents", arrays.trust_agent_belief[w], frame.agent_beliefs)
        for k, (a, b) in enumerate(frame.agent_beliefs):
            variance = a * b / ((a + b) ** 2 * (a + b + 1))
            ours = arrays.agent_trust[w, k], arrays.agent_trust_var[w, k]
            self.close(f"world {w}, trust in agent {k}", ours, (a / (a + b), variance))
        for i, (a, b) in frame.track_beliefs.items():
            if i not in columns:
                assert self.loaded.actuation == "remove" and a / (a + b) < 0.5
                continue
            j = columns[i]
            self.close(f"world {w}, belief in track {i}", arrays.trust_track_belief[w, j], (a, b))
            self.close(f"world {w}, trust in track {i}", arrays.track_trust[w, j], a / (a + b))
            shown = self.loaded.actuation == "monitor" or a / (a + b) >= 0.5
            assert arrays.published[w, j] == shown
            self.seen["false"] += not shown
        assert arrays.published[w].sum() <= len(frame.track_beliefs)

    def compare_counters(self, w: int, reference: Reference) -> None:
        trackers = [reference.central, *reference.local]
        evicted, dropped = (sum(getattr(t, name) for t in trackers) for name in ("evicted", "dropped"))
        arrays = self.env.arrays
        assert (arrays.overflow_evicted_tracks[w], arrays.overflow_dropped_births[w]) == (evicted, dropped)
        self.seen["evicted"] += evicted
        self.seen["dropped"] += dropped

    def close(self, name: str, ours: Any, theirs: Any) -> None:
        a, b = np.asarray(ours), np.asarray(theirs)
        error = float(np.max(np.abs(a - b) / (1.0 + np.abs(b)), initial=0.0))
        self.worst = max(self.worst, error)
        assert error < TOLERANCE, f"{name}: {a.tolist()} is not {b.tolist()}"


BUSY: dict[str, Any] = {
    "base": "patrol",
    "sensor": {"clutter_density": 1e-5, "p_detect": 0.85},
    "tracker": {"beta_fp": 1e-5},
    "targets": {"birth_rate": 0.1, "death_rate": 0.02},
    "injection": {"benign": None},
}
DIFFERENT: dict[str, Any] = BUSY | {
    "agents": [
        {
            "role": "adversary",
            "position": [0, 0],
            "heading": 0.5,
            "fov": {"type": "sector", "radius": 600, "width": 2.0},
            "belief": {"p_detect": 0.8, "beta_fp": 3e-6, "beta_nt": 1e-8},
        },
        {
            "role": "benign",
            "position": [-100, 50],
            "heading": -2.5,
            "fov": {"type": "polygon", "vertices": [[-50, -300], [400, -200], [400, 200], [-50, 300]]},
            "sensor": {"sigma": None, "noise_cov": [[40.0, 15.0], [15.0, 20.0]]},
        },
        {
            "role": "benign",
            "position": [200, -100],
            "fov": {"type": "circle", "radius": 250},
            "sensor": {"sigma": 12.0, "p_detect": 0.6},
            "belief": {"p_detect": 0.6},
        },
        {"role": "adversary", "position": [50, 120], "fov": {"type": "sector", "radius": 350, "width": 5.0}},
    ],
}


def tracker(**fields: Any) -> dict[str, Any]:
    return BUSY | {"tracker": BUSY["tracker"] | fields}


CONFIRMATIONS = {
    "score": {},
    "m_of_n": {"confirmation": "m_of_n", "confirm_m": 3, "confirm_n": 5},
    "m_of_32": {"confirmation": "m_of_n", "confirm_m": 12, "confirm_n": 32},
    "score_or_hits": {"confirmation": "score_or_hits", "confirm_hits": 4},
}
DELETIONS = {
    "drop": {"confirmed_drop": 6.0, "tentative_drop": 2.0},
    "relative": {"deletion": "relative"},
    "absolute": {"deletion": "absolute", "beta_nt": 1e-5},
}


@pytest.mark.core
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_a_patrol_under_attack(preset):
    seen = Comparison(BUSY, {"preset": preset}).run(60, seed=1).seen
    assert min(seen[name] for name in seen if name not in ("evicted", "dropped")) > 5


@pytest.mark.core
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_agents_that_differ_in_all_they_have(preset):
    seen = Comparison(DIFFERENT, {"preset": preset}).run(60, seed=2).seen
    assert min(seen["births"], seen["confirmed"], seen["deleted"], seen["held"]) > 5


@pytest.mark.core
@pytest.mark.parametrize("deletion", DELETIONS)
@pytest.mark.parametrize("confirmation", CONFIRMATIONS)
def test_all_confirmation_and_deletion_rules(confirmation, deletion):
    scenario = tracker(**CONFIRMATIONS[confirmation], **DELETIONS[deletion])
    seen = Comparison(scenario, worlds=1).run(45, seed=3).seen
    assert min(seen["births"], seen["confirmed"], seen["deleted"]) > 5


@pytest.mark.core
def test_full_stores_of_tentative_tracks():
    small = tracker(max_tracks=9, max_local_tracks=4, tentative_drop=7.0, max_unseen=20)
    assert Comparison(small).run(60, seed=4, fire=0.7).seen["evicted"] > 100


@pytest.mark.core
@pytest.mark.parametrize("size", [1, 2, 3])
def test_stores_so_small_that_a_track_that_was_just_hit_gives_way(size):
    small = tracker(max_tracks=size, max_local_tracks=size, tentative_drop=7.0)
    seen = Comparison(small).run(40, seed=15, fire=0.7).seen
    assert seen["evicted"] > 100 and seen["injected"] > 10


@pytest.mark.core
def test_full_stores_of_confirmed_tracks():
    small = tracker(max_tracks=9, max_local_tracks=4, confirmation="m_of_n", confirm_m=1, confirmed_drop=30.0)
    seen = Comparison(small).run(60, seed=5, fire=0.7).seen
    assert seen["dropped"] > 100


@pytest.mark.core
@pytest.mark.parametrize("gate", [0.3, 0.9999])
def test_targets_that_cross_the_edges_of_many_small_fovs(gate):
    """A detection may lie outside the FOV by its noise, and the track that it hits still farther out."""
    fovs = [
        {"type": "circle", "radius": 60},
        {"type": "sector", "radius": 80, "width": 1.0},
        {"type": "polygon", "vertices": [[-40, -40], [40, -40], [0, 60]]},
    ]
    scenario = BUSY | {
        "area": [-150.0, 150.0, -150.0, 150.0],
        "sensor": {"sigma": None, "noise_cov": [[400.0, 190.0], [190.0, 100.0]], "p_detect": 1.0},
        "tracker": {"beta_fp": 1e-5, "gate": gate, "initial_velocity_variance": 9.0},
        "agents": [
            {"role": "benign", "position": [x, y], "heading": x + y, "fov": fov}
            for x, y in ((-60, -50), (40, 30))
            for fov in fovs
        ],
    }
    assert Comparison(scenario).run(80, seed=13).seen["confirmed"] > 20


@pytest.mark.core
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
@pytest.mark.parametrize("actuation", ["monitor", "remove", "weight"])
def test_actuations(actuation, preset):
    scenario = BUSY | {"actuation": actuation}
    seen = Comparison(scenario, {"preset": preset}, worlds=1).run(50, seed=6).seen
    assert min(seen["births"], seen["confirmed"], seen["deleted"]) > 5


@pytest.mark.core
def test_agents_with_small_weights():
    """Priors so dark that an agent is ignored, also when it alone watches a track."""
    priors = {0: (1e-4, 50.0), 2: (2e-3, 50.0)}
    scenario = DIFFERENT | {"actuation": "weight"}
    switches = {"preset": "paper", "kernel": {"agent_priors": priors}, "oracle": {"agent_priors": priors}}
    seen = Comparison(scenario, switches).run(60, seed=7).seen
    assert seen["confirmed"] > 5


@pytest.mark.core
@pytest.mark.parametrize("near", [None, 3.0, 60.0])
@pytest.mark.parametrize("hold", [1.0, 8.0, 300.0])
def test_near_and_hold_distances(near, hold):
    scenario = BUSY | {"evidence": {"near_distance": near, "hold_distance": hold}}
    assert Comparison(scenario, worlds=1).run(35, seed=8).seen["confirmed"] > 5


@pytest.mark.core
@pytest.mark.parametrize("gate", [0.5, 0.9, 0.999999])
def test_gates_and_crowds_of_rivals(gate):
    crowd = tracker(gate=gate, initial_velocity_variance=400.0) | {
        "targets": {"slots": 14, "speed": [0.0, 60.0], "birth_rate": 0.3, "process_noise": 5.0},
        "area": [-150.0, 150.0, -150.0, 150.0],
        "dt": 0.5,
        "sensor": {"sigma": 15.0, "clutter_density": 2e-5},
    }
    assert Comparison(crowd, worlds=1).run(45, seed=9).seen["confirmed"] > 5


SWITCHES = {
    "agents known before only": ({"agent_tracks": "previous"}, {"known_only": True}),
    "agents first": ({"order": "agents_first"}, {"order": "agents_tracks"}),
    "least value": ({"agent_psms": "least"}, {"agent_psms": "least"}),
    "held outside": ({"held_outside_fov": True}, {"held_outside": True}),
    "decay": ({"epsilon": 0.2}, {"epsilon": 0.2}),
    "no decay": ({"epsilon": 0.0}, {"epsilon": 0.0}),
    "return": (
        {"track_forgetting": "return", "agent_forgetting": "return", "dt_return": 3.0},
        {"forgetting": "return", "dt_return": 3.0},
    ),
    "prior": (
        {"track_forgetting": "prior", "agent_forgetting": "none", "prior_rate": 0.05},
        {"forgetting": "to_prior", "to_prior": 0.05},
    ),
    "deviation": ({"agent_confidence": "deviation"}, {"confidence": "deviation"}),
    "bias": (
        {"agent_negativity_bias": 2.0, "negativity_threshold": 0.6},
        {"negativity_bias": 2.0, "negativity_threshold": 0.6},
    ),
    "weights": ({"psm_weights": "mate"}, {"weigh_negatives": True}),
    "priors": (
        {
            "agent_prior": (0.7, 3.0),
            "track_prior": (0.4, 2.0),
            "trusted": [1],
            "agent_priors": {0: (0.3, 5.0)},
        },
        {
            "agent_prior": (0.7, 3.0),
            "track_prior": (0.4, 2.0),
            "agent_priors": {1: (0.8, 10.0), 0: (0.3, 5.0)},
        },
    ),
}


@pytest.mark.core
@pytest.mark.parametrize("name", SWITCHES)
def test_every_switch_of_trust(name):
    kernel, oracle = SWITCHES[name]
    Comparison(BUSY, {"preset": "paper", "kernel": kernel, "oracle": oracle}, worlds=1).run(40, seed=10)


@pytest.mark.core
@pytest.mark.parametrize("name", ["case1", "case2", "theorem", "trio"])
def test_built_in_scenarios(name):
    for preset in ("paper", "cdc2024"):
        comparison = Comparison({"base": name}, {"preset": preset}, worlds=1)
        comparison.run(min(50, comparison.loaded.horizon), seed=11, fire=0.8, suppress=0.02)


@pytest.mark.core
@pytest.mark.skipif(not TRAFFIC.exists(), reason=f"the recording is not there: {TRAFFIC}")
def test_recorded_air_traffic():
    skies = {"base": "skies", "targets": {"data": str(TRAFFIC)}}
    assert Comparison(skies, worlds=1).run(12, seed=14).seen["confirmed"] > 5


@pytest.mark.core
@pytest.mark.parametrize("order", ["adversaries_first", "adversaries_last"])
@pytest.mark.parametrize(("n_adversaries", "n_benign"), [(1, n) for n in range(6)] + [(2, n) for n in range(7)])
def test_a_perfect_lie_is_confirmed_in_the_frame_that_theory_says(n_adversaries, n_benign, order):
    team = {"n_adversaries": n_adversaries, "n_benign": n_benign, "order": order}
    env = trust_env.vector_env({"base": "theorem", "team": team}, "score", autoreset=False)
    env.reset(seed=1)
    actions = np.zeros(env.arrays.action.shape, dtype=np.float32)
    for k, role in enumerate(env.scenario.roles):
        if role == "adversary":
            box = env.arrays.fov_box[0, k]
            actions[0, k] = ActionTable(env.scenario).encode(box, np.array([[12.0, -7.0]]))
    confirmed = math.inf
    for frame in range(1, 51):
        env.step(actions)
        if (env.arrays.track_status[0] == CONFIRMED).any():
            confirmed = min(confirmed, frame)
    assert confirmed == score_optimal_frames(env.scenario.roles)


@pytest.mark.nojit
def test_without_the_compiler():
    seen = Comparison({"base": "trio"}, {"preset": "paper"}, worlds=1).run(12, seed=12).seen
    assert seen["births"] > 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_many_long_episodes(preset, seed):
    for scenario in (
        BUSY,
        DIFFERENT,
        DIFFERENT | {"actuation": "weight"},
        DIFFERENT | {"actuation": "remove"},
    ):
        Comparison(scenario, {"preset": preset}).run(200, seed=100 + seed)
