"""The network of a policy file, against its definition and Stable-Baselines3."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from policy_files import actions_of, weights, write_fitting

from trust_env.agents import build_policy
from trust_env.agents.learned.network import Network
from trust_env.agents.learned.policy_file import FILE

pytestmark = pytest.mark.core


class TestNetwork:
    @pytest.mark.parametrize("activation", ["tanh", "relu"])
    @pytest.mark.parametrize("rows", [1, 64, 65])
    def test_the_network_is_the_perceptron_of_the_file(self, activation: str, rows: int) -> None:
        """Against the definition, row by row in float64."""
        layers, activate = [5, 7, 6, 3], {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}[activation]
        tensors = {name: values.astype(np.float64) for name, values in weights(layers, None).items()}
        inputs = np.random.default_rng(1).uniform(-1.0, 1.0, (rows, 5)).astype(np.float32)
        found = Network(weights(layers, None), {"layers": layers, "activation": activation})(inputs)
        assert found.shape == (rows, 3) and found.dtype == np.float32
        for x, y in zip(inputs.astype(np.float64), found):
            x = np.clip((x - tensors["obs_mean"]) / np.sqrt(tensors["obs_var"] + 1e-8), -10.0, 10.0)
            for name in ("pi.0", "pi.1"):
                x = activate(tensors[f"{name}.weight"] @ x + tensors[f"{name}.bias"])
            np.testing.assert_allclose(y, tensors["action.weight"] @ x + tensors["action.bias"], atol=1e-5)

    @pytest.mark.extra("train")
    @pytest.mark.parametrize("discrete", [False, True])
    def test_the_network_acts_as_in_stable_baselines3(self, discrete: bool) -> None:
        import torch
        from gymnasium.spaces import Box, MultiDiscrete
        from stable_baselines3.common.policies import ActorCriticPolicy

        torch.manual_seed(3)
        space = MultiDiscrete([3, 5, 2]) if discrete else Box(-1.0, 1.0, (4,), np.float32)
        theirs = ActorCriticPolicy(
            Box(-1.0, 1.0, (9,), np.float32), space, lambda _: 1e-3, net_arch=[32, 32], ortho_init=False
        )
        state = {name: values.numpy() for name, values in theirs.state_dict().items()}
        tensors = {
            f"{ours}.{part}": 3.0 * state[f"{name}.{part}"]
            for ours, name in (
                ("pi.0", "mlp_extractor.policy_net.0"),
                ("pi.1", "mlp_extractor.policy_net.2"),
                ("action", "action_net"),
            )
            for part in ("weight", "bias")
        }
        with torch.no_grad():
            for values in theirs.parameters():
                values *= 3.0
        config = {"layers": [9, 32, 32, 10 if discrete else 4], "activation": "tanh"}
        inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 9)).astype(np.float32)
        expected, _ = theirs.predict(inputs, deterministic=True)
        found = Network(tensors, config)(inputs)
        if discrete:
            parts = np.split(found, [3, 8], axis=-1)
            assert np.array_equal(np.stack([part.argmax(-1) for part in parts], -1), expected)
        else:
            assert (np.abs(expected) == 1.0).any() and (np.abs(expected) < 1.0).any()
            np.testing.assert_allclose(np.clip(found, -1.0, 1.0), expected, atol=1e-5)

    def test_actions_that_are_not_finite_raise_and_name_the_file(self, tmp_path: Path) -> None:
        policy = build_policy(str(write_fitting(tmp_path / FILE, activation="relu")))
        for name, values in policy.tensors.items():  # type: ignore[attr-defined]
            if name.endswith("weight"):
                values = np.full_like(values, 3e38)
            policy.tensors[name] = values  # type: ignore[attr-defined]
        policy._network = Network(policy.tensors, policy.config)  # type: ignore[attr-defined]
        with pytest.raises(ValueError, match=f"{FILE}: the weights give actions that are not finite"):
            actions_of(policy, np.arange(1), frames=1)
