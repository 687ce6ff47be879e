"""What a scenario is and where it comes from: a YAML file, a built-in name or a mapping, checked."""

from trust_env.scenario.errors import ScenarioError
from trust_env.scenario.fov import Fov
from trust_env.scenario.schema import Agent, Scenario, load_scenario, scenario_fields
from trust_env.scenario.sources import scenarios

__all__ = ["Agent", "Fov", "Scenario", "ScenarioError", "load_scenario", "scenario_fields", "scenarios"]
