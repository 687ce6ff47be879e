"""The trust estimator: the authors' numbers and cases, the plain reference on random evidence, the centre."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest
from kernels import fov_of
from oracle import OracleCentre, OracleEvidence, OracleTrust, TrackerParams
from paths import REFERENCE

import trust_env
from trust_env.spaces.action import ActionTable

CASES = json.loads((REFERENCE / "cdc2024_cases.json").read_text())["cases"]
NAMES = ("case1_no_prior", "case1_prior100", "case2_no_prior", "case2_prior100")
PRIOR_MEAN = {"trusted": 0.8, "untrusted": 0.5, "distrusted": 0.2}


def frame_of(recorded: Mapping[str, Any], n_agents: int) -> dict[str, np.ndarray]:
    """Evidence of one recorded frame."""
    tracks = recorded["tracks"]
    ids = [track["track"] for track in tracks]
    expected, detected, held = (np.zeros((n_agents, len(ids)), dtype=bool) for _ in range(3))
    for j, track in enumerate(tracks):
        for k, (value, _) in zip(track["in_fov_of"], track["psms"], strict=True):
            expected[k, j], detected[k, j] = True, value == 1.0
    for agent in recorded["agents"]:
        for track, seen, _, _ in agent["candidate_psms"]:
            held[agent["agent"], ids.index(track)] = seen
    return {"track_id": np.array(ids, dtype=int), "expected": expected, "detected": detected, "held": held}


def priors_of(case: Mapping[str, Any]) -> dict[int, tuple[float, float]]:
    return {int(k): (PRIOR_MEAN[p["type"]], p["strength"]) for k, p in case["prior_agents"].items()}


# --- the authors' numbers -----------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize("name", NAMES)
def test_cdc2024_gives_every_published_alpha_and_beta(name):
    case = CASES[name]
    n_agents = len(case["agent_positions"])
    frames = [frame_of(frame, n_agents) for frame in case["frames"]]
    verdicts = trust_env.replay_evidence(
        frames, n_agents=n_agents, defense="trust(preset=cdc2024)", agent_priors=priors_of(case)
    )
    compared = 0
    for recorded, verdict in zip(case["frames"], verdicts, strict=True):
        for track in recorded["tracks"]:
            ours, theirs = verdict.track_beliefs[track["track"]], (track["alpha"], track["beta"])
            assert ours == pytest.approx(theirs, abs=1e-9)
            compared += 1
        assert len(verdict.track_beliefs) == len(recorded["tracks"])
        for agent in recorded["agents"]:
            ours, theirs = verdict.agent_beliefs[agent["agent"]], (agent["alpha"], agent["beta"])
            assert ours == pytest.approx(theirs, abs=1e-9)
    assert compared > 90


@pytest.mark.parametrize("name", NAMES)
def test_priors_by_name_are_those_of_the_authors(name):
    case = CASES[name]
    trusted = [k for k, p in case["prior_agents"].items() if p["type"] == "trusted"]
    frames = [frame_of(frame, 3) for frame in case["frames"]]
    by_name = trust_env.replay_evidence(frames, 3, f"trust(preset=cdc2024, trusted=[{', '.join(trusted)}])")
    by_number = trust_env.replay_evidence(frames, 3, "trust(preset=cdc2024)", agent_priors=priors_of(case))
    assert [v.agent_beliefs for v in by_name] == [v.agent_beliefs for v in by_number]


def test_paper_preset_shows_case_1_otherwise_than_its_figure():
    """What the text gives on the same evidence: agent 2, who lies, ends highest instead of lowest."""
    frames = [frame_of(frame, 3) for frame in CASES["case1_no_prior"]["frames"]]
    last = trust_env.replay_evidence(frames, 3, "trust")[-1]
    assert last.agent_trust == pytest.approx([0.64, 0.76, 0.80], abs=0.02)
    with_prior = trust_env.replay_evidence(frames, 3, "trust", agent_priors={1: (0.8, 10.0)})[-1]
    assert abs(with_prior.agent_trust[0] - last.agent_trust[0]) < 0.05


# --- the whole environment on the authors' cases ------------------------------------------------------------


def final_trust(case: Mapping[str, Any], scenario: str, seed: int) -> tuple[np.ndarray, dict[int, float]]:
    """Trust in agents, and in tracks by the authors' numbering, at the end of an episode."""
    priors = ", ".join(f"{k}: ({mean}, {precision})" for k, (mean, precision) in priors_of(case).items())
    defense = f"trust(preset=cdc2024, agent_priors={{{priors}}})"
    env = trust_env.vector_env(scenario, defense, num_worlds=1, autoreset=False)
    env.reset(seed=seed)
    arrays, loaded = env.arrays, env.scenario
    places = [[i.position for i in loaded.injections if i.agent == k] for k in range(loaded.n_agents)]
    actions = np.zeros(arrays.action.shape, dtype=np.float32)
    for k, wanted in enumerate(places):
        if wanted:
            actions[0, k] = ActionTable(loaded).encode(arrays.fov_box[0, k], np.array(wanted))
    for _ in range(len(case["frames"])):
        env.step(actions)
    tracks = {}
    for track in case["final"]["tracks"]:
        confirmed = np.flatnonzero(arrays.track_status[0] == 2)
        distance = np.hypot(*(arrays.track_mean[0, confirmed, :2] - track["position"]).T)
        assert distance.min() < 0.05
        tracks[track["track"]] = float(arrays.track_trust[0, confirmed[distance.argmin()]])
    assert (arrays.track_status[0] == 2).sum() == len(tracks)
    return arrays.agent_trust[0].copy(), tracks


def worst_deviation(name: str, seed: int) -> float:
    case = CASES[name]
    agents, tracks = final_trust(case, name.split("_")[0], seed)
    off = [abs(agents[agent["agent"]] - agent["mean"]) for agent in case["final"]["agents"]]
    off += [abs(tracks[track["track"]] - track["mean"]) for track in case["final"]["tracks"]]
    return max(off)


@pytest.mark.core
@pytest.mark.parametrize("name", NAMES)
def test_the_environment_ends_where_the_authors_do(name):
    assert max(worst_deviation(name, seed) for seed in range(20)) < 0.05


# --- random evidence against the reference ------------------------------------------------------------------


def random_evidence(seed: int, n_agents: int, n_frames: int) -> list[dict[str, np.ndarray]]:
    """Tracks come and go, their order changes from frame to frame; who sees what is drawn anew."""
    rng = np.random.default_rng(seed)
    alive, next_id, frames = list(range(3)), 3, []
    hits = dict.fromkeys(alive, 1)
    place = {i: rng.uniform(-80, 80, 2) for i in alive}
    poses = np.column_stack([rng.uniform(-20, 20, (n_agents, 2)), np.zeros(n_agents)])
    for _ in range(n_frames):
        alive = [i for i in alive if rng.random() > 0.08]
        for _ in range(rng.poisson(0.5)):
            alive.append(next_id)
            hits[next_id], place[next_id] = 0, rng.uniform(-80, 80, 2)
            next_id += int(rng.integers(1, 4))
        order = rng.permutation(alive).astype(int)
        for i in order:
            hits[int(i)] += int(rng.integers(0, 3))
        detected = rng.random((n_agents, len(order))) < 0.6
        means = np.array([[*place[int(i)], 0.0, 0.0] for i in order]).reshape(-1, 4)
        distance = np.hypot(*(means[None, :, :2] - poses[:, None, :2]).transpose(2, 0, 1))
        frames.append(
            {
                "track_id": order,
                "expected": (rng.random((n_agents, len(order))) < 0.8) & (distance < 350.0),
                "detected": detected,
                "held": detected & (rng.random((n_agents, len(order))) < 0.9),
                "track_mean": means,
                "poses": poses,
                "hits": np.array([hits[int(i)] for i in order], dtype=int),
            }
        )
    return frames


def judge_by_reference(frames, preset: str, n_agents: int, dt: float, radius: float, **more) -> Iterator[OracleTrust]:
    """The reference's beliefs after every frame; it wants tracks in ascending order of their ids."""
    trust = OracleTrust(preset, n_agents=n_agents, dt=dt, **more)
    in_a_row: dict[tuple[int, int], Any] = {}
    for frame in frames:
        order = np.argsort(frame["track_id"])
        ids = frame["track_id"][order]
        expected, detected, held = (frame[name][:, order] for name in ("expected", "detected", "held"))
        runs = np.zeros(expected.shape, dtype=int)
        for k, j in np.ndindex(expected.shape):
            runs[k, j] = in_a_row.get((k, ids[j]), 0) + 1 if expected[k, j] else 0
        in_a_row = {(k, ids[j]): runs[k, j] for k, j in np.ndindex(expected.shape)}
        offset = frame["track_mean"][None, order, :2] - frame["poses"][:, None, :2]
        distance = np.hypot(offset[..., 0], offset[..., 1]) / radius
        trust.update(
            OracleEvidence(ids, expected, detected, held, distance, frame["hits"][order], runs),
        )
        yield trust


@pytest.mark.core
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_random_evidence_as_by_the_reference(preset, seed):
    n_agents, dt, radius = 2 + seed, 0.7, trust_env.load_scenario("base").fov.radius
    frames = random_evidence(seed, n_agents, 80)
    priors = {0: (0.8, 100.0), n_agents - 1: (0.2, 3.0)} if seed % 2 else {}
    verdicts = trust_env.replay_evidence(frames, n_agents, f"trust(preset={preset})", priors, dt=dt)
    reference = judge_by_reference(frames, preset, n_agents, dt, radius, agent_priors=priors)
    worst = 0.0
    for verdict, trust in zip(verdicts, reference, strict=True):
        assert set(verdict.track_beliefs) == set(trust.track_beliefs)
        for i, belief in trust.track_beliefs.items():
            worst = max(worst, *np.abs(np.subtract(verdict.track_beliefs[i], belief)))
        worst = max(worst, np.abs(np.subtract(verdict.agent_beliefs, trust.agent_beliefs)).max())
        means = [a / (a + b) for a, b in trust.agent_beliefs]
        assert verdict.agent_trust == pytest.approx(means, abs=1e-9)
        assert ((verdict.agent_trust_var > 0) & (verdict.agent_trust_var <= 0.25)).all()
        assert (verdict.publish == (verdict.track_trust >= 0.5)).all()
    assert worst < 1e-9


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_the_order_in_which_tracks_are_listed_does_not_matter(preset):
    frames = random_evidence(7, 3, 20)
    listed = [{name: frame[name] for name in ("track_id", "expected", "detected", "held")} for frame in frames]
    rng = np.random.default_rng(0)
    shuffled = []
    for frame in listed:
        order = rng.permutation(len(frame["track_id"]))
        shuffled.append({name: value[..., order] for name, value in frame.items()})
    for a, b in zip(*(trust_env.replay_evidence(f, 3, f"trust(preset={preset})") for f in (listed, shuffled))):
        assert b.agent_beliefs == [pytest.approx(belief, abs=1e-12) for belief in a.agent_beliefs]
        assert b.track_beliefs == {i: pytest.approx(belief, abs=1e-12) for i, belief in a.track_beliefs.items()}


# --- by hand ------------------------------------------------------------------------------------------------


def one_track(expected, detected, held, n_frames: int = 1) -> list[dict[str, Any]]:
    columns = {"expected": expected, "detected": detected, "held": held}
    frame = {name: np.array(value, dtype=bool).reshape(-1, 1) for name, value in columns.items()}
    return [frame | {"track_id": [5]}] * n_frames


@pytest.mark.core
@pytest.mark.nojit
def test_one_frame_by_hand():
    (verdict,) = trust_env.replay_evidence(one_track([1, 1], [1, 0], [1, 0]), 2)
    # Track: Beta(.5, .5) + .5 from each; then E = 1/2, Var = 1/12 judge both agents alike, c = 11/12.
    assert verdict.track_beliefs[5] == pytest.approx((1.0, 1.0))
    assert verdict.agent_beliefs == [pytest.approx((0.5 + 11 / 24, 0.5 + 11 / 24))] * 2
    assert verdict.track_trust == pytest.approx([0.5]) and verdict.track_trust_var == pytest.approx([1 / 12])
    assert verdict.publish.tolist() == [True]


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_a_track_seen_by_one_agent_keeps_its_prior(preset):
    verdicts = trust_env.replay_evidence(one_track([1, 0, 0], [1, 1, 0], [1, 0, 0], 30), 3, f"trust(preset={preset})")
    for verdict in verdicts:
        assert verdict.track_beliefs[5] == pytest.approx((0.5, 0.5))
    assert verdicts[-1].agent_trust[1:] == pytest.approx([0.5, 0.5])


@pytest.mark.core
@pytest.mark.nojit
def test_beliefs_decay_to_the_precision_of_their_prior_and_not_below():
    seen, gone = one_track([1, 1], [1, 1], [1, 1], 40), one_track([0, 0], [0, 0], [0, 0], 600)
    verdicts = trust_env.replay_evidence(seen + gone, 2, "trust(track_prior=(0.3, 2.0))", {1: (0.8, 10.0)})
    rich, poor = verdicts[39], verdicts[-1]
    assert sum(rich.track_beliefs[5]) > 10 and sum(poor.track_beliefs[5]) == pytest.approx(2.0)
    assert rich.track_trust == pytest.approx(poor.track_trust)
    assert [sum(belief) for belief in poor.agent_beliefs] == pytest.approx([1.0, 10.0])
    assert rich.agent_trust == pytest.approx(poor.agent_trust)
    ages = [sum(v.track_beliefs[5]) for v in verdicts[40:60]]
    assert np.diff(np.log(ages)) == pytest.approx(np.full(19, math.log(0.99)))


@pytest.mark.core
@pytest.mark.nojit
def test_an_even_split_is_not_resolved_without_a_prior_and_is_with_one():
    split = one_track([1, 1], [1, 0], [1, 0], 50)
    even = trust_env.replay_evidence(split, 2)[-1]
    assert even.track_trust == pytest.approx([0.5]) and even.agent_trust == pytest.approx([0.5, 0.5])
    for k, trusted in ((0, True), (1, False)):
        told = trust_env.replay_evidence(split, 2, "trust(preset=cdc2024)", {k: (0.8, 100.0)})[-1]
        assert (told.track_trust[0] > 0.5) == trusted and told.agent_trust[k] > told.agent_trust[1 - k]


@pytest.mark.core
@pytest.mark.nojit
def test_a_single_track_has_a_prior_of_its_own_while_the_others_keep_theirs():
    """One agent alone sees both tracks, so that they stay where they began; the first comes again under a new id."""
    seen = dict.fromkeys(("expected", "detected", "held"), np.array([[1, 1], [0, 0]], dtype=bool))
    frames = [seen | {"track_id": [5, 6]}] * 20 + [seen | {"track_id": [7, 6]}] * 3
    verdicts = trust_env.replay_evidence(frames, 2, "trust(track_priors={5: (0.2, 10.0)})")
    assert verdicts[0].track_beliefs == {5: pytest.approx((2.0, 8.0)), 6: pytest.approx((0.5, 0.5))}
    assert verdicts[19].track_beliefs == verdicts[0].track_beliefs
    assert verdicts[19].publish.tolist() == [False, True]
    assert verdicts[-1].track_beliefs == {7: pytest.approx((0.5, 0.5)), 6: pytest.approx((0.5, 0.5))}


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize(("preset", "precision"), [("paper", 10.0), ("cdc2024", None)])
def test_a_track_forgets_toward_its_own_prior(preset, precision):
    """`paper` keeps the mean and falls to the precision of the prior, `cdc2024` returns to the prior itself."""
    seen, gone = one_track([1, 1], [1, 1], [1, 1], 30), one_track([0, 0], [0, 0], [0, 0], 400)
    last = trust_env.replay_evidence(seen + gone, 2, f"trust(preset={preset}, track_priors={{5: (0.2, 10.0)}})")[-1]
    if precision is None:
        assert last.track_beliefs[5] == pytest.approx((2.0, 8.0))
    else:
        assert sum(last.track_beliefs[5]) == pytest.approx(precision) and last.track_trust[0] > 0.5


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize(
    ("odds", "alpha", "beta"),
    [(1.0, 1.0, 1.0), (2.0, 0.75, 1.0), (0.5, 1.0, 0.75), (4.0, 0.625, 1.0)],
)
def test_odds_of_a_false_positive_weigh_a_miss_against_a_hit(odds, alpha, beta):
    """Beta(.5, .5), then .5 from the hit and .5 from the miss; at odds of 2 the hit weighs half."""
    defense = f"trust(false_positive_odds={odds})"
    (verdict,) = trust_env.replay_evidence(one_track([1, 1], [1, 0], [1, 0]), 2, defense)
    assert verdict.track_beliefs[5] == pytest.approx((alpha, beta))


@pytest.mark.core
@pytest.mark.nojit
@pytest.mark.parametrize("preset", ["paper", "cdc2024", "mate"])
def test_odds_of_a_false_positive_resolve_an_even_split_and_leave_agreement_alone(preset):
    split, agreed = one_track([1, 1], [1, 0], [1, 0], 50), one_track([1, 1], [1, 1], [1, 1], 50)
    for odds, published in ((8.0, False), (0.125, True)):
        defense = f"trust(preset={preset}, false_positive_odds={odds})"
        last = trust_env.replay_evidence(split, 2, defense)[-1]
        assert last.publish.tolist() == [published] and abs(last.track_trust[0] - 0.5) > 0.1
        assert (last.agent_trust[0] > last.agent_trust[1]) == published
        assert trust_env.replay_evidence(agreed, 2, defense)[-1].track_trust[0] > 0.6


@pytest.mark.parametrize(
    ("defense", "message"),
    [
        ("trust(track_priors={5: (1.2, 10.0)})", r"track_priors\[5\] must be \(mean, precision\)"),
        ("trust(track_priors={-1: (0.2, 10.0)})", "track ids, whole numbers from 0"),
        ("trust(track_priors=[1])", "must map track ids to"),
        ("trust(false_positive_odds=0)", "false_positive_odds must be a number above 0"),
    ],
)
def test_priors_that_do_not_fit(defense, message):
    with pytest.raises(ValueError, match=message):
        trust_env.replay_evidence(one_track([1, 1], [1, 1], [1, 1]), 2, defense)


def test_priors_decide_the_even_split_of_case_1_in_the_simulation():
    """The false positive of agent 0, in view of agents 0 and 1, whose track has id 2: undecided, then not."""
    from trust_env.agents import Player

    def trust_in_it(priors: str) -> float:
        env = trust_env.vector_env("case1", f"trust(preset=cdc2024{priors})", num_worlds=8, autoreset=False)
        player, (seen, _) = Player(env, {"adversary": "false_positive"}), env.reset(seed=0)
        for _ in range(env.max_cycles):
            seen, *_ = env.step(player.actions(seen))
        a, place = env.arrays, np.array(env.scenario.injections[0].position)
        found = np.linalg.norm(a.track_mean[..., :2] - place, axis=-1) < 0.1
        assert (a.track_id[found] == 2).all() and found.sum() == 8
        return float(a.track_trust[found].mean())

    assert trust_in_it("") == pytest.approx(0.5, abs=0.02)
    assert trust_in_it(", track_priors={2: (0.2, 10.0)}") < 0.4
    assert trust_in_it(", false_positive_odds=3") < 0.4 < 0.6 < trust_in_it(", false_positive_odds=0.25")


TWICE = {"track_id": [1, 1]} | dict.fromkeys(("expected", "detected", "held"), np.ones((2, 2)))


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ([{"track_id": [1]}], "frame 0 lacks expected, detected, held"),
        (one_track([1], [1], [1]), r"expected must have shape \[2, 1\]"),
        ([*one_track([1, 1], [1, 1], [1, 1]), TWICE], "frame 1.*different"),
    ],
)
def test_evidence_that_does_not_fit(frames, message):
    with pytest.raises(ValueError, match=message):
        trust_env.replay_evidence(frames, 2)


# --- the fusion centre --------------------------------------------------------------------------------------

POLYGONS = {
    "base": "trio",
    "fov": {"type": "polygon", "vertices": [[-100, -100], [200, -150], [200, 150], [-100, 100]]},
    "injection": {"benign": None},
}


@pytest.mark.core
@pytest.mark.parametrize("defense", ["score", "trust", "trust(preset=cdc2024)", "majority"])
def test_the_centre_alone_does_what_it_does_in_the_environment(defense):
    env = trust_env.vector_env(POLYGONS, defense, num_worlds=1)
    centre = trust_env.FusionCentre(POLYGONS, defense)
    env.reset(seed=3)
    rng, shown = np.random.default_rng(3), 0
    for _ in range(60):
        poses = env.arrays.pose[0].copy()
        env.step(rng.uniform(-1, 1, env.arrays.action.shape))
        shown += env.arrays.published[0].sum()
        counts = env.arrays.report_count[0]
        frame = centre.update([env.arrays.report_detections[0, k, : counts[k]] for k in range(3)], poses=poses)
        a = env.arrays
        columns = np.flatnonzero(a.track_status[0])
        columns = columns[np.argsort(a.track_id[0, columns])]
        assert (frame.track_id == a.track_id[0, columns]).all()
        assert (frame.tracks == a.track_mean[0, columns]).all()
        assert (frame.covariances == a.track_cov[0, columns]).all()
        assert (frame.scores == a.track_score[0, columns]).all()
        assert (frame.status == a.track_status[0, columns]).all()
        np.testing.assert_array_equal(frame.trust, a.track_trust[0, columns])
        np.testing.assert_array_equal(frame.agent_trust, a.agent_trust[0])
        assert frame.existence == pytest.approx(1 / (1 + np.exp(-frame.scores)))
        assert set(frame.picture_id) == set(a.track_id[0, a.published[0]])
    assert shown > 0


@pytest.mark.core
def test_the_centre_at_uneven_times_with_moving_agents_as_the_reference():
    scenario = trust_env.load_scenario(POLYGONS)
    rng = np.random.default_rng(4)
    centre = trust_env.FusionCentre(scenario, "trust")
    t = scenario.tracker
    params = TrackerParams(
        beta_fp=1e-6, beta_nt=1e-9, process_noise=t.process_noise, gate=t.gate, capacity=t.max_tracks,
        initial_velocity_variance=t.initial_velocity_variance,
    )  # fmt: skip
    reference = OracleCentre(params, OracleTrust("paper", n_agents=3), hold_distance=scenario.evidence.hold_distance)
    targets, now, confirmed = rng.uniform(-150, 150, (6, 2)), 0.0, 0
    poses = np.column_stack([rng.uniform(-50, 50, (3, 2)), rng.uniform(-3, 3, 3)])
    for f in range(50):
        dt = float(rng.choice([0.1, 1.0, 3.0]))
        now, targets = now + dt, targets + dt * np.array([2.0, -1.0])
        poses += dt * np.array([1.0, -0.5, 0.05])
        reports = [
            np.concatenate([targets[rng.random(6) < 0.9], rng.uniform(-400, 400, (rng.poisson(1), 2))])
            for _ in range(3)
        ]
        reports = [report + rng.normal(0, 5, report.shape) for report in reports]
        frame = centre.update(reports, time=now, poses=poses)
        fovs = [fov_of(scenario, k, poses[k]) for k in range(3)]
        expected = reference.update(reports, fovs, [25.0 * np.eye(2)] * 3, dt if f else scenario.dt)
        assert frame.track_id.tolist() == [track.id for track in expected.tracks]
        for j, track in enumerate(expected.tracks):
            assert frame.tracks[j] == pytest.approx(track.mean, abs=1e-9)
            assert frame.covariances[j] == pytest.approx(track.cov, abs=1e-9)
            assert frame.scores[j] == pytest.approx(track.score, abs=1e-9)
        confirmed += int((frame.status == 2).sum())
    assert confirmed > 100


def test_what_the_centre_refuses_changes_nothing():
    centre, twin = (trust_env.FusionCentre("case1", "trust") for _ in range(2))
    fine = [np.array([[0.1, 0.5]])] * 3
    for c in (centre, twin):
        c.update(fine, time=1.0)
    wrong: list[dict[str, Any]] = [
        {"detections": fine[:2]},
        {"detections": [np.zeros((2, 3)), *fine[1:]]},
        {"detections": [*fine[:2], np.array([[np.nan, 0.0]])]},
        {"detections": [*fine[:2], np.array([[np.inf, 0.0]])]},
        {"detections": [*fine[:2], np.zeros((9, 2))]},
        {"detections": [*fine[:2], [["a", "b"]]]},
        {"detections": fine, "time": 1.0},
        {"detections": fine, "time": 0.5},
        {"detections": fine, "time": math.nan},
        {"detections": fine, "poses": np.zeros((2, 3))},
        {"detections": fine, "poses": np.full((3, 3), np.nan)},
    ]
    for arguments in wrong:
        with pytest.raises(ValueError):
            centre.update(**arguments)
    for _ in range(3):
        a, b = (c.update(fine) for c in (centre, twin))
        assert a.time == b.time and (a.tracks == b.tracks).all() and (a.agent_trust == b.agent_trust).all()
