"""`threats list` and `threats show`."""

import json

from trust_env.training.exploitation.threat_models import THREATS


def test_list_names_every_threat_model(cli):
    code, out, _ = cli("threats", "list", "--json")
    assert code == 0 and [entry["name"] for entry in json.loads(out)] == list(THREATS)
    assert [line.split()[0] for line in cli("threats", "list")[1].splitlines()] == list(THREATS)


def test_show_says_what_adversaries_are_know_and_may_do(cli):
    code, out, _ = cli("threats", "show", "poses_shared", "--json")
    assert code == 0 and json.loads(out) == THREATS["poses_shared@1"].to_dict()
    text = cli("threats", "show", "injections_only@1")[1]
    assert "adversaries: 40% of the agents" in text and "knowledge: own" in text
    assert "injections of an adversary in a frame: all slots" in text
    assert "suppressions of an adversary in a frame: none" in text
    assert "in a frame: at most 1" in cli("threats", "show", "one_injection")[1]


def test_an_unknown_threat_model_is_refused(cli):
    code, _, err = cli("threats", "show", "white-box")
    assert code == 2 and "unknown threat model 'white-box'; did you mean 'white_box'" in err
