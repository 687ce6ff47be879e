"""Fusion rules that survive wrong positions: all hits of a frame, judged against the predicted track, make one update.

With m hits on a track, of which at most l are wrong: `trimmed_mean` takes the mean of each coordinate without the l
least and the l greatest, with the covariance R/(m - 2l); `residual_clique` (after the idea of Mao et al. 2022) takes
the largest set of hits that agree pairwise, d² < 9.21 under R_k + R_i; `secure_estimate` (after the idea of Mo &
Sinopoli 2014 and Ren et al. 2020) takes the m - l hits of the least spread. Sets are fused by information, Σ R_k⁻¹.
With m ≤ 2l no rule can tell right from wrong: the prediction stays, and `overflow.unfused_tracks` counts it.
"""

from __future__ import annotations

from trust_env.compiled.kernels import kernel
from trust_env.world.tracking import kalman

SEQUENTIAL, TRIMMED_MEAN, RESIDUAL_CLIQUE, SECURE_ESTIMATE = range(4)
FUSIONS = {
    "sequential": SEQUENTIAL,
    "trimmed_mean": TRIMMED_MEAN,
    "residual_clique": RESIDUAL_CLIQUE,
    "secure_estimate": SECURE_ESTIMATE,
}
_AGREE = 9.21  # the 99 % point of chi-square with two degrees of freedom
_MOST_EXACT = 10  # hits of which all subsets are tried; of more the worst are left out one by one


@kernel
def keep_hit(world, k, weight, j, x, y):
    """Keep agent k's hit (x, y) on track j, with R_k/w, until all agents have reported."""
    kept, noise = world.kept, world.agents.noise_cov[k]
    i = kept.hits[j]
    kept.point[j, i, 0], kept.point[j, i, 1] = x, y
    for a in range(2):
        for b in range(2):
            kept.noise[j, i, a, b] = noise[a, b] / weight
    kept.hits[j] += 1


@kernel
def fuse_hits(world):
    """Update every track with its kept hits."""
    tracks, kept = world.tracks, world.kept
    for j in range(tracks.count):
        if kept.hits[j] > 2 * world.parameters.fusion_tolerance:
            _fuse(world, j)
        elif kept.hits[j] > 0:
            world.overflow.unfused_tracks += 1


@kernel
def _fuse(world, j):
    if world.parameters.fusion == TRIMMED_MEAN:
        x, y, xx, xy, yy = _trimmed_mean(world, j)
    else:
        _choose_hits(world, j)
        x, y, xx, xy, yy = _fuse_information(world, j)
    mean, cov = world.tracks.mean[j], world.tracks.cov[j]
    sxx, sxy, syy, det = kalman.innovation_cov(cov, xx, xy, yy)
    s_inverse = (syy / det, -sxy / det, sxx / det)
    kalman.update(mean, cov, x - mean[0], y - mean[1], (xx, xy, yy), s_inverse, det)


@kernel
def _trimmed_mean(world, j):
    """The trimmed mean of the kept hits of track j, and R/(m - 2l) with the mean of their R: x, y, xx, xy, yy."""
    kept, trimmed = world.kept, world.parameters.fusion_tolerance
    hits, noise = kept.hits[j], kept.noise[j]
    left = hits - 2 * trimmed
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(hits):
        xx, xy, yy = xx + noise[i, 0, 0], xy + noise[i, 0, 1], yy + noise[i, 1, 1]
    scale = 1.0 / (hits * left)
    return _middle(world, j, 0, trimmed), _middle(world, j, 1, trimmed), xx * scale, xy * scale, yy * scale


@kernel
def _middle(world, j, axis, trimmed):
    """The mean of one coordinate of the kept hits, without the `trimmed` least and greatest."""
    hits, point, ordered = world.kept.hits[j], world.kept.point[j], world.kept.ordered
    total = 0.0
    for i in range(hits):
        at = i
        while at > 0 and ordered[at - 1] > point[i, axis]:
            ordered[at] = ordered[at - 1]
            at -= 1
        ordered[at] = point[i, axis]
    for i in range(trimmed, hits - trimmed):
        total += ordered[i]
    return total / (hits - 2 * trimmed)


@kernel
def _choose_hits(world, j):
    """Set `kept.chosen` for the hits of track j that the rule takes."""
    hits, size = world.kept.hits[j], 0
    if world.parameters.fusion == SECURE_ESTIMATE:
        size = hits - world.parameters.fusion_tolerance
    if hits <= _MOST_EXACT:
        _choose_among_all(world, j, hits, size)
    else:
        _leave_out_the_worst(world, j, hits, size)


@kernel
def _choose_among_all(world, j, hits, size):
    """Of all sets of hits: the tightest of `size`, or (size 0) of those that agree the largest, then the tightest."""
    chosen, best, best_members, best_spread = world.kept.chosen, 0, 0, 0.0
    for subset in range(1, 1 << hits):
        members = 0
        for i in range(hits):
            chosen[i] = (subset >> i) & 1 == 1
            members += int(chosen[i])
        if members < best_members or (size > 0 and members != size):
            continue
        if size == 0 and not _agree(world, j, hits):
            continue
        spread = _spread(world, j, hits)
        if members > best_members or spread < best_spread:
            best, best_members, best_spread = subset, members, spread
    for i in range(hits):
        chosen[i] = (best >> i) & 1 == 1


@kernel
def _leave_out_the_worst(world, j, hits, size):
    """Leave out the hit whose absence tightens the set most, until `size` are left or (size 0) those left agree."""
    chosen, left = world.kept.chosen, hits
    for i in range(hits):
        chosen[i] = True
    while left > 1 and (left > size if size > 0 else not _agree(world, j, hits)):
        worst, least = -1, 0.0
        for i in range(hits):
            if chosen[i]:
                chosen[i] = False
                spread = _spread(world, j, hits)
                chosen[i] = True
                if worst < 0 or spread < least:
                    worst, least = i, spread
        chosen[worst] = False
        left -= 1


@kernel
def _agree(world, j, hits):
    """Whether the chosen hits of track j agree pairwise, d² < 9.21 under the sum of their R."""
    point, noise, chosen = world.kept.point[j], world.kept.noise[j], world.kept.chosen
    for i in range(hits):
        for h in range(i):
            if chosen[i] and chosen[h]:
                dx, dy = point[i, 0] - point[h, 0], point[i, 1] - point[h, 1]
                xx, xy = noise[i, 0, 0] + noise[h, 0, 0], noise[i, 0, 1] + noise[h, 0, 1]
                yy = noise[i, 1, 1] + noise[h, 1, 1]
                if not yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy < _AGREE * (xx * yy - xy * xy):
                    return False
    return True


@kernel
def _spread(world, j, hits):
    """Sum of the squared distances of the chosen hits of track j from their mean, m²."""
    point, chosen = world.kept.point[j], world.kept.chosen
    members, x, y, total = 0, 0.0, 0.0, 0.0
    for i in range(hits):
        if chosen[i]:
            members, x, y = members + 1, x + point[i, 0], y + point[i, 1]
    for i in range(hits):
        if chosen[i]:
            dx, dy = point[i, 0] - x / members, point[i, 1] - y / members
            total += dx * dx + dy * dy
    return total


@kernel
def _fuse_information(world, j):
    """The chosen hits of track j as one: its position, and (Σ R_i⁻¹)⁻¹ by its entries: x, y, xx, xy, yy."""
    hits, point, noise = world.kept.hits[j], world.kept.point[j], world.kept.noise[j]
    ixx, ixy, iyy, u, v = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(hits):
        if world.kept.chosen[i]:
            xx, xy, yy = noise[i, 0, 0], noise[i, 0, 1], noise[i, 1, 1]
            det = xx * yy - xy * xy
            ixx, ixy, iyy = ixx + yy / det, ixy - xy / det, iyy + xx / det
            u += (yy * point[i, 0] - xy * point[i, 1]) / det
            v += (xx * point[i, 1] - xy * point[i, 0]) / det
    det = ixx * iyy - ixy * ixy
    xx, xy, yy = iyy / det, -ixy / det, ixx / det
    return xx * u + xy * v, xy * u + yy * v, xx, xy, yy
