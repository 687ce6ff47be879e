"""The search for an attack's best parameters: its ranges, its distribution, and what it finds."""

import inspect
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents import POLICIES, build_policy, parse_policy
from agents.ranges import RANGES, Range, limits, resolved
from training.cross_entropy import Names, Numbers, attacks_like
from training.evaluate import evaluate
from training.learning.configuration import TRAINING_SEEDS
from training.search import FINAL_EPISODES, FINALISTS, search, searched
from trust_env.scenario import load_scenario
from trust_env.worlds import Worlds

pytestmark = pytest.mark.core
SMALL: dict[str, Any] = {"scenario": "trio(horizon=30)", "defense": "score", "progress": False}
TINY: Any = SMALL | {"generations": 2, "population": 4, "episodes": 2}


class TestRanges:
    def test_every_parameter_of_every_scripted_attack_has_one(self) -> None:
        without = {"honest", "random", "learned"}
        assert set(RANGES) == set(POLICIES) - without
        for name, ranges in RANGES.items():
            assert list(ranges) != [] and set(ranges) == set(inspect.signature(POLICIES[name]).parameters)

    @pytest.mark.parametrize("scenario", ["trio(horizon=3)", "patrol(knowledge=poses)", "theorem", "case1"])
    @pytest.mark.parametrize("name", RANGES)
    def test_both_ends_can_be_played(self, name: str, scenario: str) -> None:
        world = load_scenario(scenario)
        for end in (0, 1):
            params = {
                key: resolved(values, world)[end] if isinstance(values, Range) else values[-end]
                for key, values in RANGES[name].items()
            }
            attack = f"{name}({', '.join(f'{key}={value}' for key, value in params.items())})"
            level = "poses" if "fov_aware" in attack else world.knowledge
            evaluate(world, attack, "score", 1, knowledge=level, max_cycles=1, progress=False)

    def test_limits_are_those_of_the_scenario(self) -> None:
        found = limits(load_scenario("patrol"))
        assert found["benign"] == 3 and found["half_episode"] == 100
        assert found["coalition_slots"] == 2 * found["slots"]
        assert found["speed"] == 2.0 * load_scenario("patrol").targets.speed[1]


class TestDistribution:
    def test_it_moves_to_where_the_best_are(self) -> None:
        """The best of x in [0, 10] and of a name under -(x - 8)² + [name is c]."""
        rng = np.random.default_rng(0)
        x, name = Numbers(Range(0.0, 10.0)), Names("abc")
        for _ in range(15):
            drawn = [(x.draw(rng), name.draw(rng)) for _ in range(40)]
            best = sorted(drawn, key=lambda one: -((one[0] - 8.0) ** 2) + (one[1] == "c"))[-10:]
            x.learn([one[0] for one in best])
            name.learn([one[1] for one in best])
        assert abs(x.likeliest() - 8.0) < 0.3 and x.std < 0.1
        assert name.likeliest() == "c" and name.probability[2] > 0.9
        assert name.probability.min() > 0.01  # nothing is given up for good

    def test_whole_numbers_are_equally_likely_and_reach_both_ends(self) -> None:
        rng, numbers = np.random.default_rng(1), Numbers(Range(1, 4, whole=True))
        numbers.std = 100.0  # nearly all draws fall out of the range, half to each side
        drawn = [numbers.draw(rng) for _ in range(200)]
        assert {1, 4} <= set(drawn) <= {1, 2, 3, 4} and all(type(value) is int for value in drawn)
        assert 80 < drawn.count(1) < 120 and 80 < drawn.count(4) < 120
        shares = (np.arange(1000) + 0.5) / 1000
        assert np.array_equal(np.bincount([numbers._at(share) for share in shares])[1:], [250] * 4)
        for value in (1, 2, 3, 4):
            for _ in range(10):
                numbers.learn([value] * 5)
            assert numbers.likeliest() == value

    def test_drawn_numbers_stay_in_their_range(self) -> None:
        rng, numbers = np.random.default_rng(2), Numbers(Range(0.05, 1.0))
        drawn = np.array([numbers.draw(rng) for _ in range(500)])
        assert drawn.min() == 0.05 and drawn.max() == 1.0
        assert 0.4 < ((drawn > 0.05) & (drawn < 1.0)).mean() < 0.9

    def test_what_is_given_stays(self) -> None:
        rng, world = np.random.default_rng(3), load_scenario("patrol")
        attacks = attacks_like(parse_policy("false_positive(n=2, motion=static)"), world)
        for _ in range(20):
            assert {"n": 2, "motion": "static"}.items() <= attacks.draw(rng).params.items()
        nested = attacks_like(parse_policy("sleeper(inner=suppress(choice=all))"), world)
        for _ in range(20):
            inner = parse_policy(nested.draw(rng).params["inner"])
            assert inner.name == "suppress" and inner.params["choice"] == "all" and "start" in inner.params

    def test_inner_attacks_know_no_more_than_the_scenario_gives(self) -> None:
        def drawn(level: str) -> set[str]:
            rng, world = np.random.default_rng(4), load_scenario("patrol", knowledge=level)
            attacks = attacks_like(parse_policy("on_off"), world)
            return {parse_policy(attacks.draw(rng).params["inner"]).name for _ in range(60)}

        assert drawn("own") == {"false_positive", "optimal_false_positive", "suppress"}
        assert drawn("poses") == {*drawn("own"), "fov_aware"}

    def test_what_the_best_do_not_say_is_as_by_default(self) -> None:
        world = load_scenario("patrol")
        attacks: Any = attacks_like(parse_policy("false_positive"), world)
        for _ in range(10):
            attacks.learn([attacks.spec] * 3)
        expected = {"n": 4, "motion": "static", "start": 0, "period": 1, "hit_rate": 0.9}
        assert expected["n"] == world.injection.slots and expected["hit_rate"] == world.sensor.p_detect
        assert expected.items() <= attacks.likeliest().params.items()
        assert attacks.parameters["speed"].mean == 0.5  # as fast as targets: of no one speed

    def test_an_inner_attack_learns_from_its_own_draws(self) -> None:
        world = load_scenario("patrol")
        attacks: Any = attacks_like(parse_policy("on_off"), world)
        inner = attacks.parameters["inner"].attacks
        before = replace_of(inner["false_positive"].parameters["hit_rate"])
        best = [
            parse_policy("on_off(duty=1.0, period=10, inner=suppress(fraction=1.0, choice=all, start=0))")
        ]
        for _ in range(8):
            attacks.learn(best * 3)
        assert replace_of(inner["false_positive"].parameters["hit_rate"]) == before
        assert str(attacks.likeliest()).startswith("on_off(duty=1.0, period=10, inner=suppress(fraction=1.0")


def replace_of(numbers: Any) -> tuple[float, float]:
    return numbers.mean, numbers.std


class TestSearch:
    def test_it_finds_what_does_more_damage(self) -> None:
        """False positives in half of the frames only are far from the worst."""
        attack = "on_off(inner=false_positive(motion=static))"
        found = search(attack=attack, generations=4, population=8, episodes=6, **SMALL)
        assert found.damage > 1.2 * found.given_damage
        assert found.history[-1] >= found.history[0]
        held_out = evaluate(
            SMALL["scenario"], [found.given, found.attack], "score", 40, seed=9, progress=False
        )
        low = held_out.difference((found.attack, "score"), (found.given, "score"), "damage_per_frame")
        assert low is not None and low.low > 0.0

    def test_the_same_seed_finds_the_same(self) -> None:
        first, second = (search(attack="false_positive", **TINY) for _ in range(2))
        assert replace(first, seconds=0.0) == replace(second, seconds=0.0)
        other = search(attack="false_positive", seed=1, **TINY)
        assert other.history != first.history
        assert repr(build_policy(first.attack)) == repr(build_policy(repr(build_policy(first.attack))))

    def test_it_plays_training_worlds_only(self, monkeypatch: pytest.MonkeyPatch) -> None:
        seeds, start = set(), Worlds.start

        def watched(worlds: Worlds, mask: np.ndarray) -> None:
            seeds.update(worlds.arrays.seed.reshape(-1).tolist())
            start(worlds, mask)

        monkeypatch.setattr(Worlds, "start", watched)
        search(attack="false_positive", seed=5, **TINY)
        assert seeds == {TRAINING_SEEDS + 5}

    def test_it_says_what_it_cost(self) -> None:
        found = search(attack="false_positive", **TINY)
        assert 4 <= found.tried <= 8
        most = found.tried * 2 + (FINALISTS + 2) * FINAL_EPISODES * 2
        assert found.tried * 2 < found.episodes <= most and found.frames == 30 * found.episodes
        assert found.seconds > 0.0 and found.to_dict()["given"] == "false_positive"

    def test_knowledge_is_what_the_attack_needs(self) -> None:
        assert search(attack="fov_aware", **TINY).attack.startswith("fov_aware")
        with pytest.raises(ValueError, match="needs knowledge level 'poses'"):
            search(attack="fov_aware", knowledge="own", **TINY)

    @pytest.mark.parametrize(
        ("change", "expected"),
        [
            (
                {"attack": "honest"},
                r"search\(honest\): its parameters have no ranges; expected one of false_pos",
            ),
            ({"attack": "suppress(fraction=1.0, choice=all, start=0)"}, "all of its parameters are given"),
            ({"attack": "false_positiv"}, "unknown policy 'false_positiv'; did you mean"),
            ({"generations": 0}, "generations must be a whole number of at least 1; got 0"),
            ({"episodes": 1.5}, "episodes must be a whole number of at least 1; got 1.5"),
            ({"defense": "nothing"}, "unknown defense 'nothing'"),
        ],
    )
    def test_what_does_not_fit_is_refused(self, change: dict[str, Any], expected: str) -> None:
        with pytest.raises(ValueError, match=expected):
            search(**TINY | {"attack": "false_positive"} | change)


@pytest.mark.parametrize(
    ("text", "inner"),
    [
        ("search(false_positive)", "false_positive"),
        (" search(inner=sleeper(inner=suppress)) ", "sleeper(inner=suppress)"),
        ("false_positive", None),
        ("searching(x)", None),
    ],
)
def test_searches_are_told_by_their_name(text: str, inner: str | None) -> None:
    assert searched(text) == inner


def test_a_search_is_no_policy() -> None:
    with pytest.raises(ValueError, match="a search has to be run before it can be played; expected what"):
        build_policy("search(false_positive)")
