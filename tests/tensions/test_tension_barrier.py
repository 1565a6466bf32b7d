"""The smooth method: its minimum by IPOPT, continuous rates, wrench errors, warm starts."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import log
from pydrake.solvers import IpoptSolver, MathematicalProgram, SolverOptions

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.barrier_kernel import BARRIER, LEAST_SHARE, SOFTNESS, minimize_barrier
from cdpr_drake.tensions.methods import Distributor, distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus, writable
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from tests.tensions.tension_cases import random_problem

IPOPT = 1e-6  # of the range; IPOPT stops at gradients of 1e-9 of numbers around one
STATIONARY = 1e-9  # of gradients around 1e-2
SAME = 1e-9  # [N]; Newton's method ends at rounding wherever it starts
ROBOT = "acrobot_large"


def scaled(problem):
    """B and b of a wrench error e = B a + b, as the method has it, and the range [N]."""
    span = problem.upper - problem.lower
    B = problem.W * span / problem.scale_of_rows[:, None]
    b = (problem.W @ problem.lower + problem.wrench) / problem.scale_of_rows
    size = np.sqrt(b @ b + LEAST_SHARE**2 * np.sum(B**2))
    return B / size, b / size, span


def by_ipopt(problem):
    """Minimum of the printed function; its stiff term has a variable of its own, e = root s."""
    B, b, span = scaled(problem)
    n, m = B.shape
    root = np.sqrt(SOFTNESS)

    def cost(a):
        return sum(x**4 / 4.0 - BARRIER * (log(x) + log(1.0 - x)) for x in a)

    program = MathematicalProgram()
    a, s = program.NewContinuousVariables(m), program.NewContinuousVariables(n)
    program.AddCost(cost, a)
    program.AddQuadraticCost(np.eye(n), np.zeros(n), s, is_convex=True)
    program.AddLinearEqualityConstraint(np.hstack([B, -root * np.eye(n)]), -b, np.append(a, s))
    program.AddBoundingBoxConstraint(1e-12, 1.0 - 1e-12, a)
    options = SolverOptions()
    for name, value in (("tol", 1e-9), ("acceptable_tol", 1e-9), ("bound_relax_factor", 0.0)):
        options.SetOption(IpoptSolver.id(), name, value)
    options.SetOption(IpoptSolver.id(), "max_iter", 3000)
    program.SetInitialGuess(a, np.full(m, 0.5))
    program.SetInitialGuess(s, np.zeros(n))
    result = IpoptSolver().Solve(program, None, options)
    # Where it asks for more than rounding leaves it gives up at the optimum, and does not say so.
    return problem.lower + span * result.GetSolution(a)


@pytest.mark.parametrize(("n", "r"), [(1, 0), (2, 1), (3, 1), (3, 2), (6, 2), (6, 4)])
def test_the_minimum_is_that_of_ipopt(n, r):
    rng = np.random.default_rng(10 * n + r)
    for _ in range(3):
        problem = random_problem(rng, n, r, lowest=2.0)
        found = distribute(problem, "log_barrier").tensions
        np.testing.assert_allclose(found, by_ipopt(problem), rtol=0.0, atol=IPOPT * 60.0)


@pytest.mark.parametrize(("n", "r"), [(2, 1), (3, 2), (6, 2), (6, 5)])
def test_the_gradient_has_no_part_that_does_not_move_the_wrench(n, r):
    """Written anew: with a balanced wrench, the minimum is where the null space sees no slope."""
    rng = np.random.default_rng(r)
    for _ in range(20):
        problem = random_problem(rng, n, r, lowest=1.0)
        B, _, span = scaled(problem)
        solution = distribute(problem, "log_barrier")
        a = (solution.tensions - problem.lower) / span
        slope = a**3 - BARRIER / a + BARRIER / (1.0 - a)
        N = np.linalg.svd(B)[2][n:]
        np.testing.assert_allclose(N @ slope, 0.0, atol=STATIONARY)
        assert solution.status == TensionStatus.FEASIBLE


# Rates along a path.


def line(s):
    return pose_from_angles([-0.3 + 0.65 * s, 0.3 - 0.57 * s, 0.2 + 0.25 * s], np.zeros(3))


def rate_jumps(method, step, times=(0.1, 0.22)):
    """Largest change of a tension's rate from one step of a path to the next [N per path]."""
    robot = load_robot(ROBOT)
    grid = np.arange(times[0], times[1], step)
    t = np.array(
        [
            distribute(tension_problem(robot, line(s), limits=(2.0, 60.0)), method).tensions
            for s in grid
        ]
    )
    return float(np.max(np.abs(np.diff(t, 2, axis=0)))) / step


COARSE = 2e-3
"""Share of the path; the barrier acts over some fiftieths of it."""


@pytest.mark.parametrize(
    ("method", "smooth"), [("log_barrier", True), ("quadratic_program", False), ("median", False)]
)
def test_rates_are_continuous(method, smooth):
    """A rate without jumps changes half as much in half the step, one with a jump as much.

    Up to where in a step the jump is, which counts for up to half.
    """
    coarse, fine, finest = (rate_jumps(method, COARSE / k) for k in (1, 2, 4))
    ratios = np.array([fine / coarse, finest / fine])
    if smooth:
        np.testing.assert_allclose(ratios, 0.5, atol=0.1)
    else:
        assert np.all(ratios > 0.75)
        assert finest > 5.0  # [N per path]


# Where there are no tensions, and on the way there.


def heavier(factor):
    robot = load_robot(ROBOT)
    X_WP = pose_from_angles([0.2, -0.1, 0.3], np.zeros(3))
    return tension_problem(robot, X_WP, limits=(1.0, 12.0), mass=factor * 3.5)


def in_a_loop(problem):
    """What a step of control gets, shape (m,) [N], also where nothing is feasible."""
    return iterations(problem, np.zeros(problem.W.shape[1]))[1]


def wrench_error(t, problem):
    return float(np.linalg.norm((problem.W @ t + problem.wrench) / problem.scale_of_rows))


@pytest.mark.parametrize("factor", [3.0, 10.0, 300.0])
def test_the_error_of_an_infeasible_wrench_is_the_least_and_is_told(factor):
    problem = heavier(factor)
    solution, relaxed = (distribute(problem, name) for name in ("log_barrier", "slack_relaxed"))
    assert solution.status == relaxed.status == TensionStatus.INFEASIBLE
    assert np.all(np.isnan(solution.tensions))  # numbers beside "infeasible" would be read as some
    t = in_a_loop(problem)
    assert problem.residual(t) > 1e-3
    least = wrench_error(relaxed.tensions, problem)
    assert wrench_error(t, problem) == pytest.approx(least, rel=1e-6)
    assert np.all((t >= 1.0) & (t <= 12.0))


def test_the_way_into_what_is_infeasible_is_continuous():
    """The weight grows beyond what the bounds hold; tensions change no faster than before."""
    factors = np.linspace(1.0, 2.5, 150)
    problems = [heavier(f) for f in factors]
    solutions = [distribute(p, "log_barrier") for p in problems]
    states = [s.status for s in solutions]
    assert states[0] == TensionStatus.FEASIBLE
    assert states[-1] == TensionStatus.INFEASIBLE
    assert states == sorted(states, key=["feasible", "missed", "infeasible"].index)
    t = np.array([in_a_loop(p) for p in problems])
    assert np.max(np.abs(np.diff(t, axis=0))) < 60.0 * (factors[1] - factors[0])


def test_a_sliver_of_tensions_is_missed_with_a_small_error():
    """All cables pull one way, so zero is all there is: on the bounds, where the method is not."""
    one_way = np.array([[1.0, 2.0, 3.0], [0.3, 0.2, 0.7]])
    problem = TensionProblem(one_way, np.zeros(2), np.zeros(3), np.full(3, 60.0))
    solution = distribute(problem, "log_barrier")
    assert solution.status == TensionStatus.NOT_FOUND
    assert np.all(solution.tensions > 0.0)
    assert np.max(solution.tensions) < 1e-3
    assert np.linalg.norm(solution.slack) < 1e-3


# From the last step.


def iterations(problem, start):
    n, m = problem.W.shape
    t = np.empty(m)
    arrays = (problem.W, problem.wrench, problem.lower, problem.upper)
    return minimize_barrier(
        np.empty(workspace_shape(n, m)), *map(writable, arrays), start,
        writable(problem.scale_of_rows), t,
    ), t  # fmt: skip


def test_a_warm_start_needs_fewer_iterations_and_ends_where_a_cold_one_does():
    robot, m = load_robot(ROBOT), 8
    problems = [
        tension_problem(robot, line(s), limits=(1.5, 60.0)) for s in np.linspace(0.3, 0.7, 401)
    ]
    ready, last = Distributor(problems[0], "log_barrier"), None
    for problem in problems:
        cold_count, cold = iterations(problem, np.zeros(m))
        solution = ready(problem.W, problem.wrench, last)
        np.testing.assert_allclose(solution.tensions, cold, rtol=0.0, atol=SAME)
        if last is not None:
            warm_count, _ = iterations(problem, last)
            assert 1 <= warm_count <= 5 < cold_count <= 20
        last = solution.tensions


@pytest.mark.parametrize(
    "start", [np.full(8, 59.999999), np.full(8, 1.5 + 1e-9), np.full(8, np.nan)]
)
def test_a_bad_start_does_no_harm(start):
    problem = tension_problem(load_robot(ROBOT), line(0.5), limits=(1.5, 60.0))
    ready = Distributor(problem, "log_barrier")
    expected = distribute(problem, "log_barrier").tensions
    found = ready(problem.W, problem.wrench, start)
    np.testing.assert_allclose(found.tensions, expected, rtol=0.0, atol=SAME)


def test_a_start_of_another_size_is_refused():
    problem = tension_problem(load_robot(ROBOT), line(0.5))
    with pytest.raises(TensionProblemError, match=r"start: found shape \(3,\); accepted: \(8,\)"):
        Distributor(problem, "log_barrier")(problem.W, problem.wrench, np.ones(3))


def test_a_fixed_tension_stays():
    problem = random_problem(np.random.default_rng(5), 3, 2)
    fixed = distribute(problem, "log_barrier").tensions[1]
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[1] = upper[1] = fixed
    again = distribute(replace(problem, lower=lower, upper=upper), "log_barrier")
    assert again.status == TensionStatus.FEASIBLE
    assert again.tensions[1] == fixed
