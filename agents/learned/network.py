"""The network of a policy file, evaluated in plain NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

OBS_CLIP, OBS_EPSILON = 10.0, 1e-8  # normalisation: clip((x - mean) / sqrt(var + OBS_EPSILON), ±OBS_CLIP)


class Network:
    """The layers of a policy file: outputs float32[I, outputs] of inputs float32[I, inputs]."""

    def __init__(self, tensors: dict[str, np.ndarray], config: dict[str, Any]):
        names = [*(f"pi.{i}" for i in range(len(config["layers"]) - 2)), "action"]
        self._layers = [(np.ascontiguousarray(tensors[f"{name}.weight"].T), tensors[f"{name}.bias"]) for name in names]
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
