"""What the built-in defenses take as parameters, and what they say of anything else."""

from __future__ import annotations

import inspect

import pytest

import trust_env
from trust_env.defenses import DEFENSES, build_defense


@pytest.mark.parametrize(
    ("defense", "message"),
    [
        ("majority(window=0)", "majority: window must be a whole number from 1 to 1000, not 0"),
        ("majority(q=1)", r"majority: q must be a number in \[0, 1\), not 1"),
        ("quorum(l=-1)", "quorum: l must be a whole number from 0 to 255, not -1"),
        ("quorum(misses=2.5)", "quorum: misses must be a whole number from 1 to 1000, not 2.5"),
        ("quorum(strict=1)", "quorum: strict must be False or True, not 1"),
        ("binary_beta(window=True)", "binary_beta: window must be a whole number from 1 to 1000, not True"),
        ("rfsn_beta(w=0)", r"rfsn_beta: w must be a number in \(0, 1\], not 0"),
        ("particle(n=1)", "particle: n must be a whole number from 2 to 10000, not 1"),
        ("particle(sigma=0.6)", r"particle: sigma must be a number in \[0, 0.5\], not 0.6"),
        ("parsimony(pi=0.5)", r"parsimony: pi must be a number in \(0, 0.5\), not 0.5"),
        ("parsimony(epsilon=0)", r"parsimony: epsilon must be a number in \(0, 1\), not 0"),
        ("score_asymmetry(gamma=0.5)", r"score_asymmetry: gamma must be a number in \[0.7, 1\], not 0.5"),
        ("score_asymmetry(a='x')", r"score_asymmetry: a must be a number in \(0, 1\), not 'x'"),
        ("dawid_skene(rho=1.5)", r"dawid_skene: rho must be a number in \(0, 1\], not 1.5"),
        ("dawid_skene(real=3)", "dawid_skene: real must be two numbers above 0, α and β, not 3"),
        ("dawid_skene(fake=(0, 1))", r"dawid_skene: fake\[0\] must be a number above 0, not 0"),
        ("path_trust", "PathTrust.* missing .*'anchor'"),
        ("path_trust(anchor=-1)", "path_trust: anchor must be a whole number from 0 to 255, not -1"),
        ("cusum(h=0)", "cusum: h must be a number above 0, not 0"),
        ("oracle(lone='maybe')", "oracle: lone must be 'hide' or 'show', not 'maybe'"),
        ("oracle(epsilon=1)", r"oracle: epsilon must be a number in \(0, 1\), not 1"),
    ],
)
def test_a_parameter_out_of_range_is_named_with_what_was_expected(defense, message):
    with pytest.raises(ValueError, match=message):
        build_defense(defense)


def test_the_anchor_must_be_one_of_the_agents():
    trust_env.vector_env("trio", "path_trust(anchor=2)")
    with pytest.raises(ValueError, match="path_trust: anchor must be a whole number from 0 to 2, not 3"):
        trust_env.vector_env("trio", "path_trust(anchor=3)")


@pytest.mark.parametrize("name", [name for name in DEFENSES if name != "trust"])
def test_params_are_what_the_defense_was_built_with(name):
    given = {"anchor": 1} if name == "path_trust" else {}
    defaults = {p.name: p.default for p in inspect.signature(DEFENSES[name]).parameters.values()}
    built = DEFENSES[name](**given)
    assert built.params() == {key: value for key, value in (defaults | given).items() if key != "kwargs"}
    assert DEFENSES[name](**built.params()).params() == built.params()
