"""The page of a report in a browser: its numbers, its controls, its pictures."""

import base64
import io
import json

import numpy as np
import pytest
from browsers import open_browser, open_page
from paths import REFERENCE

from trust_env import training

pytestmark = pytest.mark.extra("browser")

PICTURES = REFERENCE / "report_plots.png"
PLOTS = (
    "heatmap", "intervals", "differences", "distribution", "profile", "damage", "trust", "roc", "track_trust",
    "agent_trust",
)  # fmt: skip
READY = "document.body.dataset.ready === 'true'"


@pytest.fixture(scope="module")
def browser():
    with open_browser() as found:
        yield found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("report")
    scenario = {"base": "trio", "horizon": 20}
    training.evaluate(scenario, "honest,false_positive", "score,trust,majority", 6, 3, out=root / "run", progress=False)
    training.report(root / "run", root / "report.html", cells=1, progress=False)
    return root


@pytest.fixture
def page(browser, folder):
    with open_page(browser, folder / "report.html") as found:
        found.wait_for_function(READY)
        yield found


def column(page, heading):
    cells = page.locator(f"[data-part=cells] [data-heading='{heading}']")
    values = cells.evaluate_all("cells => cells.map(cell => cell.dataset.value)")
    return [None if value == "" else float(value) for value in values]


def data_of(page, name, field):
    """A field of every trace of a plot, as plain lists."""
    code = f"e => e.data.map(trace => trace.{field} === undefined ? null : Array.from(trace.{field}))"
    return page.locator(f"[data-plot={name}]").evaluate(code)


def test_numbers_in_the_table_are_those_of_results_json(page, folder):
    cells = json.loads((folder / "run" / "results.json").read_text())["cells"]
    for heading, metric in (("damage", "damage_per_frame"), ("AUROC", "adversary_auroc")):
        assert column(page, heading) == [(cell["metrics"].get(metric) or {}).get("mean") for cell in cells]


def test_columns_sort_both_ways_by_their_values(page):
    page.click("[data-part=cells] th:has-text('damage')")
    assert column(page, "damage") == sorted(column(page, "damage"), reverse=True)
    page.click("[data-part=cells] th:has-text('damage')")
    assert column(page, "damage") == sorted(column(page, "damage"))
    page.focus("[data-part=cells] th:has-text('attack') button")
    page.keyboard.press("Enter")
    names = page.locator("[data-part=cells] tbody tr td:first-child").all_text_contents()
    assert names == ["false_positive"] * 3 + ["honest"] * 3


def test_the_heat_map_shows_mean_damage(page, folder):
    cells = json.loads((folder / "run" / "results.json").read_text())["cells"]
    means = [cell["metrics"]["damage_per_frame"]["mean"] for cell in cells]
    (shown,) = data_of(page, "heatmap", "z")
    assert np.ravel(shown).tolist() == means


def test_details_begin_with_the_worst_attack_and_follow_the_choice(page, folder):
    assert page.input_value("[data-part=group]") == "attack:1"
    cells = json.loads((folder / "run" / "results.json").read_text())["cells"]
    damage = [cell["metrics"]["damage_per_frame"]["mean"] for cell in cells]
    assert data_of(page, "intervals", "x") == [damage[3:]]
    page.select_option("[data-part=group]", label="honest")
    assert data_of(page, "intervals", "x") == [damage[:3]]
    page.select_option("[data-part=group]", label="majority")
    assert data_of(page, "intervals", "x") == [[damage[2], damage[5]]]


def test_a_line_can_be_left_out_of_all_plots(page):
    assert len(data_of(page, "distribution", "x")) == 3
    page.uncheck("[data-part=lines] label:has-text('score') input")
    assert len(data_of(page, "distribution", "x")) == 2
    assert len(data_of(page, "intervals", "x")[0]) == 2


def test_every_episode_stands_in_the_distribution(page, folder):
    import pyarrow.parquet as pq

    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    expected = [row["damage_per_frame"] for row in rows if row["attack"] == "false_positive"]
    shown = np.concatenate(data_of(page, "distribution", "x"))
    assert shown == pytest.approx(expected, abs=(max(expected) + 1.0) / 131068 + 1e-6)


def test_the_profile_is_the_share_of_episodes_with_more_damage(page, folder):
    import pyarrow.parquet as pq

    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    damage = [[r["damage_per_frame"] for r in rows if (r["attack"], r["defense"]) == ("false_positive", d)]
              for d in ("score", "trust(preset=paper)", "majority")]  # fmt: skip
    xs, ys = data_of(page, "profile", "x"), data_of(page, "profile", "y")
    assert len(xs) == 6  # three bands, three lines
    for values, x, y in zip(damage, xs[3:], ys[3:], strict=True):
        near = np.abs(np.subtract.outer(x, values)).min(axis=1) < 1e-3  # numbers in the page are rounded
        expected = (np.array(values) > np.array(x)[:, None]).mean(axis=1)
        assert np.array(y)[~near] == pytest.approx(expected[~near]) and (~near).sum() > 150
        assert y[0] == 1.0 and y[-1] <= 1 / 6
    low, high = np.array(ys[0][:201]), np.array(ys[0][201:])[::-1]
    low, high = np.minimum(low, high), np.maximum(low, high)
    assert high[0] == 1.0 and low[0] == pytest.approx(1.0 / (1.0 + 1.959964**2 / 6))  # Wilson's interval of 6 of 6


def test_how_often_a_defense_has_less_damage_is_counted_by_pairs(page, folder):
    import pyarrow.parquet as pq

    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    damage = {(row["attack"], row["defense"], row["world"]): row["damage_per_frame"] for row in rows}
    table = page.locator("[data-part=differences] tbody tr")
    for row in table.all():
        cells = [text.strip() for text in row.locator("td").evaluate_all("cells => cells.map(c => c.textContent)")]
        pairs = [(damage[cells[0], cells[1], w], damage[cells[0], "score", w]) for w in range(6)]
        share = sum((mine < other) + 0.5 * (mine == other) for mine, other in pairs) / 6
        assert float(row.locator("td").last.get_attribute("data-value")) == pytest.approx(share)
    assert table.count() == 4


def test_a_table_is_saved_with_all_digits_in_the_order_shown(page, folder):
    import csv

    page.click("[data-part=cells] th:has-text('damage')")
    with page.expect_download() as download:
        page.locator(".scroll:has([data-part=cells]) + .save").click()
    rows = list(csv.DictReader(download.value.path().read_text().splitlines()))
    assert download.value.suggested_filename == "cells.csv"
    assert [float(row["damage"]) for row in rows] == column(page, "damage")
    cells = json.loads((folder / "run" / "results.json").read_text())["cells"]
    written = {(cell["attack"], cell["defense"]): cell["metrics"]["damage_per_frame"]["mean"] for cell in cells}
    assert {(row["attack"], row["defense"]): float(row["damage"]) for row in rows} == written


def test_courses_are_those_of_the_second_file(page, folder):
    import pyarrow.parquet as pq

    table = pq.read_table(folder / "run" / "courses.parquet").to_pylist()
    expected = [row["damage_mean"] for row in table if row["attack"] == "false_positive" and row["defense"] == "score"]
    shown = data_of(page, "damage", "y")[3]  # after a band for each of three
    assert shown == pytest.approx(expected, abs=1e-3)


def test_the_roc_rises_from_nobody_to_everybody(page):
    wrong, right = data_of(page, "roc", "x"), data_of(page, "roc", "y")
    assert len(wrong) == 3  # chance, trust, majority: score has no opinion
    for x, y in zip(wrong, right):
        assert (x[0], y[0], x[-1], y[-1]) == (0, 0, 1, 1)
        assert all(np.diff(x) >= 0) and all(np.diff(y) >= 0)


def test_episodes_are_played_in_the_page(page):
    assert page.locator("#episode option").count() == 3
    assert page.text_content("[data-part=number]").startswith("frame 1 of 20")
    titles = page.locator("[data-part=title]").all_text_contents()
    assert titles[0] in page.locator("#episode option").first.text_content() and "score" in titles and len(titles) == 2
    page.click("[data-part=forward]")
    assert page.text_content("[data-part=number]").startswith("frame 2 of 20")
    page.select_option("#episode", "2")
    page.wait_for_function("document.querySelector('[data-part=number]').textContent.startsWith('frame 1 ')")


def test_keys_move_the_replay_only_where_it_has_the_focus(page):
    page.keyboard.press("End")
    assert page.text_content("[data-part=number]").startswith("frame 1 of 20")
    page.click("[data-part=map]", position={"x": 5, "y": 5})
    page.keyboard.press("End")
    assert page.text_content("[data-part=number]").startswith("frame 20 of 20")


DRAW = """async (element) => {
    if (element.data[0].type === "heatmap") await Plotly.restyle(element, { texttemplate: "", showscale: false });
    await Plotly.relayout(element, {
        margin: { l: 20, r: 60, t: 10, b: 20 }, "xaxis.automargin": false, "yaxis.automargin": false,
        "font.color": "rgba(0, 0, 0, 0)", paper_bgcolor: "white" });
    return Plotly.toImage(element, { format: "png", width: 480, height: 240 });
}"""


def pictures_of(page):
    """All plots below one another, each 120 x 60 pixels; without words and with fixed margins, as fonts differ from
    machine to machine. uint8[60 * plots, 120, 3].
    """
    from PIL import Image

    found = []
    for name in PLOTS:
        url = page.locator(f"[data-plot={name}]").evaluate(DRAW)
        image = Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))).convert("RGB")
        found.append(np.asarray(image.resize((120, 60), Image.Resampling.BOX)))
    return np.concatenate(found)


def differing(pictures):
    """The plots that are not as in the pictures that were looked at."""
    from PIL import Image

    reference = np.asarray(Image.open(PICTURES).convert("RGB")).astype(int)
    difference = np.abs(pictures.astype(int) - reference).reshape(len(PLOTS), -1, 3)
    off = (difference.mean(axis=(1, 2)) > 0.4) | ((difference.max(axis=2) > 60).mean(axis=1) > 0.004)
    return {name for name, differs in zip(PLOTS, off, strict=True) if differs}


def test_plots_look_as_they_did(page):
    assert differing(pictures_of(page)) == set()


def test_pictures_show_when_a_line_is_missing(page):
    page.uncheck("[data-part=lines] label:has-text('trust') input")
    assert differing(pictures_of(page)) == set(PLOTS) - {"heatmap"}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_400_pixels_in_the_colours_of_the_scheme(browser, folder, scheme):
    with open_page(browser, folder / "report.html", 400, scheme) as page:
        page.wait_for_function(READY)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        ink = page.locator("[data-plot=damage]").evaluate("e => e._fullLayout.font.color")
        assert ink == {"light": "#1b2432", "dark": "#e6eaf0"}[scheme]


def test_plots_change_colours_with_the_scheme(page):
    page.emulate_media(color_scheme="dark")
    page.wait_for_function("document.querySelector('[data-plot=damage]')._fullLayout.font.color === '#e6eaf0'")
