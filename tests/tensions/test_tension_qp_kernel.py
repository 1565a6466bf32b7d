"""The exact quadratic program: optimality, verdicts against two solvers and a known truth."""

import ctypes

import daqp
import numpy as np
import pytest
import quadprog
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog, lsq_linear

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    nearest_tensions,
    nearest_tensions_in,
    project_on_polytope,
    workspace_shape,
)

OPTIMUM_TOLERANCE = 1e-9  # relative to the largest tension; what the issue asks for
BALANCE_TOLERANCE = 1e-9  # relative to the wrench and the cables' forces; a solution's promise
KKT_TOLERANCE = 1e-9  # relative to the gradient; both sides are linear algebra of condition < 1e5
DAQP_TOLERANCE = 1e-6  # [-], [N m, N]; daqp's primal_tol: a problem off by less passes as feasible
ON_BOUND = 1e-13  # relative to the forces; an active bound is met up to the step's rounding
LP_TOLERANCE = 1e-7  # [N]; HiGHS' feasibility tolerance, on numbers of size one
MARGIN_TOLERANCE = 1e-9  # relative; of the known truth, far below the 1e-8 it decides about

POSES = 10_000  # a robot
NEAR = 1e-3, 1e-6, 1e-8  # how far the lower bounds are from the limit, relative
ROBOTS = {"acrobot_large": (0.0, 60.0), "caroca": (30.0, 3000.0)}  # [N]
UNBOUNDED = 1.0e5  # [N]; upper bound of the cases near the limit, never what limits them

DAQP_SENSE = np.array([0] * 8 + [5] * 6, dtype=ctypes.c_int)  # 5: active and immutable, equality
IDENTITY, NO_COST = np.eye(8), np.zeros(8)


def solve(W, w, lower, upper, reference=None):
    m = W.shape[1]
    t = np.full(m, np.nan)
    wanted = np.zeros(m) if reference is None else reference
    W = np.ascontiguousarray(W)  # as all who call it: for each order the kernel is compiled anew
    code = nearest_tensions(W, np.asarray(w, float), lower, upper, wanted, t)
    return code, t


def by_quadprog(W, w, lower, upper, reference=None):
    """Tensions or None; the dual method of the same paper in the authors' Fortran."""
    m = W.shape[1]
    wanted = np.zeros(m) if reference is None else reference
    constraints = np.hstack([W.T, np.eye(m), -np.eye(m)])
    values = np.concatenate([-w, lower, -upper])
    try:
        return quadprog.solve_qp(np.eye(m), wanted, constraints, values, len(w))[0]
    except ValueError as error:
        if "inconsistent" in str(error):
            return None
        raise


def by_daqp(W, w, lower, upper):
    high, low = np.concatenate([upper, -w]), np.concatenate([lower, -w])
    return daqp.solve(IDENTITY, NO_COST, np.ascontiguousarray(W), high, low, DAQP_SENSE)[2] > 0


def robot_wrenches(name, count, seed=0):
    """Wrench matrices and weights at random poses in the frame."""
    robot = load_robot(name)
    A, B = robot.exit_points(), robot.anchor_points()
    center = (robot.frame.lower + robot.frame.upper) / 2.0
    half = (robot.frame.upper - robot.frame.lower) / 2.0
    rng = np.random.default_rng(seed)
    for _ in range(count):
        X_WP = pose_from_angles(
            center + half * rng.uniform(-0.95, 0.95, 3), rng.uniform(-0.5, 0.5, 3)
        )
        w = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass())
        yield wrench_matrix(X_WP, A, B), w


def highest_floor(W, w):
    """The largest possible smallest tension [N]; None if it is zero or if upper bounds limit it."""
    free = TensionProblem(W, w, np.zeros(8), np.full(8, UNBOUNDED))
    solution = distribute(free, "optimally_safe")
    if solution.status != "feasible":
        return None
    floor, ceiling = np.min(solution.tensions), np.max(solution.tensions)
    return floor if floor > 1e-6 and floor + ceiling < 0.9 * UNBOUNDED else None


def verdicts(name):
    """Per pose: how near the limit (None: as it comes), code, what quadprog and daqp say, error."""
    lowest, highest = ROBOTS[name]
    for k, (W, w) in enumerate(robot_wrenches(name, POSES)):
        lower, upper, near = np.full(8, lowest), np.full(8, highest), None
        floor = highest_floor(W, w) if k % 3 == 0 else None
        if floor is not None:
            near = NEAR[k // 3 % 3] * (1.0 if k // 9 % 2 else -1.0)
            lower, upper = np.full(8, floor * (1.0 + near)), np.full(8, UNBOUNDED)
        code, t = solve(W, w, lower, upper)
        expected = by_quadprog(W, w, lower, upper)
        error = 0.0
        if code == FEASIBLE:
            assert np.all(t >= lower)
            assert np.all(t <= upper)
            assert np.linalg.norm(W @ t + w) <= BALANCE_TOLERANCE * np.linalg.norm(w)
            if expected is not None:
                error = np.max(np.abs(t - expected)) / np.max(np.abs(expected))
        beyond = None if near is None else abs(near) * floor
        yield near, code, expected is not None, by_daqp(W, w, lower, upper), error, beyond


@pytest.mark.parametrize("name", ROBOTS)
def test_verdicts_and_optima_on_ten_thousand_poses(name):
    """No wrong verdict, also a hundred millionth off the limit.

    The truth near the limit is known from how the case was made. daqp takes a problem for feasible
    whose bounds it passes by up to its tolerance, so it is a witness only farther away than that.
    """
    rows = list(verdicts(name))
    hard = sum(code != FEASIBLE or near is not None for near, code, *_ in rows)
    assert hard >= 0.5 * POSES
    known = [(near, code) for near, code, *_ in rows if near is not None]
    assert len(known) > 0.1 * POSES
    assert all((code == FEASIBLE) == (near < 0.0) for near, code in known)
    assert all(code == (FEASIBLE if quad else INFEASIBLE) for _, code, quad, *_ in rows)
    clear = [
        (code == FEASIBLE, dual)
        for _, code, _, dual, _, beyond in rows
        if beyond is None or beyond > 10.0 * DAQP_TOLERANCE
    ]
    assert len(clear) > 0.7 * POSES
    assert all(ours == dual for ours, dual in clear)
    assert max(error for *_, error, _ in rows) <= OPTIMUM_TOLERANCE


@pytest.mark.parametrize("name", ROBOTS)
def test_the_known_truth_is_that_of_an_independent_linear_program(name):
    checked = 0
    for W, w in robot_wrenches(name, 120, seed=1):
        floor = highest_floor(W, w)
        if floor is None:
            continue
        rows = np.hstack([-np.eye(8), np.ones((8, 1))])
        result = linprog(
            np.append(np.zeros(8), -1.0),
            A_ub=rows,
            b_ub=np.zeros(8),
            A_eq=np.hstack([W, np.zeros((6, 1))]),
            b_eq=-w,
            bounds=[(None, UNBOUNDED)] * 8 + [(None, None)],
            method="highs",
        )
        assert -result.fun == pytest.approx(floor, rel=MARGIN_TOLERANCE)
        checked += 1
    assert checked > 20


@st.composite
def problems(draw):
    """Random problems of any size, most with tensions, some on the edge of having none."""
    n = draw(st.integers(1, 6))
    r = draw(st.sampled_from([0, 1, 2, 3, 5]))
    m = n + r
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    W = rng.normal(size=(n, m))
    if r > 0 and draw(st.booleans()):
        W[:, -1] = W[:, 0]  # two cables side by side
    lower = rng.uniform(0.0, 10.0, m)
    upper = lower + rng.uniform(5.0, 50.0, m)
    if draw(st.booleans()):
        fixed = rng.random(m) < 0.2
        upper[fixed] = lower[fixed]
    inside = lower + (upper - lower) * rng.uniform(0.0, 1.0, m)
    outside = lower + (upper - lower) * rng.uniform(-1.0, 2.0, m)
    w = -W @ (inside if draw(st.booleans()) else outside)
    return W, w, lower, upper, rng.uniform(-20.0, 80.0, m) * draw(st.sampled_from([0.0, 1.0]))


def distance_to_feasible(W, w, lower, upper):
    """By how much the bounds must give at least [N]; negative: by how much they could close."""
    n, m = W.shape
    reach = np.ones((m, 1))
    result = linprog(
        np.append(np.zeros(m), 1.0),
        A_ub=np.block([[-np.eye(m), -reach], [np.eye(m), -reach]]),
        b_ub=np.concatenate([-lower, upper]),
        A_eq=np.hstack([W, np.zeros((n, 1))]),
        b_eq=-w,
        bounds=[(None, None)] * (m + 1),
        method="highs",
    )
    assert result.success
    return result.fun


@given(problems())
def test_optima_satisfy_the_kuhn_tucker_conditions(problem):
    """t - reference = W' y + p - q with p, q >= 0 only on lower and upper bounds."""
    W, w, lower, upper, reference = problem
    code, t = solve(*problem)
    if code != FEASIBLE:
        assert code == INFEASIBLE
        assert distance_to_feasible(W, w, lower, upper) > -LP_TOLERANCE
        return
    assert distance_to_feasible(W, w, lower, upper) < LP_TOLERANCE
    assert np.all((t >= lower) & (t <= upper))
    n, m = W.shape
    scale = np.linalg.norm(w) + np.linalg.norm(np.abs(W) @ np.abs(t))
    assert np.linalg.norm(W @ t + w) <= BALANCE_TOLERANCE * scale
    on_lower, on_upper = t - lower <= ON_BOUND * scale, upper - t <= ON_BOUND * scale
    normals = np.hstack([W.T, np.eye(m)[:, on_lower], -np.eye(m)[:, on_upper]])
    sides = normals.shape[1] - n
    gradient = t - reference
    duals = lsq_linear(
        normals,
        gradient,
        (np.concatenate([np.full(n, -np.inf), np.zeros(sides)]), np.inf),
        method="bvls",
        tol=1e-14,
    )
    left = np.linalg.norm(normals @ duals.x - gradient)
    assert left <= KKT_TOLERANCE * max(np.linalg.norm(gradient), 1.0)


@given(problems())
def test_optima_are_those_of_quadprog(problem):
    code, t = solve(*problem)
    expected = by_quadprog(*problem)
    W, w, lower, upper, _ = problem
    if (code == FEASIBLE) != (expected is not None):  # one of them on the very edge
        assert abs(distance_to_feasible(W, w, lower, upper)) < LP_TOLERANCE
    elif expected is not None:
        size = max(np.max(np.abs(expected)), 1.0)
        allowed = OPTIMUM_TOLERANCE * size * max(np.linalg.cond(W) / 1e3, 1.0)
        np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed)


def test_two_cables_side_by_side_share_evenly():
    W = np.array([[1.0, 1.0, -1.0]])
    code, t = solve(W, [-4.0], np.zeros(3), np.full(3, 10.0))
    assert code == FEASIBLE
    np.testing.assert_allclose(t, [4 / 3 + 2 / 3, 2.0, 0.0], rtol=0.0, atol=1e-14)


def test_four_cables_in_the_plane_of_a_point():
    """A square of cables around a weightless point: all on the lower bound, by symmetry."""
    W = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    code, t = solve(W, np.zeros(2), np.full(4, 2.0), np.full(4, 9.0))
    assert code == FEASIBLE
    np.testing.assert_allclose(t, 2.0, rtol=1e-14)


def test_a_zero_wrench_takes_no_tension():
    W = np.random.default_rng(2).normal(size=(6, 8))
    code, t = solve(W, np.zeros(6), np.zeros(8), np.full(8, 60.0))
    assert code == FEASIBLE
    np.testing.assert_array_equal(t, 0.0)


def test_fixed_tensions_are_kept_or_refused():
    W = np.random.default_rng(4).normal(size=(3, 5))
    fixed = np.array([3.0, 5.0, 7.0, 11.0, 13.0])
    code, t = solve(W, -W @ fixed, fixed, fixed)
    assert code == FEASIBLE
    np.testing.assert_array_equal(t, fixed)
    assert solve(W, -W @ fixed + [0.0, 1e-6, 0.0], fixed, fixed)[0] == INFEASIBLE


def test_without_redundancy_the_only_tensions_are_judged():
    W = np.array([[0.6, -0.6], [0.8, 0.8]])
    code, t = solve(W, [0.0, -8.0], np.zeros(2), np.full(2, 5.0))
    assert code == FEASIBLE
    np.testing.assert_allclose(t, 5.0, rtol=1e-14)
    assert solve(W, [0.0, -8.0], np.zeros(2), np.full(2, 4.9))[0] == INFEASIBLE
    assert solve(W, [5.0, -1.0], np.zeros(2), np.full(2, 50.0))[0] == INFEASIBLE


@pytest.mark.parametrize("W", [np.zeros((2, 4)), np.ones((2, 3))])
def test_a_singular_wrench_matrix_has_its_own_code(W):
    m = W.shape[1]
    assert solve(W, np.ones(2), np.zeros(m), np.ones(m))[0] == SINGULAR


@pytest.mark.parametrize("place", ["W", "w", "reference"])
def test_nan_is_never_feasible(place):
    W = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])
    w, reference = np.array([-1.0, -1.0]), np.zeros(3)
    {"W": W[0], "w": w, "reference": reference}[place][0] = np.nan
    assert solve(W, w, np.zeros(3), np.full(3, 10.0), reference)[0] != FEASIBLE


@given(problems())
def test_a_work_space_that_was_used_before_changes_nothing(problem):
    code, t = solve(*problem)
    again = np.full_like(t, np.nan)
    work = np.full(workspace_shape(*problem[0].shape), np.nan)
    assert nearest_tensions_in(work, *problem, again) == code
    if code == FEASIBLE:
        np.testing.assert_array_equal(again, t)


def test_a_point_within_bounds_stays_where_it_is():
    N = np.linalg.qr(np.random.default_rng(0).normal(size=(6, 3)))[0].T.copy()
    t = np.full(6, 5.0)
    work = np.empty((3 * 3 + 6, 8))
    assert project_on_polytope(t, N, np.zeros(6), np.full(6, 10.0), 0.0, work) == FEASIBLE
    np.testing.assert_array_equal(t, 5.0)


@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_the_projection_is_the_nearest_point(r, seed):
    """No feasible point is nearer: those that other starts are projected to, and their mixtures."""
    rng = np.random.default_rng(seed)
    N = np.linalg.qr(rng.normal(size=(r + 4, r)))[0].T.copy()
    start = rng.normal(size=r + 4) * 5.0
    lower, upper = np.full(r + 4, -6.0), np.full(r + 4, 6.0)
    work = np.empty((3 * r + 6, r + 6))
    nearest = start.copy()
    if project_on_polytope(nearest, N, lower, upper, 0.0, work) != FEASIBLE:
        return
    for _ in range(5):
        other = start + N.T @ rng.normal(size=r) * 5.0
        assert project_on_polytope(other, N, lower, upper, 0.0, work) == FEASIBLE
        # The angle at the nearest point towards any other feasible one is obtuse.
        assert (start - nearest) @ (other - nearest) <= 1e-9


@given(st.integers(1, 3), st.integers(0, 2**32 - 1), st.sampled_from([1e2, 1e4, 1e6]))
def test_the_only_feasible_tensions_are_found_from_a_far_reference(r, seed, far):
    """No margin at all: the bounds leave one point, and the reference brings its rounding."""
    rng = np.random.default_rng(seed)
    n = 3
    W = rng.normal(size=(n, n + r))
    only = rng.uniform(5.0, 10.0, n + r)
    code, t = solve(W, -W @ only, only, only, far * rng.normal(size=n + r))
    assert code == FEASIBLE
    np.testing.assert_array_equal(t, only)
