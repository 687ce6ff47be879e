"""Commands that work in a folder, as processes: killed, short of disk, started twice; and what is finished."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq
from paths import ROOT
from training_runs import lines, weights

PROGRAM = [sys.executable, "-m", "trust_env.training.cli"]
STEPS = 192
TRAINING = (
    f"steps={STEPS}", "worlds=4", "threads=1", "ppo.n_steps=8", "ppo.batch_size=16", "ppo.n_epochs=1",
    "network.layers=[8]", "evaluation.episodes=2", "evaluation.every=32", "checkpoint.every=0",
)  # fmt: skip


class FolderRun(NamedTuple):
    """A command without its folder; `finished(folder)`: by name, what it has finished there, for comparison.

    version: of a ranking, the text of its file, which is put beside the folder.
    """

    arguments: Sequence[str]
    finished: Callable[[Path], dict[str, Any]]
    version: str = ""

    @property
    def name(self) -> str:
        """The command, a ranking with its kind."""
        return " ".join(self.arguments) if self.version else self.arguments[0]

    def command(self, folder: Path) -> list[str]:
        """Begins the run, or continues it."""
        if self.version:
            file = folder.with_name(f"{folder.name}.yaml")
            file.write_text(self.version)
            return [*PROGRAM, *self.arguments, "--version", str(file), "--out", str(folder), "--resume"]
        if self.arguments[0] != "train":
            return [*PROGRAM, *self.arguments, "--out", str(folder), "--resume"]
        if (folder / "config.yaml").exists():
            return [*PROGRAM, "train", "--resume", str(folder)]
        return [*PROGRAM, *self.arguments, "--out", str(folder)]


def cells(folder: Path) -> dict[str, pa.Table]:
    """The rows of an evaluation by attack and defense."""
    file = folder / "results.parquet"
    if not file.exists():
        return {}
    whole = pa.BufferReader(file.read_bytes())  # the run may put a new file in its place meanwhile
    table = pq.read_table(whole).replace_schema_metadata(None)
    keys = sorted({(row["attack"], row["defense"]) for row in table.select(["attack", "defense"]).to_pylist()})
    return {f"{a} x {d}": table.filter((pa.compute.field("attack") == a) & (pa.compute.field("defense") == d))
            for a, d in keys}  # fmt: skip


def parts(folder: Path) -> dict[str, Any]:
    """What an exploitation has finished: searches, training runs, and cells of the evaluation."""
    if not (folder / "finished.json").exists():
        return {}
    saved = json.loads((folder / "finished.json").read_text())
    found: dict[str, Any] = {f"screening {name}": _untimed(outcome) for name, outcome in saved["screened"].items()}
    found |= {f"search {name}": _untimed(outcome) for name, outcome in saved["searches"].items()}
    for seed in saved["trainings"]:
        found[f"training {seed}"] = trained(folder / "learned" / f"seed_{seed}")
    for part in ("validation", "evaluation"):
        for name, rows in cells(folder / part).items():
            found[f"{part} {name.replace(str(folder), '')}"] = rows.drop_columns("attack")
    if (folder / "exploit.md").exists():
        report = json.loads((folder / "exploit.json").read_text())
        found["report"] = [(one["kind"], one["damage"]) for one in report["attackers"]]
    return found


def trained(folder: Path) -> dict[str, Any]:
    """Weights and logs of a training run that is finished."""
    evaluations = lines(folder / "evaluations.csv") if (folder / "evaluations.csv").exists() else []
    if not evaluations or int(evaluations[-1]["steps"]) < STEPS:
        return {}
    arrays = {name: array.tobytes() for name, array in weights(folder).items()}
    return {"weights": arrays, "progress": lines(folder / "progress.csv"), "evaluations": evaluations}


def ranked(folder: Path) -> dict[str, Any]:
    """What a quick ranking has finished: cells by scenario, threat model and defense, and the rows."""
    found: dict[str, Any] = {}
    for file in sorted(folder.glob("parts/*/*/*/results.parquet")):
        part = file.parent
        found |= {f"{part.relative_to(folder)} {name}": rows for name, rows in cells(part).items()}
    return found | _rows(folder / "quick.json")


def exploited(folder: Path) -> dict[str, Any]:
    """What a full ranking has finished: the parts of the exploitation of each defense, and the rows."""
    found: dict[str, Any] = {}
    for part in sorted(folder.glob("parts/*/*/*/exploit")):
        found |= {f"{part.relative_to(folder)} {name}": outcome for name, outcome in parts(part).items()}
    return found | _rows(folder / "full.json")


def _rows(file: Path) -> dict[str, Any]:
    return {"rows": [_untimed(row) for row in json.loads(file.read_text())["rows"]]} if file.exists() else {}


def tuned(folder: Path) -> dict[str, Any]:
    """What a search for a ranking has finished: attacks by scenario and threat model, and the file of those kept."""
    found: dict[str, Any] = {}
    for file in sorted(folder.glob("parts/*/*/finished.json")):
        searches = json.loads(file.read_text())["searches"]
        found |= {f"{file.parent.relative_to(folder)} {name}": _untimed(one) for name, one in searches.items()}
    kept = folder.with_name(f"{folder.name}_searched.yaml")
    return found | ({"kept": kept.read_text()} if kept.exists() else {})


def _untimed(outcome: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in outcome.items() if name not in ("seconds", "time_ratio")}


ATTACKS = ",".join(["honest", *(f"suppress(fraction={f / 10})" for f in range(1, 6))])
EVALUATE = FolderRun(
    ["evaluate", "--scenario", "trio(horizon=60)", "--attack", ATTACKS, "--defense", "score,trust", "--episodes", "40"],
    cells,
)
TRAIN = FolderRun(
    ["train", "--scenario", "trio(horizon=20)", *(word for field in TRAINING for word in ("--set", field))], trained
)
EXPLOIT = FolderRun(
    ["exploit", "--scenario", "trio(horizon=20)", "--defense", "score", "--episodes", "6", "--seeds", "2",
     "--attack", "honest,false_positive,search(suppress),search(false_positive)", "--validation", "5",
     "--generations", "2", "--population", "3", "--search-episodes", "2", "--screening", "1", "--advancing", "1",
     *(word for field in TRAINING for word in ("--set", field))],
    parts,
)  # fmt: skip

VERSION = """
version: 1
scenarios: ["trio(horizon=30)"]
threats: [own@1, poses@1]
seed: 3
attacks: [honest, false_positive, outward, suppress, steal, fov_aware, by_turns, sleeper]
more_attacks: {}
defenses: [score, trust, quorum]
references: [oracle, blank]
quick: {validation: 10, episodes: 20}
search: {defense: trust, generations: 3, population: 6, episodes: 8, validation: 20}
full:
  {threats: [own@1], validation: 2, episodes: 3, generations: 2, population: 2, search_episodes: 2, screening: 1,
   advancing: 1, seeds: 1, training: {TRAINING}}
""".replace("TRAINING", ", ".join(TRAINING).replace("=", ": "))
RANK_QUICK = FolderRun(["rank", "--quick"], ranked, VERSION)
RANK_FULL = FolderRun(["rank", "--full", "--only", "score,trust"], exploited, VERSION)
RANK_SEARCH = FolderRun(["rank", "--search"], tuned, VERSION)


def played_in_peace(run: FolderRun, folder: Path) -> tuple[dict[str, Any], float]:
    """What a run that nothing interrupts has finished in the end, and how many seconds it took."""
    began = time.monotonic()
    subprocess.run(run.command(folder), cwd=ROOT, check=True, capture_output=True)
    return run.finished(folder), time.monotonic() - began


def out_of_space(run: FolderRun, folder: Path, most_bytes: int) -> str:
    """What a run says on stderr that fails as no file may be larger than `most_bytes`."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    done = subprocess.run(run.command(folder), cwd=ROOT, capture_output=True, text=True, preexec_fn=limit)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def kill(run: FolderRun, folder: Path, count: int, seconds: float) -> int:
    """Begin or continue a run and kill -9 it some seconds after `count` parts are finished: how many were then."""
    before = run.finished(folder)
    process = subprocess.Popen(run.command(folder), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while len(run.finished(folder)) < count and process.poll() is None:
        time.sleep(0.01)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    _, errors = process.communicate()
    assert process.returncode in (-signal.SIGKILL, 0), errors.decode()
    after = run.finished(folder)
    assert {name: after.get(name) for name in before} == before, "something finished is lost"
    return len(after)
