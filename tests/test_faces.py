"""The faces: what callers get, every frame, and what happens when they give something wrong."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

import trust_env
from trust_env.parallel import TrustEnv

KNOWLEDGE = ("own", "poses", "picture", "white_box")
INFO_KEYS = ["false_tracks", "injected_tracks", "missing_targets", "visible_targets", "published_tracks"]


def actions_of(env: TrustEnv, rng: np.random.Generator, scale: float = 1.0) -> dict[str, np.ndarray]:
    shape = env.action_space(env.possible_agents[0]).shape
    return {agent: (scale * rng.uniform(-1, 1, shape)).astype(np.float32) for agent in env.agents}


def honest(env: TrustEnv) -> dict[str, np.ndarray]:
    return {agent: np.zeros(env.action_space(agent).shape, np.float32) for agent in env.agents}


def snapshot(env: TrustEnv) -> tuple[bytes, tuple[str, ...], bool]:
    state = env.get_state()
    return state["row"].tobytes(), tuple(state["agents"]), state["started"]


def episode(env: TrustEnv, rng: np.random.Generator, frames: int) -> list[Any]:
    """Everything that comes back, in a form that can be compared exactly."""
    out = []
    for _ in range(frames):
        observations, *rest = env.step(actions_of(env, rng))
        out.append(({a: o.tobytes() for a, o in observations.items()}, *rest, env.state().tobytes()))
        if not env.agents:
            break
    return out


# --- contracts ----------------------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.parametrize("coordination", ["none", "shared"])
@pytest.mark.parametrize("knowledge", KNOWLEDGE)
def test_every_frame_keeps_its_contracts(knowledge, coordination):
    scenario = {"base": "trio", "knowledge": knowledge, "coordination": coordination, "horizon": 40}
    env = trust_env.parallel_env({**scenario, "team": {"n_adversaries": 2, "n_benign": 2}}, "trust")
    rng = np.random.default_rng(0)
    observations, infos = env.reset(seed=0)
    for frame in range(40):
        assert list(observations) == list(infos) == env.possible_agents
        for agent, observation in observations.items():
            space = env.observation_space(agent)
            assert observation.dtype == np.float32 and observation.shape == space.shape
            assert space.contains(observation)
            assert list(infos[agent]) == INFO_KEYS
            assert all(type(value) is float and np.isfinite(value) for value in infos[agent].values())
        assert env.state().dtype == np.float32 and env.state_space.contains(env.state())
        assert env.agents == env.possible_agents
        agents = env.agents[:]
        scale = float(rng.choice([1.0, 5.0]))
        observations, rewards, terminations, truncations, infos = env.step(actions_of(env, rng, scale))
        assert list(rewards) == list(terminations) == list(truncations) == agents
        assert all(type(reward) is float and np.isfinite(reward) for reward in rewards.values())
        assert all(value is False for value in terminations.values())
        assert all(value is (frame == 39) for value in truncations.values())
    assert env.agents == []


def test_what_an_environment_says_of_itself():
    env = trust_env.parallel_env("case1")
    assert env.possible_agents == ["adversary_0", "benign_0", "adversary_1"]
    assert env.metadata["name"] == "trust_env_v0" and env.metadata["is_parallelizable"]
    assert (
        set(env.metadata["render_modes"]) == {"human", "rgb_array", "ansi"} and "render_fps" in env.metadata
    )
    for space_of in (env.observation_space, env.action_space):
        spaces = [space_of(agent) for agent in env.possible_agents]
        assert all(space_of(agent) is space for agent, space in zip(env.possible_agents, spaces))
        assert all(space == spaces[0] for space in spaces) and len({id(space) for space in spaces}) == 3
        assert spaces[0].dtype == np.float32 and len(spaces[0].shape) == 1
        assert np.isfinite(spaces[0].low).all() and np.isfinite(spaces[0].high).all()
    assert env.action_space("benign_0").shape == (3 * 2 + 8,)
    env.close()
    env.close()


def test_role_time_pose_and_detections_can_be_read_back():
    env = trust_env.parallel_env(
        {"base": "trio", "knowledge": "white_box", "coordination": "shared"}, "trust"
    )
    rng = np.random.default_rng(2)
    observations, _ = env.reset(seed=2)
    for frame in range(30):
        a = env.arrays
        for k, agent in enumerate(env.possible_agents):
            read = env.observation_table.read(observations[agent], k)
            assert read["role"] == (1 if agent.startswith("adversary") else -1)
            assert read["time"] == pytest.approx(frame / 100)
            pose = a.pose[0, k]
            assert read["pose"] == pytest.approx([*pose[:2], np.cos(pose[2]), np.sin(pose[2])], abs=1e-3)
            n = a.raw_count[0, k]
            assert read["detections_mask"].sum() == n
            assert read["detections"][:n] == pytest.approx(a.raw_detections[0, k, :n], abs=1e-3)
            m = a.report_count[0, k]
            assert read["report_mask"].sum() == m
            assert read["report"][:m] == pytest.approx(a.reports[0, k, :m], abs=1e-3)
            shown = np.flatnonzero(a.published[0])
            assert read["picture_mask"].sum() == len(shown)
            assert read["picture"][: len(shown), :2] == pytest.approx(a.track_mean[0, shown, :2], abs=1e-2)
            there = a.track_status[0] > 0
            assert read["tracks_status"] == pytest.approx(a.track_status[0] / 2)
            assert read["tracks_score"][there] == pytest.approx(
                a.track_score[0, there].clip(-50, 50), abs=1e-3
            )
            known = there & ~np.isnan(a.track_trust[0])
            assert read["tracks_trust"][known, 0] == pytest.approx(a.track_trust[0, known], abs=1e-6)
            assert (read["tracks_trust"][there & ~known] == -1).all()
            trust = np.nan_to_num(a.agent_trust[0], nan=-1.0)
            assert read["agents_trust"][:, 0] == pytest.approx(trust, abs=1e-6)
        observations, *_ = env.step(actions_of(env, rng))


def test_adversaries_read_each_other_and_benign_agents_nobody():
    team = {"n_adversaries": 3, "n_benign": 1}
    env = trust_env.parallel_env(
        {"base": "trio", "team": team, "coordination": "shared", "knowledge": "poses"}
    )
    rng = np.random.default_rng(3)
    observations, _ = env.reset(seed=3)
    for _ in range(15):
        a = env.arrays
        for k, agent in enumerate(env.possible_agents):
            read = env.observation_table.read(observations[agent], k)
            for other in range(4):
                allies = k != other and max(k, other) < 3
                for name, count, points in (
                    ("shared_detections", a.raw_count, a.raw_detections),
                    ("shared_reports", a.report_count, a.reports),
                ):
                    n = count[0, other] if allies else 0
                    assert read[f"{name}_mask"][other].sum() == n
                    assert read[name][other, :n] == pytest.approx(points[0, other, :n], abs=2e-3)
                pose = a.pose[0, other]
                assert read["poses"][other] == pytest.approx(
                    [*pose[:2], np.cos(pose[2]), np.sin(pose[2])], abs=1e-3
                )
                assert read["fovs"][other, 0] == pytest.approx(250.0, rel=1e-5)
        observations, *_ = env.step(actions_of(env, rng))


@pytest.mark.core
@pytest.mark.nojit
def test_rewards_by_hand():
    scenario = {"base": "case1", "reward": {"false_track": 2.0, "missing_target": 0.5, "lost_trust": 3.0}}
    env = trust_env.parallel_env(scenario, "trust")
    env.reset(seed=1)
    rng, last = np.random.default_rng(1), np.full(3, np.nan)
    for _ in range(20):
        actions = actions_of(env, rng)
        _, rewards, _, _, infos = env.step(actions)
        info, trust = infos["benign_0"] if infos else {}, env.arrays.agent_trust[0].copy()
        gain = 2.0 * info["false_tracks"] + 0.5 * info["missing_targets"]
        expected = gain - 3.0 * np.nan_to_num(last - trust)
        assert rewards["adversary_0"] == pytest.approx(expected[0])
        assert rewards["adversary_1"] == pytest.approx(expected[2])
        assert rewards["benign_0"] == pytest.approx(-(expected[0] + expected[2]) / 2)
        last = trust


def test_benign_agents_alone_get_nothing():
    env = trust_env.parallel_env("patrol(n_adversaries=0)", "trust")
    env.reset(seed=1)
    for _ in range(20):
        _, rewards, *_ = env.step(actions_of(env, np.random.default_rng(1)))
        assert set(rewards.values()) == {0.0}


def test_pettingzoo_is_content():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # api_test remarks on flat observations that they are no images
        api_test(trust_env.env("trio", max_cycles=30), num_cycles=200)
        api_test(trust_env.raw_env("case1", "score"), num_cycles=100)
        parallel_api_test(trust_env.parallel_env("case1"), num_cycles=60)
        seed_test(lambda: trust_env.env("case1"), num_cycles=60)
        parallel_seed_test(lambda: trust_env.parallel_env("case1"))


def test_agent_by_agent_is_the_same_world():
    aec, env = (
        trust_env.env("trio", "trust", max_cycles=12),
        trust_env.parallel_env("trio", "trust", max_cycles=12),
    )
    aec.reset(seed=4)
    env.reset(seed=4)
    rng = np.random.default_rng(4)
    while env.agents:
        actions = actions_of(env, rng)
        for agent in env.agents:
            assert aec.agent_selection == agent
            aec.step(actions[agent])
        observations, rewards, _, truncations, _ = env.step(actions)
        for agent in observations:
            assert (aec.observe(agent) == observations[agent]).all()
            assert aec.rewards[agent] == rewards[agent] and aec.truncations[agent] is truncations[agent]
    assert aec.agents == aec.possible_agents  # dead until each has been stepped with None
    for _ in range(3):
        aec.step(None)
    assert aec.agents == []


# --- reset --------------------------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.nojit
def test_resets():
    env = trust_env.parallel_env("trio", "trust", max_cycles=4)
    first = [{a: o.tobytes() for a, o in env.reset(seed=9)[0].items()}]
    first += [{a: o.tobytes() for a, o in env.reset()[0].items()} for _ in range(3)]
    assert len({str(obs) for obs in first}) == 4

    def begins(**kwargs: Any) -> dict[str, bytes]:
        return {a: o.tobytes() for a, o in env.reset(**kwargs)[0].items()}

    assert begins(seed=9, options={"episode": 2}) == first[2]
    assert begins() == first[3]  # the next episode after the replayed one
    assert begins(options={"world": 0, "episode": 1, "colour": "red", "options": 1}) == first[1]
    assert begins(seed=9, options={"nonsense": np.nan}) == first[0]
    other = begins(seed=9, options={"world": 5})
    assert other not in first
    assert begins(seed=9) == first[0], "a seeded reset depends on the seed alone"
    assert begins(seed=10) not in first


def test_unseeded_environments_differ():
    starts = {trust_env.parallel_env("trio").reset()[0]["benign_0"].tobytes() for _ in range(3)}
    assert len(starts) == 3


@pytest.mark.parametrize("seed", [-1, 2**63, 1.5, "1", True, np.nan])
def test_seeds_that_are_none(seed):
    for env in (trust_env.parallel_env("case1"), trust_env.vector_env("case1")):
        env.reset(seed=3)
        before = env.worlds.rows.copy()
        with pytest.raises(ValueError, match="seed must be an integer from 0"):
            env.reset(seed=seed)
        assert np.array_equal(env.worlds.rows, before)


@pytest.mark.parametrize("seed", [0, 2**63 - 1, np.int32(5), np.uint64(7)])
def test_seeds_that_are_some(seed):
    env = trust_env.parallel_env("case1")
    env.reset(seed=seed)
    assert env.arrays.seed[0] == seed


@pytest.mark.parametrize(
    "options", [{"world": -1}, {"episode": 2**32}, {"world": 1.0}, {"episode": "3"}, {"world": None}]
)
def test_options_out_of_range(options):
    env = trust_env.parallel_env("case1")
    env.reset(seed=3)
    before = snapshot(env)
    with pytest.raises(ValueError, match=r"option '(world|episode)' must be an integer"):
        env.reset(seed=4, options=options)
    assert snapshot(env) == before


# --- bad input ----------------------------------------------------------------------------------------------


def spoilt(actions: dict[str, Any], agent: str, value: Any) -> dict[str, Any]:
    return actions | {agent: value}


def bad_actions(actions: dict[str, np.ndarray]) -> list[tuple[Any, type[Exception], str]]:
    """What a caller may hand over by mistake, and the words of the error."""
    size = len(actions["benign_0"])
    one_nan, one_inf = np.zeros(size), np.zeros(size, np.float32)
    one_nan[3], one_inf[-1] = np.nan, -np.inf
    without = {agent: action for agent, action in actions.items() if agent != "benign_0"}
    return [
        (spoilt(actions, "benign_0", one_nan), ValueError, "benign_0.*finite.*entry 3.*nan"),
        (
            spoilt(actions, "adversary_0", one_inf),
            ValueError,
            rf"adversary_0.*finite.*entry {size - 1}.*-inf",
        ),
        (spoilt(actions, "benign_0", np.zeros(size - 1, np.float32)), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", np.zeros((1, size), np.float32)), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", np.zeros((size, 1))), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", 0.0), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", None), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", "fire"), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", ["a"] * size), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", np.array(["0.5"] * size)), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", np.zeros(size, complex)), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", np.array([None] * size)), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", {"x": 1}), ValueError, f"benign_0.*{size}"),
        (spoilt(actions, "benign_0", [[0.0] * size, [0.0]]), ValueError, f"benign_0.*{size}"),
        (without, ValueError, "missing: benign_0"),
        ({}, ValueError, "missing: adversary_0, benign_0"),
        (actions | {"benign_7": actions["benign_0"]}, ValueError, "unknown: benign_7"),
        (without | {"benign_7": actions["benign_0"]}, ValueError, "benign_7"),
        (None, ValueError, "adversary_0"),
        (list(actions.values()), ValueError, "adversary_0"),
    ]


@pytest.mark.core
def test_bad_actions_are_refused_by_name_and_change_nothing():
    env = trust_env.parallel_env("trio", "trust")
    env.reset(seed=5)
    rng = np.random.default_rng(5)
    for _ in range(5):
        env.step(actions_of(env, rng))
    before, actions = snapshot(env), actions_of(env, rng)
    for wrong, error, message in bad_actions(actions):
        with pytest.raises(error, match=message):
            env.step(wrong)
        assert snapshot(env) == before, message
    twin = copy.deepcopy(env)
    assert episode(env, np.random.default_rng(6), 5) == episode(twin, np.random.default_rng(6), 5)


@pytest.mark.core
def test_finite_numbers_of_any_kind_are_clipped_alike():
    """Lists, whole numbers, float64 beyond float32's range: as if clipped to the space."""
    rng = np.random.default_rng(6)
    envs = [trust_env.parallel_env("trio", "trust") for _ in range(4)]
    for env in envs:
        env.reset(seed=6)
    for _ in range(15):
        size = envs[0].action_space("benign_0").shape
        huge = {a: rng.choice([-1e300, -2.0, -0.5, 0.0, 0.5, 7.0, 1e300], size) for a in envs[0].agents}
        clipped = {a: np.clip(v, -1, 1) for a, v in huge.items()}
        kinds = [
            huge,
            clipped,
            {a: v.tolist() for a, v in huge.items()},
            {a: clipped[a].astype(np.float32) for a in clipped},
        ]
        rows = []
        for env, actions in zip(envs, kinds, strict=True):
            observations, *_ = env.step(actions)
            rows.append({a: o.tobytes() for a, o in observations.items()})
            assert all(env.observation_space(a).contains(o) for a, o in observations.items())
        assert rows[0] == rows[1] == rows[2] == rows[3]


def test_the_order_of_a_dict_does_not_matter():
    envs = [trust_env.parallel_env("trio", "trust") for _ in range(2)]
    for env in envs:
        env.reset(seed=3)
    for _ in range(10):
        actions = actions_of(envs[0], np.random.default_rng(envs[0].arrays.frame[0].item()))
        turned = dict(reversed(actions.items()))
        first, second = envs[0].step(actions), envs[1].step(turned)
        assert list(first[0]) == list(second[0]) == envs[0].possible_agents
        assert first[1:] == second[1:] and snapshot(envs[0]) == snapshot(envs[1])


def test_steps_at_the_wrong_time():
    env = trust_env.parallel_env("case1", max_cycles=2)
    with pytest.raises(RuntimeError, match="reset"):
        env.step({})
    env.reset(seed=0)
    for _ in range(2):
        env.step(honest(env))
    before = snapshot(env)
    for actions in ({}, {"benign_0": np.zeros(14)}):
        with pytest.raises(RuntimeError, match=r"over.*reset"):
            env.step(actions)
    assert snapshot(env) == before
    env.reset()
    assert env.agents == env.possible_agents


def test_actions_are_not_kept_and_observations_not_overwritten():
    env = trust_env.parallel_env("trio")
    observations, _ = env.reset(seed=7)
    copies = {a: o.copy() for a, o in observations.items()}
    actions = actions_of(env, np.random.default_rng(7))
    given = {a: v.copy() for a, v in actions.items()}
    env.step(actions)
    assert all(
        np.array_equal(actions[a], given[a]) and np.array_equal(observations[a], copies[a]) for a in actions
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "patroll"}, "patrol"),
        ({"scenario": "case3"}, "case"),
        ({"defense": "thrust"}, "trust"),
        ({"defense": "trust(preset=papper)"}, "paper"),
        ({"defense": "trust(presset=paper)"}, "switch|presset"),
        ({"defense": "majority(window=0)"}, "window"),
        ({"defense": "majority(windw=3)"}, "windw"),
        ({"defense": "trust(agent_priors={9: (0.8, 10)})"}, "agent 9"),
        ({"scenario": "patrol(horizn=3)"}, "horizon"),
        ({"render_mode": "rgb"}, "rgb_array"),
        ({"max_cycles": 0}, "max_cycles"),
        ({"max_cycles": 2.5}, "max_cycles"),
    ],
)
def test_wrong_arguments_name_what_was_meant(arguments, message):
    with pytest.raises(ValueError, match=message):
        trust_env.parallel_env(**arguments)


@pytest.mark.parametrize("defense", [object(), 5, None, dict, type("Half", (), {"reset": lambda *a: None})()])
def test_what_is_no_defense(defense):
    with pytest.raises(TypeError, match="a defense is a name, or an object"):
        trust_env.parallel_env("case1", defense)


# --- copies -------------------------------------------------------------------------------------------------


class Remembers:
    """A user's defense with a memory of its own, outside the world's."""

    def __init__(self):
        self.level = 0.5

    def reset(self, shape, worlds):
        self.shape = shape
        self.level = 0.5

    def update(self, evidence):
        self.level = 0.9 * self.level + 0.1 * float(evidence.detected.mean() > 0.02)
        return trust_env.Verdict(track_trust=np.full((self.shape.W, self.shape.J), self.level))


@pytest.mark.core
@pytest.mark.parametrize("defense", ["trust", "majority(window=4)", "own"])
@pytest.mark.parametrize("way", ["deepcopy", "pickle", "state", "state into a fresh one"])
def test_copies_go_on_bit_for_bit(way, defense):
    def make() -> TrustEnv:
        scenario = {"base": "trio", "knowledge": "white_box", "horizon": 60}
        return trust_env.parallel_env(scenario, Remembers() if defense == "own" else defense)

    env = make()
    env.reset(seed=8)
    episode(env, np.random.default_rng(1), 25)
    state = env.get_state()
    if way == "deepcopy":
        twin = copy.deepcopy(env)
    elif way == "pickle":
        twin = pickle.loads(pickle.dumps(env))
    elif way == "state":
        twin = env
    else:
        twin = make()
        twin.reset(seed=99)
        twin.set_state(pickle.loads(pickle.dumps(state)))
    original = episode(env, np.random.default_rng(2), 50)
    if way == "state":
        env.reset(seed=55)
        episode(env, np.random.default_rng(5), 7)
        env.set_state(state)
    assert len(original) == 35
    assert episode(twin, np.random.default_rng(2), 50) == original
    assert env.agents == twin.agents == []
    if way == "state":
        return
    begin = [{a: o.tobytes() for a, o in e.reset()[0].items()} for e in (env, twin)]
    assert begin[0] == begin[1]


def test_a_snapshot_of_another_scenario_is_refused():
    env, other = trust_env.parallel_env("trio"), trust_env.parallel_env("case1")
    env.reset(seed=1)
    other.reset(seed=1)
    before = snapshot(env)
    with pytest.raises(ValueError, match="snapshot"):
        env.set_state(other.get_state())
    assert snapshot(env) == before


def test_a_snapshot_is_no_view():
    env = trust_env.parallel_env("trio")
    env.reset(seed=1)
    state = env.get_state()
    row = state["row"].copy()
    episode(env, np.random.default_rng(0), 3)
    assert np.array_equal(state["row"], row)


def test_a_copied_batch_goes_on_bit_for_bit():
    venv = trust_env.vector_env("trio", "trust", num_worlds=40, max_cycles=20, threads=2)
    venv.reset(seed=1)
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (30, *venv.arrays.action.shape))
    for action in actions[:10]:
        venv.step(action)
    twins = [venv, copy.deepcopy(venv), pickle.loads(pickle.dumps(venv))]
    for action in actions[10:]:
        results = [twin.step(action) for twin in twins]
        for other in results[1:]:
            for a, b in zip(results[0][:4], other[:4], strict=True):
                np.testing.assert_array_equal(a, b)
    assert all(np.array_equal(twin.worlds.rows, venv.worlds.rows) for twin in twins)


# --- the batch ----------------------------------------------------------------------------------------------


@pytest.mark.core
@pytest.mark.parametrize("defense", ["trust", "score"])
def test_the_batch_keeps_its_contracts(defense):
    venv = trust_env.vector_env("trio", defense, num_worlds=5, max_cycles=7)
    observations, info = venv.reset(seed=2)
    w, k = 5, len(venv.possible_agents)
    o, a = venv.single_observation_space.shape[0], venv.single_action_space.shape[0]
    keys, rng = set(info), np.random.default_rng(2)
    for frame in range(1, 30):
        assert observations.shape == (w, k, o) and observations.dtype == np.float32
        assert np.isfinite(observations).all() and np.abs(observations).max() <= 1.0
        observations, rewards, terminated, truncated, info = venv.step(rng.uniform(-2, 2, (w, k, a)))
        assert rewards.shape == (w, k) and rewards.dtype == np.float64 and np.isfinite(rewards).all()
        assert terminated.shape == truncated.shape == (w,) and terminated.dtype == truncated.dtype == bool
        over = frame % 7 == 0
        assert not terminated.any() and (truncated == over).all()
        assert set(info) == (keys | {"final_obs"} if over else keys)
        assert info["agent_trust"].shape == (w, k)
        assert all(
            value.shape == (w,) for name, value in info.items() if name not in ("agent_trust", "final_obs")
        )
        assert (info["frame"] == ((frame - 1) % 7) + 1).all() and (info["episode"] == (frame - 1) // 7).all()
        if over:
            final = venv.observation_table.read(info["final_obs"], np.arange(k))
            begin = venv.observation_table.read(observations, np.arange(k))
            assert (final["time"] == 1).all() and (begin["time"] == 0).all()
            assert (venv.arrays.track_status == 0).all()


def test_the_batch_without_autoreset():
    venv = trust_env.vector_env("trio", "trust", num_worlds=2, max_cycles=3, autoreset=False)
    venv.reset(seed=1)
    for frame in range(1, 4):
        _, _, _, truncated, info = venv.step(np.zeros(venv.arrays.action.shape))
        assert truncated.tolist() == [frame == 3] * 2 and "final_obs" not in info
    assert venv.arrays.episode.tolist() == [0, 0]


def test_worlds_end_one_by_one_and_only_they_begin_again():
    venv = trust_env.vector_env("trio", "trust", num_worlds=3, max_cycles=6)
    alone = trust_env.vector_env("trio", "trust", num_worlds=3, max_cycles=6)
    venv.reset(seed=3)
    alone.reset(seed=3)
    venv.arrays.frame[...] = [0, 2, 4]
    truncated = np.zeros(3, dtype=bool)
    for _ in range(2):
        _, _, _, truncated, _ = venv.step(np.zeros(venv.arrays.action.shape))
        alone.step(np.zeros(venv.arrays.action.shape))
    assert truncated.tolist() == [False, False, True]
    assert venv.arrays.episode.tolist() == [0, 0, 1] and venv.arrays.frame.tolist() == [2, 4, 0]
    assert np.array_equal(venv.arrays.track_score[0], alone.arrays.track_score[0])


def bad_batches(shape: tuple[int, ...]) -> list[tuple[Any, str]]:
    one_nan = np.zeros(shape)
    one_nan[1, 0, 2] = np.nan
    return [
        (one_nan, "world 1, adversary_0, entry 2"),
        (np.full(shape, np.inf), "finite"),
        (np.zeros(shape[1:]), "shape"),
        (np.zeros((*shape, 1)), "shape"),
        (np.zeros(shape, complex), "numbers"),
        (np.full(shape, "a"), "numbers"),
        (None, "numbers"),
        (np.full(shape, None), "numbers"),
    ]


@pytest.mark.core
def test_bad_batches_are_refused_and_change_nothing():
    venv = trust_env.vector_env("trio", "trust", num_worlds=2)
    with pytest.raises(RuntimeError, match="reset"):
        venv.step(np.zeros(venv.arrays.action.shape))
    venv.reset(seed=4)
    for _ in range(3):
        venv.step(np.ones(venv.arrays.action.shape))
    before = venv.worlds.rows.copy()
    for actions, message in bad_batches(venv.arrays.action.shape):
        with pytest.raises(ValueError, match=message):
            venv.step(actions)
        assert np.array_equal(venv.worlds.rows, before)
    for options in (
        {"worlds": [0]},
        {"episodes": [0.5, 1.0]},
        {"worlds": [-1, 0]},
        {"episodes": [0, 2**32]},
        {"worlds": 3},
    ):
        for seed in (None, 9):
            with pytest.raises(ValueError, match=r"option '(worlds|episodes)'"):
                venv.reset(seed=seed, options=options)
            assert np.array_equal(venv.worlds.rows, before)


@pytest.mark.parametrize(
    "arguments",
    [{"num_worlds": 0}, {"num_worlds": 1.5}, {"threads": -1}, {"max_cycles": "3"}, {"num_worlds": True}],
)
def test_batches_of_no_size(arguments):
    with pytest.raises(ValueError, match="must be a whole number of at least 1"):
        trust_env.vector_env("trio", **arguments)


# --- memory -------------------------------------------------------------------------------------------------


def resident_bytes() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def grown(frames: int) -> int:
    venv = trust_env.vector_env("patrol", "trust", num_worlds=256, max_cycles=100_000)
    venv.reset(seed=1)
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (4, *venv.arrays.action.shape))
    actions[..., :12] *= rng.random((4, *venv.arrays.action.shape[:2], 1)) < 0.1
    for step in range(40):
        venv.step(actions[step % 4])
    before = resident_bytes()
    for step in range(frames // 256):
        venv.step(actions[step % 4])
    venv.close()
    return resident_bytes() - before


def test_two_hundred_thousand_frames_need_no_more_memory():
    assert grown(200_000) < 4 << 20


@pytest.mark.slow
def test_a_million_frames_need_no_more_memory():
    assert grown(1_000_000) < 4 << 20


def test_ten_thousand_dict_steps_and_many_resets_need_no_more_memory():
    env = trust_env.parallel_env("trio", "trust", max_cycles=20)
    actions: dict[str, np.ndarray] = {}
    before = 0
    for step in range(6000):
        if not env.agents:
            env.reset()
            actions = actions or honest(env)
        env.step(actions)
        before = before or (resident_bytes() if step == 1000 else 0)
    assert resident_bytes() - before < 4 << 20
