"""The page of a replay in a browser: what its controls do, and what stands on its maps."""

import base64
import io

import numpy as np
import pyarrow.parquet as pq
import pytest
from browsers import open_browser, open_page
from paths import ROOT

from trust_env import training

pytestmark = pytest.mark.extra("browser")

TRIO = {"base": "trio", "horizon": 30}
INJECTED = (214, 0, 170)
REFERENCE = ROOT / "tests" / "reference" / "replay_map.png"


@pytest.fixture(scope="module")
def browser():
    with open_browser() as found:
        yield found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("replay")


@pytest.fixture(scope="module")
def played(folder):
    """The recordings of a row under two defenses; their page is `a.html`."""
    training.evaluate(TRIO, "false_positive", "trust,score", 2, 1, out=folder / "run", progress=False)
    return training.replay(folder / "run", 1, beside="score", out=folder / "a.html")


@pytest.fixture
def page(browser, folder, played):
    with open_page(browser, folder / "a.html") as found:
        found.wait_for_function("document.querySelector('[data-part=number]').textContent.startsWith('frame 1 ')")
        yield found


def frame_of(page):
    return int(page.text_content("[data-part=number]").split()[1])


def test_keys_move_through_the_frames(page):
    frames, right, left = [], "ArrowRight", "ArrowLeft"
    for key in (right, right, left, "PageDown", "End", right, "PageUp", "Home", left):
        page.keyboard.press(key)
        frames.append(frame_of(page))
    assert frames == [2, 3, 2, 12, 30, 30, 20, 1, 1]


def test_it_plays_pauses_and_stops_at_the_end(page):
    page.keyboard.press("Space")
    page.wait_for_function("Number(document.querySelector('[data-part=frame]').value) >= 4")
    assert "Pause" in page.text_content("[data-part=play]")
    page.keyboard.press("Space")
    assert "Play" in page.text_content("[data-part=play]")
    here = frame_of(page)
    page.wait_for_timeout(400)
    assert frame_of(page) == here < 30
    page.select_option("[data-part=speed]", "8")
    page.click("[data-part=play]")
    page.wait_for_function("document.querySelector('[data-part=play]').textContent.includes('Play')")
    assert frame_of(page) == 30


def test_speed_changes_by_keys(page):
    speeds = []
    for key in ("+", "+", "-", "-", "-", "-", "-"):
        page.keyboard.press(key)
        speeds.append(page.input_value("[data-part=speed]"))
    assert speeds == ["2", "4", "2", "1", "0.5", "0.25", "0.25"]


def test_scrubbing_and_clicking_a_chart_go_to_a_frame(page):
    page.fill("[data-part=frame]", "17")
    assert frame_of(page) == 17
    box = page.locator("[data-part=history]").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] - 8, box["y"] + 40)
    assert frame_of(page) == 30


def test_both_defenses_tell_the_numbers_of_the_same_frame(page, played):
    page.fill("[data-part=frame]", "20")
    told = page.locator("[data-part=now]").all_text_contents()
    for recording, text in zip(played, told, strict=True):
        metrics = recording.scenes[19].metrics
        assert f"picture {metrics['published_tracks']:.0f}, false {metrics['false_tracks']:.0f}" in text
        assert f"missing {metrics['missing_targets']:.0f} of {metrics['visible_targets']:.0f}" in text


def test_metrics_in_the_page_are_those_of_the_rows(page, folder, played):
    rows = pq.read_table(folder / "run" / "results.parquet").to_pylist()
    for name in played[0].metrics:
        shown = page.locator(f"[data-metric={name}]").all_text_contents()
        assert [None if text == "–" else float(text) for text in shown] == [rows[1][name], rows[3][name]]


def pixel_of(recording, size, position):
    """Where a position (m) lies on a map of `size` pixels, as the camera of the environment's own pictures has it."""
    x_min, x_max, y_min, y_max = recording.scenes[0].extent
    scale = size / max(x_max - x_min, y_max - y_min)
    return (
        size / 2 + (position[0] - (x_min + x_max) / 2) * scale,
        size / 2 - (position[1] - (y_min + y_max) / 2) * scale,
    )


def test_a_click_chooses_an_agent_in_both_or_a_track_in_one(page, played):
    page.keyboard.press("End")
    box = page.locator("[data-part=map]").first.bounding_box()
    first = played[0]
    x, y = pixel_of(first, box["width"], first.scenes[0].agents[1].position)
    page.mouse.click(box["x"] + x, box["y"] + y)
    told = page.locator("[data-part=chosen]").all_text_contents()
    agent = first.scenes[-1].agents[1]
    assert told[0] == f"{agent.name}: trust {agent.trust:.2f} ± {agent.trust_std:.2f}"
    assert told[1] == f"{agent.name}: no opinion"
    places = [a.position for a in first.scenes[0].agents]
    tracks = [t for t in first.scenes[-1].tracks if t.kind != "tentative"]
    alone = max(tracks, key=lambda t: min(np.hypot(*(t.position - p)) for p in places))
    x, y = pixel_of(first, box["width"], alone.position)
    page.mouse.click(box["x"] + x, box["y"] + y)
    told = page.locator("[data-part=chosen]").all_text_contents()
    assert told[0].startswith(f"track {alone.id}: ") and f"trust {alone.trust:.2f}" in told[0]
    assert told[1] == ""
    page.keyboard.press("Escape")
    assert page.locator("[data-part=chosen]").all_text_contents() == ["", ""]


def test_what_a_click_finds_can_be_chosen_without_a_pointer(page):
    options = page.locator("[data-part=look] option").all_text_contents()
    assert options[:4] == ["nothing chosen", "adversary_0", "benign_0", "benign_1"]
    assert any(option.startswith("track ") for option in options)
    before = page.locator("[data-part=history]").first.bounding_box()["height"]
    page.select_option("[data-part=look]", label="benign_1")
    assert page.locator("[data-part=history]").first.bounding_box()["height"] > before + 200


def map_of(page):
    """The first map's pixels, uint8[H, W, 3]."""
    from PIL import Image

    url = page.evaluate("document.querySelector('[data-part=map]').toDataURL()")
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))).convert("RGB"))


def test_injections_stand_on_the_map_where_they_were_reported(page, played):
    page.fill("[data-part=frame]", "12")
    page.uncheck("[data-layer=labels]")
    image, scene = map_of(page), played[0].scenes[11]
    injected = [d for d in scene.detections if d.kind == "injected"]
    assert injected
    for detection in injected:
        x, y = (round(number) for number in pixel_of(played[0], image.shape[1], detection.position))
        near = image[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3).astype(int)
        assert np.abs(near - INJECTED).sum(axis=1).min() < 60
    page.uncheck("[data-layer=detections]")
    assert not np.array_equal(map_of(page), image)


def test_trails_of_tracks_lead_to_where_they_are(page, played):
    page.fill("[data-part=frame]", "25")
    page.uncheck("[data-layer=labels]")
    without = map_of(page)
    page.check("[data-layer=tracks]")
    changed = (map_of(page) != without).any(axis=2)
    tracks = {t.id: t.position for t in played[0].scenes[24].tracks}
    before = {t.id: t.position for t in played[0].scenes[20].tracks}
    leading = [(before[i], tracks[i]) for i in tracks if i in before and np.hypot(*(tracks[i] - before[i])) > 15.0]
    assert leading
    for start, _ in leading:
        x, y = (round(number) for number in pixel_of(played[0], without.shape[1], start))
        assert changed[y - 4 : y + 5, x - 4 : x + 5].any()


def test_the_map_looks_as_it_did(page):
    """Against a picture that was looked at; labels are left out, as their fonts differ from machine to machine."""
    from PIL import Image

    page.fill("[data-part=frame]", "25")
    page.uncheck("[data-layer=labels]")
    small = np.asarray(Image.fromarray(map_of(page)).resize((160, 160), Image.Resampling.BOX)).astype(int)
    reference = np.asarray(Image.open(REFERENCE).convert("RGB")).astype(int)
    difference = np.abs(small - reference)
    assert difference.mean() < 2.0 and (difference.max(axis=2) > 60).mean() < 0.01


def test_zoom_shows_less_and_then_everything_again(page):
    whole = map_of(page)
    page.keyboard.press("z")
    assert not np.array_equal(map_of(page), whole)
    page.keyboard.press("x")
    assert np.array_equal(map_of(page), whole)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_400_pixels_and_follows_the_colour_scheme(browser, folder, played, scheme):
    with open_page(browser, folder / "a.html", 400, scheme) as page:
        page.wait_for_selector("[data-part=map]")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        corner = map_of(page)[2, 2].mean()
        assert corner > 200 if scheme == "light" else corner < 60


def test_sixteen_agents_and_sixty_targets_are_drawn_smoothly(browser, tmp_path):
    scenario = {
        "base": "patrol", "horizon": 40, "team": {"n_adversaries": 4, "n_benign": 12},
        "targets": {"slots": 60, "initial": 1.0, "birth_rate": 1.0, "death_rate": 0.0},
    }  # fmt: skip
    (found,) = training.replay(scenario=scenario, attack="false_positive", defense="trust", out=tmp_path / "a.html")
    assert len(found.scenes[0].targets) == 60
    with open_page(browser, tmp_path / "a.html") as page:
        page.wait_for_selector("[data-part=map]")
        # 40 frames at four times the speed last a second; what is too slow to draw makes it longer.
        page.select_option("[data-part=speed]", "4")
        page.click("[data-part=play]")
        page.wait_for_function("document.querySelector('[data-part=play]').textContent.includes('Play')", timeout=8000)
        milliseconds = page.evaluate(
            "() => { const begin = performance.now(); for (let i = 0; i < 20; i++) "
            "document.querySelector('[data-part=back]').click(); return (performance.now() - begin) / 20; }"
        )
        assert milliseconds < 50  # a frame lasts 100 at speed 1
