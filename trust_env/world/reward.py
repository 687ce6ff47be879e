"""Rewards. Evaluation never uses them."""

from __future__ import annotations

import math

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, floats1, ints1, real
from trust_env.world.scoring import FALSE_TRACKS, MISSING_TARGETS


@compiled
def pay(world):
    """An adversary gains for false tracks shown and for targets missing, and pays for the trust it lost since
    the last frame (regained trust is paid back); benign agents get the negative of the adversaries' mean, 0
    without adversaries.
    """
    metrics, reward, role = floats1(world, F.metrics), floats1(world, F.reward), ints1(world, F.role)
    trust, last = floats1(world, F.agent_trust), floats1(world, F.last_agent_trust)
    gain = (
        real(world, F.reward_false_track) * metrics[FALSE_TRACKS]
        + real(world, F.reward_missing_target) * metrics[MISSING_TARGETS]
    )
    total, adversaries = 0.0, 0
    for k in range(role.shape[0]):
        if role[k] > 0:
            lost = last[k] - trust[k]
            reward[k] = gain - (0.0 if math.isnan(lost) else real(world, F.reward_lost_trust) * lost)
            total += reward[k]
            adversaries += 1
        last[k] = trust[k]
    for k in range(role.shape[0]):
        if role[k] <= 0:
            reward[k] = -total / adversaries if adversaries > 0 else 0.0
