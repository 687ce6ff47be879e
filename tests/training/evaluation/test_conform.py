"""What `conform` checks where nobody names a defense."""

from __future__ import annotations

from trust_env.defenses import DEFENSES
from trust_env.scenario import load_scenario
from trust_env.training.evaluation.conform import _fitting_defenses


def test_defenses_that_need_a_parameter_or_take_fewer_agents_are_left_out():
    assert _fitting_defenses(load_scenario("patrol")) == [name for name in DEFENSES if name != "path_trust"]
    assert set(DEFENSES) - set(_fitting_defenses(load_scenario("crowd"))) == {"path_trust", "parsimony"}
