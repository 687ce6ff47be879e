"""Several choices at once, without a distribution object for each."""

from __future__ import annotations

from itertools import groupby

import torch as th
from stable_baselines3.common.distributions import MultiCategoricalDistribution
from stable_baselines3.common.policies import ActorCriticPolicy


class GroupedCategorical(MultiCategoricalDistribution):
    """`MultiCategoricalDistribution` that computes neighbouring choices of one size, such as those for all
    phantoms, together: [I, choices, size].
    """

    def __init__(self, sizes: list[int]):
        super().__init__(sizes)
        self._groups = [(size, len(list(run))) for size, run in groupby(sizes)]

    def proba_distribution(self, action_logits: th.Tensor) -> GroupedCategorical:
        stretches = th.split(action_logits, [size * count for size, count in self._groups], dim=1)
        self._log_probs = [
            th.log_softmax(stretch.reshape(-1, count, size), dim=-1)
            for stretch, (size, count) in zip(stretches, self._groups)
        ]
        return self

    def log_prob(self, actions: th.Tensor) -> th.Tensor:
        chosen = th.split(actions.long(), [count for _, count in self._groups], dim=1)
        found = [p.gather(-1, c[..., None])[..., 0] for p, c in zip(self._log_probs, chosen)]
        return th.cat(found, dim=1).sum(dim=1)

    def entropy(self) -> th.Tensor:
        return th.stack([-(p.exp() * p).sum(dim=(1, 2)) for p in self._log_probs]).sum(dim=0)

    def sample(self) -> th.Tensor:
        """One uniform number for each choice, looked up among the sums of the probabilities."""
        drawn = []
        for log_probs, (size, _) in zip(self._log_probs, self._groups):
            sums = log_probs.exp().cumsum(dim=-1)
            level = sums[..., -1:] * th.rand(*sums.shape[:-1], 1)
            drawn.append((sums <= level).sum(dim=-1).clamp(max=size - 1))
        return th.cat(drawn, dim=1)

    def mode(self) -> th.Tensor:
        return th.cat([p.argmax(dim=-1) for p in self._log_probs], dim=1)


class GroupedPolicy(ActorCriticPolicy):
    """Stable-Baselines3's policy with the distribution above, where an action is several choices."""

    def _build(self, lr_schedule) -> None:
        if isinstance(self.action_dist, MultiCategoricalDistribution):
            self.action_dist = GroupedCategorical(self.action_dist.action_dims)
        super()._build(lr_schedule)
