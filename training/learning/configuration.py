"""The fields of a training run, their types, bounds and errors. Their defaults stand in `defaults.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from trust_env.files import expanded
from trust_env.scenario.errors import Origins, Problem, problems_of
from trust_env.scenario.layers import Layer, locations, merge_layers
from trust_env.scenario.overrides import override_layer
from trust_env.scenario.types import (
    NonNegative,
    Part,
    Positive,
    Probability,
    Real,
    Size,
    Whole,
    raise_problems,
)
from trust_env.scenario.yaml_lines import read_yaml, write_yaml

MOST_BETWEEN_EVALUATIONS = 250_000  # steps, where nothing is said
TRAINING_SEEDS = 2**62  # worlds of training have seeds from here on, so that all below are held out
VALIDATION_SEEDS = TRAINING_SEEDS + 2**61  # from here on they are for choosing among attacks that were found

# Torch and NumPy take seeds of 32 bits.
RunSeed = Annotated[Whole, Field(ge=0, lt=2**32)]
HeldOutSeed = Annotated[Whole, Field(ge=0, lt=TRAINING_SEEDS)]


class Ppo(Part):
    learning_rate: Positive
    final_learning_rate: NonNegative
    n_steps: Size
    batch_size: Annotated[Whole, Field(ge=2)]
    n_epochs: Size
    gamma: Probability
    gae_lambda: Probability
    clip_range: Positive
    clip_range_vf: Positive | None
    ent_coef: NonNegative
    vf_coef: NonNegative
    max_grad_norm: Positive
    normalize_advantage: bool
    target_kl: Positive | None


class Network(Part):
    layers: tuple[Size, ...]
    activation: Literal["tanh", "relu"]
    log_std: Real


class Normalise(Part):
    observations: bool
    rewards: bool


class Evaluation(Part):
    every: Size | None  # steps; None: see `Configuration.evaluated_every`
    episodes: Size
    seed: HeldOutSeed


class Checkpoint(Part):
    every: NonNegative  # s; 0: after every rollout


class Configuration(Part):
    """All fields of a training run, from `load_configuration`; `defaults.yaml` explains each."""

    scenario: str
    defense: str
    knowledge: Literal["own", "poses", "picture", "white_box"] | None
    max_cycles: Size | None
    role: Literal["adversary", "benign"]
    wrapper: str | None
    others: dict[str, str]
    worlds: Size
    steps: Size
    seed: RunSeed
    threads: Size
    ppo: Ppo
    network: Network
    normalise: Normalise
    evaluation: Evaluation
    checkpoint: Checkpoint

    @model_validator(mode="after")
    def _agree(self) -> Configuration:
        if self.role in self.others:
            text = f"expected the policy of others: {self.role} is the role that learns"
            raise_problems([Problem(("others", self.role), self.others[self.role], text)])
        return self

    @property
    def evaluated_every(self) -> int:
        """Steps between evaluations: as given, or so that there are ten and more."""
        return self.evaluation.every or max(1, min(MOST_BETWEEN_EVALUATIONS, self.steps // 10))

    @property
    def world_seed(self) -> int:
        return TRAINING_SEEDS + self.seed

    def to_yaml(self) -> str:
        """The whole configuration as YAML that `load_configuration` reads back."""
        return write_yaml(self.model_dump(mode="json"))


def defaults() -> dict[str, Any]:
    """The fields of `defaults.yaml`: every field there is."""
    return read_yaml(
        (resources.files("trust_env.training.learning") / "defaults.yaml").read_text("utf-8"), "defaults.yaml"
    )[0]


def load_configuration(
    config: str | Path | Mapping[str, Any] | None = None, overrides: Mapping[str, Any] | None = None
) -> Configuration:
    """The defaults, replaced by a YAML file or a mapping, replaced by single fields ({"ppo.gamma": 0.9}).

    Raises a ValueError that lists everything that is wrong, with the file and the line.
    """
    layers = [Layer(defaults(), Origins("training"))]
    if config is not None:
        layers.append(_layer_of(config))
    layers += _override_layers(dict(overrides or {}), layers[-1].origins.source)
    layer = merge_layers(layers)
    try:
        return Configuration.model_validate(layer.fields)
    except ValidationError as error:
        raise layer.origins.error(problems_of(error, Configuration)) from None


def _layer_of(config: str | Path | Mapping[str, Any]) -> Layer:
    if isinstance(config, Mapping):
        return Layer(dict(config), Origins("mapping", locations(config, "mapping")))
    try:
        text = expanded(config).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as fault:
        reason = fault.strerror if isinstance(fault, OSError) else "not in UTF-8"
        raise ValueError(f"{config}: {reason}; expected a YAML file") from None
    fields, lines = read_yaml(text, str(config))
    return Layer(fields, Origins.in_file(str(config), str(config), lines))


def _override_layers(overrides: dict[str, Any], source: str) -> list[Layer]:
    """Single fields set; of `others` also by role or agent, as in others.benign."""
    of_others = {key: overrides.pop(key) for key in list(overrides) if key.startswith("others.")}
    others = {key.removeprefix("others."): value for key, value in of_others.items()}
    layers = [override_layer(overrides, defaults(), source)]
    return [*layers, Layer({"others": others}, Origins(source))] if others else layers
