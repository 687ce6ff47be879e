"""Sleeper and on-off attacks: in which frames they act."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import play

from trust_env.agents import build_policy
from trust_env.agents.attacks.timing import OnOff, Sleeper

pytestmark = pytest.mark.core


class TestTiming:
    def test_the_registry_builds_the_inner_policy_and_the_class_takes_it_built(self) -> None:
        inner, named = build_policy("suppress"), build_policy("on_off(inner=suppress)")
        assert isinstance(named, OnOff) and type(named.inner) is type(inner)
        assert Sleeper(3, inner).inner is inner
        with pytest.raises(ValueError, match="inner = 'suppress': expected a policy; build_policy"):
            Sleeper(3, "suppress")

    def test_a_sleeper_attacks_from_start_on(self) -> None:
        awake = [a for _, a in play("patrol", "false_positive", 6, 3)]
        for frame, (_, actions) in enumerate(play("patrol", "sleeper(start=4, inner=false_positive)", 6, 3)):
            np.testing.assert_array_equal(actions, awake[frame] if frame >= 4 else np.zeros_like(actions))

    def test_duty_is_rounded_up_to_whole_frames(self) -> None:
        for duty, on in (
            (0.5, [1, 1, 1, 0, 0]),
            (0.4, [1, 1, 0, 0, 0]),
            (0.01, [1, 0, 0, 0, 0]),
            (1, [1] * 5),
        ):
            run = play("trio", f"on_off(duty={duty}, period=5, inner=false_positive(hit_rate=1))", 10)
            assert [int((a[0, 0] > 0).any()) for _, a in run] == on * 2
