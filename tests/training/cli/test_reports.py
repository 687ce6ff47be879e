"""`reproduce` and `benchmark`: what becomes of their reports."""

import json
import sys

import pytest

from trust_env import training


class _Outcome:
    """Stands for what `reproduce` and `benchmark` return, which have tests of their own."""

    def __init__(self, ok, *given):
        self.ok, self.given = ok, given

    def to_dict(self):
        return {"ok": self.ok, "given": [str(g) for g in self.given]}

    def print(self, console):
        console.print(f"ok: {self.ok}")


@pytest.mark.parametrize(("command", "arguments", "given", "failed"), [
    ("reproduce", ("--out", "figures", "--seeds", "3"), ["figures", "3"], 1),
    ("benchmark", ("--quick",), ["True"], 0),
])  # fmt: skip
def test_a_report_gives_text_json_and_an_exit_code(cli, monkeypatch, command, arguments, given, failed):
    getattr(training, command)  # imports the module of that name
    module = sys.modules[getattr(training, command).__module__]
    for ok, code in ((True, 0), (False, failed)):
        monkeypatch.setattr(module, command, lambda *a, ok=ok: _Outcome(ok, *a))
        assert cli(command, *arguments) == (code, f"ok: {ok}\n", "")
        found = cli(command, *arguments, "--json")
        assert (found[0], json.loads(found[1])) == (code, {"ok": ok, "given": given})
