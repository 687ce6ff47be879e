"""The agents: where they stand."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel
from trust_env.world.fov import locate_fovs
from trust_env.world.random import PLACEMENT, key_of, uniform, uniform_pair

ROLES = {"adversary": 1, "benign": -1}
RANDOM, OVERLAPPING = range(2)
PLACEMENTS = {"random": RANDOM, "overlapping": OVERLAPPING}  # of agents whose positions are drawn


@kernel
def place_agents(world):
    """Poses of the episode: as the scenario gives them, or drawn."""
    agents, key = world.agents, key_of(world)
    for k in range(agents.pose.shape[0]):
        for axis in range(3):
            agents.pose[k, axis] = agents.start_pose[k, axis]
        agents.fov_heading[k] = agents.fov_start_heading[k]
        if agents.pose_drawn[k]:
            _draw_pose(world, key, k)
    locate_fovs(world)


@kernel
def _draw_pose(world, key, k):
    pose, area = world.agents.pose[k], world.targets.area
    u, v = uniform_pair(key, PLACEMENT, 0, 2 * k)
    if world.agents.placement == OVERLAPPING:
        radius = world.agents.spread * math.sqrt(u)
        pose[0] = 0.5 * (area[0] + area[1]) + radius * math.cos(2.0 * math.pi * v)
        pose[1] = 0.5 * (area[2] + area[3]) + radius * math.sin(2.0 * math.pi * v)
    else:
        pose[0], pose[1] = area[0] + u * (area[1] - area[0]), area[2] + v * (area[3] - area[2])
    pose[2] = 2.0 * math.pi * uniform(key, PLACEMENT, 0, 2 * k + 1) - math.pi
