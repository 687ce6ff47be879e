"""AgileRL's PettingZoo vector, in an environment of its own."""

from __future__ import annotations

import pytest
from clients.checks import check_trained

pytestmark = pytest.mark.extra("agilerl")


@pytest.mark.parametrize("scenario", ["trio", "patrol"])
def test_the_example_trains(scenario):
    from trust_env.training.examples import agilerl_ppo

    check_trained(agilerl_ppo.train(updates=2, scenario=scenario), 2, {"adversary", "benign"})
