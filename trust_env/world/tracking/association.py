"""Assignment between rows (detections) and columns (tracks) along gated pairs.

Pairs are kept by row: those of row r are entries `pair_start[r]` to `pair_start[r + 1]` of `pair_column` and
`pair_cost`. Most rows have no rival and are assigned at sight; what is left is solved by shortest augmenting
paths (Jonker & Volgenant 1987), row by row.
"""

from __future__ import annotations

import numpy as np

from trust_env.compiled.jit import compiled
from trust_env.world.fields import F, flags1, floats1, ints1

NONE = -1


@compiled
def most_pairs_then_least_cost(world, rows, columns):
    """Assign as many pairs as possible, and among such assignments the one of least total cost."""
    if not _assign_unrivalled(world, rows, columns, np.inf):
        return
    start, cost = ints1(world, F.pair_start), floats1(world, F.pair_cost)
    low, high = np.inf, -np.inf
    for p in range(start[rows]):
        low, high = min(low, cost[p]), max(high, cost[p])
    for p in range(start[rows]):
        cost[p] -= low  # changes every assignment of the same size alike
    _solve_rivals(world, rows, columns, (high - low + 1.0) * (rows + 1.0))


@compiled
def assign(world, rows, columns, unassigned_cost):
    """Minimise the sum of costs (not negative) plus `unassigned_cost` per row without a column.

    Results: `row_column[rows]` and `column_row[columns]`, -1 where unassigned.
    """
    if _assign_unrivalled(world, rows, columns, unassigned_cost):
        _solve_rivals(world, rows, columns, unassigned_cost)


@compiled
def _assign_unrivalled(world, rows, columns, unassigned_cost):
    """Assign the rows and columns that only have each other; returns whether there are others."""
    start, pair_column, degree = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        ints1(world, F.column_degree),
    )
    row_column, column_row = ints1(world, F.row_column), ints1(world, F.column_row)
    cost, rivals = floats1(world, F.pair_cost), 0
    for c in range(columns):
        degree[c], column_row[c] = 0, NONE
    for p in range(start[rows]):
        degree[pair_column[p]] += 1
    for r in range(rows):  # without branches, as nobody can predict which rows have rivals
        pairs, first = start[r + 1] - start[r], start[r]
        c = pair_column[first]  # of a row without pairs, some column
        alone = (pairs == 1) & (degree[c] == 1)
        taken = alone & (cost[first] < unassigned_cost)
        row_column[r] = c if taken else NONE
        column_row[c] = r if taken else column_row[c]
        rivals += 0 if alone else pairs
    return rivals > 0


@compiled
def _solve_rivals(world, rows, columns, unassigned_cost):
    start, pair_column, degree = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        ints1(world, F.column_degree),
    )
    row_potential, column_potential = floats1(world, F.row_potential), floats1(world, F.column_potential)
    path_cost, done = floats1(world, F.path_cost), flags1(world, F.done)
    for c in range(columns):
        column_potential[c], path_cost[c], done[c] = 0.0, np.inf, False
    for r in range(rows):
        row_potential[r] = 0.0
    for r in range(rows):
        pairs = start[r + 1] - start[r]
        if pairs > 1 or (pairs == 1 and degree[pair_column[start[r]]] > 1):
            _augment(world, r, unassigned_cost)


@compiled
def _augment(world, first, unassigned_cost):
    """Dijkstra from row `first` to the nearest free column, or to the cheapest row to leave unassigned; then
    flip the path.
    """
    start, pair_column, pair_cost = (
        ints1(world, F.pair_start),
        ints1(world, F.pair_column),
        floats1(world, F.pair_cost),
    )
    column_row = ints1(world, F.column_row)
    u, v = floats1(world, F.row_potential), floats1(world, F.column_potential)
    path_cost, path_row, done = floats1(world, F.path_cost), ints1(world, F.path_row), flags1(world, F.done)
    touched, n_touched = ints1(world, F.touched), 0
    row, base, end = first, 0.0, NONE
    leave, leave_cost = NONE, np.inf  # the row to leave unassigned, and the length of the path to it
    while True:
        if base + unassigned_cost - u[row] < leave_cost:
            leave, leave_cost = row, base + unassigned_cost - u[row]
        for p in range(start[row], start[row + 1]):
            c = pair_column[p]
            length = base + pair_cost[p] - u[row] - v[c]
            if not done[c] and length < path_cost[c]:
                if path_cost[c] == np.inf:
                    touched[n_touched] = c
                    n_touched += 1
                path_cost[c], path_row[c] = length, row
        nearest, total = NONE, leave_cost
        for t in range(n_touched):
            c = touched[t]
            if not done[c] and path_cost[c] < total:
                nearest, total = c, path_cost[c]
        if nearest == NONE:
            break
        done[nearest] = True
        if column_row[nearest] == NONE:
            end = nearest
            break
        row, base = column_row[nearest], total
    _reprice(world, first, total, n_touched)
    _flip(world, first, end, leave)


@compiled
def _reprice(world, first, total, n_touched):
    """Potentials after a search of length `total`: reduced costs stay non-negative, those of the new
    assignment become zero.
    """
    u, v, column_row = (
        floats1(world, F.row_potential),
        floats1(world, F.column_potential),
        ints1(world, F.column_row),
    )
    path_cost, done, touched = floats1(world, F.path_cost), flags1(world, F.done), ints1(world, F.touched)
    u[first] += total
    for t in range(n_touched):
        c = touched[t]
        if done[c]:
            v[c] += path_cost[c] - total
            if column_row[c] != NONE:
                u[column_row[c]] += total - path_cost[c]
        path_cost[c], done[c] = np.inf, False


@compiled
def _flip(world, first, end, leave):
    """Exchange assignments along the path that ends at a free column, or at a row that is left unassigned."""
    row_column, column_row, path_row = (
        ints1(world, F.row_column),
        ints1(world, F.column_row),
        ints1(world, F.path_row),
    )
    column = end
    if end == NONE:
        column = row_column[leave]
        row_column[leave] = NONE
    row = leave if end == NONE else NONE
    while row != first:
        row = path_row[column]
        following = row_column[row]
        row_column[row], column_row[column] = column, row
        column = following
