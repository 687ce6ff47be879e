"""Where agents stand over recorded traffic."""

from __future__ import annotations

import functools

import numpy as np

from trust_env.scenario.recording import Recording


@functools.lru_cache(maxsize=8)
def traffic_centres(recording: Recording, n_agents: int) -> tuple[tuple[float, float], ...]:
    """Centres of k-means over the recorded positions, K points in m, the busiest first."""
    from scipy.cluster.vq import kmeans2

    points = recording.positions[~np.isnan(recording.positions[..., 0])]
    start = [points.mean(axis=0)]
    while len(start) < n_agents:  # each far from the others: no random start, the same result everywhere
        apart = np.min([np.hypot(*(points - centre).T) for centre in start], axis=0)
        start.append(points[apart.argmax()])
    centres, members = kmeans2(points, np.array(start), minit="matrix", iter=50)
    busiest = np.argsort(-np.bincount(members, minlength=n_agents), kind="stable")
    return tuple((float(x), float(y)) for x, y in centres[busiest])
