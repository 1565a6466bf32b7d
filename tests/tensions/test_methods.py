"""Published tensions, closed solutions, optima by other solvers, paths, and batches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import get_num_threads
from pydrake.math import RigidTransform
from scipy.optimize import brentq, lsq_linear

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS, gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.kernel_calls import SHARES
from cdpr_drake.tensions.barrier_kernel import BARRIER
from cdpr_drake.tensions.control_step_kernel import wrench_matrix_at
from cdpr_drake.tensions.methods import (
    METHODS,
    distribute,
    distribute_batch,
    exact_tensions,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, TensionProblem
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE, SINGULAR
from tests.tensions.tension_cases import (
    LIMITS,
    acrobot,
    by_highs,
    largest_margin,
    numbers_of,
    random_problem,
    seeds,
    weights,
)

EVEN = brentq(lambda a: a**3 - BARRIER / a + BARRIER / (1.0 - a), 0.01, 0.5, xtol=1e-14)
"""Share of the range of equal tensions by `log_barrier` that balance nothing."""

PRINTED = 0.005  # [N]; the thesis prints two decimals
ROUNDING = 1e-12  # relative; two ways to compute the same tensions
SMOOTH = 1e-9  # relative; `log_barrier` leaves as much of the wrench
HIGHS = 1e-7  # relative to the largest bound; where HiGHS stops
FREE = [name for name, method in METHODS.items() if method.takes(0)]


@pytest.mark.parametrize(
    ("position", "tensions", "tolerance"),
    [
        ((0.35, -0.27, 0.45), (2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31), PRINTED),
        # The printed pose is that of the real platform.
        ((0.0, 0.0, 0.15), (5.22, 5.46, 5.16, 5.41, 5.13, 5.39, 5.22, 5.46), PRINTED + 0.02),
    ],
)
def test_published_tensions(position, tensions, tolerance):
    """Servoing thesis, section 1.3.4."""
    problem = acrobot(RigidTransform(position))
    solution = distribute(problem, "barycenter")
    np.testing.assert_allclose(solution.tensions, tensions, rtol=0.0, atol=tolerance)
    least = distribute(problem)
    assert least.method == "quadratic_program"
    np.testing.assert_array_equal(least.tensions, exact_tensions(problem))
    assert np.linalg.norm(least.tensions) <= np.linalg.norm(tensions) + 3.0 * tolerance


@pytest.mark.parametrize("aside", [(0.0, 0.0), (0.005, 0.0), (0.0, 0.005)])
def test_published_tensions_balance_the_weight_of_a_centre_of_mass_above_po(aside):
    """To the rounding of the print, and not 5 mm aside."""
    X_WP = RigidTransform([0.35, -0.27, 0.45])
    A, B, (mass, _), _ = numbers_of("acrobot_large")
    W = wrench_matrix(X_WP, A, B)
    tensions = np.array([2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31])
    for height in (0.0, 0.035, 0.1):
        w = gravity_wrench(X_WP, mass, np.array([*aside, height]))
        balanced = np.all(np.abs(W @ tensions + w) <= PRINTED * np.sum(np.abs(W), axis=1))
        assert balanced == (aside == (0.0, 0.0))


@pytest.mark.parametrize("factor", [1e-3, 1e3])
@pytest.mark.parametrize("method", ["quadratic_program", "barycenter", "log_barrier"])
def test_tensions_scale_with_the_weight(method, factor):
    X_WP = RigidTransform([0.35, -0.27, 0.45])
    light = distribute(acrobot(X_WP), method).tensions
    heavy = distribute(acrobot(X_WP, 0.0, 60.0 * factor, factor=factor), method).tensions
    np.testing.assert_allclose(heavy, factor * light)


def test_no_tensions_outside_the_frame():
    problem = acrobot(RigidTransform([2.0, 0.0, 0.3]), reference=np.ones(8))
    assert feasible_polygon(problem).shape == (2, 0)
    for name in [name for name, method in METHODS.items() if method.takes(2)]:
        assert distribute(problem, name).status == "infeasible"


# Small robots with known solutions.


@pytest.mark.parametrize("method", FREE)
def test_no_redundancy(method):
    tolerance = SMOOTH if method == "log_barrier" else ROUNDING
    for n in (1, 2, 3, 6):
        problem = random_problem(np.random.default_rng(n), n, 0)
        solution = distribute(problem, method)
        expected = np.linalg.solve(problem.W, -problem.wrench)
        allowed = tolerance * np.linalg.cond(problem.W) * np.linalg.norm(expected)
        assert solution.status == "feasible"
        np.testing.assert_allclose(solution.tensions, expected, rtol=0.0, atol=allowed)
    none = TensionProblem(np.eye(2), [1.0, -3.0], np.zeros(2), np.full(2, 5.0), [1, 1])
    solution = distribute(none, method)
    assert solution.status == "infeasible"
    if METHODS[method].answers:
        np.testing.assert_allclose(solution.tensions, [0.0, 3.0], atol=tolerance)
        np.testing.assert_allclose(solution.slack, [1.0, 0.0], atol=tolerance)
    else:
        assert np.all(np.isnan(solution.tensions))


@pytest.mark.parametrize("method", [name for name in METHODS if METHODS[name].takes(1)])
def test_a_point_between_four_cables(method):
    """Cables to the corners of a tetrahedron, no weight: all tensions are equal by symmetry."""
    W = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]).T / np.sqrt(3.0)
    problem = TensionProblem(W, np.zeros(3), np.full(4, 2.0), np.full(4, 8.0), np.full(4, 3.0))
    solution = distribute(problem, method)
    middle = ("kernel", "closed_form", "dykstra", "weighted_vertices", "optimally_safe", "median",
              "improved_closed_form")  # fmt: skip
    level = {"reference_program": 3.0, "log_barrier": 2.0 + 6.0 * EVEN} | dict.fromkeys(middle, 5.0)
    if method == "pseudo_inverse":  # zero, below the bounds
        assert solution.status == "missed"
    else:
        assert solution.status == "feasible"
        tolerance = SMOOTH if method == "log_barrier" else ROUNDING
        np.testing.assert_allclose(solution.tensions, level.get(method, 2.0), rtol=tolerance)


@pytest.mark.parametrize("method", METHODS)
def test_zero_is_all_there_is(method):
    """All cables pull one way and nothing pulls back."""
    W = np.array([[1.0, 2.0, 3.0], [0.3, 0.2, 0.7]] if METHODS[method].takes(1) else [[1, 0.37, 3]])
    n = len(W)
    solution = distribute(
        TensionProblem(W, np.zeros(n), np.zeros(3), np.full(3, 60.0), np.full(3, 7.7)), method
    )
    if METHODS[method].exact:
        assert solution.status == "feasible"
        np.testing.assert_allclose(solution.tensions, 0.0, atol=1e-9)
    else:
        assert solution.status != "infeasible"


@pytest.mark.parametrize("method", METHODS)
def test_exact_methods_miss_none_and_others_some(method):
    """Of hardly feasible problems: half of the tensions are near their bounds."""
    rng, missed = np.random.default_rng(5), 0
    m = 8 if METHODS[method].takes(2) else 7
    for _ in range(150):
        t = np.where(rng.uniform(size=m) < 0.5, rng.choice([0.5, 59.5], m), 30.0)
        W, reference = rng.normal(size=(6, m)), rng.uniform(0.0, 60.0, m)
        problem = TensionProblem(W, -W @ t, np.zeros(m), np.full(m, 60.0), reference)
        missed += distribute(problem, method).status == "missed"
    assert METHODS[method].exact == (missed == 0)


# Optima.


@settings(max_examples=40)
@given(seeds, st.integers(1, 6), st.sampled_from([1, 2, 3, 5]), st.sampled_from([0.0, 5.0]))
def test_linear_objectives_are_those_of_highs(seed, n, r, lowest):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest)
    m, tolerance = n + r, HIGHS * np.max(problem.upper)
    total = by_highs(problem, np.append(np.ones(m), 0.0)).fun
    for name in ("linear_program", "polygon_1_norm") if r == 2 else ("linear_program",):
        t = distribute(problem, name).tensions
        assert t.sum() == pytest.approx(total, abs=m * tolerance)
    rows = np.hstack([np.eye(m), -np.ones((m, 1))])
    largest = by_highs(problem, np.append(np.zeros(m), 1.0), rows, np.zeros(m)).fun
    t = distribute(problem, "infinity_norm").tensions
    assert np.max(t) == pytest.approx(largest, abs=tolerance)
    t = distribute(problem, "optimally_safe").tensions
    margin = min(np.min(t - problem.lower), np.min(problem.upper - t))
    assert margin == pytest.approx(largest_margin(problem), abs=tolerance)


@settings(max_examples=60)
@given(seeds, st.integers(1, 6), st.sampled_from([1, 2, 3, 5]))
def test_two_norms_are_least(seed, n, r):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest=2.0)
    middle = (problem.lower + problem.upper) / 2.0
    points = {"quadratic_program": 0.0, "reference_program": problem.reference, "median": middle}
    least = {
        name: np.linalg.norm(distribute(problem, name).tensions - point)
        for name, point in points.items()
    }
    for method in [name for name, method in METHODS.items() if method.takes(r)]:
        solution = distribute(problem, method)
        if solution.status == "feasible":
            for name, point in points.items():
                assert np.linalg.norm(solution.tensions - point) >= least[name] - HIGHS, method
    if r == 2:
        two = distribute(problem, "polygon_2_norm").tensions
        np.testing.assert_array_equal(two, distribute(problem).tensions)
        t, N = solution_space(problem)
        corners = t[:, np.newaxis] + N @ feasible_polygon(problem)
        assert np.all((corners >= problem.lower[0] - 1e-9) & (corners <= problem.upper[0] + 1e-9))


@settings(max_examples=40)
@given(seeds, st.integers(1, 6), st.sampled_from([0, 1, 2, 3, 5]))
def test_slack_relaxed_leaves_the_least_unbalanced(seed, n, r):
    problem = random_problem(np.random.default_rng(seed), n, r, lowest=2.0, reach=0.6)
    solution = distribute(problem, "slack_relaxed")
    t = solution.tensions
    assert np.all((t >= problem.lower) & (t <= problem.upper))
    assert solution.status == distribute(problem).status
    slack = np.linalg.norm(problem.W @ t + problem.wrench)
    assert np.linalg.norm(solution.slack) == pytest.approx(slack, abs=1e-9)
    oracle = lsq_linear(
        problem.W, -problem.wrench, (problem.lower, problem.upper), method="trf", tol=1e-13
    )
    assert slack == pytest.approx(np.sqrt(2.0 * oracle.cost), rel=1e-5, abs=1e-5)


# Paths, batches, steps.


def largest_step(method, lower, points):
    """Largest step of a tension on a line, and of the platform."""
    s = np.linspace(0.0, 1.0, points)
    places = np.array([-0.3, 0.3, 0.2]) + np.outer(s, [0.65, -0.57, 0.25])
    solutions = [distribute(acrobot(RigidTransform(p), lower), method) for p in places]
    assert all(solution.status == "feasible" for solution in solutions)
    steps = np.diff([solution.tensions for solution in solutions], axis=0)
    return np.max(np.abs(steps)), np.linalg.norm(places[1] - places[0])


@pytest.mark.parametrize(
    ("method", "continuous"),
    [("quadratic_program", True), ("barycenter", True), ("weighted_vertices", True),
     ("linear_program", False), ("polygon_1_norm", False)],
)  # fmt: skip
def test_continuity_along_a_path(method, continuous):
    """The weight changes sides within half of the frame, 0.6 m; linear programs jump."""
    step, distance = largest_step(method, 0.0, 600)
    steepest = 3.5 * 9.81 / 0.6 * distance
    assert step <= steepest if continuous else step > 20.0 * steepest
    if continuous:
        assert largest_step(method, 1.0, 600)[0] <= steepest


def hard_problems(r, top, count=100, seed=0):
    """Tensions on their bounds, near them or beyond, with nearly parallel cables."""
    rng, m = np.random.default_rng(seed), 6 + r
    W = rng.normal(size=(count, 6, m))
    W[:, :3] *= 10.0 ** rng.uniform(-3.0, 0.0, (count, 1, 1))
    W[:, :, -1] = W[:, :, 0] + 10.0 ** rng.uniform(-4.0, 0.0, (count, 1)) * W[:, :, -1]
    t = rng.choice([1.0, 50.0, 100.0, 1.0001, 99.999, 1.5, 0.5], size=(count, m))
    return W, -np.einsum("knm,km->kn", W, t), np.full(m, 1.0), np.full(m, top)


def robot_problems(name, r):
    W, w = weights(name, 2 * SHARES + 7)  # the last share of a thread is not full
    low, high = LIMITS[name]
    return W[:, :, : 6 + r], w, np.full(6 + r, low), np.full(6 + r, high)


@pytest.mark.parametrize("method", METHODS)
def test_a_batch_equals_single_calls(method):
    r = 1 if method == "kernel" else 2
    hard = [hard_problems(r, top) for top in (1e2, 1e6)]
    for W, w, lower, upper in (*hard, *(robot_problems(name, r) for name in LIMITS)):
        reference = lower + (upper - lower) / 9.0
        t, codes = distribute_batch(W, w, lower, upper, method, reference, threads=1)
        two, same = distribute_batch(W, w, lower, upper, method, reference, threads=2)
        assert t.tobytes() == two.tobytes()
        assert codes.tobytes() == same.tobytes()
        for k, code in enumerate(codes):
            problem = TensionProblem(W[k], w[k], lower, upper, reference)
            single = distribute(problem, method)
            assert single.status == {1: "feasible", 0: "missed", -1: "infeasible"}[code]
            if code == FEASIBLE:
                assert problem.residual(t[k]) <= RESIDUAL_TOLERANCE
                assert np.all((lower <= t[k]) & (t[k] <= upper))
            if code != 0:
                np.testing.assert_allclose(t[k], single.tensions, rtol=0.0, atol=1e-10 * upper[0])
        assert {FEASIBLE, INFEASIBLE} <= set(codes)


def with_a_slack_cable(r, count=100):
    """Tensions of which the last is zero and cannot be another, and may not be either."""
    rng, upper = np.random.default_rng(0), np.append(np.full(r + 2, 60.0), 0.0)
    for _ in range(count):
        W = np.zeros((3, r + 3))
        W[:2, :-1], W[2, -1] = rng.normal(size=(2, r + 2)), 1.0
        W = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ W
        t = upper * rng.uniform(0.3, 0.7, r + 3)
        yield TensionProblem(W, -W @ t, np.zeros(r + 3), upper, upper / 9.0)


@pytest.mark.parametrize("method", METHODS)
def test_fixed_tensions_get_the_verdict_of_the_single_call(method):
    """Their bounds are met up to the rounding of the others' tensions, not of their own."""
    problems = list(with_a_slack_cable(1 if method == "kernel" else 2))
    W, w, first = [p.W for p in problems], [p.wrench for p in problems], problems[0]
    before = get_num_threads()
    _, codes = distribute_batch(W, w, first.lower, first.upper, method, first.reference)
    assert get_num_threads() == before
    single = [distribute(problem, method).status == "feasible" for problem in problems]
    np.testing.assert_array_equal(codes == FEASIBLE, single)
    assert any(single)


def test_batches_of_any_shape_and_layout():
    W, w = weights("acrobot_large", 5)
    limits = list(np.zeros(8)), list(np.full(8, 60.0))
    expected, good = distribute_batch(W, w, *limits)
    t, _ = distribute_batch(np.asfortranarray(W), np.asfortranarray(w), *limits)
    np.testing.assert_array_equal(t, expected)
    W[2, 3] = W[2, 4]
    for name in ("quadratic_program", "slack_relaxed"):
        t, codes = distribute_batch(W, w, *limits, name)
        assert codes[2] == SINGULAR
        assert np.all(np.isnan(t[2]))
    t, codes = distribute_batch(W, w, *limits)
    np.testing.assert_array_equal(np.delete(t, 2, 0), np.delete(expected, 2, 0))
    np.testing.assert_array_equal(np.delete(codes, 2), np.delete(good, 2))
    assert distribute_batch(W[:0], w[:0], *limits)[0].shape == (0, 8)


@pytest.mark.parametrize("moments", [True, False])
@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_wrench_matrix_of_a_state(name, moments):
    robot, rng = load_robot(name), np.random.default_rng(3)
    rows = [r for r in (PLANAR_ROWS if robot.is_planar() else range(6)) if moments or r > 2]
    for cables in (robot.cable_set(), robot.cable_set().without_pulleys()):
        rest = [] if robot.is_planar() else [1.0, *rng.uniform(-0.1, 0.1, 3), 0.05, 0.1, 0.4]
        state = np.array([*rest, *rng.uniform(-0.2, 0.2, 6)])
        W = np.empty((len(rows), len(robot.cables)))
        wrench_matrix_at(state, cables.packed(), robot.plane_height or 0.0, W)
        expected = -cable_paths(pose_from_state(robot, state), cables).J.T[rows]
        np.testing.assert_allclose(W, expected, atol=1e-13)
