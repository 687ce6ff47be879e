"""Learned policies: the trained network of a file, played in plain NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trust_env.agents.base import ACTION, Policy, PolicyContext
from trust_env.agents.learned.policy_file import FILE, load_policy, policy_file, save_policy
from trust_env.agents.parameters import one_of, refuse
from trust_env.agents.wrappers import build_view

__all__ = ["FILE", "Learned", "load_policy", "policy_file", "save_policy", "shipped", "shipped_file"]

OBS_CLIP, OBS_EPSILON = 10.0, 1e-8  # normalisation: clip((x - mean) / sqrt(var + OBS_EPSILON), ±OBS_CLIP)
DEFAULT_AGAINST = "trust"
_WEIGHTS = Path(__file__).parent / "weights"
_SHIPPED = "patrol_{}.safetensors"


def shipped() -> list[str]:
    """The defenses against which weights are shipped, all trained on `patrol`."""
    return sorted(file.stem.removeprefix("patrol_") for file in _WEIGHTS.glob(_SHIPPED.format("*")))


def shipped_file(against: str) -> Path:
    """The shipped weights against a defense."""
    return _WEIGHTS / _SHIPPED.format(one_of(Learned.name, "against", against, shipped()))


class Learned(Policy):
    """A trained policy: the shipped one against a defense, or that of a training run of yours.

    Acts as trained, by its best action. It plays in any scenario whose observations have the sizes that it
    was trained on, at the knowledge level that it was trained at or a higher one.

    path         folder of a training run, or its policy.safetensors; None: shipped weights
    against      score | trust | majority: the shipped weights against that defense; None: trust
    sampled      True: draws its actions, as in training
    """

    name = "learned"

    def __init__(self, path: str | None = None, against: str | None = None, sampled: bool = False):
        if path is not None and against is not None:
            raise refuse(self.name, "against", against, "nothing beside a path, which names the weights")
        if not isinstance(sampled, bool):
            raise refuse(self.name, "sampled", sampled, "True or False")
        self.path, self.against, self.sampled = path, against, sampled
        self.file = shipped_file(against or DEFAULT_AGAINST) if path is None else policy_file(path)
        self.tensors, self.config = load_policy(self.file)
        self.knowledge = self.config["knowledge"]
        self._view: Any = build_view(self.config["view"])
        self._network = Network(self.tensors, self.config)

    def reset(self, context: PolicyContext) -> None:
        super().reset(context)
        self._view.reset(context)
        self._check_sizes()

    def _check_sizes(self) -> None:
        """The view must show and take here what it did in training."""
        trained, here = self.config["fields"], self._view.fields
        for name in {**trained, **here}:
            if trained.get(name) != here.get(name):
                raise self._unfit(f"entries of the field {name}", trained.get(name, 0), here.get(name, 0))
        layers, space = self.config["layers"], self._view.action_space
        if self._view.observation_size != layers[0]:
            raise self._unfit("inputs", layers[0], self._view.observation_size)
        choices, sizes = self.config["choices"], getattr(space, "nvec", None)
        if choices is not None or sizes is not None:
            if sizes is None or sizes.tolist() != choices:
                raise self._unfit("choices", choices, space if sizes is None else sizes.tolist())
        elif space.shape != (layers[-1],):
            raise self._unfit("outputs", layers[-1], space.shape)

    def _unfit(self, what: str, trained: Any, here: Any) -> ValueError:
        about, scenario = self.config["about"], self.context.scenario.name
        return ValueError(
            f"learned: {self.file}: {what}: {trained} where it was trained (scenario "
            f"{about.get('scenario', 'unknown')!r}, view {self.config['view']}), but {here} in scenario "
            f"{scenario!r}; expected a scenario that gives the same sizes"
        )

    def act(self, observations: np.ndarray) -> np.ndarray:
        seen = self._view.observe(observations)
        outputs = self._network(seen.reshape(-1, seen.shape[-1])).reshape(*seen.shape[:2], -1)
        if not np.isfinite(outputs).all():
            raise ValueError(f"{self.file}: the weights give actions that are not finite numbers")
        choose = self._gaussian if self.config["choices"] is None else self._categorical
        actions = self._view.act(choose(outputs), observations)
        self.frame += 1
        return actions

    def _gaussian(self, mean: np.ndarray) -> np.ndarray:
        """Actions float32[W, n, A'] of N(mean, exp(log_std)²), or the mean; within [-1, 1]."""
        if self.sampled:
            size = mean.shape[-1]
            draws = self.draw(ACTION, 2 * size)
            u, v = (np.ascontiguousarray(part) for part in (draws[..., :size], draws[..., size:]))
            normal = np.sqrt(-2.0 * np.log(1.0 - u)) * np.cos(2.0 * np.pi * v)  # Box & Muller 1958
            mean = mean + np.exp(self.tensors["log_std"]) * normal
        return np.clip(mean, -1.0, 1.0).astype(np.float32)

    def _categorical(self, logits: np.ndarray) -> np.ndarray:
        """Choices int64[W, n, C] from the logits of all of them, one after the other."""
        sizes = self.config["choices"]
        parts = np.split(logits, np.cumsum(sizes)[:-1], axis=-1)
        if not self.sampled:
            return np.stack([part.argmax(axis=-1) for part in parts], axis=-1)
        draws = self.draw(ACTION, len(sizes))
        return np.stack([_drawn(part, draws[..., i]) for i, part in enumerate(parts)], axis=-1)


def _drawn(logits: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Indices int64[W, n], drawn in proportion to exp(logits[W, n, C]) by u[W, n] in [0, 1)."""
    weights = np.exp(logits.astype(np.float64) - logits.max(axis=-1, keepdims=True))
    below = np.cumsum(weights, axis=-1)
    return (below <= u[..., None] * below[..., -1:]).sum(axis=-1).clip(max=logits.shape[-1] - 1)


class Network:
    """The layers of a policy file: outputs float32[I, outputs] of inputs float32[I, inputs]."""

    def __init__(self, tensors: dict[str, np.ndarray], config: dict[str, Any]):
        names = [*(f"pi.{i}" for i in range(len(config["layers"]) - 2)), "action"]
        self._layers = [
            (np.ascontiguousarray(tensors[f"{name}.weight"].T), tensors[f"{name}.bias"]) for name in names
        ]
        self._activate = {"tanh": np.tanh, "relu": _relu}[config["activation"]]
        self._mean, self._variance = tensors.get("obs_mean"), tensors.get("obs_var")

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        # Row by row: in a product of matrices rounding may depend on how many rows there are, and on which.
        values = self._normalised(inputs)[:, None, :].astype(np.float32)
        with np.errstate(over="ignore", invalid="ignore"):  # the caller looks whether all is finite
            for weight, bias in self._layers[:-1]:
                values = self._activate(values @ weight + bias)
            weight, bias = self._layers[-1]
            return (values @ weight + bias)[:, 0]

    def _normalised(self, inputs: np.ndarray) -> np.ndarray:
        if self._mean is None or self._variance is None:
            return inputs
        scaled = (inputs - self._mean) / np.sqrt(self._variance + OBS_EPSILON)
        return np.clip(scaled, -OBS_CLIP, OBS_CLIP)


def _relu(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, np.float32(0.0))
