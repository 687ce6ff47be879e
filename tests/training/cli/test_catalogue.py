"""`scenarios list`, and `list` and `show` of defenses, attacks and metrics."""

import json

import trust_env
from trust_env.agents import POLICIES
from trust_env.defenses import DEFENSES
from trust_env.defenses.trust_switches import PRESETS
from trust_env.metrics import METRICS


def test_lists_name_everything_that_is_registered(cli):
    for group, names in (
        ("scenarios", trust_env.scenarios()),
        ("defenses", trust_env.defenses()),
        ("attacks", POLICIES),
        ("metrics", METRICS),
    ):
        code, out, _ = cli(group, "list", "--json")
        listed = json.loads(out)
        assert code == 0
        assert [entry["name"] for entry in listed] == list(names)
        assert all(len(entry["description"]) > 20 for entry in listed)
        _, text, _ = cli(group, "list")
        assert [line.split()[0] for line in text.splitlines()] == list(names)


def test_every_defense_and_attack_can_be_shown(cli):
    for name in trust_env.defenses():
        assert cli("defenses", "show", name)[0] == 0
    for name, policy in POLICIES.items():
        code, out, _ = cli("attacks", "show", name, "--json")
        shown = json.loads(out)
        assert (code, shown["name"], shown["knowledge"]) == (0, name, policy.knowledge)


def test_show_defense_has_parameters_and_presets(cli):
    _, out, _ = cli("defenses", "show", "trust", "--json")
    shown = json.loads(out)
    assert shown["parameters"]["preset"] == {"default": "paper"}
    assert shown["parameters"]["epsilon"] == {"default": 0.01}
    assert shown["parameters"]["order"] == {
        "default": "tracks_first",
        "choices": ["tracks_first", "agents_first"],
    }
    assert list(shown["presets"]) == list(PRESETS)
    assert shown["presets"]["paper"] == {}
    assert shown["presets"]["cdc2024"]["strong_precision"] == 100.0
    _, text, _ = cli("defenses", "show", "majority")
    assert "  window = 10" in text
    assert "  q = 0.5" in text


def test_show_takes_a_class_in_a_file(cli, tmp_path):
    (tmp_path / "mine.py").write_text('class Mine:\n    "Mine alone."\n    def __init__(self, x, y=3): ...\n')
    _, out, _ = cli("defenses", "show", f"{tmp_path}/mine.py:Mine", "--json")
    assert json.loads(out) == {
        "name": "Mine",
        "doc": "Mine alone.",
        "parameters": {"x": {}, "y": {"default": 3}},
    }


def test_the_list_of_defenses_says_which_are_for_evaluation_only(cli):
    _, out, _ = cli("defenses", "list", "--json")
    marked = [entry["name"] for entry in json.loads(out) if "for evaluation only" in entry["description"]]
    assert marked == [name for name, defense in DEFENSES.items() if defense.reference] != []


def test_every_metric_says_its_unit_which_way_is_worse_and_when_it_is_absent(cli):
    for name, metric in METRICS.items():
        _, out, _ = cli("metrics", "show", name, "--json")
        assert json.loads(out) == metric._asdict()
        assert metric.unit and metric.worse in ("higher", "lower") and not metric.definition.endswith(".")
        assert metric.never_where is None or (metric.never_where in METRICS and metric.absent)
    _, text, _ = cli("metrics", "show", "detection_delay")
    assert all(line in text for line in ("unit: frames", "worse: higher", "absent where accusation_rate is not: never"))
    code, _, err = cli("metrics", "show", "gospar")
    assert code == 2 and "unknown metric 'gospar'; did you mean 'gospa'?" in err
