"""Assignment between rows (detections) and columns (tracks) along gated pairs.

Pairs are kept by row: those of row r are entries `pairs.start[r]` to `pairs.start[r + 1]` of `pairs.column` and
`pairs.cost`. Most rows and columns have only each other and are assigned at sight; what is left is solved by
shortest augmenting paths (Jonker & Volgenant 1987), row by row. Results: `matching.row_column[rows]` and
`matching.column_row[columns]`, NONE where unassigned.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled.kernels import kernel

NONE = -1
_LARGEST = 1e150  # of costs: their sums stay finite


@kernel
def max_cardinality_assignment(world, rows, columns):
    """Assign as many pairs as possible, and among such assignments choose the one of least total cost."""
    if not _assign_unambiguous(world, rows, columns, np.inf):
        return
    pairs, low, high = _limit_costs(world, rows), np.inf, -np.inf
    for p in range(pairs.start[rows]):
        low, high = min(low, pairs.cost[p]), max(high, pairs.cost[p])
    for p in range(pairs.start[rows]):
        pairs.cost[p] -= low  # changes every assignment of the same size alike
    _assign_ambiguous(world, rows, columns, (high - low + 1.0) * (rows + 1.0))


@kernel
def _limit_costs(world, rows):
    """The pairs, with all costs finite: what is no number, or too large, costs the most that there is."""
    pairs, total = world.pairs, 0.0
    for p in range(pairs.start[rows]):
        total += abs(pairs.cost[p])
    if not total <= _LARGEST:  # written so that NaN is found, too
        for p in range(pairs.start[rows]):
            cost = pairs.cost[p]
            pairs.cost[p] = max(cost, -_LARGEST) if cost <= _LARGEST else _LARGEST
    return pairs


@kernel
def least_cost_assignment(world, rows, columns, unassigned_cost):
    """Minimise the sum of costs (not negative) plus `unassigned_cost` per row without a column."""
    if _assign_unambiguous(world, rows, columns, unassigned_cost):
        _assign_ambiguous(world, rows, columns, unassigned_cost)


@kernel
def _assign_unambiguous(world, rows, columns, unassigned_cost):
    """Assign the rows and columns that only have each other; returns whether there are others."""
    pairs, found, others = world.pairs, world.matching, 0
    for c in range(columns):
        found.degree[c], found.column_row[c] = 0, NONE
    for p in range(pairs.start[rows]):
        found.degree[pairs.column[p]] += 1
    for r in range(rows):  # without branches, as nobody can predict which rows are ambiguous
        first, length = pairs.start[r], pairs.start[r + 1] - pairs.start[r]
        c = pairs.column[first]  # of a row without pairs, some column
        alone = (length == 1) & (found.degree[c] == 1)
        taken = alone & (pairs.cost[first] < unassigned_cost)
        found.row_column[r] = c if taken else NONE
        found.column_row[c] = r if taken else found.column_row[c]
        others += 0 if alone else length
    return others > 0


@kernel
def _assign_ambiguous(world, rows, columns, unassigned_cost):
    pairs, found = world.pairs, world.matching
    for c in range(columns):
        found.column_potential[c], found.path_cost[c], found.done[c] = 0.0, np.inf, False
    for r in range(rows):
        found.row_potential[r] = 0.0
    for r in range(rows):
        length = pairs.start[r + 1] - pairs.start[r]
        if length > 1 or (length == 1 and found.degree[pairs.column[pairs.start[r]]] > 1):
            _augment(world, r, unassigned_cost)


@kernel
def _augment(world, first, unassigned_cost):
    """Dijkstra from row `first` to the nearest free column, or to the cheapest row to leave unassigned; then
    exchange the assignments along the path.

    Every round is done with one more column, so that there are at most as many rounds as columns, and one.
    """
    found, touched, total = world.matching, 0, np.inf
    row, length, end = first, 0.0, NONE
    left_out, left_out_cost = first, np.inf  # the row to leave unassigned, and the length of the path to it
    for _ in range(found.done.shape[0] + 1):
        if length + unassigned_cost - found.row_potential[row] < left_out_cost:
            left_out, left_out_cost = row, length + unassigned_cost - found.row_potential[row]
        touched = _relax(world, row, length, touched)
        nearest, total = NONE, left_out_cost
        for t in range(touched):
            c = found.touched[t]
            if not found.done[c] and found.path_cost[c] < total:
                nearest, total = c, found.path_cost[c]
        if nearest == NONE:
            break
        found.done[nearest] = True
        if found.column_row[nearest] == NONE:
            end = nearest
            break
        row, length = found.column_row[nearest], total
    _update_potentials(world, first, total, touched)
    _exchange(world, first, end, left_out)


@kernel
def _relax(world, row, length, touched):
    """Shorten the paths to a row's columns that lead through it; returns how many columns have a path."""
    pairs, found = world.pairs, world.matching
    for p in range(pairs.start[row], pairs.start[row + 1]):
        c = pairs.column[p]
        through = length + pairs.cost[p] - found.row_potential[row] - found.column_potential[c]
        if not found.done[c] and through < found.path_cost[c]:
            if found.path_cost[c] == np.inf:
                found.touched[touched] = c
                touched += 1
            found.path_cost[c], found.path_row[c] = through, row
    return touched


@kernel
def _update_potentials(world, first, total, touched):
    """Potentials after a search of length `total`: reduced costs stay non-negative, those of the new assignment
    become zero.
    """
    found = world.matching
    found.row_potential[first] += total
    for t in range(touched):
        c = found.touched[t]
        if found.done[c]:
            found.column_potential[c] += found.path_cost[c] - total
            if found.column_row[c] != NONE:
                found.row_potential[found.column_row[c]] += total - found.path_cost[c]
        found.path_cost[c], found.done[c] = np.inf, False


@kernel
def _exchange(world, first, end, left_out):
    """Exchange assignments along the path to a free column, or to a row that is left unassigned."""
    found, column = world.matching, end
    if end == NONE:
        if left_out == first:
            return
        column = found.row_column[left_out]
        found.row_column[left_out] = NONE
    for _ in range(found.done.shape[0]):  # a path leads through a column once
        row = found.path_row[column]
        following = found.row_column[row]
        found.row_column[row], found.column_row[column] = column, row
        if row == first:
            break
        column = following
