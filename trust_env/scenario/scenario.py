"""A scenario: fields that agree with one another."""

from __future__ import annotations

from pydantic import model_validator

from trust_env.scenario.checks import agent_problems, problems_between_fields
from trust_env.scenario.schema import ScenarioFields
from trust_env.scenario.types import raise_problems
from trust_env.scenario.yaml_lines import write_yaml


class Scenario(ScenarioFields):
    """A complete and consistent description of worlds, made by `load_scenario`."""

    @model_validator(mode="after")
    def _consistent(self) -> Scenario:
        raise_problems(agent_problems(self))  # first: the other checks need agents
        raise_problems(problems_between_fields(self))
        return self

    def to_yaml(self) -> str:
        """The whole scenario as YAML that `load_scenario` reads back."""
        return write_yaml(self.model_dump(mode="json"))
