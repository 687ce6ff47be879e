"""Replays: the very episode of a row, or one that is described, and what is kept of it."""

import json
import re

import numpy as np
import pyarrow.parquet as pq
import pytest

import trust_env
from trust_env import training
from trust_env.agents import Player
from trust_env.metrics import METRICS
from trust_env.training.replays.episode import Run
from trust_env.training.replays.recording import EXPECTED, HIT

TRIO = {"base": "trio", "horizon": 25}
OWN_DEFENSE = """
from trust_env import Verdict
class Mine:
    def reset(self, shape, worlds): pass
    def update(self, evidence): return Verdict()
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two attacks, one of which needs more knowledge than the scenario gives, against two defenses."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    training.evaluate(TRIO, "false_positive,fov_aware", "score,trust", 3, 7, out=folder, progress=False)
    return folder


def test_every_row_of_a_run_comes_out_to_the_bit(run):
    rows = pq.read_table(run / "results.parquet").to_pylist()
    assert len(rows) == 12
    for number, row in enumerate(rows):
        (found,) = training.replay(run, number)
        assert (found.episode.attack, found.episode.defense) == (row["attack"], row["defense"])
        same = [found.metrics[name] == row[name] or row[name] is None for name in found.metrics]
        assert all(same) and found.metrics["gospa"] == row["gospa"]


def test_a_row_that_comes_out_otherwise_is_an_error_that_names_the_metric(run, tmp_path):
    table = pq.read_table(run / "results.parquet")
    values = table["gospa"].to_pylist()
    values[4] = np.nextafter(values[4], np.inf)
    place = table.schema.get_field_index("gospa")
    pq.write_table(table.set_column(place, "gospa", [values]), tmp_path / "results.parquet")
    training.replay(tmp_path, 3)
    with pytest.raises(ValueError, match=re.escape("false_positive x trust(preset=paper), world 1: gospa is")):
        training.replay(tmp_path, 4)


def test_another_defense_beside_plays_the_same_episode(run):
    first, second = training.replay(run, 2, beside="trust")
    row = pq.read_table(run / "results.parquet").to_pylist()[5]
    assert (row["defense"], row["world"]) == (second.episode.defense, 2) == ("trust(preset=paper)", 2)
    assert second.episode.metrics.items() <= row.items()
    (third,) = training.replay(run, 2, beside="majority")[1:]
    assert not third.episode.metrics
    for a, b, c in zip(first.scenes, second.scenes, third.scenes):
        places = [[target.position.tolist() for target in scene.targets] for scene in (a, b, c)]
        assert places[0] == places[1] == places[2]


def test_an_episode_can_be_described_in_place_of_a_row(run):
    (of_row,) = training.replay(run, 5)
    (described,) = training.replay(scenario=TRIO, attack="false_positive", defense="trust", seed=7, world=2)
    assert {n: v for n, v in described.metrics.items() if not np.isnan(v)} == {
        n: v for n, v in of_row.metrics.items() if not np.isnan(v)
    }


def test_a_recording_holds_what_the_world_held_in_every_frame():
    (found,) = training.replay(scenario=TRIO, attack="false_positive", defense="trust", seed=3)
    env = trust_env.parallel_env(TRIO, "trust")
    observations, _ = env.reset(seed=3, options={"world": 0, "episode": 0})
    player = Player(env, {"adversary": "false_positive"})
    for t in range(25):
        observations = env.step(player.actions(observations))[0]
        a, columns = env.arrays, np.flatnonzero(env.arrays.track_status[0])
        assert [track.id for track in found.scenes[t].tracks] == a.track_id[0, columns].tolist()
        assert found.scores[t].tolist() == a.track_score[0, columns].tolist()
        bits = found.evidence[t]
        assert (bits & EXPECTED > 0).tolist() == a.expected[0][:, columns].T.tolist()
        assert (bits & HIT > 0).tolist() == a.hit[0][:, columns].T.tolist()
        assert found.targets[t].tolist() == np.flatnonzero(a.scored_alive[0]).tolist()


def test_a_user_s_code_runs_only_when_named(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(OWN_DEFENSE)
    name = f"{file}:Mine"
    training.evaluate(TRIO, "honest", [name], 1, out=tmp_path / "run", progress=False)
    with pytest.raises(ValueError, match="code of yours, which a run does not start"):
        training.replay(tmp_path / "run", 0)
    assert training.replay(tmp_path / "run", 0, defense=name)
    file.write_text(OWN_DEFENSE + "\n# changed\n")
    with pytest.raises(ValueError, match="not as it was when"):
        training.replay(tmp_path / "run", 0, defense=name)


def test_a_run_with_recorded_trajectories_needs_them_again(tmp_path):
    rows = [f"{t},{name},{x + 100 * t},{y}" for t in range(0, 300, 10) for name, x, y in (("a", 0, 0), ("b", 0, 9000))]
    data = tmp_path / "traffic.csv"
    data.write_text("\n".join(["t,id,x,y", *rows]) + "\n")
    training.evaluate("skies", "honest", "score", 1, data=data, out=tmp_path / "run", progress=False)
    with pytest.raises(ValueError, match="expected them as --data FILE"):
        training.replay(tmp_path / "run", 0)
    assert training.replay(tmp_path / "run", 0, data=data)
    data.write_text("t,id,x,y\n0,a,0,0\n10,a,1,1\n")
    with pytest.raises(ValueError, match="not as it was when"):
        training.replay(tmp_path / "run", 0, data=data)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"row": 12}, "row = 12: expected a whole number from 0 to 11"),
        ({}, "row: expected a row of"),
        ({"row": 0, "scenario": "patrol"}, "scenario: .* says that"),
        ({"row": 0, "out": "episode.mp4"}, "expected a name that ends in .html or .gif"),
        ({"row": 0, "beside": "trustt"}, "did you mean 'trust'"),
    ],
)
def test_wrong_input_is_refused_before_anything_is_played(run, arguments, text):
    with pytest.raises(ValueError, match=text):
        training.replay(run, **arguments)


def test_results_of_another_version_are_refused(run, monkeypatch):
    monkeypatch.setitem(trust_env.parallel_env("trio").metadata, "name", "trust_env_v9")
    with pytest.raises(ValueError, match="which trust_env_v9 cannot repeat"):
        Run(run)


def test_the_program_writes_a_page_and_says_what_came_out(cli, run, tmp_path):
    code, out, err = cli("replay", run, "--row", "4", "--beside", "score", "--out", tmp_path / "a.html")
    assert code == 0, err
    assert out.count("as in its row") == 2
    page = (tmp_path / "a.html").read_text()
    assert "http" not in page.replace("http://www.w3.org", "")  # nothing comes from the network
    assert len(page) < 300_000
    code, out, _ = cli("replay", run, "--row", "4", "--out", tmp_path / "b.html", "--json")
    (summary,) = json.loads(out)
    assert summary["metrics"] == {n: pq.read_table(run / "results.parquet")[n][4].as_py() for n in METRICS}
    code, _, err = cli("replay", tmp_path, "--row", "4")
    assert code == 2 and "there is no results.parquet in it" in err


@pytest.mark.extra("render")
@pytest.mark.extra("plot")
def test_a_gif_has_an_image_for_every_frame_of_both_defenses(tmp_path):
    from PIL import Image

    file = tmp_path / "a.gif"
    training.replay(scenario=TRIO, attack="random", defense="trust", beside="score", max_cycles=4, out=file)
    with Image.open(file) as image:
        assert (image.size, image.n_frames) == ((1980, 720), 4)
        assert image.info["duration"] == 100
