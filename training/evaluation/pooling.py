"""Brier scores and calibration of trust, pooled over episodes: of one cell, or of all attacks on a defense.

A forecast is the trust in a track or an agent in a frame. Every forecast counts once, so that episodes with more
tracks weigh more; the mean of the episodes' own scores, as among the metrics, weighs all episodes alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trust_env.metrics import RELIABILITY
from trust_env.metrics.forecast_scores import COUNT, FORECAST, OUTCOME, calibration_error, ratio

Arrays = Mapping[str, np.ndarray]


def pool(metrics: Sequence[Arrays], reliability: Sequence[Arrays]) -> dict[str, dict[str, Any]]:
    """For each of `RELIABILITY` of which there is a forecast: forecasts, brier, calibration_error; and by tenth of
    [0, 1] count, mean_forecast and share_true, None where the count is 0.

    metrics, reliability: those of the cells, by name, an entry for every episode.
    """
    found = {}
    for kind in RELIABILITY:
        briers = np.concatenate([cell[f"{kind}_brier"] for cell in metrics])
        bins = np.concatenate([cell[kind] for cell in reliability])
        if bins[:, COUNT].any():
            found[kind] = _pool(briers, bins)
    return found


def _pool(briers: np.ndarray, episodes: np.ndarray) -> dict[str, Any]:
    """Of Brier scores [episodes] and bins [episodes, 3, N_BINS]."""
    bins, counts = episodes.sum(axis=0), episodes[:, COUNT].sum(axis=1)
    return {
        "forecasts": int(counts.sum()),
        "brier": float(np.nansum(briers * counts) / counts.sum()),
        "calibration_error": float(calibration_error(bins)),
        "count": bins[COUNT].astype(int).tolist(),
        "mean_forecast": _nullable(ratio(bins[FORECAST], bins[COUNT])),
        "share_true": _nullable(ratio(bins[OUTCOME], bins[COUNT])),
    }


def _nullable(values: np.ndarray) -> list[float | None]:
    return [None if np.isnan(value) else float(value) for value in values]
