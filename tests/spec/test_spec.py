"""Specs: what is parsed, what is an error, and that only files the user names are run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trust_env.errors import nearest, unknown_name
from trust_env.spec import Spec, load_object, parse, split_specs


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("trust", Spec("trust")),
        (" trust( ) ", Spec("trust")),
        ("trust(preset=cdc2024, window=9)", Spec("trust", {"preset": "cdc2024", "window": 9})),
        ("my_file.py:MyDefense(window=9)", Spec("MyDefense", {"window": 9}, "my_file.py")),
        ("../a b/c.py:D", Spec("D", {}, "../a b/c.py")),
        ("a(x=-1e-6, y=+2, z=1_000)", Spec("a", {"x": -1e-6, "y": 2, "z": 1000})),
        ("a(x=True, y=None, z='None')", Spec("a", {"x": True, "y": None, "z": "None"})),
        ("a(x='b, c) (', y=\"it's\",)", Spec("a", {"x": "b, c) (", "y": "it's"})),
        ("a(p={1: (0.8, 100), two: [b, -3]})", Spec("a", {"p": {1: (0.8, 100), "two": ["b", -3]}})),
        ("a(inner=b(n=2, c=d(e=3)))", Spec("a", {"inner": "b(n=2, c=d(e=3))"})),
        ("a(inner=b.py:C(n=2))", Spec("a", {"inner": "b.py:C(n=2)"})),
        ("a(inner=[b(n=2), c])", Spec("a", {"inner": ["b(n=2)", "c"]})),
        ("skies(data=traffic.csv)", Spec("skies", {"data": "traffic.csv"})),
        ("patrol(tracker.gate=0.95)", Spec("patrol", {"tracker.gate": 0.95})),
    ],
)
def test_specs_are_parsed_and_formatted_back(text: str, expected: Spec) -> None:
    assert parse(text) == expected
    assert parse(str(parse(text))) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("trust(9)", "'9' has no name; expected key=value"),
        ("trust(*a)", "'*a' has no name; expected key=value"),
        ("trust(a=1, a=2)", "a is given twice"),
        ("trust(", "a ) is missing at the end"),
        ("trust(a=[1, 2)", "a ) closes nothing"),
        ("trust(a='x)", "a ' is missing at the end"),
        ("trust)", "a ) closes nothing"),
        ("trust(a=1,, b=2)", "nothing stands before a comma"),
        ("false-positive", "expected name, name(key=value, ...) or file.py:Name(key=value, ...)"),
        ("", "expected name, name(key=value, ...)"),
        ("trust(a=/tmp/x)", "a=/tmp/x: expected a number, a name, a quoted text"),
        ("trust(a=1+1)", "expressions are not evaluated"),
        ("trust(a=-True)", "expressions are not evaluated"),
        ("trust(a={1, 2})", "expressions are not evaluated"),
        ("trust(a={**b})", "expressions are not evaluated"),
        ("trust(a=[b().c])", "is no name"),
        ("trust(a=b'x')", "a value is of type bytes"),
        ("trust(a=1e999)", "a number is not finite"),
        ("trust(a={1.5: 2})", "the keys of a dict are names or whole numbers"),
        ("trust(a={[1]: 2})", "the keys of a dict are names or whole numbers"),
        ("trust(inner=b(3))", "'3' has no name"),
    ],
)
def test_invalid_specs_are_named_with_what_was_expected(text: str, expected: str) -> None:
    with pytest.raises(ValueError) as caught:
        parse(text)
    assert expected in str(caught.value)
    assert repr(text) in str(caught.value)


def test_specs_that_are_no_text_are_an_error() -> None:
    with pytest.raises(ValueError, match="3: expected a text"):
        parse(3)  # type: ignore[arg-type]


def test_nothing_is_evaluated(tmp_path: Path) -> None:
    mark = tmp_path / "ran"
    spec = parse(f"a(b=touch(path='{mark}'))")
    assert spec.params == {"b": f"touch(path='{mark}')"}
    assert not mark.exists()


_scalars = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
_values = st.recursive(
    _scalars,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.dictionaries(st.integers() | st.text(), inner, max_size=3)
    ),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.sampled_from(["a", "b_1", "c.d"]), _values))
def test_str_parses_back_to_the_same(params: dict[str, object]) -> None:
    spec = Spec("name", params)
    assert parse(str(spec)) == spec


def test_lists_of_specs_split_at_commas_outside_brackets_and_quotes() -> None:
    text = "honest, false_positive(n=2, start=3),a(b=[1,2], c='x,y'),"
    assert split_specs(text) == ["honest", "false_positive(n=2, start=3)", "a(b=[1,2], c='x,y')"]
    assert split_specs("") == []
    with pytest.raises(ValueError, match="nothing stands before a comma"):
        split_specs("honest,,random")
    with pytest.raises(ValueError, match=r"a \) is missing at the end"):
        split_specs("honest,random(")


def test_a_file_runs_once_until_it_changes(tmp_path: Path) -> None:
    log, file = tmp_path / "log", tmp_path / "mine.py"
    file.write_text(f"open({str(log)!r}, 'a').write('x')\nclass Mine:\n    n = 1\n")
    first = load_object(parse(f"{file}:Mine(n=2)"))
    assert load_object(parse(f"{file}:Mine")) is first
    assert first.n == 1
    assert log.read_text() == "x"
    file.write_text(file.read_text().replace("n = 1", "n = 2"))
    os.utime(file, ns=(1, 1))
    assert load_object(parse(f"{file}:Mine")).n == 2
    assert log.read_text() == "xx"


def test_a_file_may_define_dataclasses(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    lines = [
        "from __future__ import annotations",
        "from dataclasses import dataclass",
        "@dataclass",
        "class A:",
    ]
    file.write_text("\n".join([*lines, "    n: int = 4", ""]))
    assert load_object(parse(f"{file}:A"))().n == 4


def test_errors_name_what_a_file_does_not_have(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    with pytest.raises(ValueError, match=r"mine\.py:Mine: there is no file"):
        load_object(parse(f"{file}:Mine"))
    file.write_text("class MyDefense: pass\n")
    with pytest.raises(ValueError, match=r"unknown name in .*'MyDefence'; did you mean 'MyDefense'\?"):
        load_object(parse(f"{file}:MyDefence"))
    with pytest.raises(ValueError, match="'trust' names no file"):
        load_object(parse("trust"))
    broken = tmp_path / "broken.py"
    broken.write_text("1 / 0\n")
    with pytest.raises(ValueError, match="could not be run: ZeroDivisionError: division by zero"):
        load_object(parse(f"{broken}:Mine"))


def test_unknown_names_suggest_the_nearest() -> None:
    error = unknown_name("defense", "trsut", ["trust", "score", "majority"])
    assert str(error) == "unknown defense 'trsut'; did you mean 'trust'? known: majority, score, trust"
    assert str(unknown_name("defense", "xyz", ["trust"])) == "unknown defense 'xyz'; known: trust"
    assert nearest("False-Positive", ["false_positive", "flood"]) == "false_positive"
    assert nearest("zzz", ["trust"]) is None
