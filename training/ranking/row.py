"""A row of the ranking: a defense in a scenario under a threat model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from trust_env.defenses import named_in_full
from trust_env.training.evaluation.hierarchical import Outcome, outcome
from trust_env.training.evaluation.pooling import pool
from trust_env.training.evaluation.results import DAMAGE, REFERENCES
from trust_env.training.evaluation.statistics import Bounds, placed_between
from trust_env.training.evaluation.summary import without_nan
from trust_env.training.exploitation.threat_models import ThreatModel
from trust_env.training.ranking.cells import Cells
from trust_env.training.ranking.version import Version


@dataclass(frozen=True)
class Row:
    """Damage is per frame, in the reported episodes; intervals are 95 % bootstrap over episodes.

    worst_attack: that of most damage in the validation episodes. mean: over the version's attacks without the control.
    placed: the worst attack's damage where `oracle` under the same attack is 0 and `blank` is 1; None: undefined.
    false_accusations: mean share of benign agents that are accused; None: the defense has no opinion of agents.
    calibration: scores of trust pooled over the version's attacks, by what is trusted. damage: mean by attack.
    time_ratio: of a step of the environment to one with `score`.
    """

    scenario: str
    threat: str
    defense: str
    is_reference: bool
    honest: Outcome
    mean: Bounds
    worst_attack: str
    worst: Outcome
    placed: Bounds | None
    false_accusations: float | None
    calibration: dict[str, dict[str, float]]
    damage: dict[str, float]
    time_ratio: float

    @property
    def key(self) -> tuple[str, str, str]:
        return self.scenario, self.threat, self.defense

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, as in the files of a ranking."""
        return {
            "scenario": self.scenario,
            "threat": self.threat,
            "defense": self.defense,
            "reference": self.is_reference,
            "honest": self.honest.to_dict(),
            "mean": self.mean._asdict(),
            "worst": {"attack": self.worst_attack, **self.worst.to_dict()},
            "placed": None if self.placed is None else without_nan(self.placed._asdict()),
            "false_accusations": self.false_accusations,
            "calibration": self.calibration,
            "damage": self.damage,
            "time_ratio": self.time_ratio,
        }


def row(
    version: Version,
    scenario: str,
    threat: ThreatModel,
    defense: str,
    cells: Mapping[str, Cells],
    references: Mapping[str, Mapping[str, Cells]],
    time_ratio: float,
) -> Row:
    """The row of cells by attack; references: the cells of `oracle` and `blank` under the same attacks."""
    listed = [found for attack, found in cells.items() if attack in version.attacks_on(scenario)]
    attacks = [found.damage for found in listed if found.reported.attack != version.control]
    worst = max(cells, key=lambda attack: cells[attack].chosen_by)
    low, high = (references[name][worst].damage for name in REFERENCES)
    return Row(
        scenario=scenario,
        threat=threat.label,
        defense=named_in_full(defense),
        is_reference=defense in version.references,
        honest=outcome(cells[version.control].damage),
        mean=outcome(np.mean(attacks, axis=0)).mean,
        worst_attack=worst,
        worst=outcome(cells[worst].damage),
        placed=placed_between(cells[worst].damage, low, high),
        false_accusations=_mean(np.concatenate([found.reported.metrics["false_accusation_rate"] for found in listed])),
        calibration=_calibration(listed),
        damage={attack: float(found.reported.metrics[DAMAGE].mean()) for attack, found in cells.items()},
        time_ratio=time_ratio,
    )


def _mean(values: np.ndarray) -> float | None:
    """Over the episodes that define it; None: none does."""
    return None if np.isnan(values).all() else float(np.nanmean(values))


def _calibration(listed: list[Cells]) -> dict[str, dict[str, float]]:
    reported = [found.reported for found in listed]
    scores = pool([cell.metrics for cell in reported], [cell.reliability for cell in reported])
    return {kind: {name: found[name] for name in ("brier", "calibration_error")} for kind, found in scores.items()}
