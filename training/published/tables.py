"""Which tables are published: a title, what it says, the command that makes it, and how its JSON becomes rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from trust_env.training.published import rows

ATTACKS = (
    "honest", "random", "false_positive", "false_positive(hit_rate=1.0)", "optimal_false_positive", "outward",
    "exclusive", "exclusive(noise=0.0)", "stealth", "by_turns", "fov_aware", "fov_aware(noise=0.0)", "burst",
    "sleeper", "on_off", "suppress", "selective_suppress", "framing", "collusion", "replay", "drag", "steal", "flood",
)  # fmt: skip
LEARNED = tuple(f"learned(against={name})" for name in ("score", "trust", "majority", "joint_posterior"))
DEFENSES = (
    "score", "trust", "majority", "quorum", "quorum(strict=False)", "binary_beta", "rfsn_beta", "particle",
    "parsimony", "score_asymmetry", "dawid_skene", "path_trust(anchor=2)", "cusum", "joint_posterior", "oracle",
    "blank",
)  # fmt: skip
COMPARED = ("trust", "score", "quorum", "joint_posterior", "oracle", "blank")
FEWER = (
    "honest",
    "false_positive",
    "optimal_false_positive",
    "outward",
    "exclusive",
    "stealth",
    "fov_aware",
    "suppress",
)
_TRIO_HAS_NONE = {"collusion"}  # one adversary of three outnumbers nobody with another


RECORDING = "RECORDING.csv"  # stands in a command for a file of recorded trajectories, which is not shipped


@dataclass(frozen=True)
class Table:
    """One table: `command` is the arguments of `trust-env`, without --json; `lines` makes Markdown of its JSON."""

    name: str
    title: str
    text: str
    command: tuple[str, ...]
    lines: Callable[[dict[str, Any]], list[str]]


def _evaluation(scenario: str, attacks: tuple[str, ...], defenses: tuple[str, ...], *more: str) -> tuple[str, ...]:
    named = ("--attack", ",".join(attacks), "--defense", ",".join(defenses))
    return ("evaluate", "--scenario", scenario, *named, "--episodes", "100", *more)


def _compared(name: str, title: str, scenario: str, attacks: tuple[str, ...], defenses: tuple[str, ...]) -> Table:
    text = "Mean damage per frame, and joint_posterior less trust with an interval that holds for all rows at once."
    command = _evaluation(scenario, attacks, defenses, "--against", "trust")
    return Table(name, title, text, command, rows.against("joint_posterior"))


def _variant(name: str, title: str, change: str, attacks: tuple[str, ...] = FEWER) -> Table:
    return _compared(f"patrol_{name}", title, f"patrol({change})", attacks, ("trust", "score", "joint_posterior"))


PATROL, TRIO = (*ATTACKS, *LEARNED), tuple(a for a in ATTACKS if a not in _TRIO_HAS_NONE)
TABLES: tuple[Table, ...] = (
    Table(
        "patrol", "Every attack against every defense: patrol",
        "Mean damage per frame (false tracks shown and missing targets together).",
        _evaluation("patrol", PATROL, DEFENSES), rows.damage,
    ),
    Table(
        "patrol_worst", "The worst tenth of the episodes: patrol",
        "Mean damage per frame in the worst tenth of the episodes.",
        _evaluation("patrol", PATROL, DEFENSES), rows.worst,
    ),
    Table(
        "trio", "Every attack against every defense: trio",
        "Mean damage per frame.", _evaluation("trio", TRIO, DEFENSES), rows.damage,
    ),
    _compared("patrol_joint", "joint_posterior against trust: patrol", "patrol", PATROL, COMPARED),
    _compared("trio_joint", "joint_posterior against trust: trio", "trio", TRIO, COMPARED),
    _variant("1_of_5", "One adversary of five", "n_adversaries=1, n_benign=4"),
    _variant("3_of_5", "Three adversaries of five", "n_adversaries=3, n_benign=2"),
    _variant("3_of_8", "Three adversaries of eight", "n_adversaries=3, n_benign=5"),
    _variant("0_of_5", "Five benign agents", "n_adversaries=0, n_benign=5", ("honest",)),
    _variant("p_detect", "Detection with probability 0.7", "sensor.p_detect=0.7, tracker.p_detect=0.7"),
    _variant("clutter", "Ten times the clutter", "sensor.clutter_density=1e-5"),
    _variant("sectors", "FOVs that are sectors", "fov.type=sector, fov.width=3.0"),
    Table(
        "skies", "Recorded aircraft: joint_posterior against trust",
        "Mean damage per frame on twenty minutes of recorded air traffic (OpenSky, United Kingdom, 2021-07-12).",
        _evaluation("skies", (*FEWER, "fov_aware(noise=0.0)", "by_turns"), ("trust", "score", "joint_posterior"),
                    "--data", RECORDING, "--against", "trust"),
        rows.against("joint_posterior"),
    ),
    Table(
        "calibration", "How well trust is calibrated",
        "Scores of trust, pooled over all attacks: every track or agent and frame counts once.",
        _evaluation("patrol", PATROL, ("trust", "majority", "parsimony", "joint_posterior")), rows.calibration,
    ),
    *(
        Table(
            f"actuation_{defense}", f"What a verdict is worth to the tracker: {defense}",
            "Mean damage per frame by what a verdict does.",
            ("curve", "--over", "actuation", "--values", "monitor,filter,remove,weight,retro", "--attack",
             "honest,false_positive,optimal_false_positive,outward,fov_aware,suppress,drag,steal", "--defense",
             defense, "--episodes", "100"),
            rows.curve,
        )
        for defense in ("trust", "joint_posterior")
    ),
    Table(
        "fusion", "Fusion rules against reports that drag a track",
        "Distance of the shown tracks from their targets, m, mean over tracks and frames.",
        ("curve", "--over", "tracker.fusion", "--values", "sequential,trimmed_mean,residual_clique,secure_estimate",
         "--attack", "honest,drag,steal", "--defense", "score", "--scenario",
         "patrol(n_adversaries=1, n_benign=4, spread=40.0)", "--episodes", "100", "--metric", "siap_position_error"),
        rows.curve,
    ),
    Table(
        "adversaries", "Security curve: the number of adversaries",
        "Mean damage per frame on patrol, of five agents.",
        ("curve", "--over", "adversaries", "--attack", "false_positive,outward,by_turns", "--defense",
         "score,trust,quorum,joint_posterior,oracle,blank", "--episodes", "100"),
        rows.curve,
    ),
)  # fmt: skip
