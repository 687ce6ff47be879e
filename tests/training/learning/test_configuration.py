"""The configuration of a training run: defaults, files and overrides."""

from __future__ import annotations

import pytest
from paths import ROOT
from training_runs import SMALL

from trust_env.training.learning.configuration import load_configuration

pytestmark = pytest.mark.extra("train")


def test_a_configuration_written_as_yaml_loads_again(tmp_path):
    config = load_configuration(SMALL, {"others.benign": "honest", "ppo.gamma": 0.5, "gae_lambda": 0.4})
    (tmp_path / "copy.yaml").write_text(config.to_yaml())
    assert load_configuration(tmp_path / "copy.yaml") == config
    assert (config.others, config.ppo.gamma, config.ppo.gae_lambda) == ({"benign": "honest"}, 0.5, 0.4)


def test_a_file_replaces_only_its_fields_and_errors_name_its_lines(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("steps: 10\nppo:\n  gamma: 2\n")
    with pytest.raises(ValueError, match=r"mine\.yaml, line 3: ppo\.gamma = 2: expected a number from 0 to 1"):
        load_configuration(mine)
    mine.write_text("steps: 10\n")
    assert load_configuration(mine) == load_configuration(overrides={"steps": 10})
    with pytest.raises(ValueError, match="No such file"):
        load_configuration(tmp_path / "missing.yaml")


def test_every_default_is_commented():
    text = (ROOT / "training" / "learning" / "defaults.yaml").read_text()
    missing = [line for line in text.splitlines() if line.strip() and not line.startswith("#") and "#" not in line]
    assert [line.split(":")[0].strip() for line in missing] == []
