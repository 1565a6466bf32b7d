"""Elimination, smallest eigenpairs and small linear programs against NumPy, LAPACK and HiGHS."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_drake.numerics.linear_algebra_kernel import (
    copy_matrix,
    copy_vector,
    eliminate,
    factor,
    smallest_eigenpair,
    smallest_eigenvalue,
    substitute,
)
from cdpr_drake.numerics.linear_program_kernel import lowest_point

VALUE = 1e-7  # relative; HiGHS stops at 1e-7 of feasibility and optimality
BOUND = 1e-10  # of rows of size one; the steps of a walk round off


def by_highs(cost, rows, low, high):
    """Optimal value; None: infeasible or unbounded."""
    above, below = np.isfinite(high), np.isfinite(low)
    result = linprog(
        cost, A_ub=np.vstack([rows[above], -rows[below]]),
        b_ub=np.concatenate([high[above], -low[below]]),
        bounds=[(None, None)] * len(cost), method="highs",
    )  # fmt: skip
    return result.fun if result.status == 0 else None


@st.composite
def programs(draw):
    """Polytopes around a point, many of them degenerate or open."""
    k = draw(st.integers(1, 6))
    p = k + draw(st.integers(0, 8))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    whole = draw(st.booleans())
    rows = rng.integers(-2, 3, (p, k)).astype(float) if whole else rng.normal(size=(p, k))
    if draw(st.booleans()):
        rows[-1] = rows[0]  # the same bound twice
    cost = rng.integers(-3, 4, k).astype(float) if whole else rng.normal(size=k)
    x = rng.integers(-3, 4, k).astype(float) if whole else rng.normal(size=k)
    value = rows @ x
    room = rng.integers(0, 4, (2, p)).astype(float) if whole else rng.uniform(0.0, 2.0, (2, p))
    low, high = value - room[0], value + room[1]
    if draw(st.booleans()):
        fixed = rng.random(p) < 0.2
        low[fixed] = high[fixed] = value[fixed]
    if draw(st.booleans()):
        low[rng.random(p) < 0.4] = -np.inf
        high[rng.random(p) < 0.4] = np.inf
    return cost, rows, low, high, x


@settings(max_examples=200)
@given(programs())
def test_optimal_values_are_those_of_highs_and_the_walk_never_raises_the_cost(program):
    cost, rows, low, high, x = program
    start = x.copy()
    reached, expected = lowest_point(cost, rows, low, high, x), by_highs(cost, rows, low, high)
    assert reached == (expected is not None)
    before, norm = cost @ start, np.linalg.norm(cost)
    assert cost @ x <= before + BOUND * (1.0 + abs(before)) * (1.0 + norm)
    if reached:
        size = 1.0 + np.linalg.norm(x) + np.linalg.norm(start)
        assert abs(cost @ x - expected) <= VALUE * norm * size
        assert np.all(rows @ x >= low - BOUND * size)
        assert np.all(rows @ x <= high + BOUND * size)


TRIPLE = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])


@pytest.mark.parametrize(
    ("cost", "rows", "low", "high", "start"),
    [
        ([0.0, 0.0], np.eye(2), -np.ones(2), np.ones(2), [0.25, -0.5]),  # no cost
        ([1.0, -1.0], TRIPLE, [2.0, 3.0, 5.0], [2.0, 3.0, 5.0], [2.0, 3.0]),  # one point
    ],
)
def test_the_start_stays(cost, rows, low, high, start):
    x = np.array(start)
    assert lowest_point(np.array(cost), rows, np.array(low), np.array(high), x)
    np.testing.assert_array_equal(x, start)


def test_an_open_polytope_has_no_lowest_point():
    low, high = np.array([-1.0, -np.inf]), np.array([1.0, 0.0])
    assert not lowest_point(np.array([0.0, 1.0]), np.eye(2), low, high, np.zeros(2))
    assert lowest_point(np.array([0.0, -1.0]), np.eye(2), low, high, np.zeros(2))
    nothing = np.empty((0, 2)), np.empty(0), np.empty(0)
    assert not lowest_point(np.ones(2), *nothing, np.zeros(2))


@pytest.mark.parametrize("k", [2, 3, 5])
def test_the_tip_of_a_pyramid_where_many_bounds_meet(k):
    """Sixty bounds through the one lowest point, the usual place for a simplex method to circle."""
    rng = np.random.default_rng(k)
    rows = np.vstack([rng.normal(size=(60, k)), -np.eye(k)])
    rows[:, 0] = -np.abs(rows[:, 0]) - 0.1
    cost, x = np.eye(k)[0], 5.0 * np.eye(k)[0]
    high = np.repeat([0.0, 10.0], [60, k])  # the tip is the origin
    low = np.full(len(rows), -np.inf)
    assert lowest_point(cost, rows, low, high, x)
    assert cost @ x == pytest.approx(by_highs(cost, rows, low, high), abs=VALUE * 10.0)


def test_the_example_on_which_dantzigs_rule_circles():
    """Beale, 1955: a degenerate start, from which the steepest choice returns to where it was."""
    cost, x = np.array([-0.75, 150.0, -0.02, 6.0]), np.zeros(4)
    own = [[0.25, -60.0, -0.04, 9.0], [0.5, -90.0, -0.02, 3.0], [0.0, 0.0, 1.0, 0.0]]
    low = np.array([-np.inf] * 3 + [0.0] * 4)
    high = np.array([0.0, 0.0, 1.0] + [np.inf] * 4)
    assert lowest_point(cost, np.vstack([own, np.eye(4)]), low, high, x)
    assert cost @ x == pytest.approx(-0.05, rel=1e-12)


@pytest.mark.parametrize("n", range(1, 15))
def test_elimination_solves_as_numpy_does(n):
    random = np.random.default_rng(n)
    for _ in range(10):
        A = random.normal(size=(n, n)) + np.diag(random.choice([0.0, 3.0], n))
        b = random.normal(size=n)
        factors, x, pivots = A.copy(), b.copy(), np.zeros(n)
        eliminate(factors, n, pivots)
        substitute(factors, n, pivots, x)
        assert np.linalg.norm(A @ x - b) < 1e-9 * np.linalg.cond(A)


def matrices():
    random = np.random.default_rng(4)
    made = [np.eye(6), np.zeros((6, 6)), np.diag([3.0, 1.0, 2.0, 1.0, 5.0, -1.0]), np.ones((3, 3))]
    for n in (1, 2, 3, 6):
        for size in (1e-8, 1.0, 1e8):
            X = random.normal(size=(n, n)) * size
            made += [X + X.T, X @ X.T]
    for tiny in (1e-155, 1e-157, 1e-160, 1e-200):  # whose squares are subnormal or zero
        Y = np.diag([1.0, 2.0, -0.5, 3.0, 4.0, 5.0])
        Y[0, 1:3] = Y[1:3, 0] = tiny, 0.7 * tiny
        made.append(Y)
    X = random.normal(size=(6, 2))
    return [*made, X @ X.T, np.eye(6) + 1e-9 * (X @ X.T)]


@pytest.mark.parametrize("S", matrices())
def test_eigenpair_is_that_of_lapack(S):
    T, F, v = np.empty_like(S), np.zeros_like(S), np.empty(len(S))
    values = np.linalg.eigvalsh(S)
    size = max(np.max(np.abs(values)), 1e-300)
    assert smallest_eigenpair(S, T, F, v) == pytest.approx(values[0], abs=1e-13 * size)
    assert np.linalg.norm(v) == pytest.approx(1.0, abs=1e-12)
    # The vector's quotient is what a search needs; it is second order in the vector's error.
    assert v @ S @ v == pytest.approx(values[0], abs=1e-7 * max(size, 1.0))


def test_numbers_that_are_not_finite_give_minus_infinity():
    S = np.eye(3)
    S[1, 2] = S[2, 1] = np.nan
    assert smallest_eigenvalue(S, np.empty((3, 3))) == -np.inf


def test_factor_tells_positive_from_not():
    S, F = np.diag([2.0, 3.0, 1.0]), np.zeros((3, 3))
    assert factor(S, 0.99, F)
    np.testing.assert_allclose(F @ F.T, S - 0.99 * np.eye(3), atol=1e-15)
    assert not factor(S, 1.0, F)


def test_copies():
    a, out = np.arange(12.0).reshape(3, 4), np.zeros((4, 4))
    copy_matrix(a, out[1:])
    np.testing.assert_array_equal(out, [np.zeros(4), *a])
    copy_vector(a[2], out[:, 0])
    np.testing.assert_array_equal(out[:, 0], a[2])
