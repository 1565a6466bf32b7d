"""Small linear programs: optimal values against HiGHS, degenerate polytopes, no optimum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_drake.numerics.linear_program_kernel import lowest_point

VALUE_TOLERANCE = 1e-7  # relative; HiGHS stops at 1e-7 of feasibility and optimality
BOUND_TOLERANCE = 1e-10  # of rows of size one; the steps of a walk round off


def by_highs(cost, rows, low, high):
    """Optimal value; None: infeasible or unbounded."""
    above, below = np.isfinite(high), np.isfinite(low)
    result = linprog(
        cost,
        A_ub=np.vstack([rows[above], -rows[below]]),
        b_ub=np.concatenate([high[above], -low[below]]),
        bounds=[(None, None)] * len(cost),
        method="highs",
    )
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


@settings(max_examples=400)
@given(programs())
def test_optimal_values_are_those_of_highs(program):
    cost, rows, low, high, x = program
    start = x.copy()
    reached = lowest_point(cost, rows, low, high, x)
    expected = by_highs(cost, rows, low, high)
    assert reached == (expected is not None)
    if reached:
        size = np.linalg.norm(cost) * (1.0 + np.linalg.norm(x) + np.linalg.norm(start))
        assert abs(cost @ x - expected) <= VALUE_TOLERANCE * size
        slack = BOUND_TOLERANCE * (1.0 + np.linalg.norm(x) + np.linalg.norm(start))
        assert np.all(rows @ x >= low - slack)
        assert np.all(rows @ x <= high + slack)


@given(programs())
def test_the_walk_never_raises_the_cost(program):
    cost, rows, low, high, x = program
    before = cost @ x
    lowest_point(cost, rows, low, high, x)
    assert cost @ x <= before + BOUND_TOLERANCE * (1.0 + abs(before)) * (1 + np.linalg.norm(cost))


def test_without_cost_the_start_stays():
    x = np.array([0.25, -0.5])
    assert lowest_point(np.zeros(2), np.eye(2), -np.ones(2), np.ones(2), x)
    np.testing.assert_array_equal(x, [0.25, -0.5])


def test_an_open_polytope_has_no_lowest_point():
    rows = np.array([[1.0, 0.0], [0.0, 1.0]])
    low, high = np.array([-1.0, -np.inf]), np.array([1.0, 0.0])
    assert not lowest_point(np.array([0.0, 1.0]), rows, low, high, np.zeros(2))
    assert lowest_point(np.array([0.0, -1.0]), rows, low, high, np.zeros(2))


def test_no_bounds_at_all():
    assert not lowest_point(np.ones(2), np.empty((0, 2)), np.empty(0), np.empty(0), np.zeros(2))


def test_bounds_that_leave_one_point():
    x = np.array([2.0, 3.0])
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    assert lowest_point(np.array([1.0, -1.0]), rows, rows @ x, rows @ x, x)
    np.testing.assert_array_equal(x, [2.0, 3.0])


@pytest.mark.parametrize("k", [2, 3, 5])
def test_the_tip_of_a_pyramid_where_many_bounds_meet(k):
    """Sixty bounds through the one lowest point, the usual place for a simplex method to circle."""
    rng = np.random.default_rng(k)
    rows = np.vstack([rng.normal(size=(60, k)), -np.eye(k)])
    rows[:, 0] = -np.abs(rows[:, 0]) - 0.1
    cost = np.zeros(k)
    cost[0] = 1.0
    x = np.zeros(k)
    x[0] = 5.0
    high = np.zeros(len(rows))  # the tip is the origin
    low = np.full(len(rows), -np.inf)
    high[60:] = 10.0
    expected = by_highs(cost, rows, low, high)
    assert lowest_point(cost, rows, low, high, x)
    assert cost @ x == pytest.approx(expected, abs=VALUE_TOLERANCE * 10.0)


def test_the_example_on_which_dantzigs_rule_circles():
    """Beale, 1955: a degenerate start, from which the steepest choice returns to where it was."""
    cost = np.array([-0.75, 150.0, -0.02, 6.0])
    rows = np.vstack(
        [
            [0.25, -60.0, -0.04, 9.0],
            [0.5, -90.0, -0.02, 3.0],
            [0.0, 0.0, 1.0, 0.0],
            np.eye(4),
        ]
    )
    low = np.array([-np.inf] * 3 + [0.0] * 4)
    high = np.array([0.0, 0.0, 1.0] + [np.inf] * 4)
    x = np.zeros(4)
    assert lowest_point(cost, rows, low, high, x)
    assert cost @ x == pytest.approx(-0.05, rel=1e-12)
