"""A page on runs, in one file that needs no network.

report("RUN", out="report.html")
report(["runs/evaluation", "runs/curve", "runs/train_0", "runs/train_1"], out="report.html", against="score")
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import trust_env
from trust_env.agents import build_policy
from trust_env.defenses import build_defense
from trust_env.files import expanded
from trust_env.training.console import progress_bar
from trust_env.training.evaluation.configuration import named_specs
from trust_env.training.evaluation.run_folder import ROWS
from trust_env.training.pages.packing import compressed
from trust_env.training.pages.page import as_script_data, render, save_page
from trust_env.training.reports import other_runs
from trust_env.training.reports.evaluation import Evaluation
from trust_env.training.reports.ranking import ranking_files, ranking_section
from trust_env.training.reports.replays import MOST_CELLS, Played, replays

MOST_BYTES = 8_000_000  # of a page; replays for which there is no room are left out, and the page says so
_OF_EXPLOITATION = "evaluation"


def report(
    runs: str | Path | Sequence[str | Path],
    out: str | Path,
    against: str | None = None,
    cells: int = 4,
    attacks: str | Iterable[Any] = (),
    defenses: str | Iterable[Any] = (),
    progress: bool = True,
) -> dict[str, Any]:
    """Write a page on the folders of `evaluate`, `exploit`, `curve`, `rank` and `train`, and give what stands in it.

    against: the defense that all others are compared with (default: `score`, else the first). cells: of how many cells
    the worst, the median and the best episode are played in the page, those with the highest damage, 12 at most.
    attacks, defenses: those of the runs that are the user's own code or objects, to be played in the page, too; a run
    holds names only, and no name in a file makes anything be imported.

    Raises ValueError for a folder that is none of these, and for an unknown defense, OSError for a file that cannot be
    written.
    """
    if isinstance(cells, bool) or not isinstance(cells, int) or not 0 <= cells <= MOST_CELLS:
        raise ValueError(f"cells = {cells!r}: expected a whole number from 0 to {MOST_CELLS}")
    folders = [expanded(run) for run in ([runs] if isinstance(runs, (str, Path)) else runs)]
    if not folders:
        raise ValueError("runs: expected at least one folder")
    evaluations, sections = [], []
    for section in _sections(folders):
        if isinstance(section, Evaluation):
            evaluations.append(section)
            section = section.section(against)
        sections.append(section)
    values = {"sections": sections, "replays": [], "version": trust_env.__version__, "left_out": []}
    values |= {"title": _title(sections), "plotly": compressed(_plotly().encode()) if sections else ""}
    code = _named("attack", attacks, build_policy) | _named("defense", defenses, build_defense)
    played = _played(evaluations, cells, against, code, progress)
    values["replays"], values["left_out"] = _fitting(played, MOST_BYTES - len(_page(values)))
    save_page(expanded(out), _page(values))
    return {name: value for name, value in values.items() if name != "plotly"}


def _page(values: dict[str, Any]) -> str:
    return render("reports/report.html.j2", **values)


def _title(sections: Sequence[dict[str, Any]]) -> str:
    names = dict.fromkeys(str(section.get("scenario") or section["runs"][0]["scenario"]) for section in sections)
    return ", ".join(names)


def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()


def _sections(folders: Sequence[Path]) -> Iterator[Evaluation | dict[str, Any]]:
    """What the folders hold, in their order; training runs side by side, at the first of them."""
    training = [folder for folder in folders if _is_training(folder)]
    for folder in folders:
        if folder in training:
            if folder == training[0]:
                yield other_runs.learning_section(training)
        elif (folder / other_runs.EXPLOITATION).is_file():
            yield other_runs.exploitation_section(folder)
            yield Evaluation(folder / _OF_EXPLOITATION)
            learned = sorted(each for each in folder.glob("learned/*") if _is_training(each))
            if learned:
                yield other_runs.learning_section(learned)
        elif ranking_files(folder):
            yield from map(ranking_section, ranking_files(folder))
        elif (folder / other_runs.CURVE).is_file():
            yield other_runs.curve_section(folder)
        elif (folder / ROWS).is_file():
            yield Evaluation(folder)
        else:
            expected = "expected the folder of a finished run of evaluate, exploit, curve, rank or train"
            raise ValueError(f"{folder}: {expected}")


def _is_training(folder: Path) -> bool:
    return (folder / other_runs.TRAINING).is_file() and (folder / other_runs.EVALUATIONS).is_file()


def _named(kind: str, given: str | Iterable[Any], build: Callable[[Any], Any]) -> dict[str, Any]:
    """What plays, by the names that a run has for it."""
    found = named_specs(kind, given, build) if given else []
    return {one.name: one.construct() if one.spec is None else str(one.spec) for one in found}


def _played(
    evaluations: Sequence[Evaluation], cells: int, against: str | None, code: Mapping[str, Any], progress: bool
) -> list[Played]:
    """The episodes of so many cells, which the evaluations share."""
    found: list[Played] = []
    shares = [cells // len(evaluations) + (i < cells % len(evaluations)) for i in range(len(evaluations))]
    with progress_bar("replays", 3 * cells, progress) as (advance, _):
        for evaluation, share in zip(evaluations, shares):
            for one in replays(evaluation, share, evaluation.reference(against), code):
                found.append(one)
                advance(1)
    return found


def _fitting(played: Sequence[Played], room: int) -> tuple[list[dict[str, Any]], list[str]]:
    """The recordings that fit into so many bytes, those that stand beside others last, and why others are left out."""
    left_out = list(dict.fromkeys(f"{one.cell}: {one.fault}" for one in played if one.fault))
    kept: dict[int, list[dict[str, Any]]] = {}
    for beside in (False, True):
        for number, one in enumerate(played):
            for recording in one.recordings[1:] if beside else one.recordings[:1]:
                size = len(as_script_data(recording).encode())
                if size <= room and (number in kept or not beside):
                    kept.setdefault(number, []).append(recording)
                    room -= size
                else:
                    what = f"{one.label}, beside {recording['defense']}" if beside else one.label
                    left_out.append(f"{what}: no room in {MOST_BYTES / 1e6:g} MB")
    return [{"label": played[number].label, "recordings": kept[number]} for number in sorted(kept)], left_out
