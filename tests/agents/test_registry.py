"""Policies by name: what is built, and which names and parameters raise."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from attack_runs import SCRIPTED, VARIANTS, play

from trust_env.agents import POLICIES, Policy, build_policy, policies

pytestmark = pytest.mark.core


class TestNaming:
    def test_every_policy_is_listed_and_built_by_its_name(self) -> None:
        assert policies() == tuple(POLICIES)
        for name, policy in POLICIES.items():
            assert policy.name == name and (name not in SCRIPTED or type(build_policy(name)) is policy)
            assert (policy.__doc__ or "").split("\n")[0].endswith((".", ","))

    def test_parameters_of_a_name_reach_the_policy(self) -> None:
        policy: Any = build_policy("false_positive(n=2, motion=random_walk, speed=4, hit_rate=0.5)")
        assert (policy.n, policy.motion, policy.speed, policy.hit_rate) == (2, "random_walk", 4.0, 0.5)
        sleeper: Any = build_policy("sleeper(start=7, inner=on_off(duty=0.25, inner=suppress(choice=all)))")
        inner = sleeper.inner
        assert (inner.duty, inner.inner.choice) == (0.25, "all")

    @pytest.mark.parametrize("name", VARIANTS)
    def test_the_repr_of_a_policy_builds_the_same_policy(self, name: str) -> None:
        policy = build_policy(name)
        again = build_policy(repr(policy))
        assert repr(again) == repr(policy) and type(again) is type(policy)

    def test_unknown_names_get_a_suggestion(self) -> None:
        with pytest.raises(ValueError, match="unknown policy 'false_positiv'; did you mean 'false_positive'"):
            build_policy("false_positiv")
        with pytest.raises(ValueError, match="'suppress' has no parameter 'fractoin'; did you mean 'fraction'"):
            build_policy("suppress(fractoin=0.5)")
        with pytest.raises(ValueError, match="'honest' has no parameter 'n'; it takes: none"):
            build_policy("honest(n=2)")

    @pytest.mark.parametrize(
        ("text", "found"),
        [
            ("false_positive(n=0)", "n = 0: expected a whole number of at least 1"),
            ("false_positive(n=1.5)", "n = 1.5: expected a whole number"),
            ("false_positive(n=True)", "n = True: expected a whole number"),
            (
                "false_positive(motion=statik)",
                "expected one of static, constant_velocity, random_walk, pace; did you mean 'static'?",
            ),
            ("false_positive(speed=-1)", "speed = -1: expected a number of at least 0"),
            ("false_positive(start=-1)", "start = -1: expected a whole number of at least 0"),
            ("false_positive(period=0)", "period = 0: expected a whole number of at least 1"),
            ("false_positive(noise=-1)", "noise = -1: expected a number of at least 0 (m), or None"),
            ("false_positive(suppress=2)", "suppress = 2: expected a number from 0 to 1"),
            ("false_positive(share=1)", "share = 1: expected True or False"),
            ("outward(spread=wide)", "spread = 'wide': expected a number (rad)"),
            ("by_turns(per_slot=0)", "per_slot = 0: expected a whole number of at least 1"),
            ("burst(frames=0)", "frames = 0: expected a whole number of at least 1"),
            ("false_positive(hit_rate=1.1)", "hit_rate = 1.1: expected a number from 0 to 1"),
            ("optimal_false_positive(n=many)", "n = 'many': expected a whole number"),
            ("suppress(fraction=0)", "fraction = 0: expected a number above 0 and at most 1"),
            ("suppress(choice=far)", "choice = 'far': expected one of random, nearest, all"),
            ("fov_aware(max_honest=-1)", "max_honest = -1: expected a whole number of at least 0"),
            ("sleeper(start=2.5)", "start = 2.5: expected a whole number of at least 0"),
            ("on_off(duty=0)", "duty = 0: expected a number above 0 and at most 1"),
            ("on_off(inner=suppress(choice=far))", "choice = 'far'"),
        ],
    )
    def test_errors_name_the_parameter_its_value_and_what_was_expected(self, text: str, found: str) -> None:
        with pytest.raises(ValueError) as caught:
            build_policy(text)
        assert found in str(caught.value)

    def test_more_phantoms_than_slots_raise(self) -> None:
        with pytest.raises(ValueError, match="n = 5: expected at most 4, the injection slots of scenario"):
            next(play("patrol", "false_positive(n=5)", 1))
        with pytest.raises(ValueError, match="n = 5: expected at most 4, the injection slots of scenario"):
            next(play("patrol", "optimal_false_positive(n=5)", 1))
        with pytest.raises(ValueError, match="n = 9: expected at most 8, the injection slots of 2 agents"):
            next(play("patrol(knowledge=poses)", "fov_aware(n=9)", 1))
        with pytest.raises(ValueError, match="n = 5: expected at most 4, the injection slots of scenario"):
            next(play("patrol(knowledge=poses)", "fov_aware(n=5, share=False)", 1))

    def test_own_policies_come_from_files_and_objects(self, tmp_path: Path) -> None:
        file = tmp_path / "mine.py"
        file.write_text(
            "from trust_env import agents\n"
            "class Still(agents.Policy):\n"
            "    name = 'still'\n"
            "    def __init__(self, x=1): self.x = x\n"
            "    def choose(self, seen): return self.zero_actions() + self.x\n"
        )
        policy = build_policy(f"{file}:Still(x=-1)")
        (_, actions), *_ = play("trio", policy, 1)
        assert (actions[0, 0] == -1).all() and (actions[0, 1:] == 0).all()
        assert build_policy(policy) is policy
        with pytest.raises(ValueError, match="no parameter 'y'; it takes: x"):
            build_policy(f"{file}:Still(y=1)")
        for wrong in (3, None, Policy, object()):
            with pytest.raises(TypeError, match="a policy is a name, or an object with `reset"):
                build_policy(wrong)

    def test_neither_torch_nor_training_is_imported(self) -> None:
        unwanted = "{'torch', 'trust_env.training', 'pygame'}"
        code = f"import sys, trust_env.agents; print(sorted({unwanted} & set(sys.modules)))"
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert found.stdout.strip() == "[]"
