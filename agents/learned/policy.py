"""Learned policies: the trained network of a policy file, evaluated in plain NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trust_env.agents.base import ACTION, Policy, PolicyContext
from trust_env.agents.learned.network import Network
from trust_env.agents.learned.policy_file import load_policy, policy_file
from trust_env.agents.parameters import invalid, one_of
from trust_env.agents.wrappers import build_wrapper

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
    against      score | trust | majority | joint_posterior: the shipped weights against that defense; None: trust
    sampled      True: draws its actions, as in training
    """

    name = "learned"
    scripted = False

    def __init__(self, path: str | None = None, against: str | None = None, sampled: bool = False):
        if path is not None and against is not None:
            raise invalid(self.name, "against", against, "nothing beside a path, which names the weights")
        if not isinstance(sampled, bool):
            raise invalid(self.name, "sampled", sampled, "True or False")
        self.path, self.against, self.sampled = path, against, sampled
        self.file = shipped_file(against or DEFAULT_AGAINST) if path is None else policy_file(path)
        self.tensors, self.config = load_policy(self.file)
        self.knowledge = self.config["knowledge"]
        self._wrapper: Any = build_wrapper(self.config["wrapper"])
        self._network = Network(self.tensors, self.config)

    def reset(self, context: PolicyContext) -> None:
        super().reset(context)
        self._wrapper.reset(context)
        self._check_sizes()

    def _check_sizes(self) -> None:
        """ValueError unless the wrapper's inputs and outputs have the sizes of training here."""
        trained, here = self.config["fields"], self._wrapper.fields
        for name in {**trained, **here}:
            if trained.get(name) != here.get(name):
                raise self._wrong_size(f"entries of the field {name}", trained.get(name, 0), here.get(name, 0))
        layers, space = self.config["layers"], self._wrapper.action_space
        if self._wrapper.observation_size != layers[0]:
            raise self._wrong_size("inputs", layers[0], self._wrapper.observation_size)
        choices, sizes = self.config["choices"], getattr(space, "nvec", None)
        if choices is not None or sizes is not None:
            if sizes is None or sizes.tolist() != choices:
                raise self._wrong_size("choices", choices, space if sizes is None else sizes.tolist())
        elif space.shape != (layers[-1],):
            raise self._wrong_size("outputs", layers[-1], space.shape)

    def _wrong_size(self, what: str, trained: Any, here: Any) -> ValueError:
        origin = self.config["about"].get("scenario", "unknown")
        return ValueError(
            f"learned: {self.file}: {what}: {trained} where it was trained (scenario {origin!r}, wrapper "
            f"{self.config['wrapper']}), but {here} in scenario {self.context.scenario.name!r}; "
            "expected a scenario that gives the same sizes"
        )

    def act(self, observations: np.ndarray) -> np.ndarray:
        seen = self._wrapper.observe(observations)
        outputs = self._network(seen.reshape(-1, seen.shape[-1])).reshape(*seen.shape[:2], -1)
        if not np.isfinite(outputs).all():
            raise ValueError(f"{self.file}: the weights give actions that are not finite numbers")
        choose = self._gaussian if self.config["choices"] is None else self._categorical
        actions = self._wrapper.act(choose(outputs), observations)
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
        return np.stack([_draw_index(part, draws[..., i]) for i, part in enumerate(parts)], axis=-1)


def _draw_index(logits: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Indices int64[W, n], drawn in proportion to exp(logits[W, n, C]) by u[W, n] in [0, 1)."""
    weights = np.exp(logits.astype(np.float64) - logits.max(axis=-1, keepdims=True))
    below = np.cumsum(weights, axis=-1)
    return (below <= u[..., None] * below[..., -1:]).sum(axis=-1).clip(max=logits.shape[-1] - 1)
