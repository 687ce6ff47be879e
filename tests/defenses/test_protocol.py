"""A user's own defense: how it is named, what it is told, what it may answer, and what its answers do."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import trust_env
from trust_env import Evidence, Shape, Verdict
from trust_env.vector import VectorEnv

BUSY: dict[str, Any] = {
    "base": "patrol",
    "sensor": {"clutter_density": 1e-5},
    "tracker": {"beta_fp": 1e-5, "max_tracks": 96},
    "injection": {"benign": None},
}
IN_TEN_LINES = '''
import numpy as np
from trust_env import Verdict


class MyDefense:
    """A track is trusted by the share of its expected observers that detect it, smoothed over a window."""

    def __init__(self, window=5):
        self.keep = 1 - 1 / window

    def reset(self, shape, worlds):
        if not hasattr(self, "trust"):
            self.trust = np.full((shape.W, shape.J), 0.5)
        self.trust[worlds] = 0.5

    def update(self, evidence):
        looks = evidence.expected.sum(axis=1)
        share = (evidence.expected & evidence.detected).sum(axis=1) / np.maximum(looks, 1)
        self.trust = np.where(looks > 0, self.keep * self.trust + (1 - self.keep) * share, self.trust)
        return Verdict(track_trust=self.trust)
'''


class Own:
    """Answers with what the test gives it: a value, or a function of the evidence, per field."""

    def __init__(self, **answers: Any):
        self.answers, self.resets, self.frames = answers, [], 0
        self.shape: Any = None

    def reset(self, shape: Shape, worlds: np.ndarray) -> None:
        self.shape = shape
        self.resets.append(worlds.copy())

    def update(self, evidence: Evidence) -> Verdict:
        self.frames += 1
        answers: dict[str, Any] = {n: a(evidence) if callable(a) else a for n, a in self.answers.items()}
        return Verdict(**answers)


def play(
    defense: Any, frames: int = 40, scenario: Any = BUSY, n_worlds: int = 2, seed: int = 1, **more: Any
) -> VectorEnv:
    env = trust_env.vector_env(scenario, defense, num_worlds=n_worlds, **more)
    env.reset(seed=seed)
    go_on(env, frames)
    return env


def go_on(env: VectorEnv, frames: int) -> None:
    rng = np.random.default_rng(3)
    actions = rng.uniform(-1, 1, env.arrays.action.shape)
    actions[..., 12:] = -1.0
    for frame in range(frames):
        if frame % 10 == 0:
            actions = np.where(rng.random(actions.shape) < 0.3, rng.uniform(-1, 1, actions.shape), actions)
        env.step(actions)


def confirmed(env: VectorEnv) -> np.ndarray:
    return env.arrays.track_status == 2


# --- names --------------------------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.nojit
def test_ten_lines_in_a_file(tmp_path, monkeypatch):
    (tmp_path / "my_file.py").write_text(IN_TEN_LINES)
    monkeypatch.chdir(tmp_path)
    for name in ("my_file.py:MyDefense(window=9)", f"{tmp_path}/my_file.py:MyDefense"):
        env = trust_env.parallel_env("trio", name, max_cycles=12)
        env.reset(seed=1)
        while env.agents:
            env.step({agent: np.zeros(env.action_space(agent).shape) for agent in env.agents})
        known = env.arrays.track_status[0] == 2
        assert known.any() and (env.arrays.track_trust[0, known] > 0.5).all()
        assert (env.arrays.published[0] == known).all()
        twin = copy.deepcopy(env)
        assert twin.worlds.own_defense is not env.worlds.own_defense
        twin.reset()
        pickle.loads(pickle.dumps(env)).reset()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("my_file.py:YourDefense", "YourDefense"),
        ("no_file.py:MyDefense", "no_file.py"),
        ("my_file.py:MyDefense(windw=3)", "windw"),
        ("my_file.py:MyDefense(3)", "posit|name"),
        ("trust(preset=", "trust"),
        ("trust(preset=__import__('os'))", "preset|literal|expected"),
    ],
)
def test_names_that_lead_nowhere(tmp_path, monkeypatch, name, message):
    (tmp_path / "my_file.py").write_text(IN_TEN_LINES)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        trust_env.parallel_env("case1", name)


def test_resets_say_which_worlds_begin():
    own = Own()
    env = play(own, frames=7, n_worlds=3, max_cycles=3)
    assert own.shape == (3, 5, 96, 16) and own.shape._fields == ("W", "K", "J", "D")
    assert [worlds.tolist() for worlds in own.resets] == [[True] * 3] * 3 and own.frames == 7
    env.arrays.frame[...] = [0, 2, 1]
    go_on(env, 1)
    assert own.resets[-1].tolist() == [False, True, False]


# --- evidence -----------------------------------------------------------------------------------------------


class Listens:
    """Checks what every frame's evidence says of itself."""

    def __init__(self, weights: float = 1.0):
        self.hits, self.births, self.looked, self.seen, self.weights = 0, 0, 0, 0, weights

    def reset(self, shape: Shape, worlds: np.ndarray) -> None:
        self.shape = shape

    def update(self, e: Evidence) -> Verdict:
        w, k, j, d = self.shape
        there = e.status > 0
        assert e.track_id.shape == e.status.shape == e.age.shape == e.score.shape == e.to_delete.shape == (w, j)
        assert e.track_mean.shape == (w, j, 4) and e.track_cov.shape == (w, j, 4, 4)
        assert e.expected.shape == e.detected.shape == e.held.shape == (w, k, j)
        assert e.detections.shape == (w, k, d, 2) and e.assignment.shape == (w, k, d)
        assert e.detection_count.shape == (w, k) and e.pose.shape == (w, k, 3)
        assert e.innovation.shape == (w, k, j, 2) and e.innovation_cov.shape == (w, k, j, 2, 2)
        assert e.frame.shape == e.dt.shape == (w,) and (e.dt == 1.0).all()
        assert ((e.track_id >= 0) == there).all() and (e.age[there] >= 1).all()
        assert e.existence_probability[there] == pytest.approx(1 / (1 + np.exp(-e.score[there])))
        assert (e.confirmed == ((e.status == 2) & ~(e.to_delete & there))).all()
        self.check_scores(e, there)
        self.check_hits(e, there)
        self.check_looks(e)
        return Verdict(agent_weight=np.full((w, k), self.weights))

    def check_scores(self, e: Evidence, there: np.ndarray) -> None:
        total = e.agent_score.sum(axis=1)
        assert total[there] == pytest.approx(e.score[there], abs=1e-9)
        self.births += int((e.age[there] == 1).sum())

    def check_hits(self, e: Evidence, there: np.ndarray) -> None:
        hit = np.zeros(e.expected.shape, dtype=bool)
        listed = np.arange(e.assignment.shape[-1]) < e.detection_count[..., None]
        at = np.argwhere(listed & (e.assignment >= 0))
        for w, k, d in at:
            j = e.assignment[w, k, d]
            assert there[w, j] and not hit[w, k, j], "one detection per track, agent and frame"
            hit[w, k, j] = True
        mask = np.broadcast_to(there[:, None], hit.shape)
        assert (np.isnan(e.distance2[mask]) == ~hit[mask]).all()
        assert (np.isnan(e.innovation[mask]).all(axis=-1) == ~hit[mask]).all()
        assert (np.isnan(e.innovation_cov[mask]).all(axis=(-1, -2)) == ~hit[mask]).all()
        nu, s, d2 = e.innovation[hit], e.innovation_cov[hit], e.distance2[hit]
        if len(nu):
            assert np.linalg.eigvalsh(s).min() > 0
            assert d2 == pytest.approx(np.einsum("ni,nij,nj->n", nu, np.linalg.inv(s), nu))
            assert d2.max() <= 18.43  # chi-square, 0.9999, two dimensions
        self.hits += int(hit.sum())

    def check_looks(self, e: Evidence) -> None:
        offset = e.track_mean[:, None, :, :2] - e.pose[:, :, None, :2]
        inside = np.hypot(offset[..., 0], offset[..., 1]) <= 350.0
        there = np.broadcast_to((e.status > 0)[:, None], inside.shape)
        assert (e.expected[there] == inside[there]).all()
        assert not e.held[~np.broadcast_to(e.confirmed[:, None], inside.shape) & there].any()
        self.looked += int(e.expected[there].sum())
        self.seen += int((e.detected & there).sum())


@pytest.mark.core
@pytest.mark.parametrize("actuation", ["filter", "weight"])
@pytest.mark.parametrize("weight", [1.0, 0.3, 0.0])
def test_evidence_means_what_it_says(actuation, weight):
    listens = Listens(weight)
    play(listens, scenario=BUSY | {"actuation": actuation}, n_worlds=3)
    assert listens.births > 10
    if actuation == "filter" or weight > 0:
        assert min(listens.hits, listens.looked, listens.seen) > 500


# --- verdicts -----------------------------------------------------------------------------------------------

W, K, J = 2, 5, 96


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        ({"track_trust": np.zeros((W, J - 1))}, ValueError, r"Own: track_trust.*shape \[2, 96\].*\[2, 95\]"),
        ({"agent_trust": np.zeros((K, W))}, ValueError, r"Own: agent_trust must have shape \[2, 5\]"),
        ({"track_trust": np.full((W, J), 1.5)}, ValueError, r"track_trust must lie in \[0, 1\].*1\.5"),
        ({"agent_trust": [[np.nan, 0.5, -0.1, 0, 0]] * W}, ValueError, r"agent_trust.*\[0, 1\].* -0\.1"),
        ({"agent_trust": np.full((W, K), np.inf)}, ValueError, r"agent_trust.*inf"),
        ({"agent_trust_var": np.full((W, K), -1.0)}, ValueError, "agent_trust_var"),
        ({"publish": np.ones(J, bool)}, ValueError, "publish must have shape"),
        ({"keep": True}, ValueError, "keep must have shape"),
        ({"agent_weight": np.full((W, K), 2.0)}, ValueError, "agent_weight must lie in"),
        ({"agent_weight": 0.5}, ValueError, "agent_weight must have shape"),
        ({"track_trust": np.full((W, J), "high")}, ValueError, "track_trust must.*numbers"),
        ({"agent_trust": np.full((W, K), None)}, ValueError, "agent_trust must.*numbers"),
        ({"agent_trust": [[0.5], [0.5, 0.5]]}, ValueError, "agent_trust"),
        ({"publish": np.full((W, J), "yes")}, ValueError, "publish must.*numbers|publish must.*bool"),
    ],
)  # fmt: skip
def test_answers_that_do_not_fit(answer, error, message):
    env = trust_env.vector_env(BUSY, Own(**answer), num_worlds=W)
    env.reset(seed=1)
    with pytest.raises(error, match=message):
        env.step(np.zeros(env.arrays.action.shape))


@pytest.mark.parametrize("answer", [None, {"track_trust": 1}, np.zeros(3), (1, 2), Verdict])
def test_answers_that_are_no_verdict(answer):
    class Wrong(Own):
        def update(self, evidence: Evidence) -> Any:
            return answer

    env = trust_env.parallel_env("case1", Wrong())
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"test_protocol\.py:Wrong\.update must return a trust_env\.Verdict, not "):
        env.step({agent: np.zeros(14) for agent in env.agents})


@pytest.mark.core
def test_no_opinion_shows_all_confirmed_tracks():
    env, score = play(Own()), play("score")
    assert (env.arrays.published == confirmed(env)).all() and confirmed(env).sum() > 5
    assert np.isnan(env.arrays.agent_trust).all()
    known = env.arrays.track_status > 0
    assert np.isnan(env.arrays.track_trust[known]).all()
    for name in ("track_id", "track_mean", "track_cov", "track_score", "published", "reward", "observation"):
        np.testing.assert_array_equal(env.arrays[name], score.arrays[name], err_msg=name)


@pytest.mark.core
def test_trust_below_one_half_hides_and_publish_decides_alone():
    def even(e: Evidence) -> np.ndarray:
        return np.where(e.track_id % 2 == 0, 0.5, 0.499)

    env = play(Own(track_trust=even))
    is_even = env.arrays.track_id % 2 == 0
    assert (env.arrays.published == (confirmed(env) & is_even)).all() and (confirmed(env) & ~is_even).any()
    env = play(Own(track_trust=even, publish=lambda e: e.track_id % 3 == 0))
    assert (env.arrays.published == (confirmed(env) & (env.arrays.track_id % 3 == 0))).all()
    assert confirmed(env).sum() > 5
    everything = play(Own(publish=np.ones((W, J), dtype=bool)))  # tentative and empty columns are not shown
    assert (everything.arrays.published == confirmed(everything)).all()


@pytest.mark.core
def test_monitor_shows_everything_whatever_the_verdict():
    nothing = np.zeros((W, J), dtype=bool)
    env, score = play(Own(publish=nothing), scenario=BUSY | {"actuation": "monitor"}), play("score")
    assert (env.arrays.published == confirmed(env)).all()
    np.testing.assert_array_equal(env.arrays.track_id, score.arrays.track_id)
    hidden = play(Own(publish=nothing))
    assert not hidden.arrays.published.any() and hidden.arrays.metrics[:, 4].tolist() == [0, 0]
    np.testing.assert_array_equal(hidden.arrays.track_id, score.arrays.track_id)


@pytest.mark.core
def test_remove_takes_distrusted_tracks_out_and_their_rebirth_is_new():
    env = play(Own(publish=lambda e: e.track_id % 2 == 0), frames=0, scenario=BUSY | {"actuation": "remove"})
    known: list[dict[int, int]] = [{}, {}]
    removed, there = 0, confirmed(env)
    for _ in range(40):
        go_on(env, 1)
        there = confirmed(env)
        assert (env.arrays.track_id[there] % 2 == 0).all()
        for w in range(W):
            ids = set(env.arrays.track_id[w, env.arrays.track_status[w] > 0].tolist())
            removed += sum(1 for i, status in known[w].items() if i not in ids and i % 2 == 1 and status == 1)
            known[w] = {
                int(env.arrays.track_id[w, j]): int(env.arrays.track_status[w, j])
                for j in np.flatnonzero(env.arrays.track_status[w])
            }
    assert removed > 10 and there.any()


@pytest.mark.core
def test_keep_saves_tracks_that_the_tracker_would_delete():
    def only_the_first(e: Evidence) -> np.ndarray:
        return (e.track_id >= 0) & (e.track_id < 12)

    scenario = BUSY | {"team": {"spread": 100.0}, "targets": {"slots": 6, "death_rate": 0.2}}
    without, kept = (play(Own(keep=keep), frames=60, scenario=scenario) for keep in (None, only_the_first))
    assert ((without.arrays.track_id >= 0) & (without.arrays.track_id < 12)).sum() < 24
    for w in range(W):
        alive = kept.arrays.track_id[w, kept.arrays.track_status[w] > 0]
        assert set(range(12)) <= set(alive.tolist())
    lost = (
        confirmed(kept) & (kept.arrays.track_id < 12) & (kept.arrays.track_unseen == 0) & (kept.arrays.track_score < 0)
    )
    assert lost.any(), "some of the kept tracks have no target any more"
    assert (kept.arrays.published == confirmed(kept)).all(), "what is kept is not about to be deleted"


def actor(weights: list[float] | None, trust: list[float] | None = None, **scenario: Any) -> VectorEnv:
    own = Own(
        agent_weight=None if weights is None else np.array([weights] * W),
        agent_trust=None if trust is None else np.array([trust] * W),
    )
    return play(own, frames=30, scenario=BUSY | scenario)


def tracker_of(env: VectorEnv) -> list[bytes]:
    return [env.arrays[name].tobytes() for name in ("track_id", "track_mean", "track_cov", "track_score")]


@pytest.mark.core
def test_weights_count_from_the_next_frame_on_and_only_under_weight():
    all_ones, none = actor([1.0] * K, actuation="weight"), actor(None, actuation="weight")
    half = actor([0.5] * K, actuation="weight")
    assert tracker_of(all_ones) == tracker_of(none) != tracker_of(half)
    assert tracker_of(actor([0.5] * K, actuation="filter")) == tracker_of(none)
    assert tracker_of(actor(None, trust=[0.5] * K, actuation="weight")) == tracker_of(half)
    unknown = actor(None, trust=[np.nan] * K, actuation="weight")
    assert tracker_of(unknown) == tracker_of(none)
    first = Own(agent_weight=np.full((W, K), 0.5))
    one = play(first, frames=1, scenario=BUSY | {"actuation": "weight"})
    assert tracker_of(one) == tracker_of(play("score", frames=1, scenario=BUSY | {"actuation": "weight"}))


@pytest.mark.core
def test_an_agent_of_no_weight_is_not_heard():
    """Below 1e-3 its report counts for nothing: as if it had sent an empty one, and seen nothing."""
    for weight in (0.0, 9e-4):
        env = actor([1.0, 1.0, weight, 1.0, 1.0], actuation="weight")
        assert (env.arrays.agent_score[:, 2][env.arrays.track_age <= 28] == 0).all()
        listed = np.arange(16) < env.arrays.report_count[:, 2, None]
        assert listed.any() and (env.arrays.assignment[:, 2][listed] == -1).all()
    heard = actor([1.0, 1.0, 1.1e-3, 1.0, 1.0], actuation="weight")
    there = (heard.arrays.track_status > 0) & (heard.arrays.track_age <= 28)
    assert (heard.arrays.agent_score[:, 2][there] != 0).any()


@pytest.mark.core
@pytest.mark.parametrize("actuation", ["monitor", "filter", "remove", "weight"])
def test_a_defense_in_numpy_equals_the_compiled_one(actuation):
    """`majority` again, in NumPy through the public protocol."""

    class Votes:
        def __init__(self, window: int):
            self.window = window

        def reset(self, shape: Shape, worlds: np.ndarray) -> None:
            self.shape = shape
            self.votes: list[list[dict[int, float]]] = [[] for _ in range(shape.W)]
            self.agreed: list[list[np.ndarray]] = [[] for _ in range(shape.W)]

        def update(self, e: Evidence) -> Verdict:
            s = self.shape
            trust, agent = np.full((s.W, s.J), np.nan), np.full((s.W, s.K), np.nan)
            for w in range(s.W):
                now, agree = {}, np.zeros((s.K, 2))
                columns = np.flatnonzero(e.confirmed[w])
                for j in columns:
                    if e.expected[w, :, j].any():
                        now[int(e.track_id[w, j])] = e.detected[w, e.expected[w, :, j], j].mean()
                self.votes[w] = [*self.votes[w], now][-self.window :]
                for j in columns:
                    past = [v[int(e.track_id[w, j])] for v in self.votes[w] if int(e.track_id[w, j]) in v]
                    if past:
                        trust[w, j] = np.mean(past)
                        seen = e.expected[w, :, j]
                        agree[seen, 0] += e.detected[w, seen, j] == (trust[w, j] > 0.5)
                        agree[seen, 1] += 1
                self.agreed[w] = [*self.agreed[w], agree][-self.window :]
                total = np.sum(self.agreed[w], axis=0)
                agent[w] = np.where(total[:, 1] > 0, total[:, 0] / np.maximum(total[:, 1], 1), np.nan)
            return Verdict(track_trust=trust, agent_trust=agent, publish=~(trust <= 0.5))

    scenario = BUSY | {"actuation": actuation}
    ours, builtin = play(Votes(4), scenario=scenario), play("majority(window=4)", scenario=scenario)
    assert confirmed(builtin).any()
    for name in ("track_id", "track_status", "published"):
        np.testing.assert_array_equal(ours.arrays[name], builtin.arrays[name], err_msg=name)
    there = confirmed(builtin)
    np.testing.assert_allclose(ours.arrays.track_trust[there], builtin.arrays.track_trust[there], atol=1e-12)
    np.testing.assert_allclose(ours.arrays.agent_trust, builtin.arrays.agent_trust, atol=1e-12)
    np.testing.assert_allclose(ours.arrays.track_score[there], builtin.arrays.track_score[there], rtol=1e-9)
