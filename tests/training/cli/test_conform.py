"""`conform`: built-in environments, environments of the user's own, and its errors."""

import json

import pytest

from trust_env.conformance import CHECKS


def test_conform_reports_every_check(cli):
    arguments = ("conform", "--scenario", "trio(horizon=20)", "--defense", "score", "--max-seconds", "0.2")
    code, out, _ = cli(*arguments, "--attack", "fov_aware", "--json")
    found = json.loads(out)
    assert (code, found["ok"]) == (0, True)
    (report,) = found["environments"]
    assert report["environment"] == "trio x score"
    assert [check["name"] for check in report["checks"]] == list(CHECKS)
    assert not [check for check in report["checks"] if check["status"] == "failed"]


_ENVIRONMENTS = """
import numpy as np
from mpe2 import simple_spread_v3

def sound(max_cycles=25, render_mode=None):
    return simple_spread_v3.parallel_env(max_cycles=max_cycles, render_mode=render_mode)

class Drifting:
    "Observations that depend on how many environments there have been."
    made = 0
    def __new__(cls, max_cycles=25, render_mode=None):
        env = sound(max_cycles, render_mode)
        cls.made += 1
        step, offset = env.step, np.float32(1e-3 * cls.made)
        def drifting(actions):
            observations, *rest = step(actions)
            return {a: o + offset for a, o in observations.items()}, *rest
        env.step = drifting
        return env
"""


@pytest.mark.extra("bench")
def test_conform_takes_an_environment_in_a_file(cli, tmp_path):
    (tmp_path / "envs.py").write_text(_ENVIRONMENTS)
    arguments = ("--max-seconds", "0.2", "--json")
    code, out, _ = cli("conform", "--env", f"{tmp_path}/envs.py:sound", *arguments)
    sound = {check["name"]: check["status"] for check in json.loads(out)["environments"][0]["checks"]}
    assert sound["whole_episode_determinism"] == sound["parallel_api_test"] == "passed"
    code, out, _ = cli("conform", "--env", f"{tmp_path}/envs.py:Drifting(max_cycles=10)", *arguments)
    found = {check["name"]: check["status"] for check in json.loads(out)["environments"][0]["checks"]}
    assert (code, found["whole_episode_determinism"]) == (1, "failed")


def test_wrong_input_names_what_was_expected(cli, tmp_path):
    (tmp_path / "envs.py").write_text("make_env = 3\n")
    for arguments, text in (
        (
            ("--env", f"{tmp_path}/envs.py:make_env"),
            "expected a function or class that returns a ParallelEnv",
        ),
        (("--env", f"{tmp_path}/envs.py:other"), "unknown name"),
        (("--env", "x.py:make", "--scenario", "trio"), "expected no scenario, defense or attack beside it"),
        (("--scenario", "skies"), "targets.data"),
        (("--attack", "nobody"), "unknown policy 'nobody'"),
    ):
        code, _, err = cli("conform", *arguments)
        assert code == 2
        assert text in err
