"""`rank`: rows worked out by hand, what joins a ranking, what goes on, and what `--check` finds."""

from __future__ import annotations

import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from paths import ROOT

from trust_env import training
from trust_env.agents import build_policy
from trust_env.defenses import DEFENSES, build_defense, named_in_full
from trust_env.metrics import METRICS
from trust_env.metrics.forecast_scores import N_BINS
from trust_env.training.evaluation.cell import Cell
from trust_env.training.exploitation.threat_models import threat_model
from trust_env.training.published.ranking_summary import summary
from trust_env.training.ranking.cells import Cells, split
from trust_env.training.ranking.check import check_ranking
from trust_env.training.ranking.rank import check
from trust_env.training.ranking.ranking import Ranking, load_ranking
from trust_env.training.ranking.row import row
from trust_env.training.ranking.version import load_version

TINY = """
version: 1
scenarios: ["trio(horizon=12)"]
threats: [own@1, poses@1]
seed: 3
attacks: [honest, false_positive, outward, fov_aware]
more_attacks: {}
defenses: [score, quorum]
references: [oracle, blank]
quick: {validation: 2, episodes: 4}
search: {defense: score, generations: 1, population: 2, episodes: 2, validation: 3}
full:
  {threats: [own@1, poses@1], validation: 2, episodes: 3, generations: 2, population: 2, search_episodes: 2,
   screening: 1, advancing: 1, seeds: 0, training: {}}
"""
PUBLISHED, FULL = (ROOT / "rankings" / "v1" / f"{kind}.json" for kind in ("quick", "full"))
TEMPLATE = ROOT / "rankings" / "entries" / "template"
OUTWARD = "from trust_env.agents.attacks.outward import Outward\n\n\nclass Theirs(Outward):\n    name = 'theirs'\n"


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    file = tmp_path_factory.mktemp("rank") / "tiny.yaml"
    file.write_text(TINY)
    return str(file)


@pytest.fixture(scope="module")
def played(tiny, tmp_path_factory):
    """A tiny ranking, and its folder."""
    folder = tmp_path_factory.mktemp("rank") / "run"
    return training.rank(version=tiny, out=folder, progress=False), folder


def untimed(ranking: Ranking) -> list[dict]:
    return [{name: value for name, value in row.items() if name != "time_ratio"} for row in ranking.rows]


def set_damage(file: Path, damage: float) -> None:
    """Change the damage of all episodes in a results.parquet."""
    table = pq.read_table(file)
    at = table.schema.get_field_index("damage_per_frame")
    column = pa.array(np.full(table.num_rows, damage))
    pq.write_table(table.set_column(at, table.schema.field(at), column), file)


class TestVersion:
    def test_version_1_can_be_played_and_lists_every_built_in_defense(self):
        version = load_version("1")
        listed = [*version.defenses, *version.references]
        assert {name.partition("(")[0] for name in listed} == set(DEFENSES)
        for name in listed:
            build_defense(name)
        for scenario in version.scenarios:
            shares = [version.needing(version.attacks_on(scenario), model) for model in version.threat_models]
            assert sorted(attack for share in shares for attack in share) == sorted(version.attacks_on(scenario))
            for model in version.threat_models:
                world = version.world(scenario, model)
                assert world.knowledge == model.knowledge and "adversary" in world.roles

    def test_threat_models_of_a_version_differ_in_what_is_observed_only(self):
        models = load_version("1").threat_models
        same = {(m.share, m.coordination, m.injections, m.suppressions) for m in models}
        assert len(same) == 1 and [m.label for m in models] == ["own@1", "poses@1"]

    def test_an_attack_belongs_to_the_least_threat_model_that_observes_enough(self):
        version = load_version("1")
        own, poses = version.threat_models
        assert version.needing(["by_turns", "outward"], own) == ["outward"]
        assert version.needing(["by_turns", "outward"], poses) == ["by_turns"]

    def test_unknown_versions_and_fields_are_refused(self, tmp_path):
        with pytest.raises(ValueError, match="version = 7: expected a number from 1 to 1"):
            load_version("7")
        file = tmp_path / "wrong.yaml"
        file.write_text(TINY.replace("seed: 3", "sede: 3"))
        with pytest.raises(ValueError, match="sede"):
            load_version(str(file))


def cells(attack: str, chosen_by: float, damage: list[float]) -> Cells:
    """Cells of given damage, nobody accused in every other episode, no forecasts."""

    def cell(values: list[float]) -> Cell:
        metrics = {name: np.full(len(values), np.nan) for name in METRICS}
        metrics["damage_per_frame"] = np.array(values)
        metrics["false_accusation_rate"] = np.arange(len(values)) % 2.0
        none = np.zeros((len(values), 3, N_BINS))
        return Cell(attack, "score", metrics, {"track_trust": none, "agent_trust": none, "existence": none}, ())

    return Cells(cell([chosen_by]), cell(damage))


class TestRow:
    def test_numbers_worked_out_by_hand(self):
        """`drag` is worst where attacks are chosen, though `outward` does more in the reported episodes; `theirs`
        joined, so the mean is of (1 + 4) / 2 and (3 + 4) / 2. Between 1 and 5, drag's 2 stands at 1/4.
        """
        version = load_version("1")
        found = {
            "honest": cells("honest", 0.0, [0.0, 1.0]),
            "drag": cells("drag", 9.0, [1.0, 3.0]),
            "outward": cells("outward", 5.0, [4.0, 4.0]),
            "mine.py:Theirs": cells("mine.py:Theirs", 1.0, [50.0, 50.0]),
        }
        between = {
            "oracle": {"drag": cells("drag", 0.0, [1.0, 1.0])},
            "blank": {"drag": cells("drag", 0.0, [5.0, 5.0])},
        }
        made = row(version, "patrol", threat_model("own@1"), "score", found, between, 1.0)
        assert made.worst_attack == "drag" and made.worst.mean.value == 2.0 and made.worst.worst_decile.value == 3.0
        assert made.honest.mean.value == 0.5 and made.mean.value == 3.0
        assert made.placed is not None and made.placed.value == 0.25
        assert made.false_accusations == 0.5 and made.calibration == {}
        assert made.damage == {"honest": 0.5, "drag": 2.0, "outward": 4.0, "mine.py:Theirs": 50.0}

    def test_a_stronger_attack_that_joins_becomes_the_worst(self):
        found = {name: cells(name, chosen_by, [chosen_by]) for name, chosen_by in
                 {"honest": 0.0, "drag": 2.0, "mine.py:Theirs": 3.0}.items()}  # fmt: skip
        between = {name: {"mine.py:Theirs": cells("mine.py:Theirs", 0.0, [1.0])} for name in ("oracle", "blank")}
        made = row(load_version("1"), "patrol", threat_model("own@1"), "score", found, between, 1.0)
        assert made.worst_attack == "mine.py:Theirs" and made.worst.mean.value == 3.0 and made.mean.value == 2.0
        assert made.placed is None  # oracle and blank are the same here

    def test_the_first_episodes_choose_and_the_rest_are_reported(self):
        whole = cells("drag", 0.0, [1.0, 2.0, 3.0, 7.0, 9.0]).reported
        parts = split(whole, 3)
        assert parts.chosen_by == 2.0 and parts.damage.tolist() == [7.0, 9.0]


class TestQuick:
    def test_rows_are_those_of_evaluate_on_the_reported_episodes(self, played):
        ranking, _ = played
        assert len(ranking.rows) == 1 * 2 * 4
        own = load_version("1").threat_models[0]
        world = load_version("1").world("trio(horizon=12)", own)
        results = training.evaluate(world, "outward", "quorum", 6, seed=3, progress=False)
        expected = results.cells[0].metrics["damage_per_frame"][2:].mean()
        by_key = {(r["threat"], r["defense"]): r for r in ranking.rows}
        quorum = named_in_full("quorum")
        assert by_key["own@1", quorum]["damage"]["outward"] == expected
        assert by_key["poses@1", quorum]["damage"]["outward"] == expected
        assert "fov_aware" not in by_key["own@1", quorum]["damage"]
        assert "fov_aware" in by_key["poses@1", quorum]["damage"]

    def test_references_stand_last_and_the_rest_by_the_worst_attack(self, played):
        for _, _, rows in played[0].groups():
            assert [r["defense"] for r in rows if r["reference"]] == [r["defense"] for r in rows[2:]]
            worst = [r["worst"]["mean"]["value"] for r in rows[:2]]
            assert worst == sorted(worst)

    def test_a_ranking_goes_on_where_it_was_and_ends_in_the_same_values(self, played, tiny, tmp_path):
        ranking, folder = played
        copy = tmp_path / "copy"
        shutil.copytree(folder, copy)
        part = copy / "parts" / "trio_horizon_12" / "own@1"
        shutil.rmtree(part / "score")
        again = training.rank(version=tiny, out=copy, resume=True, progress=False)
        assert untimed(again) == untimed(ranking)
        set_damage(part / "quorum" / "results.parquet", 99.0)  # what is finished is read, not played again
        found = training.rank(version=tiny, out=copy, resume=True, progress=False).rows
        assert [r["defense"] for r in found if r["damage"]["outward"] == 99.0] == [named_in_full("quorum")] * 2
        with pytest.raises(ValueError, match="--resume to continue the ranking in it"):
            training.rank(version=tiny, out=copy, progress=False)

    def test_the_table_shows_every_row_and_the_command(self, played):
        folder = played[1]
        text = (folder / "quick.md").read_text()
        assert text == load_ranking(folder / "quick.json").markdown()
        assert text.count("| `quorum") == 2 and "Transfer" in text and "trust-env rank --quick" in text

    def test_a_defense_and_an_attack_join(self, tiny, tmp_path):
        (tmp_path / "theirs.py").write_text(OUTWARD)
        theirs = f"{tmp_path / 'theirs.py'}:Theirs"
        found = training.rank(
            defenses=f"{TEMPLATE / 'defense.py'}:MyDefense", attacks=theirs, only="score", version=tiny, progress=False
        )
        for made in found.rows:
            assert made["damage"][theirs] == made["damage"]["outward"]
        alone = training.rank(only="score", version=tiny, progress=False)
        assert [r["mean"] for r in found.rows] == [r["mean"] for r in alone.rows]

    def test_what_the_threat_models_do_not_give_is_refused(self, tiny, tmp_path):
        (tmp_path / "theirs.py").write_text(OUTWARD + "    knowledge = 'white_box'\n")
        with pytest.raises(ValueError, match="needs white_box, more than any of own@1, poses@1 gives"):
            training.rank(attacks=f"{tmp_path / 'theirs.py'}:Theirs", version=tiny, progress=False)
        with pytest.raises(ValueError, match="unknown defense of the ranking 'trust'"):
            training.rank(only="trust", version=tiny, progress=False)
        with pytest.raises(ValueError, match="unknown scenario of version 1 'patrol'"):
            training.rank(scenarios="patrol", version=tiny, progress=False)


class TestFull:
    def test_attacks_are_searched_against_each_defense_and_what_is_finished_is_kept(self, tiny, tmp_path):
        options = {"only": "score", "threats": "own", "version": tiny, "out": tmp_path / "run", "progress": False}
        found = training.rank("full", **options)
        (made,) = found.rows
        assert {"honest", "outward"} <= set(made["damage"])
        assert "fov_aware" not in made["damage"] and made["worst"]["attack"] in made["damage"]
        searched = tmp_path / "run" / "parts" / "trio_horizon_12" / "own@1" / "score" / "exploit" / "finished.json"
        kept = searched.read_text()
        assert set(json.loads(kept)["screened"]) == {"outward", "false_positive"}
        ((name, deep),) = json.loads(kept)["searches"].items()
        assert deep["attack"] in made["damage"] and f"search({name})" not in made["damage"]
        assert untimed(training.rank("full", resume=True, **options)) == untimed(found)
        assert json.loads(searched.read_text()) == json.loads(kept)
        assert "Adaptive" in (tmp_path / "run" / "full.md").read_text()

    @pytest.mark.extra("train")
    def test_attackers_are_trained_against_each_defense(self, tmp_path):
        file = tmp_path / "trained.yaml"
        fields = "steps: 64, worlds: 4, threads: 1, ppo.n_steps: 8, ppo.batch_size: 16, ppo.n_epochs: 1"
        text = TINY.replace("seeds: 0, training: {}", f"seeds: 1, training: {{{fields}, evaluation.episodes: 2}}")
        file.write_text(text)
        options = {"only": "score", "threats": "own", "version": str(file), "out": tmp_path / "run"}
        (made,) = training.rank("full", progress=False, **options).rows
        assert "learned, seed 0" in made["damage"]

    def test_it_has_threat_models_of_its_own(self, tiny, tmp_path):
        file = tmp_path / "poses.yaml"
        file.write_text(TINY.replace("{threats: [own@1, poses@1]", "{threats: [poses@1]"))
        options = {"only": "score", "version": str(file), "progress": False}
        (made,) = training.rank("full", out=tmp_path / "run", **options).rows
        assert made["threat"] == "poses@1" and {"outward", "fov_aware"} <= set(made["damage"])
        with pytest.raises(ValueError, match="unknown threat model of version 1 'own@1'"):
            training.rank("full", threats="own", out=tmp_path / "other", **options)

    def test_it_needs_a_folder(self, tiny):
        with pytest.raises(ValueError, match="expected out"):
            training.rank("full", version=tiny)


class TestCheck:
    def test_a_ranking_is_reproduced_to_the_bit(self, played):
        found = check(played[1] / "quick.json", only="quorum", progress=False)
        assert found.exact and found.rows == 6 and found.differences == ()

    def test_a_changed_value_is_found(self, played, tmp_path, cli):
        fields = json.loads((played[1] / "quick.json").read_text())
        fields["rows"][0]["damage"]["outward"] += 1e-6
        file = tmp_path / "changed.json"
        file.write_text(json.dumps(fields))
        code, out, _ = cli("rank", "--check", file, "--only", "score", "--json")
        (line,) = json.loads(out)["differences"]
        assert code == 1 and "score: damage: outward is" in line

    def test_on_another_processor_the_last_bits_may_differ(self, played):
        saved, anew = (Ranking(json.loads((played[1] / "quick.json").read_text())) for _ in range(2))
        anew.rows[0]["damage"]["outward"] *= 1.0 + 1e-12
        assert check_ranking(saved, anew).differences
        saved.fields["processor"] = "another one"
        assert not check_ranking(saved, anew).differences
        anew.rows[0]["damage"]["outward"] *= 1.0 + 1e-6
        assert len(check_ranking(saved, anew).differences) == 1


class TestEntries:
    @pytest.mark.parametrize("name", ["defense.py", "attack.py"])
    def test_the_template_has_the_code_that_trust_env_new_writes(self, name):
        assert (TEMPLATE / name).read_text() == (ROOT / "training" / "templates" / name).read_text()

    def test_the_template_joins(self, tiny, cli):
        only = f"{TEMPLATE / 'defense.py'}:MyDefense(window=9)"
        code, out, err = cli("rank", "--quick", "--entry", TEMPLATE, "--only", only, "--version", tiny, "--json")
        assert code == 0, err
        found = json.loads(out)
        assert found["rows"][0]["defense"] == only
        assert f"{TEMPLATE / 'attack.py'}:MyAttack" in found["rows"][-1]["damage"]

    @pytest.mark.parametrize(("text", "expected"), [
        ("authors: A\nabout: B\n", "at least one of `defenses` and `attacks`"),
        ("authors: A\nabout: B\ndefenses: [trust]\n", "expected a file beside it"),
    ])  # fmt: skip
    def test_an_entry_of_nothing_is_refused(self, tmp_path, cli, text, expected):
        (tmp_path / "entry.yaml").write_text(text)
        code, _, err = cli("rank", "--quick", "--entry", tmp_path)
        assert code == 2 and expected in " ".join(err.split())


def test_one_of_quick_full_search_and_check_is_expected(cli):
    assert "expected one of --quick, --full, --search and --check" in cli("rank")[2]
    assert cli("rank", "--quick", "--full")[0] == 2


class TestPublished:
    @pytest.mark.parametrize("file", [PUBLISHED, FULL])
    def test_the_table_is_made_from_the_json(self, file):
        assert load_ranking(file).markdown() == file.with_suffix(".md").read_text()

    def test_the_table_in_short_is_made_from_the_full_one(self):
        assert "\n".join(summary(load_ranking(FULL))) in (ROOT / "rankings" / "README.md").read_text()

    def test_it_is_the_protocol_of_version_1(self):
        protocol = json.loads(load_version("1").model_dump_json())
        assert load_ranking(PUBLISHED).fields["protocol"] == protocol
        assert load_ranking(FULL).fields["protocol"] == {**protocol, "threats": protocol["full"]["threats"]}

    def test_all_of_it_was_played(self):
        version, rows = load_version("1"), load_ranking(FULL).rows
        played = {(row["scenario"], row["threat"], row["defense"]) for row in rows}
        defenses = [named_in_full(name) for name in version.defenses]
        assert played == set(itertools.product(version.scenarios, version.full.threats, defenses))
        assert not load_ranking(FULL).fields["options"]

    def test_a_row_is_what_evaluate_finds_now(self):
        version = load_version("1")
        world, quick = version.world("trio", version.threat_models[0]), version.quick
        counts = (quick.validation + quick.episodes, version.seed)
        results = training.evaluate(world, "honest,outward", "score", *counts, progress=False)
        rows = {(r["scenario"], r["threat"], r["defense"]): r for r in load_ranking(PUBLISHED).rows}
        saved = rows["trio", "own@1", "score"]["damage"]
        for cell in results.cells:
            assert split(cell, quick.validation).damage.mean() == pytest.approx(saved[cell.attack], rel=1e-9)

    def test_what_a_search_of_the_full_one_found_does_that_damage(self):
        """Against a defense of trio, in the episodes of the row."""
        version, ranking = load_version("1"), load_ranking(FULL)
        (made,) = (row for row in ranking.rows if (row["scenario"], row["defense"]) == ("trio", "score"))
        named = {"learned, seed 0", "learned, seed 1", *version.attacks_on("trio")}
        attack = max(set(made["damage"]) - named, key=made["damage"].get)
        world = version.world("trio", threat_model(made["threat"]))
        counts = version.full.episodes, version.seed
        results = training.evaluate(world, attack, "score", *counts, progress=False)
        found = results.cells[0].metrics["damage_per_frame"].mean()
        assert found == pytest.approx(made["damage"][attack], rel=1e-9)


def test_attacks_of_version_1_are_named_as_results_name_them():
    version = load_version("1")
    for attack in version.attacks_on("patrol"):
        build_policy(attack)
    results = training.evaluate("patrol", version.attacks_on("patrol"), "score", 1, max_cycles=1, progress=False)
    assert [cell.attack for cell in results.cells] == version.attacks_on("patrol")
