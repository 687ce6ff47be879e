"""Rewards. Evaluation never uses them."""

from __future__ import annotations

import math

from trust_env.compiled.kernels import kernel


@kernel
def compute_rewards(world):
    """An adversary gains for false tracks shown and for targets missing, and pays for the trust it lost since
    the last frame (regained trust is paid back); benign agents get the negative of the adversaries' mean, 0
    without adversaries.
    """
    weights, rewards, role = world.parameters, world.rewards, world.agents.role
    false, missing = world.metrics.false_tracks, world.metrics.missing_targets
    gain = weights.reward_false_track * false + weights.reward_missing_target * missing
    total, adversaries = 0.0, 0
    for k in range(role.shape[0]):
        trust = world.verdict.agent_trust[k]
        if role[k] > 0:
            lost = rewards.last_agent_trust[k] - trust
            rewards.reward[k] = gain - (0.0 if math.isnan(lost) else weights.reward_lost_trust * lost)
            total += rewards.reward[k]
            adversaries += 1
        rewards.last_agent_trust[k] = trust
    for k in range(role.shape[0]):
        if role[k] <= 0:
            rewards.reward[k] = -total / adversaries if adversaries > 0 else 0.0
