"""`reproduce`: its numbers against the authors' own, its claims, its figures."""

import errno
import io
import json
import math

import numpy as np
import pytest
from paths import REFERENCE
from rich.console import Console

from trust_env.training.paper import figures, published, trust_claims
from trust_env.training.paper.panels import estimator_deviation, replayed_beliefs, simulated_panel
from trust_env.training.paper.published import Panel, objects, panel_keys, published_panels
from trust_env.training.paper.reproduce import Report, reproduce
from trust_env.training.paper.theorem import TheoremRow, theorem_row
from trust_env.training.paper.theory_claims import theory_verdicts

FAILS_WITH_PAPER = {
    ("V-B", "without a prior agent 2 ends lowest"),
    ("V-B", "agent 2 tends towards distrusted"),
    ("V-B", "the prior on agent 1 decides the even split"),
    ("V-B", "with the prior agent 0 falls"),
    ("V-B", "with the prior agent 2 falls further"),
    ("V-C", "agent 2 tends towards distrusted"),
    ("V-C", "the prior on agent 1 decides the even split"),
    ("V-C", "with the prior agent 2 falls further"),
}


@pytest.fixture(scope="module")
def report() -> Report:
    return reproduce(seeds=8, progress=False)


def reference_case(key) -> dict:
    cases = json.loads((REFERENCE / "cdc2024_cases.json").read_text())["cases"]
    return cases[f"{key[0]}_{'prior100' if key[1] else 'no_prior'}"]


# --- the data that is shipped ---------------------------------------------------------------------------


@pytest.mark.parametrize("key", panel_keys())
def test_shipped_numbers_are_the_authors(key):
    case, panel = reference_case(key), published_panels()[key]
    finals = [(row["alpha"], row["beta"]) for name in ("tracks", "agents") for row in case["final"][name]]
    assert published.final_beliefs(key).tolist() == [list(pair) for pair in finals]
    for frame in case["frames"]:
        known = {t["track"]: t["alpha"] / (t["alpha"] + t["beta"]) for t in frame["tracks"]}
        for j in range(len(panel.tracks)):
            expected = known.get(j, math.nan)
            assert panel.tracks[j, frame["frame"]] == pytest.approx(expected, abs=1e-5, nan_ok=True)
        means = [a["alpha"] / (a["alpha"] + a["beta"]) for a in frame["agents"]]
        assert panel.agents[:, frame["frame"]] == pytest.approx(means, abs=1e-5)


def test_shipped_numbers_are_of_the_built_in_cases():
    import trust_env

    for case in published.CASES:
        scenario = trust_env.load_scenario(case)
        true = [obj.position for obj in objects(case) if obj.kind == "true"]
        assert sorted(true) == sorted(tuple(p) for p in scenario.targets.positions)
        false = [(obj.detected_by[0], obj.position) for obj in objects(case) if obj.kind == "fp"]
        assert sorted(false) == sorted((i.agent, tuple(i.position)) for i in scenario.injections)


# --- the trust panels -----------------------------------------------------------------------------------


def test_cdc2024_on_the_authors_evidence_is_exact():
    assert estimator_deviation("cdc2024") < 1e-9


def test_paper_on_the_authors_evidence_puts_agent_2_first():
    alpha, beta = replayed_beliefs(("case1", False), "paper")[-3:].T
    assert alpha / (alpha + beta) == pytest.approx([0.64, 0.76, 0.80], abs=0.01)


def test_panels_in_our_environment_end_where_the_authors_do(report):
    for key in panel_keys():
        case = reference_case(key)
        means = [row["mean"] for name in ("tracks", "agents") for row in case["final"][name]]
        assert report.panels["cdc2024"][key].final_trust == pytest.approx(means, abs=0.05)
    assert 0.0 < report.deviation <= 0.05


def test_panels_follow_the_authors_frame_by_frame(report):
    for key, panel in published_panels().items():
        ours = report.panels["cdc2024"][key]
        for curve, theirs in ((ours.tracks, panel.tracks), (ours.agents, panel.agents)):
            difference = np.abs(curve[:, :-1] - theirs[:, 1:])  # their frame f is our frame f, counted from 1
            assert np.nanmax(difference) < 0.05
            assert (np.isnan(curve[:, :-1]) == np.isnan(theirs[:, 1:])).mean() > 0.95


def test_a_panel_is_the_same_when_simulated_again():
    one, again = (simulated_panel(("case2", True), "paper", 3) for _ in range(2))
    assert np.array_equal(one.tracks, again.tracks, equal_nan=True) and np.array_equal(one.agents, again.agents)


# --- Theorem 1 ------------------------------------------------------------------------------------------


def test_theorem_table_is_the_reference(report):
    tables = json.loads((REFERENCE / "frames_to_confirm.json").read_text())["tables"]
    (table,) = [t["t_min"] for t in tables if (t["eta"], t["alpha"]) == (2, 1e-4)]
    assert len(report.theorem) == 42
    for row in report.theorem:
        expected = table[row.n_adversaries - 1][row.n_benign]
        assert row.theorem == pytest.approx(math.inf if expected is None else expected, abs=1e-6)


def test_theorem_and_simulation_agree_in_every_cell(report):
    frames = {(r.n_adversaries, r.n_benign, r.order): r.simulated for r in report.theorem}
    alone = {b: (frames[1, b, "first"], frames[1, b, "last"]) for b in range(7)}
    never = (math.inf, math.inf)
    assert alone == {0: (3, 3), 1: (4, 3), 2: (5, 4), 3: (8, 6), 4: (17, 12), 5: never, 6: never}
    two = [(frames[2, b, "first"], frames[2, b, "last"]) for b in range(7)]
    assert two == [(2, 2)] * 4 + [(3, 2), (3, 2), (4, 2)]
    assert all(row.ok for row in report.theorem)
    assert all(min(row.earliest_other, row.simulated) >= row.bound for row in report.theorem)


def test_a_theorem_row_fails_where_a_confirmation_comes_too_early():
    row = theorem_row(1, 0, "first", 1)
    fields = {name: getattr(row, name) for name in row.__dataclass_fields__}
    assert row.ok
    assert not TheoremRow(**(fields | {"earliest_other": 2.0})).ok
    assert not TheoremRow(**(fields | {"simulated": 4.0})).ok
    assert not TheoremRow(**(fields | {"excess": 0.5})).ok


# --- claims ---------------------------------------------------------------------------------------------


def test_every_claim_has_a_verdict_for_the_paper_and_both_presets(report):
    sections = {verdict.section for verdict in report.verdicts}
    assert sections == {"III", "IV-A", "V-B", "V-C"}
    for section, _, text, *_ in trust_claims.CLAIMS:
        sources = {v.source for v in report.verdicts if (v.section, v.claim) == (section, text)}
        assert {"published", "cdc2024", "paper"} <= sources
    assert all(verdict.numbers for verdict in report.verdicts)


def test_the_published_numbers_and_cdc2024_bear_out_every_claim_about_trust(report):
    assert not [v for v in report.verdicts if v.source in ("published", "cdc2024") and not v.holds]


def test_claims_that_fail_with_paper_are_named_with_their_reason(report):
    failing = [v for v in report.verdicts if v.source == "paper" and not v.holds]
    assert {(v.section, v.claim) for v in failing} == FAILS_WITH_PAPER
    assert all(v.note and v.as_expected for v in failing)
    explained = [v for v in report.verdicts if v.source == "paper*"]
    assert {(v.section, v.claim) for v in explained} == FAILS_WITH_PAPER
    assert all(v.holds for v in explained)


def test_claims_about_the_score_that_do_not_hold(report):
    failing = [v.claim for v in theory_verdicts(report.theorem) if not v.holds]
    assert [claim.split(":")[0].split(" with ")[0] for claim in failing] == [
        "Prop. 3",
        "the figure's numbers follow from Theorem 1",
        "Thm. 1",
    ]


def test_claims_fail_on_panels_that_contradict_them():
    """Swapped agents in case 2, and an agent that never settles."""
    panels = dict(published_panels())
    for key, panel in panels.items():
        wave = 0.5 + 0.4 * np.sign(np.sin(np.arange(20) * 2.0))
        agents = panel.agents[::-1].copy()
        agents[1] = wave
        panels[key] = Panel(panel.tracks, agents)
    verdicts = {(v.section, v.claim): v.holds for v in trust_claims.trust_verdicts({"published": panels})}
    assert not verdicts["V-C", "without a prior, trust falls from agent 0 over 1 to 2"]
    assert not verdicts["IV-A", "Case 2: trust converges within 1 s"]
    assert verdicts["V-C", "a track that one agent sees keeps its prior"]


# --- the report -----------------------------------------------------------------------------------------


def test_report_is_plain_and_complete(report):
    found = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert found["ok"] is True and len(found["theorem"]) == 42 and len(found["panels"]) == 4
    assert found["theorem"][10]["simulated"] is None  # one adversary, five honest agents: never
    ends = found["panels"][0]["final"]
    assert len(ends) == 9 and list(ends[0]) == ["trust_in", "published", "cdc2024", "paper", "paper*"]
    assert any("1e-6" in text for text in found["differences"])


def test_report_is_not_ok_when_a_panel_is_off(report):
    off = dict(report.panels["cdc2024"])
    off["case1", False] = Panel(off["case1", False].tracks, off["case1", False].agents + 0.2)
    fields = {name: getattr(report, name) for name in report.__dataclass_fields__}
    assert not Report(**(fields | {"panels": report.panels | {"cdc2024": off}})).ok


def test_report_prints_tables_and_verdicts(report):
    console = Console(width=150, record=True, file=io.StringIO())
    report.print(console)
    text = console.export_text()
    assert "17 / 12" in text and "never / never" in text and "does not hold" in text
    assert text.rstrip().endswith("reproduced") and "NOT" not in text


@pytest.mark.parametrize("seeds", [0, -1, 1.5, True])
def test_seeds_must_be_a_whole_number_of_at_least_1(seeds):
    with pytest.raises(ValueError, match="seeds"):
        reproduce(seeds=seeds, progress=False)


@pytest.mark.extra("plot")
def test_figures_are_written(report, tmp_path):
    from trust_env.training.paper.figures import write_figures

    paths = write_figures(tmp_path / "new" / "folder", report.theorem, report.panels)
    assert sorted(path.name for path in paths) == ["theorem_1.png", "trust_cdc2024.png", "trust_paper.png"]
    assert all(path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and path.stat().st_size > 20_000 for path in paths)


def test_missing_matplotlib_raises_before_anything_is_computed(monkeypatch, tmp_path):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"trust-env\[plot\]"):
        reproduce(tmp_path, progress=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.extra("plot")
def test_a_figure_that_cannot_be_written_is_named_and_leaves_the_old_one(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    def full(self, path):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    monkeypatch.setattr(figures, "theorem_figure", lambda rows: Figure())
    monkeypatch.setattr(figures, "panel_figure", lambda *panels: Figure())
    (tmp_path / "theorem_1.png").write_bytes(b"old")
    with pytest.raises(OSError, match=r"No space left on device: '.*theorem_1\.png'"):
        figures.write_figures(tmp_path, [], {"published": {}, "cdc2024": {}, "paper": {}})
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("theorem_1.png", b"old")]
