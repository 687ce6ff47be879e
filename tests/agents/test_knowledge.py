"""Knowledge levels of policies and scenarios compared."""

from __future__ import annotations

from typing import Any

import pytest

from trust_env.agents import Player, build_policy, check_knowledge, knowledge_of, sufficient_knowledge
from trust_env.scenario import load_scenario
from trust_env.vector import vector_env

pytestmark = pytest.mark.core


class TestKnowledge:
    def test_too_little_knowledge_raises_and_names_both_levels(self) -> None:
        with pytest.raises(ValueError, match=r"'fov_aware' needs knowledge level 'poses'.*'patrol' gives 'own'"):
            check_knowledge(build_policy("fov_aware"), load_scenario("patrol"))
        with pytest.raises(ValueError, match=r"patrol\(knowledge=poses\)"):
            Player(vector_env("patrol"), {"adversary": "sleeper(inner=fov_aware)"})
        check_knowledge(build_policy("fov_aware"), load_scenario("patrol", knowledge="picture"))

    def test_sufficient_knowledge_is_the_least_level_for_all_policies(self) -> None:
        own, picture = load_scenario("patrol"), load_scenario("patrol", knowledge="picture")
        attacks = [build_policy("suppress"), build_policy("on_off(inner=fov_aware)")]
        assert knowledge_of(attacks[1]) == "poses"
        assert sufficient_knowledge(own, attacks[0]) == "own"
        assert sufficient_knowledge(own, *attacks) == "poses"
        assert sufficient_knowledge(picture, *attacks) == "picture"

    def test_an_unknown_level_raises(self) -> None:
        policy: Any = build_policy("honest")
        policy.knowledge = "everything"
        with pytest.raises(ValueError, match="'everything': expected one of own, poses, picture, white_box"):
            knowledge_of(policy)
