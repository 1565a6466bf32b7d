"""The methods: published tensions, refusals, oracles from SciPy, small robots, continuity."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from scipy.optimize import linprog, lsq_linear

from cdpr_drake.cable_geometry import gravity_wrench, wrench_matrix
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models import load_robot
from cdpr_drake.poses import pose_from_angles
from cdpr_drake.tension_methods import (
    METHODS,
    distribute,
    exact_tensions,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tension_polygon import polygon_steiner_point
from cdpr_drake.tension_problem import TensionProblem, TensionStatus

PRINTED_ROUNDING = 0.005  # [N]; the thesis prints two decimals
HOMING_TOLERANCE = 0.02 + PRINTED_ROUNDING  # [N]; the thesis' pose is that of the real platform
OBJECTIVE_TOLERANCE = 1e-7  # relative to the largest bound; HiGHS stops at 1e-7
SLACK_TOLERANCE = 1e-8  # relative to the wrench; of a least-squares optimum, by its gradient
ORACLE_SLACK = 1e-5  # relative; SciPy's interior method comes this near
NORM_TOLERANCE = 1e-7  # [N]; others may be off balance by 1e-9 of the forces, W lengthens that
BALANCE = 1e-9  # relative to the forces; what a solution promises
ON_BOUND = 1e-12  # [N]; an active bound is met up to the rounding of tensions of 60 N
ROUNDING = 1e-12  # relative; two ways to compute the same tensions

RATE = 1000  # [Hz]; of the paths
PATH_TIME = 2.0  # [s]
HALF_FRAME = 0.6  # [m]; acrobot_large
STEP_ROUNDING = 1e-9  # [N]

PUBLISHED = {
    # Servoing thesis, section 1.3.4: position of the platform, tensions, how near.
    "off the middle": (
        (0.35, -0.27, 0.45),
        (2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31),
        PRINTED_ROUNDING,
    ),
    "homing": (
        (0.0, 0.0, 0.15),
        (5.22, 5.46, 5.16, 5.41, 5.13, 5.39, 5.22, 5.46),
        HOMING_TOLERANCE,
    ),
}

FREE = [name for name, method in METHODS.items() if method.takes(0)]
BOUND_TO_SOME = {n: m.redundancies for n, m in METHODS.items() if m.redundancies is not None}


def load_acrobot():
    robot = load_robot("acrobot_large")
    A, B = robot.exit_points(), robot.anchor_points()
    weight = robot.platform.mass, robot.center_of_mass()

    def problem(X_WP, lower=0.0, upper=60.0, reference=None):
        W, w = wrench_matrix(X_WP, A, B), gravity_wrench(X_WP, *weight)
        return TensionProblem(W, w, np.full(8, lower), np.full(8, upper), reference)

    return problem


acrobot = load_acrobot()


@pytest.mark.parametrize(("position", "tensions", "near"), PUBLISHED.values(), ids=PUBLISHED.keys())
def test_the_published_tensions(position, tensions, near):
    solution = distribute(acrobot(RigidTransform(position)), "barycenter")
    assert solution.status == TensionStatus.FEASIBLE
    np.testing.assert_allclose(solution.tensions, tensions, rtol=0.0, atol=near)


def random_problem(rng, n, r, lowest=0.0, highest=60.0, reach=0.0):
    """Balanced tensions between the bounds, or out of them by up to a share of the span."""
    m = n + r
    W = rng.normal(size=(n, m))
    t = lowest + (highest - lowest) * rng.uniform(-reach, 1.0 + reach, m)
    reference = rng.uniform(lowest, highest, m)
    return TensionProblem(W, -W @ t, np.full(m, lowest), np.full(m, highest), reference)


seeds = st.integers(0, 2**32 - 1)


def test_the_names_are_those_of_the_field():
    assert set(METHODS) == {
        "pseudo_inverse",
        "closed_form",
        "improved_closed_form",
        "kernel",
        "linear_program",
        "infinity_norm",
        "quadratic_program",
        "reference_program",
        "barycenter",
        "polygon_1_norm",
        "polygon_2_norm",
        "puncture",
        "dykstra",
        "weighted_vertices",
        "optimally_safe",
        "slack_relaxed",
    }
    assert all(name == method.name and method.title for name, method in METHODS.items())


def test_an_unknown_method_is_refused():
    with pytest.raises(TensionProblemError, match=r"method: found magic; accepted: .*barycenter"):
        distribute(acrobot(RigidTransform([0.0, 0.0, 0.3])), "magic")


@pytest.mark.parametrize("r", [0, 1, 2, 3])
@pytest.mark.parametrize("method", BOUND_TO_SOME)
def test_another_redundancy_is_refused(method, r):
    problem = random_problem(np.random.default_rng(r), 3, r)
    needed = BOUND_TO_SOME[method]
    if r in needed:
        assert distribute(problem, method).status == TensionStatus.FEASIBLE
        return
    message = rf"{method}: found redundancy m - n = {r}; accepted: {' or '.join(map(str, needed))}"
    with pytest.raises(TensionProblemError, match=message):
        distribute(problem, method)


@pytest.mark.parametrize("r", [0, 2])
def test_a_missing_reference_is_refused(r):
    problem = random_problem(np.random.default_rng(0), 2, r)
    bare = TensionProblem(problem.W, problem.wrench, problem.lower, problem.upper)
    with pytest.raises(TensionProblemError, match="reference_program: found no reference"):
        distribute(bare, "reference_program")


@pytest.mark.parametrize("r", [0, 1, 3])
def test_there_is_a_polygon_only_for_two_cables_to_spare(r):
    problem = random_problem(np.random.default_rng(0), 3, r)
    with pytest.raises(TensionProblemError, match=f"feasible polygon: found redundancy {r}"):
        feasible_polygon(problem)


@pytest.mark.parametrize("method", FREE)
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_no_cable_to_spare_is_solved_directly(method, n):
    problem = random_problem(np.random.default_rng(n), n, 0)
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.FEASIBLE
    expected = np.linalg.solve(problem.W, -problem.wrench)
    allowed = ROUNDING * np.linalg.cond(problem.W) * np.linalg.norm(expected)
    np.testing.assert_allclose(solution.tensions, expected, rtol=0.0, atol=allowed)


@pytest.mark.parametrize("method", FREE)
def test_no_cable_to_spare_and_no_tensions(method):
    problem = TensionProblem(np.eye(2), np.array([1.0, -3.0]), np.zeros(2), np.full(2, 5.0), [1, 1])
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.INFEASIBLE
    if method == "slack_relaxed":
        np.testing.assert_allclose(solution.tensions, [0.0, 3.0], atol=ROUNDING)
        np.testing.assert_allclose(solution.slack, [1.0, 0.0], atol=ROUNDING)
    else:
        assert np.all(np.isnan(solution.tensions))


def test_the_default_is_the_quadratic_program():
    problem = acrobot(RigidTransform([0.1, 0.0, 0.3]))
    assert distribute(problem).method == "quadratic_program"
    np.testing.assert_array_equal(distribute(problem).tensions, exact_tensions(problem))


# Small robots: the closed solutions are known.


@pytest.mark.parametrize("m", [4, 5])
@pytest.mark.parametrize("method", METHODS)
def test_planar_platforms(method, m):
    """A square in the plane, held from the corners and, with five cables, from one more side."""
    A = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 1.2)])[:m].T
    B = 0.2 * np.array([(1.0, -1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 1.0)])[:m].T
    along = B - A
    u = along / np.linalg.norm(along, axis=0)
    W = -np.vstack([B[0] * u[1] - B[1] * u[0], u])
    problem = TensionProblem(
        W, np.array([0.1, 2.0, -1.0]), np.full(m, 1.0), np.full(m, 30.0), np.full(m, 10.0)
    )
    if not METHODS[method].takes(m - 3):
        return
    solution = distribute(problem, method)
    if METHODS[method].exact:
        assert solution.status == TensionStatus.FEASIBLE
    if solution.status == TensionStatus.FEASIBLE:
        assert np.all((solution.tensions >= 1.0) & (solution.tensions <= 30.0))
        assert solution.residual <= BALANCE


@pytest.mark.parametrize("method", FREE)
def test_a_point_mass_on_two_cables(method):
    """At 45 degrees each cable holds the weight over the square root of two."""
    W = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2.0)
    problem = TensionProblem(W, [0.0, -10.0], np.zeros(2), np.full(2, 9.0), np.ones(2))
    solution = distribute(problem, method)
    assert solution.status == TensionStatus.FEASIBLE
    np.testing.assert_allclose(solution.tensions, 10.0 / np.sqrt(2.0), rtol=ROUNDING)


@pytest.mark.parametrize("method", METHODS)
def test_a_point_in_space_between_four_cables(method):
    """Cables to the corners of a tetrahedron, no weight: all tensions are equal by symmetry."""
    if not METHODS[method].takes(1):
        return
    W = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]).T / np.sqrt(3.0)
    problem = TensionProblem(W, np.zeros(3), np.full(4, 2.0), np.full(4, 8.0), np.full(4, 3.0))
    solution = distribute(problem, method)
    level = {"reference_program": 3.0, "kernel": 5.0, "closed_form": 5.0, "dykstra": 5.0}
    level |= {"weighted_vertices": 5.0, "optimally_safe": 5.0, "improved_closed_form": 5.0}
    if method == "pseudo_inverse":  # zero, below the bounds
        assert solution.status == TensionStatus.MISSED
    else:
        assert solution.status == TensionStatus.FEASIBLE
        np.testing.assert_allclose(solution.tensions, level.get(method, 2.0), rtol=ROUNDING)


# Against linear programs.


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
    for method in FREE:
        if method == "weighted_vertices" and r > 2:
            continue
        solution = distribute(problem, method)
        if solution.status == TensionStatus.FEASIBLE:
            t = solution.tensions
            assert np.linalg.norm(t) >= least - NORM_TOLERANCE, method
            assert np.linalg.norm(t - problem.reference) >= nearest - NORM_TOLERANCE, method
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


# Who misses what.


def test_pseudo_inverse_and_closed_form_go_out_of_bounds_where_others_do_not():
    problem = acrobot(RigidTransform(PUBLISHED["off the middle"][0]), lower=2.0)
    for method in ("pseudo_inverse", "closed_form"):
        solution = distribute(problem, method)
        assert solution.status == TensionStatus.MISSED
        assert solution.residual <= BALANCE  # balanced, but out of bounds
        assert np.min(solution.tensions) < 2.0
    for method in ("improved_closed_form", "quadratic_program", "barycenter", "dykstra"):
        assert distribute(problem, method).status == TensionStatus.FEASIBLE


def test_a_pose_outside_the_frame_has_no_tensions():
    problem = acrobot(RigidTransform([2.0, 0.0, 0.3]), reference=np.ones(8))
    assert feasible_polygon(problem).shape == (2, 0)
    for method in METHODS:
        if METHODS[method].takes(2):
            solution = distribute(problem, method)
            assert solution.status == TensionStatus.INFEASIBLE
            if method != "slack_relaxed":
                assert np.all(np.isnan(solution.tensions))


# Continuity.


def smooth(s):
    """Quintic from rest to rest, 0..1."""
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def line(s):
    position = np.array([-0.3, 0.3, 0.2]) + smooth(s) * np.array([0.65, -0.57, 0.25])
    return pose_from_angles(position, np.zeros(3))


def circle(s):
    a = 2.0 * np.pi * smooth(s)
    position = np.array([0.3 * np.cos(a), 0.3 * np.sin(a), 0.3])
    return pose_from_angles(position, 0.1 * np.array([np.sin(a), np.cos(a), 0.0]))


def path_steps(path, method, lower, rate=RATE):
    """Largest tension step and largest displacement of an anchor point from sample to sample."""
    poses = [path(s) for s in np.linspace(0.0, 1.0, int(PATH_TIME * rate) + 1)]
    solutions = [distribute(acrobot(X, lower), method) for X in poses]
    assert all(solution.status == TensionStatus.FEASIBLE for solution in solutions)
    tensions = np.array([solution.tensions for solution in solutions])
    anchors = load_robot("acrobot_large").anchor_points()
    places = np.array([X.multiply(anchors) for X in poses])
    moved = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.max(np.abs(np.diff(tensions, axis=0))), np.max(moved)


WEIGHT = 3.5 * 9.81  # [N]
CONTINUOUS = WEIGHT / HALF_FRAME  # [N/m]; the weight changes sides within half the frame


@pytest.mark.parametrize("lower", [0.0, 1.0])
@pytest.mark.parametrize("path", [line, circle])
@pytest.mark.parametrize("method", ["quadratic_program", "barycenter", "weighted_vertices"])
def test_tensions_follow_a_path_without_jumps(method, path, lower):
    step, moved = path_steps(path, method, lower)
    assert step <= CONTINUOUS * moved + STEP_ROUNDING


@pytest.mark.parametrize("method", ["quadratic_program", "barycenter"])
def test_steps_shrink_with_the_time_between_them(method):
    """As those of a continuous function, at four times the rate to about a quarter."""
    coarse, _ = path_steps(line, method, 1.0)
    fine, _ = path_steps(line, method, 1.0, 4 * RATE)
    assert fine <= 0.3 * coarse


@pytest.mark.parametrize("path", [line, circle])
@pytest.mark.parametrize("method", ["linear_program", "polygon_1_norm"])
def test_the_linear_program_jumps_from_corner_to_corner(method, path):
    step, moved = path_steps(path, method, 0.0)
    assert step > 50.0 * CONTINUOUS * moved
