"""BenchMARL's tasks, in an environment of its own."""

from __future__ import annotations

import pytest
from clients.checks import check_trained

pytestmark = pytest.mark.extra("benchmarl")


@pytest.mark.parametrize("scenario", ["trio", "patrol"])
def test_the_example_trains(scenario):
    from trust_env.training.examples import benchmarl_ppo

    check_trained(benchmarl_ppo.train(updates=2, scenario=scenario), 2, {"adversary", "benign"})
