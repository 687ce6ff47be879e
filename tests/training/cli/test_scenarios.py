"""`scenarios show` and `check`."""

import json

import yaml

import trust_env


def test_every_scenario_can_be_shown(cli):
    for name in trust_env.scenarios():
        assert yaml.safe_load(cli("scenarios", "show", name)[1])["name"] == name


def test_show_prints_yaml_that_loads_back(cli, tmp_path):
    _, out, _ = cli("scenarios", "show", "patrol(horizon=50, gate=0.95)")
    assert yaml.safe_load(out)["tracker"]["gate"] == 0.95
    (tmp_path / "copy.yaml").write_text(out)
    expected = trust_env.load_scenario("patrol(horizon=50, gate=0.95)")
    assert trust_env.load_scenario(tmp_path / "copy.yaml") == expected
    assert json.loads(cli("scenarios", "show", "patrol", "--json")[1])["horizon"] == 200


def test_show_prints_units_and_comments_those_of_listed_agents_too(cli):
    lines = cli("scenarios", "show", "case1")[1].splitlines()
    assert any(line.startswith("dt: 0.1 ") and "# s, length of a frame" in line for line in lines)
    assert sum(line.startswith("- role:") and "# adversary | benign" in line for line in lines) == 3
    assert max(len(line) for line in lines if line[39:41] == " #") <= 120


def test_explain_says_unit_default_and_values_of_a_field(cli):
    code, out, _ = cli("scenarios", "explain", "tracker.process_noise")
    assert code == 0
    assert out.splitlines()[0] == "tracker.process_noise"
    assert "unit: m^2/s^3" in out and "default: 0.2" in out and "values: number from 0 to 1e+09" in out
    found = json.loads(cli("scenarios", "explain", "agents", "--json")[1])
    assert {"agents[].role", "agents[].belief.compromised"} <= {field["name"] for field in found["fields"]}
    code, _, err = cli("scenarios", "explain", "gat")
    assert code == 2 and "unknown field 'gat'" in err


def test_schema_prints_the_schema_of_files(cli):
    code, out, _ = cli("scenarios", "schema")
    found = json.loads(out)
    assert code == 0 and "base" in found["properties"]
    assert found["properties"]["tracker"]["properties"]["gate"]["default"] == 0.99


def test_check_lists_every_problem_of_a_file(cli, tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("base: patrol\nhorizn: 3\ntracker: {gate: 1.5}\ndt: -1\n")
    code, out, err = cli("scenarios", "check", file)
    assert (code, out) == (1, "")
    assert "my.yaml, line 2: horizn = 3: unknown field; did you mean 'horizon'?" in err
    assert "my.yaml, line 3: tracker.gate = 1.5: expected a number from 1e-15 to below 1" in err
    assert "my.yaml, line 4: dt = -1: expected a number from 1e-06 to 1e+06" in err
    code, out, _ = cli("scenarios", "check", file, "patrol", "--json")
    found = json.loads(out)
    assert (code, found["ok"]) == (1, False)
    assert [len(problems) for problems in found["problems"].values()] == [3, 0]
    file.write_text("base: patrol\nhorizon: 3\n")
    assert cli("scenarios", "check", file) == (0, f"{file}: ok\n", "")


def test_check_says_what_is_set_without_effect(cli, tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("base: case1\nteam: {n_benign: 3}\n")
    note = f"{file}, line 2: team.n_benign = 3: has no effect, as agents decides this"
    assert cli("scenarios", "check", file) == (0, f"{file}: ok\n{note}\n", "")
    code, out, _ = cli("scenarios", "check", file, "--json")
    assert (code, json.loads(out)["notes"]) == (0, {str(file): [note]})
