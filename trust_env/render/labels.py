"""What agents are called on the map and beside their trust, and the colours of their detections."""

from __future__ import annotations

from trust_env.render.palette import Colour, agent_colour
from trust_env.render.scene import Agent

_MAX_NAMED = 8  # with more agents, names would cover the map: indices stand for them


def map_labels(agents: list[Agent]) -> list[str]:
    """Per agent its name, or with many agents its index."""
    if len(agents) <= _MAX_NAMED:
        return [agent.name for agent in agents]
    return [str(k) for k in range(len(agents))]


def panel_labels(agents: list[Agent]) -> list[str]:
    """Per agent its name, with many agents after the index that stands on the map."""
    if len(agents) <= _MAX_NAMED:
        return [agent.name for agent in agents]
    return [f"{k}  {agent.name}" for k, agent in enumerate(agents)]


def detection_colours(agents: list[Agent]) -> list[Colour]:
    """Per agent the colour of its detections, a shade of its role's."""
    roles = [agent.adversary for agent in agents]
    return [agent_colour(role, roles[:k].count(role), roles.count(role)) for k, role in enumerate(roles)]
