"""The paper's results beside ours: Theorem 1's table, the eight trust panels, and every claim with a verdict.

report = reproduce("figures")    # writes PNGs and tables into that folder; without one it writes nothing
report.ok, report.to_dict()
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from trust_env.errors import positive_int
from trust_env.files import expanded, write_atomically
from trust_env.training.console import progress_bar
from trust_env.training.paper.panels import VARIANTS, estimator_deviation, simulated_panels
from trust_env.training.paper.published import panel_keys, published_panels, suppressed_keys
from trust_env.training.paper.report import Report
from trust_env.training.paper.theorem import theorem_cells, theorem_rows
from trust_env.training.paper.theory_claims import theory_verdicts
from trust_env.training.paper.trust_claims import EXPLAINING, trust_verdicts

TABLES = "tables.md"


def reproduce(out: str | Path | None = None, seeds: int = 64, progress: bool = True) -> Report:
    """Compute everything, in some ten seconds; `out`: a folder for figures and tables (needs the extra `plot`).

    seeds: worlds whose mean makes a panel, and worlds for every attack in a cell of Theorem 1's table.
    Raises ImportError, naming the extra, before anything is computed, for figures without matplotlib.
    """
    positive_int("seeds", seeds)
    if out is not None:
        from trust_env.training.paper.figures import require_matplotlib

        require_matplotlib()
    panels, suppressed = {"published": published_panels()}, {}
    total = len(list(theorem_cells())) + (2 * len(VARIANTS) - 1) * len(panel_keys())
    with progress_bar("reproduce", total, progress) as (advance, describe):
        describe("Theorem 1")
        rows = theorem_rows(seeds, advance)
        for variant in VARIANTS:
            describe(f"trust panels, {variant}")
            panels[variant] = simulated_panels(variant, seeds, panel_keys(), advance)
            if variant != EXPLAINING:
                suppressed[variant] = simulated_panels(variant, seeds, suppressed_keys(), advance)
    estimator = {variant: estimator_deviation(variant) for variant in VARIANTS}
    verdicts = [*theory_verdicts(rows), *trust_verdicts(panels)]
    report = Report(seeds, rows, panels, suppressed, estimator, verdicts)
    return report if out is None else _written(report, expanded(out))


def _written(report: Report, folder: Path) -> Report:
    """The report, with the files that have been written."""
    from trust_env.training.paper.figures import write_figures

    files = write_figures(folder, report.theorem, report.panels)
    write_atomically(folder / TABLES, lambda file: file.write_text(report.markdown(), encoding="utf-8"))
    return replace(report, files=(*files, folder / TABLES))
