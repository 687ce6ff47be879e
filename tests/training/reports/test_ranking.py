"""Reports on rankings: their rows, in their order, with the numbers of their files."""

import json
import shutil

import pytest
from browsers import open_browser, open_page
from paths import ROOT

from trust_env import training
from trust_env.training.ranking.ranking import load_ranking
from trust_env.training.reports.ranking import ranking_section

PUBLISHED = ROOT / "rankings" / "v1"


@pytest.fixture(scope="module")
def ranking():
    return load_ranking(PUBLISHED / "quick.json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The published quick ranking alone, and the report on it."""
    root = tmp_path_factory.mktemp("ranking")
    shutil.copy(PUBLISHED / "quick.json", root)
    training.report(root, root / "report.html", progress=False)
    return root


def test_what_is_published_is_reported_quick_and_full():
    quick, full = (ranking_section(PUBLISHED / f"{kind}.json") for kind in ("quick", "full"))
    assert (quick["order"], full["order"], len(full["groups"])) == ("quick", "full", 2)
    for section in (quick, full):  # on one map stand the attacks that all defenses have met
        for group in section["groups"]:
            assert {"honest", "outward"} < set(group["attacks"])
            assert {len(values) for values in group["damage"]} == {len(group["rows"])}
    assert not any(attack.startswith("by_turns(per_slot=4, spacing=37.0") for attack in full["groups"][0]["attacks"])


def test_every_row_stands_in_its_group_from_the_least_damage_to_the_most(ranking):
    section = ranking_section(PUBLISHED / "quick.json")
    assert len(section["groups"]) == 4
    for group, (scenario, threat, rows) in zip(section["groups"], ranking.groups(), strict=True):
        assert (group["scenario"], group["threat"]) == (scenario, threat)
        assert [row["defense"] for row in group["rows"]] == [row["defense"] for row in rows]
        for shown, row in zip(group["rows"], rows, strict=True):
            values = [cell["value"] for cell in shown["cells"]]
            assert values[:2] == [row["worst"]["mean"]["value"], row["worst"]["worst_decile"]["value"]]
            assert values[2:5] == [
                (row["placed"] or {}).get("value"),
                row["mean"]["value"],
                row["honest"]["mean"]["value"],
            ]
            assert values[5] == row["false_accusations"] and values[8] == row["time_ratio"]
        for j, row in enumerate(rows):
            assert {a: group["damage"][i][j] for i, a in enumerate(group["attacks"])} == row["damage"]


def test_a_folder_of_rank_is_reported_with_what_was_played(cli, folder, tmp_path):
    ranking = json.loads((PUBLISHED / "quick.json").read_text())
    ranking["options"] = {"defense": ["a b.py:Mine"], "only": ["score"]}
    (tmp_path / "full.json").write_text(json.dumps(ranking))
    found = training.report([folder, tmp_path], tmp_path / "a.html", progress=False)
    assert [section["kind"] for section in found["sections"]] == ["ranking", "ranking"]
    assert found["sections"][1]["command"] == "trust-env rank --quick --defense 'a b.py:Mine' --only score --out RUN"
    assert found["title"] == found["sections"][0]["scenario"] == "patrol, trio"
    del ranking["rows"][0]["damage"]
    (tmp_path / "full.json").write_text(json.dumps(ranking))
    code, _, err = cli("report", tmp_path, "--out", tmp_path / "b.html")
    assert code == 2 and "full.json: not as this version writes it: KeyError 'damage'" in err


@pytest.mark.extra("browser")
def test_the_page_plots_and_sorts_what_the_file_says(folder, ranking):
    rows = next(ranking.groups())[2]
    with open_browser() as browser, open_page(browser, folder / "report.html") as page:
        page.wait_for_function("document.body.dataset.ready === 'true'")
        plotted = page.locator("[data-plot=worst-0]").evaluate("e => Array.from(e.data.at(-1).x)")
        assert plotted == [row["worst"]["mean"]["value"] for row in rows]
        placed = page.locator("[data-plot=placed-0]").evaluate("e => Array.from(e.data.at(-1).x)")
        assert placed == [row["placed"]["value"] for row in rows]
        table = page.locator("[data-part=ranks]").first
        table.locator("th:has-text('time')").click()
        names = table.locator("tbody td:first-child").all_text_contents()
        assert names == [row["defense"] for row in sorted(rows, key=lambda row: -row["time_ratio"])]
        page.locator("summary:has-text('Every attack')").first.click()
        page.wait_for_function("document.querySelector('[data-plot=attacks-0]').data")
        shown = page.locator("[data-plot=attacks-0]").evaluate("e => Array.from(e.data[0].z, row => Array.from(row))")
        assert [values[0] for values in shown] == list(rows[0]["damage"].values())


@pytest.mark.extra("browser")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_ranking_fits_400_pixels(folder, scheme):
    with open_browser() as browser, open_page(browser, folder / "report.html", 400, scheme) as page:
        page.wait_for_function("document.body.dataset.ready === 'true'")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        damage = page.locator("[data-part=ranks] tbody td:nth-child(3)").first.bounding_box()
        assert damage["x"] + damage["width"] <= 400
