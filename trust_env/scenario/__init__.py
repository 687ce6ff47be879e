"""What a scenario is and where it comes from: a YAML file, a built-in name or a mapping, checked."""

from trust_env.scenario.agents import Agent
from trust_env.scenario.errors import ScenarioError
from trust_env.scenario.fov import Fov
from trust_env.scenario.fov.fovs import Fovs
from trust_env.scenario.load import load_scenario, scenario_fields, scenario_notes
from trust_env.scenario.scenario import Scenario
from trust_env.scenario.sources import scenarios

__all__ = [
    "Agent", "Fov", "Fovs", "Scenario", "ScenarioError", "load_scenario", "scenario_fields", "scenario_notes",
    "scenarios",
]  # fmt: skip
