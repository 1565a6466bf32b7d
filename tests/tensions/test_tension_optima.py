"""What methods promise to make least or largest, against SciPy's solvers and each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, lsq_linear

from cdpr_drake.tensions.methods import (
    METHODS,
    distribute,
    exact_tensions,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tensions.polygon_kernel import polygon_steiner_point
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from tests.tensions.tension_cases import random_problem

OBJECTIVE_TOLERANCE = 1e-7  # relative to the largest bound; HiGHS stops at 1e-7
SLACK_TOLERANCE = 1e-8  # relative to the wrench; of a least-squares optimum, by its gradient
ORACLE_SLACK = 1e-5  # relative; SciPy's interior method comes this near
NORM_TOLERANCE = 1e-7  # [N]; others may be off balance by 1e-9 of the forces, W lengthens that
BALANCE = 1e-9  # relative to the forces; what a solution promises
ON_BOUND = 1e-12  # [N]; an active bound is met up to the rounding of tensions of 60 N
ROUNDING = 1e-12  # relative; two ways to compute the same tensions

seeds = st.integers(0, 2**32 - 1)


def by_highs(cost, problem, extra_rows=None, extra_high=None):
    """Optimal value of cost' (t, s) with one more unknown s, None if infeasible."""
    n = len(problem.wrench)
    return linprog(
        cost,
        A_ub=extra_rows,
        b_ub=extra_high,
        A_eq=np.hstack([problem.W, np.zeros((n, 1))]),
        b_eq=-problem.wrench,
        bounds=[*zip(problem.lower, problem.upper, strict=True), (None, None)],
        method="highs",
    )


@settings(max_examples=60)
@given(seeds, st.integers(1, 6), st.sampled_from([1, 2, 3, 5]), st.sampled_from([0.0, 5.0]))
def test_linear_objectives_are_those_of_highs(seed, n, r, lowest):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest)
    m = n + r
    tolerance = OBJECTIVE_TOLERANCE * np.max(problem.upper)
    eye, one, none = np.eye(m), np.ones((m, 1)), np.zeros(m)

    total = by_highs(np.append(np.ones(m), 0.0), problem).fun
    assert distribute(problem, "linear_program").tensions.sum() == pytest.approx(
        total, abs=m * tolerance
    )
    if r == 2:
        assert distribute(problem, "polygon_1_norm").tensions.sum() == pytest.approx(
            total, abs=m * tolerance
        )
    largest = by_highs(np.append(none, 1.0), problem, np.hstack([eye, -one]), none).fun
    assert np.max(distribute(problem, "infinity_norm").tensions) == pytest.approx(
        largest, abs=tolerance
    )
    rows = np.block([[-eye, one], [eye, one]])
    high = np.concatenate([-problem.lower, problem.upper])
    margin = -by_highs(np.append(none, -1.0), problem, rows, high).fun
    safe = distribute(problem, "optimally_safe").tensions
    found = min(np.min(safe - problem.lower), np.min(problem.upper - safe))
    assert found == pytest.approx(margin, abs=tolerance)


@given(seeds, st.integers(1, 6), st.sampled_from([1, 2, 3, 5]))
def test_two_norms_beat_every_other_method(seed, n, r):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest=2.0)
    least = np.linalg.norm(distribute(problem, "quadratic_program").tensions)
    nearest = np.linalg.norm(distribute(problem, "reference_program").tensions - problem.reference)
    middle = (problem.lower + problem.upper) / 2.0
    central = np.linalg.norm(distribute(problem, "median").tensions - middle)
    for method in [name for name, method in METHODS.items() if method.takes(r)]:
        solution = distribute(problem, method)
        if solution.status == TensionStatus.FEASIBLE:
            t = solution.tensions
            assert np.linalg.norm(t) >= least - NORM_TOLERANCE, method
            assert np.linalg.norm(t - problem.reference) >= nearest - NORM_TOLERANCE, method
            assert np.linalg.norm(t - middle) >= central - NORM_TOLERANCE, method
    closed = distribute(problem, "closed_form")
    if closed.status == TensionStatus.FEASIBLE:  # then it is the projection of the middle
        expected = exact_tensions(problem, middle)
        np.testing.assert_allclose(closed.tensions, expected, rtol=0.0, atol=NORM_TOLERANCE)


@given(seeds, st.integers(1, 6))
def test_points_of_the_polygon(seed, n):
    problem = random_problem(np.random.default_rng(seed), n, 2)
    vertices = feasible_polygon(problem)
    t, N = solution_space(problem)
    corners = t[:, np.newaxis] + N @ vertices
    assert np.all((corners >= problem.lower[0] - 1e-9) & (corners <= problem.upper[0] + 1e-9))
    two = distribute(problem, "polygon_2_norm").tensions
    np.testing.assert_array_equal(two, distribute(problem, "quadratic_program").tensions)
    weighted = distribute(problem, "weighted_vertices").tensions
    expected = t + N @ polygon_steiner_point(vertices)
    np.testing.assert_allclose(weighted, expected, rtol=0.0, atol=1e-9)


# The relaxed method always answers.


@settings(max_examples=60)
@given(seeds, st.integers(1, 6), st.sampled_from([0, 1, 2, 3, 5]))
def test_what_slack_relaxed_leaves_unbalanced_is_the_least_possible(seed, n, r):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest=2.0, reach=0.6)
    solution = distribute(problem, "slack_relaxed")
    t = solution.tensions
    assert np.all((t >= problem.lower) & (t <= problem.upper))
    slack = problem.W @ t + problem.wrench
    np.testing.assert_allclose(solution.slack, slack, rtol=0.0, atol=1e-9)
    feasible = distribute(problem).status == TensionStatus.FEASIBLE
    expected = TensionStatus.FEASIBLE if feasible else TensionStatus.INFEASIBLE
    assert solution.status == expected
    size = np.linalg.norm(problem.wrench) + np.linalg.norm(np.abs(problem.W) @ t)
    if feasible:
        assert np.linalg.norm(slack) <= BALANCE * size
        return
    # The gradient of |W t + w|^2 / 2 pushes against bounds only.
    gradient = problem.W.T @ slack
    near = SLACK_TOLERANCE * size * np.linalg.norm(problem.W)
    assert np.all(gradient[t > problem.lower + ON_BOUND] <= near)
    assert np.all(gradient[t < problem.upper - ON_BOUND] >= -near)
    oracle = lsq_linear(
        problem.W, -problem.wrench, (problem.lower, problem.upper), method="trf", tol=1e-13
    )
    least = np.sqrt(2.0 * oracle.cost)
    assert np.linalg.norm(slack) == pytest.approx(least, rel=ORACLE_SLACK, abs=ORACLE_SLACK)


def test_slack_relaxed_takes_the_steps_it_needs():
    """SciPy's own limit on steps, one a cable, ends one per cent above the optimum here."""
    problem = random_problem(np.random.default_rng(1668), 4, 1, lowest=2.0, reach=0.6)
    t = distribute(problem, "slack_relaxed").tensions
    bounds = (problem.lower, problem.upper)
    oracle = lsq_linear(problem.W, -problem.wrench, bounds, method="trf", tol=1e-13)
    slack = np.linalg.norm(problem.W @ t + problem.wrench)
    assert slack == pytest.approx(np.sqrt(2.0 * oracle.cost), rel=ORACLE_SLACK)


def test_slack_relaxed_keeps_fixed_tensions():
    problem = TensionProblem(
        np.array([[1.0, -1.0, 0.5]]), [9.0], np.array([2.0, 3.0, 0.0]), np.array([2.0, 4.0, 1.0])
    )
    solution = distribute(problem, "slack_relaxed")
    assert solution.status == TensionStatus.INFEASIBLE
    np.testing.assert_allclose(solution.tensions, [2.0, 4.0, 0.0], atol=ROUNDING)
    assert solution.slack == pytest.approx(7.0)
