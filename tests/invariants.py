"""What holds of the worlds after every frame, whatever the scenario and the actions."""

from __future__ import annotations

import numpy as np

from trust_env.vector import VectorEnv


def check(env: VectorEnv) -> None:
    """All numbers finite and in their ranges; covariances positive semi-definite; the books agree."""
    a = env.arrays
    known = a.track_status > 0
    assert env.scenario.targets.slots > 0 or not a.target_alive.any()
    assert np.isfinite(a.observation).all() and np.abs(a.observation).max() <= 1.0
    assert np.isfinite(a.reward).all() and np.isfinite(a.metrics).all() and (a.metrics >= 0).all()
    for prefix in ("track", "local"):
        there = a[f"{prefix}_status"] > 0
        for name in ("mean", "cov", "score", "peak", "initial"):
            assert np.isfinite(a[f"{prefix}_{name}"][there]).all(), name
        check_covariances(a[f"{prefix}_cov"][there])
    for name in ("track_trust", "agent_trust"):
        opinion = a[name][known] if name == "track_trust" else a[name]
        variance = a[f"{name}_var"][known] if name == "track_trust" else a[f"{name}_var"]
        assert (np.isnan(opinion) | ((opinion >= 0) & (opinion <= 1))).all()
        assert (np.isnan(variance) | ((variance >= 0) & (variance <= 0.25))).all()
    assert (a.agent_weight >= 0).all() and (a.agent_weight <= 1).all()
    assert not (a.published & ~(a.track_status == 2)).any()
    for ids in (a.track_id.reshape(-1, a.track_id.shape[-1]), a.local_id.reshape(-1, a.local_id.shape[-1])):
        assert all(len(np.unique(row[row >= 0])) == (row >= 0).sum() for row in ids)
    assert (a.report_count <= a.report_detections.shape[-2]).all() and (a.overflow_detections >= 0).all()


def check_covariances(cov: np.ndarray) -> None:
    assert (cov == cov.swapaxes(-1, -2)).all()
    scale = np.sqrt(np.einsum("...ii->...i", cov))
    assert (scale > 0).all()
    correlation = cov / scale[..., None] / scale[..., None, :]
    assert np.linalg.eigvalsh(correlation).min(initial=1.0) > -1e-9
