"""One seed, one world: what is there and what is sensed depend on nothing that is done, nor on the batch."""

from __future__ import annotations

import hashlib
import multiprocessing
import warnings
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from scipy import stats

import trust_env
from trust_env.compiled import threads as crew
from trust_env.vector import VectorEnv

FRAMES = 25
TRUTH = ("pose", "fov_box", "target_alive", "target_state", "raw_count", "raw_detections", "raw_origin")
CLUTTERED: dict[str, Any] = {
    "base": "patrol",
    "sensor": {"clutter_density": 1e-5},
    "tracker": {"beta_fp": 1e-5},
    "targets": {"birth_rate": 0.1, "death_rate": 0.05},
    "horizon": 12,  # so that every run below crosses the end of an episode
}


def seen_by(env: VectorEnv) -> list[np.ndarray]:
    """What the sensors have to do with; entries beyond `raw_count` mean nothing."""
    a = env.arrays
    there = np.arange(a.raw_origin.shape[-1]) < a.raw_count[..., None]
    listed = np.where(there[..., None], a.raw_detections, 0.0), np.where(there, a.raw_origin, 0)
    alive = a.target_alive.copy()
    return [
        a.pose.copy(),
        a.fov_box.copy(),
        alive,
        np.where(alive[..., None], a.target_state, 0.0),
        a.raw_count.copy(),
        *listed,
    ]


def run(
    scenario: Any = CLUTTERED, defense: Any = "score", n_worlds: int = 3, act: int | None = None, **more: Any
) -> list:
    """Truth and raw detections of every frame; `act` seeds random actions, None is honest."""
    env = trust_env.vector_env(scenario, defense, num_worlds=n_worlds, **more)
    env.reset(seed=11)
    rng, frames = np.random.default_rng(act), [seen_by(env)]
    for _ in range(FRAMES):
        shape = env.arrays.action.shape
        env.step(np.zeros(shape) if act is None else rng.uniform(-1, 1, shape))
        frames.append(seen_by(env))
    env.close()
    return frames


def same(a: list, b: list, n_worlds: int | None = None) -> bool:
    return all(
        np.array_equal(x[:n_worlds], y[:n_worlds])
        for one, two in zip(a, b, strict=True)
        for x, y in zip(one, two, strict=True)
    )


@pytest.fixture(scope="module")
def honest() -> list:
    return run()


class Deaf:
    """A defense that forgets all it hears, and shows nothing."""

    def reset(self, shape, worlds):
        self.shape = shape

    def update(self, evidence):
        rest = np.zeros((self.shape.W, self.shape.J), dtype=bool)
        return trust_env.Verdict(publish=rest, agent_weight=np.zeros((self.shape.W, self.shape.K)))


@pytest.mark.core
def test_there_is_something_to_see(honest):
    counts, origins = np.array([f[4] for f in honest]), np.array([f[6] for f in honest])
    assert counts.mean() > 3 and (origins == -1).sum() > 500 and (origins >= 0).sum() > 500
    alive = np.array([f[2] for f in honest])
    assert (alive[1:] & ~alive[:-1]).any() and (~alive[1:] & alive[:-1]).any()


@pytest.mark.core
@pytest.mark.parametrize("defense", ["trust", "trust(preset=mate)", "majority(window=3)", Deaf()])
@pytest.mark.parametrize("actuation", ["monitor", "remove", "weight"])
def test_not_on_the_defense(honest, defense, actuation):
    assert same(honest, run(CLUTTERED | {"actuation": actuation}, defense, act=5))


@pytest.mark.core
@pytest.mark.parametrize("act", [1, 2])
def test_not_on_the_attack(honest, act):
    assert same(honest, run(act=act))


@pytest.mark.core
@pytest.mark.parametrize(("n_worlds", "threads"), [(1, 1), (7, 1), (40, 2), (256, 1), (256, 2), (256, 9)])
def test_not_on_the_batch_or_the_threads(honest, n_worlds, threads):
    more = run(n_worlds=n_worlds, threads=threads, defense="trust")
    assert same(honest, more, n_worlds=min(3, n_worlds))
    assert same(run(n_worlds=1), run(n_worlds=n_worlds, threads=threads, act=3), n_worlds=1)


@pytest.mark.core
@pytest.mark.parametrize("knowledge", ["poses", "picture", "white_box"])
def test_not_on_what_is_known(honest, knowledge):
    assert same(honest, run(CLUTTERED | {"knowledge": knowledge, "coordination": "shared"}))


@pytest.mark.core
def test_not_on_the_tracker_or_the_budgets(honest):
    other = {
        "tracker": {"beta_fp": 1e-7, "p_detect": 0.5, "max_tracks": 3, "gate": 0.5},
        "injection": {"slots": 1, "benign": None},
    }
    assert same(honest, run(CLUTTERED | other, act=4))


@pytest.mark.core
def test_everything_else_is_the_same_too_whatever_the_batch_and_the_threads():
    """Whole rows of memory, tracker and beliefs included, for the same actions of world 0."""
    rows = []
    for n_worlds, threads in ((1, 1), (7, 1), (50, 2)):
        env = trust_env.vector_env(CLUTTERED, "trust(preset=cdc2024)", num_worlds=n_worlds, threads=threads)
        env.reset(seed=3)
        rng = np.random.default_rng(0)
        for _ in range(30):
            env.step(np.broadcast_to(rng.uniform(-1, 1, env.arrays.action.shape[1:]), env.arrays.action.shape))
        rows.append({name: view[0].copy() for name, view in env.arrays.items()})
        env.close()
    for name in rows[0]:
        for other in rows[1:]:
            np.testing.assert_array_equal(rows[0][name], other[name], err_msg=name)


@pytest.mark.core
def test_one_more_target_slot_changes_nobody_elses_path():
    few, many = (run(CLUTTERED | {"targets": CLUTTERED["targets"] | {"slots": n}}, n_worlds=2) for n in (6, 7))
    both = zip(few, many, strict=True)
    for a, b in both:
        assert np.array_equal(a[2], b[2][:, :6]) and np.array_equal(a[3], b[3][:, :6])
        for w, k in np.ndindex(a[4].shape):  # nor what is seen of them, nor the clutter
            n, m = a[4][w, k], b[4][w, k]
            kept = b[6][w, k, :m] != 6
            assert np.array_equal(a[5][w, k, :n], b[5][w, k, :m][kept])
            assert np.array_equal(a[6][w, k, :n], b[6][w, k, :m][kept])


@pytest.mark.core
def test_one_more_agent_changes_nothing_for_the_others():
    agents = [{"role": "benign"} for _ in range(4)]
    few, many = (run(CLUTTERED | {"agents": agents[:n]}, n_worlds=2) for n in (3, 4))
    for a, b in zip(few, many, strict=True):
        for index in (0, 1, 4, 5, 6):
            assert np.array_equal(a[index], b[index][:, :3])
        assert np.array_equal(a[2], b[2]) and np.array_equal(a[3], b[3])


@pytest.mark.core
@pytest.mark.nojit
def test_episodes_seeds_and_worlds_differ_and_can_be_found_again():
    env = trust_env.vector_env("trio", "score", num_worlds=2, max_cycles=3)
    first = {}
    env.reset(seed=1)
    for episode in range(4):
        assert env.arrays.episode.tolist() == [episode] * 2 and env.arrays.frame.tolist() == [0, 0]
        first[episode] = env.arrays.target_state.copy()
        for _ in range(3):
            env.step(np.zeros(env.arrays.action.shape))
    states = [s[w] for s in first.values() for w in range(2)]
    env.reset(seed=2)
    states += list(env.arrays.target_state.copy())
    assert len({s.tobytes() for s in states}) == len(states)
    env.reset(seed=1, options={"worlds": np.array([1, 0]), "episodes": np.array([3, 2])})
    assert np.array_equal(env.arrays.target_state, np.stack([first[3][1], first[2][0]]))
    env.reset(options={"worlds": np.array([0, 1]), "episodes": np.array([1, 1])})
    assert np.array_equal(env.arrays.target_state, first[1])


@pytest.mark.core
@pytest.mark.parametrize("actuation", ["filter", "remove", "weight"])
@pytest.mark.parametrize(
    "defense", ["score", "trust", "trust(preset=cdc2024)", "trust(preset=mate)", "majority(window=5)"]
)
def test_an_episode_remembers_nothing_of_those_before(defense, actuation):
    scenario = CLUTTERED | {"knowledge": "white_box", "horizon": 20, "actuation": actuation}
    used, fresh = (trust_env.vector_env(scenario, defense, num_worlds=2) for _ in range(2))
    used.reset(seed=6)
    rng = np.random.default_rng(6)
    for _ in range(2 * 20):
        used.step(rng.uniform(-1, 1, used.arrays.action.shape))
    begin, _ = fresh.reset(seed=6, options={"episodes": np.array([2, 2])})
    assert np.array_equal(begin, used.arrays.observation)
    for _ in range(20):
        actions = rng.uniform(-1, 1, used.arrays.action.shape)
        for a, b in zip(used.step(actions)[:4], fresh.step(actions)[:4], strict=True):
            assert np.array_equal(a, b)
        known = used.arrays.track_status > 0
        counts = [name for name in used.arrays if name.startswith("overflow_") or name.endswith("_next_id")]
        for name in (*counts, "metrics", "track_id", "agent_trust", "agent_trust_var", "published"):
            np.testing.assert_array_equal(used.arrays[name], fresh.arrays[name], err_msg=name)
        for name in ("agent_score", "expected", "detected", "held"):
            ours, theirs = (env.arrays[name].swapaxes(1, 2)[known] for env in (used, fresh))
            np.testing.assert_array_equal(ours, theirs, err_msg=name)


@pytest.mark.core
def test_the_same_world_through_both_faces():
    venv = trust_env.vector_env("trio", "trust", num_worlds=3)
    env = trust_env.parallel_env("trio", "trust")
    rng = np.random.default_rng(1)
    vector_obs, _ = venv.reset(seed=5)
    obs, _ = env.reset(seed=5, options={"world": 2})
    for _ in range(40):
        assert np.array_equal(np.array(list(obs.values())), vector_obs[2])
        actions = rng.uniform(-1, 1, venv.arrays.action.shape)
        vector_obs, rewards, *_, info = venv.step(actions)
        obs, reward, *_, infos = env.step(dict(zip(env.agents, actions[2])))
        assert list(reward.values()) == rewards[2].tolist()
        for name, value in infos[env.possible_agents[0]].items():
            assert value == info[name][2]


# --- nor on who else runs, and where ------------------------------------------------------------------------


def fingerprint(seed: int = 4, n_worlds: int = 40, scenario: Any = "trio", env: VectorEnv | None = None) -> str:
    """One number for all that happens in 25 frames."""
    own = trust_env.vector_env(scenario, "trust", num_worlds=n_worlds, threads=2) if env is None else env
    own.reset(seed=seed)
    rng, digest = np.random.default_rng(seed), hashlib.sha256()
    for _ in range(25):
        observations, rewards, *_ = own.step(rng.uniform(-1, 1, own.arrays.action.shape))
        digest.update(observations.tobytes() + rewards.tobytes())
    own.close()
    return digest.hexdigest()


@pytest.mark.core
def test_not_on_other_environments_that_run_between():
    alone = [run(n_worlds=2, act=3), run("trio", n_worlds=2, act=3)]
    envs = [trust_env.vector_env(scenario, "score", num_worlds=2) for scenario in (CLUTTERED, "trio")]
    rngs = [np.random.default_rng(3) for _ in envs]
    for env in envs:
        env.reset(seed=11)
    together = [[seen_by(env)] for env in envs]
    for _ in range(FRAMES):
        for env, rng, frames in zip(envs, rngs, together, strict=True):
            env.step(rng.uniform(-1, 1, env.arrays.action.shape))
            frames.append(seen_by(env))
    assert all(same(a, b) for a, b in zip(alone, together, strict=True))


def test_not_on_threads_that_run_at_once():
    cases = [(seed, n, name) for seed, n, name in ((1, 40, "trio"), (2, 5, "patrol"), (3, 64, "case1"))]
    alone = [fingerprint(*case) for case in cases]
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(lambda case: fingerprint(*case), cases)) == alone


def test_not_on_the_patience_of_threads(monkeypatch):
    expected = fingerprint()
    monkeypatch.setattr(crew, "_PATIENCE", 1)  # who waits goes to sleep at once, the caller, too
    assert fingerprint() == expected


def _send_fingerprint(sender: Any, env: VectorEnv | None) -> None:
    sender.send(fingerprint(env=env))


def in_a_process(method: str, env: VectorEnv | None) -> str:
    """The fingerprint as another process finds it; the process is killed if it does not end by itself."""
    context: Any = multiprocessing.get_context(method)
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_fingerprint, args=(sender, env))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 warns of forks beside threads
        process.start()
    found = receiver.recv() if receiver.poll(120) else "nothing within 120 s"
    process.join(10)
    process.kill()
    return found


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_not_on_the_process(method):
    expected, env = fingerprint(), trust_env.vector_env("trio", "trust", num_worlds=40, threads=2)
    assert fingerprint(env=env) == expected  # its threads have run before the fork
    assert in_a_process(method, env) == expected
    assert in_a_process(method, None) == expected
    assert fingerprint(env=env) == expected


# --- and the worlds are what the scenario says --------------------------------------------------------------


@pytest.fixture(scope="module")
def large() -> VectorEnv:
    scenario = {
        "base": "patrol",
        "team": {"placement": "random"},
        "sensor": {"clutter_density": 1e-5, "p_detect": 0.8, "max_detections": 40},
        "tracker": {"beta_fp": 1e-5},
        "targets": {"initial": 0.5, "birth_rate": 0.0, "death_rate": 0.1, "process_noise": 0.5},
    }
    env = trust_env.vector_env(scenario, "score", num_worlds=600)
    env.reset(seed=8)
    return env


def test_targets_start_as_they_should(large):
    large.reset(seed=8)
    alive, state = large.arrays.target_alive, large.arrays.target_state
    n = alive.size
    assert abs(alive.mean() - 0.5) < 4 * 0.5 / np.sqrt(n)
    x, y, vx, vy = state[alive].T
    for coordinate in (x, y):
        assert stats.kstest(coordinate, stats.uniform(-500, 1000).cdf).pvalue > 1e-3
    speed, course = np.hypot(vx, vy), np.arctan2(vy, vx)
    assert stats.kstest(speed, stats.uniform(3, 9).cdf).pvalue > 1e-3
    assert stats.kstest(course, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 1e-3


def test_targets_move_leave_and_die_as_they_should(large):
    large.reset(seed=8)
    alive, before = large.arrays.target_alive.copy(), large.arrays.target_state.copy()
    large.step(np.zeros(large.arrays.action.shape))
    after, still = large.arrays.target_state, large.arrays.target_alive
    assert not (still & ~alive).any()
    inside = (np.abs(after[..., :2]) <= 500).all(axis=-1)
    assert not (still & ~inside).any()
    stayed = (still & alive & inside).sum() / (alive & inside).sum()
    assert abs(stayed - 0.9) < 4 * np.sqrt(0.09 / alive.sum())
    q, dt = 0.5, 1.0
    off = after[still] - before[still]
    off[:, :2] -= dt * before[still][:, 2:]
    for axis in range(2):  # Q per axis: q [[dt³/3, dt²/2], [dt²/2, dt]]
        cov = np.cov(off[:, axis], off[:, axis + 2])
        expected = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        assert cov == pytest.approx(expected, rel=0.12)


def test_sensors_see_as_they_should(large):
    large.reset(seed=9)
    a = large.arrays
    offset = a.target_state[:, None, :, :2] - a.pose[:, :, None, :2]
    in_view = a.target_alive[:, None] & (np.hypot(offset[..., 0], offset[..., 1]) <= 350.0)
    there = np.arange(a.raw_origin.shape[-1]) < a.raw_count[..., None]
    hits = there & (a.raw_origin >= 0)
    assert abs(hits.sum() / in_view.sum() - 0.8) < 4 * np.sqrt(0.16 / in_view.sum())
    w, k, _ = np.nonzero(hits)
    n = a.raw_origin[hits]
    assert in_view[w, k, n].all()
    noise = (a.raw_detections[hits] - a.target_state[w, n, :2]) / 5.0
    for column in noise.T:
        assert stats.kstest(column, "norm").pvalue > 1e-3
    clutter = there & (a.raw_origin == -1)
    counts, mean = clutter.sum(axis=-1).ravel(), 1e-5 * np.pi * 350.0**2
    assert abs(counts.mean() - mean) < 4 * np.sqrt(mean / counts.size)
    assert abs(counts.var() / mean - 1) < 0.15
    w, k, _ = np.nonzero(clutter)
    radius = np.hypot(*(a.raw_detections[clutter] - a.pose[w, k, :2]).T)
    assert stats.kstest((radius / 350.0) ** 2, "uniform").pvalue > 1e-3


def test_fixed_targets_start_where_they_should_and_drawn_velocities_differ():
    fixed = {"positions": [[10.0, 20.0], [-3.0, 4.0]], "speed": [3.0, 12.0], "process_noise": 0.0}
    env = trust_env.vector_env({"base": "patrol", "targets": fixed}, "score", num_worlds=500)
    env.reset(seed=3)
    state = env.arrays.target_state.copy()
    assert env.arrays.target_alive.all() and (state[..., :2] == fixed["positions"]).all()
    speed = np.hypot(state[..., 2], state[..., 3]).ravel()
    course = np.arctan2(state[..., 3], state[..., 2]).ravel()
    assert stats.kstest(speed, stats.uniform(3, 9).cdf).pvalue > 1e-3
    assert stats.kstest(course, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 1e-3
    for _ in range(150):  # out of the area, which does not matter to them
        env.step(np.zeros(env.arrays.action.shape))
    expected = state[..., :2] + 150 * state[..., 2:]
    assert env.arrays.target_state[..., :2] == pytest.approx(expected) and env.arrays.target_alive.all()
    given = fixed | {"velocities": [[1.0, 2.0], [-5.0, 0.0]]}
    env = trust_env.vector_env({"base": "patrol", "targets": given}, "score")
    env.reset(seed=3)
    assert (env.arrays.target_state[0, :, 2:] == given["velocities"]).all()


def test_recorded_targets_are_where_they_were(tmp_path):
    rows = [(t, "a", 10.0 * t, 5.0) for t in range(12)]
    rows += [(t, "b", -100.0, 3.0 * t) for t in (*range(2, 5), *range(90, 100))]  # with a long gap
    lines = ["t,id,x,y", *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "tracks.csv").write_text("\n".join(lines))
    scenario = {
        "base": "patrol",
        "targets": {"data": str(tmp_path / "tracks.csv")},
        "horizon": None,
        "area": None,
    }
    env = trust_env.vector_env(scenario, "score", autoreset=False)
    recording = env.scenario.recording()
    assert recording is not None and env.max_cycles == len(recording.times) == 100
    env.reset(seed=1)
    for frame in range(99):
        alive, state = env.arrays.target_alive[0], env.arrays.target_state[0]
        expected = {"a": (10.0 * frame, 5.0), "b": (-100.0, 3.0 * frame)}
        present = {"a": frame < 12, "b": 2 <= frame < 5 or frame >= 90}
        for n, name in enumerate(recording.ids):
            assert alive[n] == present[name], (frame, name)
            if alive[n]:
                assert state[n, :2] == pytest.approx(expected[name])
                assert state[n, 2:] == pytest.approx((10.0, 0.0) if name == "a" else (0.0, 3.0))
        env.step(np.zeros(env.arrays.action.shape))


@pytest.mark.parametrize("mean", [450.0, 501.0, 900.0])
def test_clutter_in_masses_is_drawn_or_refused(mean):
    scenario = {
        "base": "case1",
        "fov": {"radius": 1.0},
        "sensor": {"clutter_density": mean / np.pi, "max_detections": 1000, "sigma": 0.1},
        "agents": [{"role": "benign", "position": [0, 0]}],
        "injections": [],
    }
    if mean > 500:
        with pytest.raises(ValueError, match="false positives on average; expected at most 500"):
            trust_env.load_scenario(scenario)
        return
    env = trust_env.vector_env(scenario, "score", num_worlds=100)
    env.reset(seed=1)
    assert abs(env.arrays.raw_count.mean() - 4 - mean) < 4 * np.sqrt(mean / 100)


def test_correlated_noise():
    cov = [[40.0, 15.0], [15.0, 20.0]]
    scenario = {"base": "case1", "sensor": {"sigma": None, "noise_cov": cov}, "fov": {"radius": 1e3}}
    env = trust_env.vector_env(scenario, "score", num_worlds=3000)
    env.reset(seed=10)
    a = env.arrays
    assert (a.raw_count == 4).all()
    w, k, d = np.indices(a.raw_origin[..., :4].shape)
    noise = a.raw_detections[..., :4, :] - a.target_state[w, a.raw_origin[w, k, d], :2]
    assert np.cov(noise.reshape(-1, 2).T) == pytest.approx(np.array(cov), rel=0.05)


@pytest.mark.parametrize(("placement", "spread"), [("random", 1.0), ("overlapping", 80.0), ("together", 1.0)])
def test_agents_stand_where_they_should(placement, spread):
    scenario = {
        "base": "patrol",
        "team": {"placement": placement, "spread": spread},
        "area": [0.0, 400.0, -100.0, 300.0],
    }
    env = trust_env.vector_env(scenario, "score", num_worlds=400)
    env.reset(seed=12)
    pose = env.arrays.pose.reshape(-1, 3)
    offset = pose[:, :2] - (200.0, 100.0)
    if placement == "together":
        assert (offset == 0).all()
    elif placement == "overlapping":
        assert stats.kstest((np.hypot(*offset.T) / spread) ** 2, "uniform").pvalue > 1e-3
    else:
        assert all(stats.kstest(column, stats.uniform(-200, 400).cdf).pvalue > 1e-3 for column in offset.T)


@pytest.mark.parametrize("name", [n for n in trust_env.scenarios() if n not in ("skies", "base")])
def test_every_scenario_runs_and_nothing_overflows_much(name):
    env = trust_env.vector_env(name, "trust", num_worlds=4)
    env.reset(seed=13)
    for _ in range(min(60, env.max_cycles - 1)):
        env.step(np.zeros(env.arrays.action.shape))
    counts = [env.arrays[name] for name in env.arrays if name.startswith("overflow_")]
    assert len(counts) == 5 and np.sum(counts) <= 4
