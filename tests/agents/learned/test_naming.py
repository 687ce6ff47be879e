"""Learned policies by name: run folders, files and shipped weights, wherever a policy is named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from policy_files import SCENARIO, write_fitting

from trust_env import training
from trust_env.agents import build_policy, is_run
from trust_env.agents.learned.policy import Learned, shipped
from trust_env.agents.learned.policy_file import FILE
from trust_env.defenses import build_defense
from trust_env.scenario import load_scenario
from trust_env.training.cli.main import main
from trust_env.training.evaluation.configuration import configuration, named_specs

pytestmark = pytest.mark.core


class TestNaming:
    def test_a_run_is_a_folder_or_a_file(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        for folder in ("runs/a", "b", "honest"):
            Path(folder).mkdir(parents=True)
            write_fitting(Path(folder) / FILE)
        for text in (
            "runs/a",
            "./b",
            "b",
            "b/policy.safetensors",
            str(tmp_path / "b"),
            "learned(path='runs/a')",
        ):
            policy = build_policy(text)
            assert isinstance(policy, Learned) and policy.knowledge == "own", text
        assert type(build_policy("honest")).__name__ == "Honest"
        assert is_run("./honest") and not is_run("x.py:Mine") and not is_run("learned(path='runs/a')")
        inner: Any = build_policy("sleeper(start=2, inner=learned(path='runs/a'))")
        assert isinstance(inner.inner, Learned)
        assert repr(build_policy(repr(build_policy("runs/a")))) == repr(build_policy("runs/a"))

    def test_errors_name_what_is_missing(self, tmp_path: Path) -> None:
        (tmp_path / "empty").mkdir()
        with pytest.raises(ValueError, match=f"empty: there is no {FILE} in this folder; expected the folder"):
            build_policy(str(tmp_path / "empty"))
        with pytest.raises(ValueError, match="runs/none: there is no such file; expected"):
            build_policy("runs/none")
        with pytest.raises(ValueError, match="against = 'nothing': expected one of"):
            build_policy("learned(against=nothing)")
        with pytest.raises(ValueError, match="nothing beside a path"):
            build_policy("learned(path='runs/a', against=trust)")
        with pytest.raises(ValueError, match="sampled = 1: expected True or False"):
            build_policy("learned(path='runs/a', sampled=1)")

    def test_a_run_is_evaluated_beside_scripted_attacks(self, tmp_path: Path) -> None:
        run = str(tmp_path / "run")
        Path(run).mkdir()
        write_fitting(Path(run) / FILE)
        results = training.evaluate(SCENARIO, f"{run},honest", "score", episodes=3, progress=False)
        assert [cell.attack for cell in results.cells] == [run, "honest"]
        damage = results[run, "score"].metrics["damage_per_frame"]
        assert damage.shape == (3,) and np.isfinite(damage).all()

    def test_results_depend_on_the_digest_of_the_weights(self, tmp_path: Path) -> None:
        def files(attacks: str) -> dict[str, str]:
            found = configuration(
                load_scenario(SCENARIO),
                named_specs("attack", attacks, build_policy),
                named_specs("defense", "score", build_defense),
                1, 0, 12,
            )  # fmt: skip
            return found["files"]

        path = write_fitting(tmp_path / FILE)
        named = f"learned(path='{path}')"
        before = files(str(path))
        assert list(before) == [named] and len(before[named]) == 16
        assert files(f"sleeper(inner={named})") == before == files(str(path))
        write_fitting(path, seed=1)
        assert files(str(path))[named] != before[named]
        (tmp_path / "mine.py").write_text("from trust_env.agents.attacks.baseline import Honest as Mine")
        assert len(files(f"on_off(inner={tmp_path}/mine.py:Mine)")) == 1

    @pytest.mark.extra("train")
    def test_benign_agents_can_learn_against_an_earlier_run(self, tmp_path: Path) -> None:
        """An earlier run plays the adversaries while benign agents learn; it must stay what it was."""
        write_fitting(tmp_path / FILE)
        tiny = {"steps": 32, "worlds": 2, "threads": 1, "role": "benign", "evaluation.episodes": 1}
        tiny |= {"ppo.n_steps": 8, "ppo.batch_size": 16, "network.layers": [4]}
        others, out = {"adversary": str(tmp_path)}, tmp_path / "run"
        training.train(SCENARIO, "trust", out=out, others=others, overrides=tiny, progress=False)
        assert list(json.loads((out / "run.json").read_text())["files"]) == [f"learned(path='{tmp_path}')"]
        assert training.train(resume=out, progress=False).steps >= 32
        unfinished = (out / "config.yaml").read_text().replace("steps: 32", "steps: 64")
        (out / "config.yaml").write_text(unfinished)
        write_fitting(tmp_path / FILE, seed=1)
        with pytest.raises(ValueError, match=r"has changed since the run in .* began"):
            training.train(resume=out, progress=False)

    def test_the_command_line_shows_the_config_of_a_run(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        path = write_fitting(tmp_path / FILE)
        assert main(["attacks", "show", str(tmp_path), "--json"]) == 0
        shown = json.loads(capsys.readouterr().out)
        assert shown["name"] == "learned" and shown["file"] == str(path)
        assert shown["config"]["about"] == {"scenario": "trio", "defense": "score", "seed": 0, "steps": 0}
        assert main(["attacks", "show", str(tmp_path)]) == 0
        assert "wrapper: phantoms(n=2" in capsys.readouterr().out
        assert main(["attacks", "show", "learned"]) == 0
        assert "shipped" in capsys.readouterr().out

    @pytest.mark.parametrize("against", shipped())
    def test_the_shipped_weights_play(self, against: str) -> None:
        attack = f"learned(against={against})"
        results = training.evaluate("patrol(horizon=20)", attack, against, episodes=2, progress=False)
        assert results[attack, against].metrics["damage_per_frame"].shape == (2,)
