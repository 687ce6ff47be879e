"""Learned policies at play: batches, knowledge levels, sizes and sampling."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from policy_files import SCENARIO, actions_of, write_fitting

from trust_env import training
from trust_env.agents import Player
from trust_env.agents.learned.policy_file import FILE, load_policy, save_policy
from trust_env.parallel import parallel_env
from trust_env.scenario import load_scenario

pytestmark = pytest.mark.core


class TestPlay:
    @pytest.mark.parametrize("wrapper", ["raw", "phantoms(n=2)", "grid", "by_need(n=6)"])
    @pytest.mark.parametrize("sampled", [False, True])
    def test_actions_do_not_depend_on_the_batch(self, tmp_path: Path, wrapper: str, sampled: bool) -> None:
        spec = f"learned(path='{write_fitting(tmp_path / FILE, wrapper)}', sampled={sampled})"
        together = actions_of(spec, np.arange(70))
        assert np.abs(together).max() > 0.0
        for w in (0, 33, 69):
            assert np.array_equal(actions_of(spec, np.array([w]))[:, 0], together[:, w])
        assert np.array_equal(actions_of(spec, np.array([69, 4, 33])), together[:, [69, 4, 33]])

    def test_a_parallel_env_and_a_batch_get_the_same_actions(self, tmp_path: Path) -> None:
        run = write_fitting(tmp_path / FILE) and str(tmp_path)
        batch = actions_of(run, np.arange(3), seed=7)
        env = parallel_env(SCENARIO, "score")
        player = Player(env, {"adversary": run})
        observations, _ = env.reset(seed=7, options={"world": 2, "episode": 0})
        for frame in range(12):
            actions = player.actions(observations)
            assert np.array_equal(np.stack(list(actions.values())), batch[frame, 2])
            observations, *_ = env.step(actions)

    def test_more_knowledge_does_not_change_actions(self, tmp_path: Path) -> None:
        path = str(write_fitting(tmp_path / FILE))
        own = actions_of(path, np.arange(4))
        for level in ("poses", "white_box"):
            assert np.array_equal(actions_of(path, np.arange(4), f"trio(horizon=12, knowledge={level})"), own)

    def test_less_knowledge_than_in_training_raises(self, tmp_path: Path) -> None:
        path = write_fitting(tmp_path / FILE, scenario="trio(horizon=12, knowledge=poses)")
        with pytest.raises(ValueError, match=r"'learned' needs knowledge level 'poses'.* gives 'own'"):
            actions_of(str(path), np.arange(1))
        results = training.evaluate(SCENARIO, str(path), "score", episodes=1, progress=False)
        assert "poses here for all cells" in results.notes[0]

    def test_other_sizes_than_in_training_raise_and_name_the_field(self, tmp_path: Path) -> None:
        path = write_fitting(tmp_path / FILE)
        size = load_scenario(SCENARIO).sensor.max_detections
        sizes = f"entries of the field detections: {2 * size} where it was trained .*, but {2 * size + 4} in"
        with pytest.raises(ValueError, match=sizes):
            actions_of(str(path), np.arange(1), f"trio(max_detections={size + 2})")
        raw = write_fitting(tmp_path / "raw.safetensors", "raw")
        with pytest.raises(ValueError, match=r"outputs: .* where it was trained"):
            actions_of(str(raw), np.arange(1), "trio(injection.slots=1)")

    def test_sampled_actions_have_the_deviation_of_the_file(self, tmp_path: Path) -> None:
        """Without a network's say the actions are N(0, 0.3²)."""
        path = write_fitting(tmp_path / FILE, "raw")
        tensors, config = load_policy(path)
        tensors = {name: np.zeros_like(values) for name, values in tensors.items()}
        tensors["log_std"] += np.log(np.float32(0.3))
        save_policy(path, tensors, config)
        actions = actions_of(f"learned(path='{path}', sampled=True)", np.arange(200))
        drawn = actions[:, :, [k for k, role in enumerate(load_scenario(SCENARIO).roles) if role == "adversary"]]
        assert abs(drawn.mean()) < 0.005 and abs(drawn.std() - 0.3) < 0.005
        assert not actions_of(str(path), np.arange(2)).any()

    def test_choices_are_sampled_in_proportion_to_their_probabilities(self) -> None:
        from trust_env.agents.learned.policy import _draw_index

        logits = np.log(np.array([0.5, 0.2, 0.3], dtype=np.float32)) + 700.0
        u = (np.arange(1000) + 0.5) / 1000
        drawn = _draw_index(np.broadcast_to(logits.astype(np.float32), (1, 1000, 3)), u[None])
        np.testing.assert_allclose(np.bincount(drawn[0]) / 1000, [0.5, 0.2, 0.3], atol=2e-3)
