"""Sleeper and on-off attacks: in which frames they act."""

from __future__ import annotations

import numpy as np
import pytest
from attack_runs import play

pytestmark = pytest.mark.core


class TestTiming:
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
