"""Tension distribution by Drake's solvers agrees with the kernels; the published tensions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.solvers import ClarabelSolver, ClpSolver, OsqpSolver

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.tensions.program import make_program, program_tensions
from tests.models.published_points import LARGE_ANCHORS

# Servoing thesis, section 1.3.4: the suspended robot of Rennes with its large platform.
EXIT_POINTS = np.array(
    [
        (-0.47, -0.525, 1.165),
        (-0.52, -0.465, 1.165),
        (-0.52, 0.475, 1.165),
        (-0.47, 0.53, 1.165),
        (0.47, 0.53, 1.165),
        (0.52, 0.475, 1.165),
        (0.525, -0.47, 1.165),
        (0.47, -0.52, 1.165),
    ]
).T
ANCHOR_POINTS = np.array(LARGE_ANCHORS).T
MASS, GRAVITY = 3.5, 9.81
PUBLISHED_POSE = RigidTransform([0.35, -0.27, 0.45])
PUBLISHED_TENSIONS = np.array([2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31])
PRINTED_ROUNDING = 0.005  # [N]; tensions are printed with two decimals

# Objectives relative to the largest tension; Drake's linear and quadratic defaults.
CLARABEL = 1e-6  # stops at a gap of 1e-8, scaled
CLP = 1e-8  # a simplex method with feasibility 1e-7, scaled
OSQP = 1e-2  # stops at residuals of 1e-3 before it polishes, if it manages to
BALANCE = 1e-6  # relative; of an interior method that stops at 1e-8, in other scales

SLACK_TENSIONS = 1e-3  # relative; the slack is flat where a cable adds little to it

HAIR = 1e-4  # [N]; nearer to the limit than that an interior method may err

ROW_SCALE = np.array([0.15, 0.15, 0.15, 1.0, 1.0, 1.0])  # [m, -]; anchors 0.13 m from Po


def slack_norm(t, problem):
    scale = 1.0 if problem.row_scale is None else problem.row_scale
    return np.linalg.norm((problem.W @ t + problem.wrench) / scale)


OBJECTIVES = {
    "linear_program": lambda t, problem: np.sum(t),
    "quadratic_program": lambda t, problem: np.linalg.norm(t),
    "reference_program": lambda t, problem: np.linalg.norm(t - problem.reference),
    "infinity_norm": lambda t, problem: np.max(t),
    "optimally_safe": lambda t, problem: min(np.min(t - problem.lower), np.min(problem.upper - t)),
    "slack_relaxed": slack_norm,
    "median": lambda t, problem: np.linalg.norm(t - (problem.lower + problem.upper) / 2.0),
}
GOALS = [name for name, method in METHODS.items() if method.program]
BALANCED = [goal for goal in GOALS if goal != "slack_relaxed"]
LINEAR = ("linear_program", "infinity_norm", "optimally_safe")

poses = st.builds(
    lambda a, p: RigidTransform(rotation_from_angles(np.array(a)), p),
    st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.2, 0.5)),
)
wide_poses = st.builds(
    lambda a, p: RigidTransform(rotation_from_angles(np.array(a)), p),
    st.tuples(*[st.floats(-0.4, 0.4)] * 3),
    st.tuples(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45), st.floats(0.0, 0.9)),
)


def suspended(X_WP, lower=0.0, upper=60.0, p_PCo=(0.0, 0.0, 0.0), mass=MASS):
    W = wrench_matrix(X_WP, EXIT_POINTS, ANCHOR_POINTS)
    w = gravity_wrench(X_WP, mass, np.array(p_PCo), GRAVITY)
    reference = np.linspace(0.0, 14.0, 8)
    return TensionProblem(W, w, np.full(8, lower), np.full(8, upper), reference, ROW_SCALE)


def check(problem, goal, solver, tolerance):
    """The objective of a solver's tensions is that of the kernels, and they are as feasible."""
    t = program_tensions(problem, goal, solver)
    expected = distribute(problem, goal)
    assert expected.status == TensionStatus.FEASIBLE
    size = np.max(expected.tensions)
    value, best = (OBJECTIVES[goal](x, problem) for x in (t, expected.tensions))
    assert value == pytest.approx(best, abs=tolerance * size * len(t))
    assert problem.residual(t) <= max(tolerance, BALANCE)
    assert np.all(t >= problem.lower - tolerance * size)
    assert np.all(t <= problem.upper + tolerance * size)


def test_the_goals_are_methods_too():
    assert set(GOALS) == set(OBJECTIVES)


@settings(max_examples=20)
@pytest.mark.parametrize("goal", GOALS)
@given(poses)
def test_every_goal_agrees_with_the_kernels(goal, X_WP):
    check(suspended(X_WP, lower=1.0), goal, None, CLARABEL)


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize(("n", "m"), [(1, 3), (2, 4), (3, 4), (3, 5), (6, 11)])
def test_robots_of_any_size(goal, n, m):
    rng = np.random.default_rng(10 * n + m)
    W = rng.normal(size=(n, m))
    w = -W @ rng.uniform(10.0, 50.0, m)
    problem = TensionProblem(W, w, np.full(m, 2.0), np.full(m, 60.0), rng.uniform(0, 60, m))
    check(problem, goal, None, CLARABEL)


@pytest.mark.parametrize("goal", GOALS)
def test_another_solver_is_taken_by_its_id(goal):
    problem = suspended(PUBLISHED_POSE, lower=1.0)
    check(problem, goal, ClarabelSolver.id(), CLARABEL)
    if goal in LINEAR:
        check(problem, goal, ClpSolver.id(), CLP)
    else:
        check(problem, goal, OsqpSolver.id(), OSQP)


INFEASIBLE = pytest.mark.parametrize(
    ("lower", "upper", "x"),
    [
        (0.0, 5.0, 0.0),  # too weak for the weight
        (20.0, 60.0, 0.0),  # cables that pull so much from above lift the platform
        (0.0, 60.0, 2.0),  # outside the frame
    ],
)


@pytest.mark.parametrize("goal", BALANCED)
@INFEASIBLE
def test_what_is_infeasible_gives_nothing(goal, lower, upper, x):
    problem = suspended(RigidTransform([x, 0.0, 0.3]), lower, upper)
    assert program_tensions(problem, goal) is None
    assert distribute(problem, goal).status == TensionStatus.INFEASIBLE


@INFEASIBLE
def test_the_least_slack_is_that_of_the_program(lower, upper, x):
    problem = suspended(RigidTransform([x, 0.0, 0.3]), lower, upper)
    t = program_tensions(problem, "slack_relaxed")
    solution = distribute(problem, "slack_relaxed")
    assert solution.status == TensionStatus.INFEASIBLE
    assert slack_norm(solution.tensions, problem) > 0.1  # [N]; not a rounding
    size = np.max(solution.tensions)
    # The tensions themselves agree: too few are off their bounds for more than one choice.
    np.testing.assert_allclose(solution.tensions, t, rtol=0.0, atol=SLACK_TENSIONS * size)


@settings(max_examples=40)
@given(wide_poses, st.sampled_from([0.0, 3.0]), st.sampled_from([4.0, 10.0, 60.0]))
def test_no_slack_is_less_than_that_of_the_kernel(X_WP, lower, upper):
    problem = suspended(X_WP, lower, upper)
    t = distribute(problem, "slack_relaxed").tensions
    by_solver = np.clip(program_tensions(problem, "slack_relaxed"), lower, upper)
    size = np.linalg.norm(problem.wrench)
    assert slack_norm(t, problem) <= slack_norm(by_solver, problem) + CLARABEL * size


def test_an_unknown_goal_is_refused():
    with pytest.raises(TensionProblemError, match=r"goal: found magic; accepted: linear_program, "):
        make_program(suspended(PUBLISHED_POSE), "magic")


def test_a_missing_reference_is_refused():
    full = suspended(PUBLISHED_POSE)
    problem = TensionProblem(full.W, full.wrench, full.lower, full.upper)
    with pytest.raises(TensionProblemError, match="reference_program: found no reference"):
        program_tensions(problem, "reference_program")


def test_a_program_takes_more_constraints():
    """Two cables of one tension, which no method here knows."""
    problem = suspended(PUBLISHED_POSE)
    program, t, scale = make_program(problem, "quadratic_program")
    program.AddLinearEqualityConstraint(t[2] - t[3], 0.0)
    result = ClarabelSolver().Solve(program)
    assert result.is_success()
    tensions = result.GetSolution(t) * scale
    size = np.max(tensions)
    assert tensions[2] == pytest.approx(tensions[3], abs=CLARABEL * size)
    assert problem.residual(tensions) <= BALANCE
    least = np.linalg.norm(distribute(problem).tensions)
    assert np.linalg.norm(tensions) >= least - CLARABEL * size


@settings(max_examples=40)
@given(wide_poses, st.sampled_from([0.0, 0.5, 3.0]), st.sampled_from([10.0, 20.0, 60.0]))
def test_verdicts_agree_where_the_solver_can_tell(X_WP, lower, upper):
    problem = suspended(X_WP, lower, upper)
    by_solver = program_tensions(problem, "quadratic_program") is not None
    by_kernel = distribute(problem).status == TensionStatus.FEASIBLE
    if by_solver != by_kernel:  # then the kernel too is of two minds a hair's breadth away
        wider = suspended(X_WP, max(lower - HAIR, 0.0), upper + HAIR)
        narrower = suspended(X_WP, lower + HAIR, upper - HAIR)
        assert distribute(wider).status == TensionStatus.FEASIBLE
        assert distribute(narrower).status == TensionStatus.INFEASIBLE


def test_tensions_scale_with_the_weight():
    t = program_tensions(suspended(PUBLISHED_POSE), "quadratic_program")
    for factor in (1e-3, 1e3):
        heavy = suspended(PUBLISHED_POSE, 0.0, 60.0 * factor, mass=MASS * factor)
        exact = distribute(heavy).tensions
        np.testing.assert_allclose(exact, factor * distribute(suspended(PUBLISHED_POSE)).tensions)
        scaled = program_tensions(heavy, "quadratic_program")
        size = np.linalg.norm(factor * t)
        assert np.linalg.norm(scaled) == pytest.approx(size, rel=1e3 * CLARABEL)


@settings(max_examples=30)
@given(poses, st.sampled_from([0.0, 1.0]))
def test_without_active_bounds_the_optimum_is_the_pseudo_inverse(X_WP, lower):
    problem = suspended(X_WP, lower)
    least = -np.linalg.pinv(problem.W) @ problem.wrench
    if np.all((least > lower) & (least < 60.0)):
        np.testing.assert_allclose(distribute(problem).tensions, least, rtol=1e-10)


def test_the_published_tensions_balance_the_weight():
    """They do, to the rounding of the print, for a centre of mass anywhere on the z axis of P.

    The platform is not rotated, so the height of its centre of mass makes no moment; the residual
    about Po shows that the thesis has the centre of mass above Po, not off to a side.
    """
    for height in (0.0, 0.035, 0.1):
        problem = suspended(PUBLISHED_POSE, p_PCo=(0.0, 0.0, height))
        allowed = np.sum(np.abs(problem.W), axis=1) * PRINTED_ROUNDING
        assert np.all(np.abs(problem.W @ PUBLISHED_TENSIONS + problem.wrench) <= allowed)


def test_the_published_tensions_would_not_balance_a_centre_of_mass_5_mm_aside():
    for p_PCo in ((0.005, 0.0, 0.0), (0.0, 0.005, 0.0)):
        problem = suspended(PUBLISHED_POSE, p_PCo=p_PCo)
        allowed = np.sum(np.abs(problem.W), axis=1) * PRINTED_ROUNDING
        assert np.any(np.abs(problem.W @ PUBLISHED_TENSIONS + problem.wrench) > allowed)


def test_the_least_norm_is_not_larger_than_that_of_the_published_tensions():
    t = program_tensions(suspended(PUBLISHED_POSE), "quadratic_program")
    slack = np.linalg.norm(np.full(8, PRINTED_ROUNDING))
    assert np.linalg.norm(t) <= np.linalg.norm(PUBLISHED_TENSIONS) + slack
