"""`rank --search`: what is searched under which threat model, what is kept, and what the quick ranking plays of it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from folder_runs import RANK_QUICK, RANK_SEARCH, VERSION, FolderRun, kill, played_in_peace

from trust_env import training
from trust_env.agents import build_policy, parse_policy
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.training.evaluation.statistics import paired_mean_difference
from trust_env.training.learning.configuration import VALIDATION_SEEDS
from trust_env.training.ranking.version import SearchedAttacks, load_version, searched_file, version_file

WORLD = "trio(horizon=30)"


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """The file of a version that was searched, the folder of the searches, and their outcome."""
    place = tmp_path_factory.mktemp("search")
    file = place / "tiny.yaml"
    file.write_text(VERSION)
    return file, place / "run", training.search_attacks(str(file), place / "run", progress=False)


def damage_by_attack(threat: str, attacks: list[str]) -> dict:
    """By episode, in the validation episodes of the version."""
    version = load_version(str(version_file("1")))
    world = version.world(WORLD, next(model for model in version.threat_models if model.label == threat))
    results = training.evaluate(world, attacks, "trust", 20, VALIDATION_SEEDS + 3, progress=False)
    return {cell.attack: cell.metrics["damage_per_frame"] for cell in results.cells}


class TestSearch:
    def test_each_attack_is_searched_where_it_can_first_be_played_and_one_that_plays_others_where_there_are_more(
        self, searched
    ):
        names = [key.rpartition(f"{WORLD}, ")[2] for key in searched[2].outcomes]
        own = ["false_positive", "outward", "suppress", "steal", "sleeper"]
        poses = ["sleeper", "fov_aware", "by_turns"]
        assert names == [*(f"own@1, {name}" for name in own), *(f"poses@1, {name}" for name in poses)]

    def test_what_is_kept_is_stronger_than_all_others_of_its_name_in_validation_episodes(self, searched):
        file, _, found = searched
        kept = {(one.threat, one.given): one for one in found.kept}
        earlier = list(load_version(str(file)).attacks)
        for key, outcome in found.outcomes.items():
            threat, _, name = key.rpartition(f"{WORLD}, ")[2].partition(", ")
            rivals = [name, *(attack for attack in earlier if parse_policy(attack).name == name)]
            damage = damage_by_attack(threat, list(dict.fromkeys([outcome["attack"], *rivals])))
            margins = [paired_mean_difference(damage[outcome["attack"]], damage[rival]) for rival in rivals]
            stronger = min(margin.low for margin in margins if margin) > 0.0
            assert stronger == ((threat, name) in kept)
            if stronger:
                one = kept[threat, name]
                assert (one.attack, one.damage) == (outcome["attack"], damage[one.attack].mean())
                assert one.damage_of_others == max(damage[rival].mean() for rival in rivals)
                earlier.append(one.attack)
        assert 0 < len(kept) < len(found.outcomes)

    def test_the_file_beside_the_version_is_read_with_it(self, searched):
        file, _, found = searched
        assert found.file == file.with_name("tiny_searched.yaml") == searched_file(str(file))
        version = load_version(str(file))
        assert version.searched == found.kept
        assert set(version.attacks_on(WORLD)) == {*version.attacks, *(one.attack for one in found.kept)}
        assert version.attacks_on("patrol") == list(version.attacks)

    def test_searches_that_are_finished_are_not_repeated_and_the_end_is_the_same(self, searched, tmp_path):
        file, folder, found = searched
        shutil.copytree(folder, tmp_path / "run")
        shutil.copy(file, tmp_path / "tiny.yaml")
        finished = tmp_path / "run" / "parts" / "trio_horizon_30" / "own@1" / "finished.json"
        fields = json.loads(finished.read_text())
        del fields["searches"]["steal"]
        fields["searches"]["outward"]["seconds"] = 1234.0
        finished.write_text(json.dumps(fields))
        again = training.search_attacks(str(tmp_path / "tiny.yaml"), tmp_path / "run", resume=True, progress=False)
        assert again.outcomes[f"{WORLD}, own@1, outward"]["seconds"] == 1234.0
        assert again.kept == found.kept and again.file.read_bytes() == found.file.read_bytes()

    def test_a_changed_version_and_a_folder_in_use_are_refused(self, searched, tmp_path):
        file, folder, _ = searched
        with pytest.raises(ValueError, match="--resume to continue the search in it"):
            training.search_attacks(str(file), folder, progress=False)
        changed = tmp_path / "tiny.yaml"
        changed.write_text(VERSION.replace("population: 6", "population: 7"))
        with pytest.raises(ValueError, match="population is 6 there, 7 here"):
            training.search_attacks(str(changed), folder, resume=True, progress=False)
        with pytest.raises(ValueError, match="expected out"):
            training.search_attacks(str(changed))

    def test_a_wrong_file_of_searched_attacks_is_refused(self, tmp_path):
        (tmp_path / "a.yaml").write_text(VERSION)
        (tmp_path / "a_searched.yaml").write_text("searched: []\n")
        with pytest.raises(ValueError, match="search"):
            load_version(str(tmp_path / "a.yaml"))


class TestQuick:
    def test_it_plays_what_was_found_under_the_threat_model_that_it_needs(self, searched):
        file, _, found = searched
        ranking = training.rank(version=str(file), only="score", progress=False)
        for row in ranking.rows:
            playable = [one.attack for one in found.kept if row["threat"] == "poses@1" or one.threat == "own@1"]
            assert set(playable) <= set(row["damage"])
        poses = [one.attack for one in found.kept if getattr(build_policy(one.attack), "knowledge", "own") == "poses"]
        own_rows = [row for row in ranking.rows if row["threat"] == "own@1"]
        assert poses and not any(attack in row["damage"] for row in own_rows for attack in poses)

    def test_an_attack_that_the_list_holds_is_not_played_twice(self, searched):
        file, _, found = searched
        again = training.rank(version=str(file), attacks=[found.kept[0].attack], only="score", progress=False)
        assert all(list(row["damage"]).count(found.kept[0].attack) == 1 for row in again.rows)


@pytest.mark.parametrize("run", [RANK_QUICK, RANK_SEARCH], ids=["quick", "search"])
def test_a_ranking_that_is_killed_ends_in_the_same_bits(run: FolderRun, tmp_path: Path):
    """kill -9 at the start, after some parts, and just after another one."""
    whole, seconds = played_in_peace(run, tmp_path / "whole")
    survived = [kill(run, tmp_path / "out", count, delay) for count, delay in ((0, seconds / 4), (2, 0.1), (5, 0.0))]
    assert survived == sorted(survived) and 2 <= survived[1] < len(whole)
    assert played_in_peace(run, tmp_path / "out")[0] == whole


class TestCommand:
    def test_it_writes_the_file_and_says_where(self, tmp_path, cli):
        short = VERSION.replace("false_positive, outward, suppress, steal, fov_aware, by_turns, sleeper", "suppress")
        (tmp_path / "a.yaml").write_text(short)
        code, out, err = cli("rank", "--search", "--version", tmp_path / "a.yaml", "--out", tmp_path / "run", "--json")
        assert code == 0, err
        found = json.loads(out)
        assert found["file"] == str(tmp_path / "a_searched.yaml")
        assert list(found["outcomes"]) == [f"{WORLD}, own@1, suppress"]
        fields = read_yaml((tmp_path / "a_searched.yaml").read_text(), "")[0]
        assert fields["searched"] == found["searched"] and fields["search"]["defense"] == "trust"

    def test_it_is_of_a_whole_version(self, tmp_path, cli):
        code, _, err = cli("rank", "--search", "--only", "trust", "--out", tmp_path)
        assert code == 2 and "it is of a whole version" in " ".join(err.split())
        assert "expected out" in cli("rank", "--search")[2]


class TestPublished:
    def test_version_1_was_searched_under_its_budget_in_all_scenarios(self):
        version, file = load_version("1"), searched_file("1")
        found = SearchedAttacks.model_validate(read_yaml(file.read_text(), file.name)[0])
        assert found.search == version.search and found.searched == version.searched
        assert {one.scenario for one in found.searched} == set(version.scenarios)
        assert all(one.damage > one.damage_of_others for one in found.searched)
