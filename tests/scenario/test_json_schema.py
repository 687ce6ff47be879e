"""The JSON schema of scenario files, and what is said of every field."""

from __future__ import annotations

from importlib import resources

import jsonschema
import pytest
import yaml

from trust_env.scenario import Scenario, load_scenario, scenario_fields, scenarios
from trust_env.scenario.commented import commented_yaml
from trust_env.scenario.comments import comment_of, field_comments, unit_of
from trust_env.scenario.json_schema import field_infos, find_field, scenario_schema
from trust_env.scenario.yaml_lines import read_yaml

BUILT_IN = resources.files("trust_env.scenario") / "builtin"


@pytest.fixture(scope="module")
def validator():
    jsonschema.Draft202012Validator.check_schema(scenario_schema())
    return jsonschema.Draft202012Validator(scenario_schema())


@pytest.mark.parametrize("name", [*scenarios(), "base"])
def test_the_schema_accepts_the_built_in_files(validator, name):
    fields, _ = read_yaml((BUILT_IN / f"{name}.yaml").read_text("utf-8"), name)
    assert [fault.message for fault in validator.iter_errors(fields)] == []


@pytest.mark.parametrize("name", [name for name in scenarios() if name != "skies"])
def test_the_schema_accepts_whole_scenarios(validator, name):
    assert validator.is_valid(load_scenario(name).model_dump(mode="json"))


@pytest.mark.parametrize(
    "text",
    [
        "horizn: 3",
        "horizon: 3.5",
        "tracker: {gate: 1.0}",
        "tracker: {gaet: 0.9}",
        "knowledge: poess",
        "dt: true",
        "dt: '1'",
        "area: [0, 1, 2]",
        "agents: [{position: [0, 0]}]",
        "agents: [{role: adversary, fov: {radus: 3}}]",
        "injections: [{agent: 0}]",
        "sensor: null",
        "team: {n_benign: 65}",
        "base: 3",
    ],
)
def test_the_schema_refuses_what_loading_refuses(validator, text):
    fields = yaml.safe_load(text)
    assert not validator.is_valid(fields)
    with pytest.raises(ValueError):
        load_scenario(fields)


def test_every_field_of_the_schema_has_a_comment_and_every_default_of_base_is_in_it():
    infos = field_infos()
    assert [name for name, info in infos.items() if len(info.comment) < 3] == []
    assert {name.partition(".")[0].removesuffix("[]") for name in infos} == set(Scenario.model_fields)
    assert infos["tracker.gate"].default == scenario_fields("base")["tracker"]["gate"] == 0.99
    assert infos["agents[].heading"].default == 0.0
    assert infos["tracker.gate"].values == "number from 1e-15 to below 1"


def test_every_comment_of_base_belongs_to_a_field():
    known = {name.replace("[]", "") for name in field_infos()}
    assert {".".join(path) for path in field_comments()} <= known


@pytest.mark.parametrize(
    ("name", "unit"),
    [("dt", "s"), ("agents.position", "m"), ("agents[].belief.beta_fp", "1/m^2"), ("targets.speed", "m/s"),
     ("initial_velocity_variance", "(m/s)^2"), ("gate", ""), ("horizon", "frames"), ("fov.width", "rad")],
)  # fmt: skip
def test_a_field_is_found_by_its_path_or_by_a_last_name_that_fits_one(name, unit):
    assert find_field(name).unit == unit


def test_an_unknown_or_ambiguous_field_is_refused_with_those_that_fit():
    with pytest.raises(ValueError, match=r"unknown field 'tracker\.gat'; did you mean 'tracker\.gate'\?"):
        find_field("tracker.gat")
    with pytest.raises(ValueError, match=r"expected one of sensor\.p_detect, tracker\.p_detect"):
        find_field("p_detect")


def test_a_comment_goes_on_below_its_field_and_stands_above_lists():
    assert comment_of(("team", "placement")).endswith("traffic: centres of k-means over the recording")
    assert comment_of(("area",)).startswith("m, [x_min")
    assert comment_of(("agents", "sensor", "sigma")) == comment_of(("sensor", "sigma"))
    assert unit_of("probability that") == "" and unit_of("m, somewhere") == "m" and unit_of("most tracks") == ""


@pytest.mark.parametrize("name", [name for name in scenarios() if name != "skies"])
def test_commented_yaml_has_the_same_fields(name):
    fields = load_scenario(name).model_dump(mode="json")
    text = commented_yaml(fields)
    assert read_yaml(text, name)[0] == fields
    assert text.count("#") > 80


def test_text_that_looks_like_fields_and_comments_stays_as_it_is():
    fields = load_scenario("patrol", description="a: 1 # no comment\n  gate: 2 " * 30).model_dump(mode="json")
    assert read_yaml(commented_yaml(fields), "text")[0] == fields


def test_a_scenario_with_its_own_name_does_not_take_the_description_of_its_base(yaml_file):
    assert load_scenario(yaml_file("base: patrol\nhorizon: 3\n")).description == "no description is given"
    assert load_scenario({"base": "patrol", "name": "mine"}).description == "no description is given"
    mine = load_scenario(yaml_file("base: patrol\ndescription: Of my own.\n"))
    assert mine.description == "Of my own."
    assert load_scenario("patrol(horizon=3)").description == load_scenario("patrol").description
