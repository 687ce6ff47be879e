"""Several choices at once, against Stable-Baselines3."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.extra("train")


def test_grouped_choices_agree_with_stable_baselines3():
    """Against Stable-Baselines3's own distribution; drawn in proportion to their probabilities."""
    import torch as th
    from stable_baselines3.common.distributions import MultiCategoricalDistribution

    from trust_env.training.learning.distribution import GroupedCategorical

    sizes = [5, 5, 3, 4, 4]
    logits = th.randn(6, sum(sizes), generator=th.Generator().manual_seed(0))
    ours = GroupedCategorical(sizes).proba_distribution(logits)
    theirs = MultiCategoricalDistribution(sizes).proba_distribution(logits)
    actions = theirs.sample()
    assert th.allclose(ours.log_prob(actions), theirs.log_prob(actions), atol=1e-5)
    assert th.allclose(ours.entropy(), theirs.entropy(), atol=1e-5)
    assert th.equal(ours.mode(), theirs.mode())
    drawn = ours.proba_distribution(logits[:1].expand(100_000, -1)).sample()
    shares = np.bincount(drawn[:, 0].numpy(), minlength=5) / 100_000
    assert shares == pytest.approx(th.softmax(logits[0, :5], dim=0).numpy(), abs=0.01)
