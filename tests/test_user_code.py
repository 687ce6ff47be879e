"""Defenses and policies of users that are wrong: one line that names the file, the class and what was expected."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trust_env
from trust_env.agents import Player, Policy, build_policy
from trust_env.defenses import build_defense
from trust_env.training import evaluate
from trust_env.training.cli.main import main

pytestmark = pytest.mark.core

RESET, BEGIN = (f"def reset({names}): pass\n    " for names in ("self, s, w", "self, c"))
# The body of a class, and what its message has to say after the file and the class.
DEFENSES = {
    "def update(self, e): return Verdict()": r"D has no method reset\(shape, worlds\)",
    "def reset(self, s, w): pass": r"D has no method update\(evidence\)",
    "pass": r"D has no method reset\(shape, worlds\) and no method update\(evidence\)",
    "def __init__(self): 1 / 0": r"D: its construction raised ZeroDivisionError: division by zero \(line 4\); it ",
    "def __init__(self, n): pass": r"D: its construction raised TypeError: .*'n' .*; it takes \(n\)",
    "update = 3\n    def reset(self, s, w): raise KeyError": r"D has no method update\(evidence\)",
    "update = print\n    def reset(self, s, w): raise KeyError": r"D\.reset raised KeyError \(line 5\)",
    "def reset(self): pass\n    def update(self, e): pass": r"D\.reset raised TypeError: D\.reset\(\) takes 1 pos",
    RESET + "def update(self, e): return e.score @ e.score": r"D\.update raised ValueError: mat",
    RESET + "def update(self, e): assert 0, 'a\\nb'": r"D\.update raised AssertionError: a b ",
    RESET + "def update(self, e): pass": r"D\.update must return .*Verdict, not NoneType",
    RESET + "def update(self, e): return {}": r"D\.update must return .*Verdict, not dict",
    RESET + "def update(self, e): return e.score": r"Verdict, not an array of shape \[\d, \d+\]",
    RESET + "def update(self, e): return Verdict(keep=3)": r"D: keep must have shape \[",
}  # fmt: skip
POLICIES = {
    "def act(self, o): return o": r"D has no method reset\(context\)",
    "def reset(self, c): pass": r"D has no method act\(observations\)",
    "def __init__(self): 1 / 0": r"D: its construction raised ZeroDivisionError: division by zero \(line 4\); it ",
    "def __init__(self, n): pass": r"D': missing a required argument: 'n'; it takes: n",
    "def reset(self, c): raise OSError('a\\nb')": r"D has no method act",
    "def reset(self, c): raise OSError('a\\nb')\n    def act(self, o): pass": r"D\.reset raised OSError: a b \(line",
    BEGIN + "def act(self, o): raise KeyError('x')": r"D\.act raised KeyError: 'x' \(line 5\)",
    BEGIN + "def act(self, o): pass": r"D: policy 'D' returned actions of shape \[\]; expected \[1, 1",
    BEGIN + "def act(self, o): return [[1], [1, 2]]": r"D: policy 'D' returned no array of actions",
    BEGIN + "def act(self, o): return np.full((len(o), 1, 18), np.nan)": r"not finite: nan \(world 0",
    BEGIN + "def act(self, o): return np.full((len(o), 1, 18), 'a')": r"returned actions of <U1; exp",
}  # fmt: skip
CHOOSING = {
    "pass": r"D\.act raised NotImplementedError: D needs a method choose\(self, seen\)",
    "def choose(self, seen): return seen['nothing']": r"D\.act raised KeyError: 'nothing' \(line 4\)",
    "def choose(self, seen): return 0": r"D: policy 'mine' returned actions of shape \[\]",
    "def prepare(self, context): raise ValueError('no')": r"D\.reset raised ValueError: no \(line 4\)",
}


def write(folder: Path, body: str, base: str = "") -> str:
    """A file with a class D of the given body; its name as a spec."""
    file = folder / "mine.py"
    name = "\n    name = 'mine'" if base else ""
    file.write_text(f"import numpy as np; from trust_env import Verdict\nfrom trust_env.agents import Policy\n"
                    f"class D({base}):\n    {body}{name}\n")  # fmt: skip
    return f"{file}:D"


def line_of(capsys: pytest.CaptureFixture, *arguments: str) -> str:
    """The only line that a command prints before it ends with the code for wrong input."""
    assert main(["evaluate", "--scenario", "trio", "--episodes", "1", *arguments]) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if line and "compil" not in line]
    assert len(lines) == 1 and "Traceback" not in out + err, err
    return lines[0]


@pytest.mark.parametrize("body", DEFENSES)
def test_a_wrong_defense_is_one_line_on_the_command_line(tmp_path, capsys, body):
    line = line_of(capsys, "--defense", write(tmp_path, body))
    assert re.search(DEFENSES[body], line) and f"{tmp_path}/mine.py:D" in line


@pytest.mark.parametrize(("base", "body"), [("", b) for b in POLICIES] + [("Policy", b) for b in CHOOSING])
def test_a_wrong_policy_is_one_line_on_the_command_line(tmp_path, capsys, base, body):
    line = line_of(capsys, "--attack", write(tmp_path, body, base))
    assert re.search((POLICIES if not base else CHOOSING)[body], line) and "mine.py:D" in line


def test_a_wrong_policy_within_a_built_in_one_is_named_with_its_file(tmp_path, capsys):
    inner = write(tmp_path, BEGIN + "def act(self, o): raise KeyError('x')")
    line = line_of(capsys, "--attack", f"sleeper(start=0, inner={inner})")
    assert "Sleeper.act raised KeyError: 'x'" in line and f"{tmp_path}/mine.py, line 5" in line


def test_the_original_exception_is_the_cause(tmp_path):
    with pytest.raises(ValueError, match="ZeroDivisionError") as caught:
        build_defense(write(tmp_path, "def __init__(self): 1 / 0"))
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    env = trust_env.vector_env(
        "trio", write(tmp_path, "def reset(self, s, w): raise KeyError('x')\n    update = print")
    )
    with pytest.raises(ValueError, match=r"D\.reset raised") as caught:
        env.reset(seed=1)
    assert isinstance(caught.value.__cause__, KeyError)


class Incomplete:
    def reset(self, *_: Any) -> None: ...


@pytest.mark.parametrize("build", [build_defense, build_policy])
def test_objects_that_lack_a_method_and_classes_are_type_errors_that_name_them(build):
    with pytest.raises(TypeError, match=r"test_user_code\.py:Incomplete has no method (update|act)"):
        build(Incomplete())
    with pytest.raises(TypeError, match=r"test_user_code\.py:Incomplete is a class; expected an object, such as Incom"):
        build(Incomplete)
    for wrong in (3, None, object(), [1]):
        with pytest.raises(TypeError, match=f"{type(wrong).__name__} has no method reset"):
            build(wrong)


def test_errors_of_built_in_policies_keep_their_own_words():
    venv = trust_env.vector_env("patrol")
    seen, _ = venv.reset(seed=1)
    with pytest.raises(ValueError, match=r"^false_positive: n = 5"):
        Player(venv, {"adversary": "false_positive(n=5)"}).actions(seen)


def test_an_interrupt_in_a_users_code_stays_one():
    class Stopped(Policy):
        def choose(self, seen: dict[str, np.ndarray]) -> np.ndarray:
            raise KeyboardInterrupt

    venv = trust_env.vector_env("trio")
    seen, _ = venv.reset(seed=1)
    with pytest.raises(KeyboardInterrupt):
        Player(venv, {"adversary": Stopped()}).actions(seen)


class Silent:
    """Trust that is NaN, always or in odd columns of tracks."""

    def __init__(self, always: bool = True, publish: bool = True):
        self.always, self.publish = always, publish

    def reset(self, shape: Any, worlds: np.ndarray) -> None:
        self.shape = shape

    def update(self, evidence: Any) -> trust_env.Verdict:
        trust = np.where(self.always | (np.arange(self.shape.J) % 2 == 1), np.nan, 0.9)
        publish = None if self.publish else np.zeros((self.shape.W, self.shape.J), bool)
        return trust_env.Verdict(track_trust=np.tile(trust, (self.shape.W, 1)), publish=publish)


NOTE = "100 % of the track trust of Silent is NaN: it decides nothing"


def test_trust_that_is_all_nan_is_played_and_remarked():
    results = evaluate("trio", "honest", ["score", Silent()], episodes=2, max_cycles=20, progress=False)
    assert [note for note in results.notes if "NaN" in note] == [NOTE]
    silent, score = (results["honest", name].metrics["damage_per_frame"] for name in ("Silent", "score"))
    assert np.array_equal(silent, score)


@pytest.mark.parametrize("defense", [Silent(always=False), Silent(publish=False)])
def test_trust_that_decides_something_is_not_remarked(defense):
    results = evaluate("trio", "honest", [defense], episodes=2, max_cycles=20, progress=False)
    assert not [note for note in results.notes if "NaN" in note]
