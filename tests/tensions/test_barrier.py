"""The smooth method: its minimum, continuous rates, wrench errors, warm starts."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.barrier_kernel import BARRIER, LEAST_SHARE, SOFTNESS, minimize_barrier
from cdpr_drake.tensions.methods import Distributor, distribute
from cdpr_drake.tensions.problem import TensionProblem, writable
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from tests.tensions.tension_cases import numbers, random_problem

STATIONARY = 1e-8  # of gradients around 1
SAME = 1e-9  # [N]; Newton's method ends at rounding wherever it starts


def minimum(problem, start=None):
    """Number of iterations, and tensions as a step of control gets them, feasible or not."""
    n, m = problem.W.shape
    t, work = np.empty(m), np.empty(workspace_shape(n, m))
    start, scale = np.zeros(m) if start is None else start, writable(problem.scale_of_rows)
    return minimize_barrier(work, *numbers(problem), start, scale, t), t


@pytest.mark.parametrize(
    ("n", "r", "reach"),
    [(1, 0, 0.0), (2, 1, 0.0), (3, 2, 0.0), (6, 2, 0.0), (6, 4, 0.0), (3, 2, 0.5), (6, 4, 0.5)],
)
def test_gradient_is_zero_at_the_minimum(n, r, reach):
    """a^3 - BARRIER / a + BARRIER / (1 - a) + B' y = 0 with y = e / SOFTNESS."""
    rng = np.random.default_rng(10 * n + r)
    for _ in range(10):
        problem = random_problem(rng, n, r, lowest=2.0, reach=reach)
        problem = replace(problem, row_scale=rng.uniform(0.1, 1.0, n))
        solution = distribute(problem, "log_barrier")
        span = problem.upper - problem.lower
        B = problem.W * span / problem.scale_of_rows[:, None]
        b = (problem.W @ problem.lower + problem.wrench) / problem.scale_of_rows
        size = np.sqrt(b @ b + LEAST_SHARE**2 * np.sum(B**2))
        a = (minimum(problem)[1] - problem.lower) / span
        slope = a**3 - BARRIER / a + BARRIER / (1.0 - a)
        if solution.status != "missed":  # a sliver
            assert solution.status == distribute(problem).status
        if solution.status == "feasible":
            shares = (solution.tensions - problem.lower) / span
            np.testing.assert_allclose(a, shares, rtol=0.0, atol=SAME)
            N = np.linalg.svd(B)[2][n:]
            np.testing.assert_allclose(N @ slope, 0.0, atol=STATIONARY * max(1.0, np.ptp(slope)))
        elif solution.status == "infeasible":  # the error shows its multiplier
            error = (B @ a + b) / size
            y = np.linalg.lstsq((B / size).T, -slope, rcond=None)[0]
            tolerance = 1e-2 * np.linalg.norm(error)
            np.testing.assert_allclose(error, SOFTNESS * y, rtol=0.0, atol=tolerance)


# Rates along a path.


def problem_at(s, lower=2.0, **changes):
    place = [-0.3 + 0.65 * s, 0.3 - 0.57 * s, 0.2 + 0.25 * s]
    X_WP = pose_from_angles(place, np.zeros(3))
    return tension_problem(load_robot("acrobot_large"), X_WP, limits=(lower, 60.0), **changes)


@pytest.mark.parametrize(("method", "smooth"), [("log_barrier", True), ("median", False)])
def test_rates_are_continuous(method, smooth):
    """A smooth rate changes half as much in half the step, one with a jump at least 0.75 times."""
    problems = [problem_at(s) for s in np.arange(0.1, 0.22, 5e-4)]
    t = np.array([distribute(problem, method).tensions for problem in problems])
    changes = [np.max(np.abs(np.diff(t[::k], 2, axis=0))) / k for k in (4, 2, 1)]
    ratios = np.array(changes[1:]) / changes[:-1]
    if smooth:
        np.testing.assert_allclose(ratios, 0.5, atol=0.1)
    else:
        assert np.all(ratios > 0.75)


def heavier(factor):
    X_WP = pose_from_angles([0.2, -0.1, 0.3], np.zeros(3))
    mass = factor * 3.5
    return tension_problem(load_robot("acrobot_large"), X_WP, limits=(1.0, 12.0), mass=mass)


@pytest.mark.parametrize("factor", [3.0, 300.0])
def test_the_error_of_an_infeasible_wrench_is_the_least(factor):
    problem = heavier(factor)
    smooth, relaxed = (distribute(problem, name) for name in ("log_barrier", "slack_relaxed"))
    assert smooth.status == relaxed.status == "infeasible"
    assert np.all(np.isnan(smooth.tensions))  # beside "infeasible" they would be taken for some
    _, t = minimum(problem)
    assert problem.residual(t) > 1e-3
    slacks = problem.W @ t + problem.wrench, relaxed.slack
    errors = [np.linalg.norm(slack / problem.scale_of_rows) for slack in slacks]
    assert errors[0] == pytest.approx(errors[1], rel=1e-6)
    assert np.all((t >= 1.0) & (t <= 12.0))


def test_the_way_into_the_infeasible_is_continuous():
    """The weight grows beyond what the bounds hold; tensions change no faster than before."""
    factors = np.linspace(1.0, 2.5, 100)
    problems = [heavier(factor) for factor in factors]
    states = [distribute(problem, "log_barrier").status for problem in problems]
    assert (states[0], states[-1]) == ("feasible", "infeasible")
    assert states == sorted(states, key=["feasible", "missed", "infeasible"].index)
    steps = np.diff([minimum(problem)[1] for problem in problems], axis=0)
    assert np.max(np.abs(steps)) < 60.0 * (factors[1] - factors[0])


def test_a_sliver_is_missed_with_a_small_error():
    """All cables pull one way: zero, on the bounds, is all there is."""
    W = np.array([[1.0, 2.0, 3.0], [0.3, 0.2, 0.7]])
    problem = TensionProblem(W, np.zeros(2), np.zeros(3), np.full(3, 60.0))
    solution = distribute(problem, "log_barrier")
    assert solution.status == "missed"
    assert np.all((solution.tensions > 0.0) & (solution.tensions < 1e-3))
    assert np.linalg.norm(solution.slack) < 1e-3


def test_starts():
    problem, start = problem_at(0.5), distribute(problem_at(0.499), "log_barrier").tensions
    cold, expected = minimum(problem, writable(problem.upper))
    warm, t = minimum(problem, start)
    assert 0 < warm <= 5 < cold
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=SAME)
    # Out of the bounds, or on them, a start is ignored.
    ready = Distributor(problem, "log_barrier")
    for wrong in (np.full(8, 70.0), problem.lower, np.full(8, np.nan)):
        solution = ready(problem.W, problem.wrench, wrong)
        np.testing.assert_allclose(solution.tensions, expected, rtol=0.0, atol=SAME)


def test_a_fixed_tension_stays():
    problem = random_problem(np.random.default_rng(5), 3, 2)
    fixed = distribute(problem, "log_barrier").tensions[1]
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[1] = upper[1] = fixed
    again = distribute(replace(problem, lower=lower, upper=upper), "log_barrier")
    assert (again.status, again.tensions[1]) == ("feasible", fixed)
