"""Learners as environments of Gymnasium, against its checkers and its own vector."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics
from learner_runs import HORIZON, drawn

from trust_env.training.learning.gym import AdversaryEnv, GymVectorEnv

pytestmark = pytest.mark.core


@pytest.mark.parametrize("wrapper", ["raw", "phantoms", "grid", "by_need"])
def test_adversary_env_passes_gymnasiums_checker(wrapper: str) -> None:
    env: Any = gymnasium.make("trust_env.training.learning.gym:TrustEnv/Adversary-v0", scenario="trio", wrapper=wrapper)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_adversary_env_ends_by_truncation_and_resets_to_the_next_episode() -> None:
    others = {"adversary_1": "false_positive", "benign": "honest"}
    env = AdversaryEnv("patrol", "score", "adversary_0", "phantoms", others, max_cycles=HORIZON)
    first, info = env.reset(seed=4)
    for frame in range(HORIZON):
        seen, reward, terminated, truncated, after = env.step(np.zeros(15, dtype=np.float32))
        assert seen in env.observation_space and isinstance(reward, float) and after.keys() == info.keys()
        assert (terminated, truncated) == (False, frame == HORIZON - 1)
    assert env.arrays.frame.item() == HORIZON and env.arrays.episode.item() == 0
    assert (env.reset()[0] != first).any() and env.arrays.episode.item() == 1
    np.testing.assert_array_equal(env.reset(seed=4)[0], first)
    for copied in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        for frame in range(3):
            choices = np.full(15, 0.1 * frame, dtype=np.float32)
            np.testing.assert_array_equal(copied.step(choices)[0], copy.deepcopy(env).step(choices)[0])
            if frame == 0:
                break
    env.close()
    env.close()


def test_adversary_env_renders() -> None:
    env = AdversaryEnv("trio", render_mode="ansi")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert "adversary_0" in env.render()
    with pytest.raises(ValueError, match="unknown render mode 'ascii'; did you mean 'ansi'"):
        AdversaryEnv("trio", render_mode="ascii")


def test_vector_env_reports_as_gymnasiums_own_does() -> None:
    """Beside a `SyncVectorEnv` of one-learner environments, which Gymnasium fills in itself."""
    ours: Any = GymVectorEnv("trio", "score", num_worlds=2, max_cycles=HORIZON)
    theirs = SyncVectorEnv(
        [lambda: RecordEpisodeStatistics(AdversaryEnv("trio", "score", max_cycles=HORIZON))] * 2,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    assert (ours.single_observation_space, ours.action_space) == (
        theirs.single_observation_space,
        theirs.action_space,
    )
    seen, expected = ours.reset(seed=3)[0], theirs.reset(seed=3)[0]
    np.testing.assert_array_equal(seen[0], expected[0])  # the same world; the second one has another seed
    for frame in range(HORIZON + 2):
        actions = drawn(ours.learners, frame)
        got, wanted = ours.step(actions), theirs.step(actions)
        for a, b in zip(got[:4], wanted[:4], strict=True):
            assert (a.shape, a.dtype) == (b.shape, b.dtype)
            np.testing.assert_array_equal(a[0], b[0])
        infos, given = got[4], wanted[4]
        assert ("final_obs" in infos) == (frame == HORIZON - 1)
        if "final_obs" in infos:
            np.testing.assert_array_equal(infos["final_obs"][0], given["final_obs"][0])
            assert infos["final_obs"].dtype == given["final_obs"].dtype == object
            np.testing.assert_array_equal(infos["_final_obs"], given["_final_obs"])
            np.testing.assert_array_equal(infos["_final_info"], given["_final_info"])
            episode, theirs_ = infos["final_info"]["episode"], given["final_info"]["episode"]
            assert episode.keys() == theirs_.keys()
            assert episode["r"][0] == pytest.approx(theirs_["r"][0]) and episode["l"][0] == HORIZON
    with pytest.raises(ValueError, match="reset_mask"):
        ours.reset(options={"reset_mask": np.array([True, False])})


def test_gymnasiums_vector_wrappers_work() -> None:
    env: Any = gymnasium.wrappers.vector.RecordEpisodeStatistics(GymVectorEnv("trio", num_worlds=3, max_cycles=4))
    env.reset(seed=0)
    total = np.zeros(3)
    for frame in range(4):
        _, rewards, _, _, infos = env.step(drawn(env.unwrapped.learners, frame))
        total += rewards
    np.testing.assert_allclose(infos["episode"]["r"], total)
    np.testing.assert_array_equal(infos["episode"]["l"], 4)
