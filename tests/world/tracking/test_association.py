"""The assignment: the best of all, on thousands of random problems and on the shapes that break solvers."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from kernels import Bench, entry
from scipy.optimize import linear_sum_assignment

from trust_env.world.tracking import association

SIZE = 40  # rows and columns that the bench has room for


@entry
def run_most_pairs(world, start, column, cost, rows, columns, row_column, column_row):
    for r in range(rows + 1):
        world.pairs.start[r] = start[r]
    for p in range(start[rows]):
        world.pairs.column[p], world.pairs.cost[p] = column[p], cost[p]
    association.max_cardinality_assignment(world, rows, columns)
    for r in range(rows):
        row_column[r] = world.matching.row_column[r]
    for c in range(columns):
        column_row[c] = world.matching.column_row[c]


@entry
def run_assign(world, start, column, cost, rows, columns, unassigned_cost, row_column, column_row):
    for r in range(rows + 1):
        world.pairs.start[r] = start[r]
    for p in range(start[rows]):
        world.pairs.column[p], world.pairs.cost[p] = column[p], cost[p]
    association.least_cost_assignment(world, rows, columns, unassigned_cost)
    for r in range(rows):
        row_column[r] = world.matching.row_column[r]
    for c in range(columns):
        column_row[c] = world.matching.column_row[c]


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench({"base": "patrol", "sensor": {"max_detections": SIZE}, "tracker": {"max_tracks": SIZE}})


def solve(bench: Bench, allowed: np.ndarray, cost: np.ndarray, unassigned_cost: float | None = None):
    """Pairs (row, column) by the kernel; also that its two lists say the same and name allowed pairs only."""
    rows, columns = allowed.shape
    start = np.concatenate([[0], np.cumsum(allowed.sum(axis=1))]).astype(np.int64)
    column = np.nonzero(allowed)[1].astype(np.int64)
    row_column, column_row = np.full(rows + 1, -7), np.full(columns + 1, -7)
    arrays = bench.world, start, column, cost[allowed].astype(np.float64), np.int64(rows), np.int64(columns)
    if unassigned_cost is None:
        run_most_pairs(*arrays, row_column, column_row)
    else:
        run_assign(*arrays, np.float64(unassigned_cost), row_column, column_row)
    pairs = [(r, int(c)) for r, c in enumerate(row_column[:rows]) if c >= 0]
    assert pairs == sorted((int(r), c) for c, r in enumerate(column_row[:columns]) if r >= 0)
    assert row_column[rows] == column_row[columns] == -7
    assert all(allowed[pair] for pair in pairs)
    return pairs


def total(pairs, cost: np.ndarray) -> float:
    return float(sum(cost[pair] for pair in pairs))


def best_by_enumeration(allowed: np.ndarray, cost: np.ndarray, unassigned_cost: float | None):
    """(number of pairs, cost) of the best partial one-to-one map, by trying all of them."""
    rows, columns = allowed.shape
    best: Any = None
    for choice in itertools.product(range(-1, columns), repeat=rows):
        pairs = [(r, c) for r, c in enumerate(choice) if c >= 0]
        if len({c for _, c in pairs}) < len(pairs) or not all(allowed[pair] for pair in pairs):
            continue
        price = total(pairs, cost)
        key = (-len(pairs), price) if unassigned_cost is None else price + unassigned_cost * (rows - len(pairs))
        best = key if best is None else min(best, key)
    return best


def best_by_scipy(allowed: np.ndarray, cost: np.ndarray) -> tuple[int, float]:
    """(most pairs, least cost): costs shifted above 0, a forbidden pair dearer than all others."""
    if not allowed.any():
        return 0, 0.0
    shifted = np.where(allowed, cost - cost[allowed].min(), 0.0)
    dear = (shifted.max() + 1.0) * (min(allowed.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(allowed, shifted, dear))
    pairs = [(r, c) for r, c in zip(rows, columns, strict=True) if allowed[r, c]]
    return len(pairs), total(pairs, cost)


def leave_by_scipy(allowed: np.ndarray, cost: np.ndarray, unassigned_cost: float) -> float:
    """Least cost with one extra column per row, which stands for "unassigned"."""
    rows = allowed.shape[0]
    forbidden = 1e6 + np.abs(cost).sum() + unassigned_cost * rows
    extra = np.where(np.eye(rows, dtype=bool), unassigned_cost, forbidden)
    full = np.concatenate([np.where(allowed, cost, forbidden), extra], axis=1)
    return float(full[linear_sum_assignment(full)].sum())


def problems(seed: int, n: int, largest: int):
    """Random problems: any shape, sparse to dense, negative, integer (ties) and far-spread costs."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        shape = rng.integers(0, largest + 1, 2)
        allowed = rng.random(shape) < rng.choice([0.05, 0.2, 0.5, 0.9, 1.0])
        kind = rng.integers(4)
        if kind == 0:
            cost = rng.normal(0.0, 10.0, shape)
        elif kind == 1:
            cost = rng.integers(-2, 3, shape).astype(float)
        elif kind == 2:
            cost = rng.uniform(0.0, 9.21, shape) + rng.normal(-6.0, 3.0, shape[1])
        else:
            cost = rng.choice([-1.0, 1.0], shape) * 10.0 ** rng.uniform(-6.0, 5.0, shape)
        yield allowed, cost


@pytest.mark.core
def test_small_problems_are_solved_as_by_trying_everything(bench):
    for allowed, cost in problems(seed=1, n=300, largest=4):
        pairs = solve(bench, allowed, cost)
        n_pairs, least = best_by_enumeration(allowed, cost, None)
        assert (-len(pairs), total(pairs, cost)) == (n_pairs, pytest.approx(least, abs=1e-6))
        free = np.abs(cost)
        limit = float(np.random.default_rng(len(pairs)).uniform(0.0, 12.0))
        pairs = solve(bench, allowed, free, limit)
        spent = total(pairs, free) + limit * (allowed.shape[0] - len(pairs))
        assert spent == pytest.approx(best_by_enumeration(allowed, free, limit), abs=1e-6)


@pytest.mark.core
def test_most_pairs_then_least_cost_as_scipy(bench):
    for allowed, cost in problems(seed=2, n=4000, largest=12):
        pairs = solve(bench, allowed, cost)
        n_pairs, least = best_by_scipy(allowed, cost)
        assert len(pairs) == n_pairs
        assert total(pairs, cost) == pytest.approx(least, rel=1e-9, abs=1e-6)


@pytest.mark.core
def test_unassigned_cost_as_scipy(bench):
    rng = np.random.default_rng(3)
    for allowed, signed in problems(seed=4, n=3000, largest=12):
        cost, limit = np.abs(signed), float(rng.choice([0.0, 0.5, 1.0, 2.0, 9.0, 100.0]))
        pairs = solve(bench, allowed, cost, limit)
        spent = total(pairs, cost) + limit * (allowed.shape[0] - len(pairs))
        assert spent == pytest.approx(leave_by_scipy(allowed, cost, limit), rel=1e-9, abs=1e-6)
        assert all(cost[pair] <= limit for pair in pairs)


@pytest.mark.core
def test_large_and_full_problems(bench):
    rng = np.random.default_rng(5)
    for shape in ((SIZE, SIZE), (SIZE, SIZE - 7), (SIZE - 7, SIZE), (1, SIZE), (SIZE, 1)):
        for spread in (1.0, 1e3):
            cost = rng.normal(0.0, spread, shape)
            allowed = np.ones(shape, dtype=bool)
            pairs = solve(bench, allowed, cost)
            assert len(pairs) == min(shape)
            assert total(pairs, cost) == pytest.approx(best_by_scipy(allowed, cost)[1], abs=1e-7 * spread)


@pytest.mark.core
@pytest.mark.nojit
def test_the_long_way_round(bench):
    """Every row but the last wants its neighbour's column: the last row must push all of them along."""
    n = 12
    allowed = np.eye(n, dtype=bool) | np.eye(n, k=1, dtype=bool)
    allowed[-1, 0], allowed[-1, -1] = True, False
    cost = np.where(np.eye(n, dtype=bool), 0.0, 1.0)
    assert solve(bench, allowed, cost) == [(r, (r + 1) % n) for r in range(n)]


@pytest.mark.core
@pytest.mark.nojit
def test_by_hand(bench):
    two = np.array([[True, True], [True, False]])
    assert solve(bench, two, np.array([[0.0, 9.0], [9.0, 0.0]])) == [
        (0, 1),
        (1, 0),
    ]  # two dear before one cheap
    assert solve(bench, two, np.array([[0.0, 9.0], [9.0, 0.0]]), 5.0) == [(0, 0)]
    assert solve(bench, two, np.array([[0.0, 9.0], [9.0, 0.0]]), 0.0) == []
    assert solve(bench, np.zeros((0, 3), dtype=bool), np.zeros((0, 3))) == []
    assert solve(bench, np.zeros((3, 0), dtype=bool), np.zeros((3, 0))) == []
    assert solve(bench, np.zeros((3, 3), dtype=bool), np.zeros((3, 3))) == []
    assert solve(bench, np.ones((1, 1), dtype=bool), np.array([[-50.0]])) == [(0, 0)]
    assert solve(bench, np.ones((3, 1), dtype=bool), np.array([[2.0], [-1.0], [0.0]])) == [(1, 0)]


@pytest.mark.core
def test_one_problem_leaves_nothing_behind_for_the_next(bench):
    rng = np.random.default_rng(6)
    allowed, cost = rng.random((8, 8)) < 0.5, rng.normal(size=(8, 8))
    first = solve(bench, allowed, cost)
    for other, price in problems(seed=7, n=50, largest=SIZE):
        solve(bench, other, price)
        assert solve(bench, allowed, cost) == first


@pytest.mark.core
def test_costs_that_are_not_finite_end_in_a_matching(bench):
    """An infinite cost once made the search for the end of a path run for ever."""
    rng = np.random.default_rng(8)
    for allowed, cost in problems(seed=9, n=500, largest=8):
        strange = rng.choice([np.inf, -np.inf, np.nan, 1e308, -1e308], cost.shape)
        solve(bench, allowed, np.where(rng.random(cost.shape) < 0.4, strange, cost))  # checks that it is one
    everything = np.ones((3, 3), dtype=bool)
    assert solve(bench, everything, np.where(np.eye(3) > 0, 1.0, np.inf)) == [(0, 0), (1, 1), (2, 2)]
