"""What to do with trained policies: the commands that play them on what they were trained on, and that show how they
learned.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from trust_env.scenario import load_scenario
from trust_env.training.learning.training_folder import SCENARIO, TrainingFolder


def next_step(folders: Sequence[Path]) -> str:
    """The lines that evaluate runs of one configuration on its scenario, against its defense, and make a page."""
    folder = TrainingFolder.open(folders[0])
    config = folder.configuration()
    if config.role == "benign":
        return f"to play it: trust_env.agents.Player(env, {{'benign': {str(folder.path)!r}}})"
    attacks = ",".join([*map(str, folders), "false_positive"])
    words = ["trust-env", "evaluate", "--scenario", _scenario(folder), "--defense", config.defense, "--attack", attacks]
    page = shlex.join(["trust-env", "report", *map(str, folders)])
    return f"to compare: {shlex.join(words)}\nas a page: {page}"


def _scenario(folder: TrainingFolder) -> str:
    """The scenario as it was named, where that still gives the same; else the file of the run."""
    named = folder.configuration().scenario
    try:
        same = load_scenario(named) == folder.scenario()
    except ValueError:
        same = False
    return named if same else str(folder.path / SCENARIO)
