"""The kernels against NumPy, SciPy, quadprog and closed solutions."""

import numpy as np
import pytest
import quadprog
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.spatial import ConvexHull, HalfspaceIntersection

from cdpr_drake.tensions.closed_form_kernel import (
    alternating_projections,
    closed_form,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
    within,
)
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.optimal_kernel import least_slack
from cdpr_drake.tensions.polygon_kernel import (
    polygon_barycenter,
    polygon_steiner_point,
    polygon_vertices,
)
from cdpr_drake.tensions.problem import TensionProblem, writable
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    NOT_FOUND,
    SINGULAR,
    factor,
    nearest_tensions,
    nearest_tensions_in,
    null_basis,
    null_space,
    project_on_polytope,
    workspace_shape,
)
from tests.tensions.tension_cases import (
    LIMITS,
    largest_margin,
    numbers,
    problems,
    run,
    seeds,
    weights,
)

ROUNDING = 1e-14  # of orthogonal reflections; of solutions times the condition number of W
FORMULA = 1e-12  # relative; two ways to compute the same tensions
QUADPROG = 1e-9  # relative to the largest tension
HIGHS = 1e-7  # relative to the largest bound
MARGIN = 1e-7  # relative; nearer to the limit quadprog and the kernel may differ


# Null space.


@given(problems())
def test_null_space(problem):
    W, w, _, _ = numbers(problem)
    n, m = W.shape
    assume(np.linalg.cond(W) < 1e8)
    t, N = np.full(m, np.nan), np.full((m - n, m), np.nan)
    assert null_space(W, w, t, N)
    np.testing.assert_allclose(N @ N.T, np.eye(m - n), rtol=0.0, atol=m * ROUNDING)
    assert np.all(np.abs(W @ N.T) <= m * ROUNDING * np.linalg.norm(W))
    expected = -np.linalg.pinv(W, rcond=1e-15) @ w
    allowed = m * ROUNDING * np.linalg.cond(W) * np.linalg.norm(expected)
    assert np.linalg.norm(t - expected) <= allowed
    # Backward stable: the residual does not depend on the condition number.
    size = np.linalg.norm(W) * np.linalg.norm(t) + np.linalg.norm(w)
    assert np.linalg.norm(W @ t + w) <= m * ROUNDING * size


@pytest.mark.parametrize(
    "W",
    [
        np.zeros((2, 4)), np.zeros((1, 3)), np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]),
        np.array([[1.0, 2.0, 3.0, 1.0], [4.0, -1.0, 2.0, 0.0], [5.0, 1.0, 5.0, 1.0]]),
        np.outer([1.0, 2.0], np.ones(5)),
    ],
)  # fmt: skip
def test_singular_wrench_matrices(W):
    n, m = W.shape
    assert not null_space(W, np.ones(n), np.empty(m), np.empty((m - n, m)))
    t, arrays = np.empty(m), (W, np.ones(n), np.zeros(m), np.ones(m), np.zeros(m))
    assert nearest_tensions(*arrays, t) == SINGULAR


@pytest.mark.parametrize(("smallest", "regular"), [(1e-9, True), (1e-11, False)])
def test_rank_tolerance_and_a_wider_basis(smallest, regular):
    rng = np.random.default_rng(3)
    U, V = (np.linalg.qr(rng.normal(size=(k, 3)))[0] for k in (3, 5))
    W, A, N = U @ np.diag([1.0, 0.5, smallest]) @ V.T, np.empty((3, 7)), np.full((2, 7), 7.0)
    before = W.copy()
    assert factor(W, A) == regular
    np.testing.assert_array_equal(W, before)
    if regular:
        null_basis(A, 5, N)
        np.testing.assert_array_equal(N[:, 5:], 7.0)


# The exact program.


def by_quadprog(problem, reference):
    """Tensions or None; the dual method of the same paper in the authors' Fortran."""
    n, m = problem.W.shape
    constraints = np.hstack([problem.W.T, np.eye(m), -np.eye(m)])
    values = np.concatenate([-problem.wrench, problem.lower, -problem.upper])
    try:
        return quadprog.solve_qp(np.eye(m), reference, constraints, values, n)[0]
    except ValueError as error:
        if "inconsistent" in str(error):
            return None
        raise


def exact(problem, reference):
    shape, wanted = problem.W.shape, writable(reference)
    t, work = np.full(shape[1], np.nan), np.full(workspace_shape(*shape), np.nan)
    code = nearest_tensions_in(work, *numbers(problem), wanted, t)
    again = np.empty_like(t)
    assert nearest_tensions(*numbers(problem), wanted, again) == code
    if code == FEASIBLE:
        np.testing.assert_array_equal(again, t)
    return code, t


@settings(max_examples=200)
@given(problems(), st.sampled_from([0.0, 1.0]))
def test_optima_satisfy_the_kuhn_tucker_conditions(problem, factor):
    """t - reference = W' y + p - q with p, q >= 0 on lower and upper bounds only."""
    W, w, lower, upper = problem.W, problem.wrench, problem.lower, problem.upper
    reference, largest = factor * problem.reference, max(np.max(upper), 1.0)
    code, t = exact(problem, reference)
    expected = by_quadprog(problem, reference)
    margin = largest_margin(problem) / largest
    if abs(margin) > MARGIN:
        assert code == (FEASIBLE if margin > 0.0 else INFEASIBLE)
        assert (expected is not None) == (margin > 0.0)
    if code != FEASIBLE:
        return
    n, m = W.shape
    scale = np.linalg.norm(w) + np.linalg.norm(np.abs(W) @ np.abs(t))
    assert np.all((t >= lower) & (t <= upper))
    assert np.linalg.norm(W @ t + w) <= 1e-9 * scale
    at_lower, at_upper = t - lower <= 1e-13 * largest, upper - t <= 1e-13 * largest
    normals = np.hstack([W.T, np.eye(m)[:, at_lower], -np.eye(m)[:, at_upper]])
    least = np.concatenate([np.full(n, -np.inf), np.zeros(normals.shape[1] - n)])
    duals = lsq_linear(normals, t - reference, (least, np.inf), method="bvls", tol=1e-14).x
    error = np.linalg.norm(normals @ duals - (t - reference))
    assert error <= 1e-9 * max(np.linalg.norm(t - reference), largest)
    if expected is not None and margin > MARGIN and np.linalg.cond(W) < 1e5:
        allowed = QUADPROG * largest * max(np.linalg.cond(W) / 1e2, 1.0)
        np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed)


@pytest.mark.parametrize("name", LIMITS)
def test_verdicts_and_optima_of_a_robot(name):
    """Also a hundred millionth off the limit, where the truth is known from how a case is made."""
    low, high = LIMITS[name]
    close, W, w = 0, *weights(name, 1200)
    for k in range(len(W)):
        problem = TensionProblem(W[k], w[k], np.full(8, low), np.full(8, high))
        if k % 3 == 0:
            free = TensionProblem(W[k], w[k], np.zeros(8), np.full(8, 1e5))
            safe = distribute(free, "optimally_safe")
            floor = np.min(safe.tensions)
            if safe.status == "feasible" and floor > 1e-6 and floor + np.max(safe.tensions) < 9e4:
                share = (1e-3, 1e-6, 1e-8)[k // 3 % 3] * (-1.0) ** (k // 9)
                problem = TensionProblem(W[k], w[k], np.full(8, floor * (1.0 + share)), free.upper)
                close += 1
                assert (exact(problem, np.zeros(8))[0] == FEASIBLE) == (share < 0.0)
        code, t = exact(problem, np.zeros(8))
        expected = by_quadprog(problem, np.zeros(8))
        assert code == (INFEASIBLE if expected is None else FEASIBLE)
        if expected is not None:
            allowed = QUADPROG * np.max(expected)
            np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed)
    assert close > 100


@pytest.mark.parametrize(
    ("W", "w", "lower", "upper", "expected"),
    [
        ([[1, 1, -1]], [-4], [0, 0, 0], [10] * 3, [2, 2, 0]),  # side by side: shared evenly
        ([[1, -1, 0, 0], [0, 0, 1, -1]], [0, 0], [2] * 4, [9] * 4, [2] * 4),  # by symmetry
        ([[0.6, -0.6], [0.8, 0.8]], [0, -8], [0, 0], [5, 5], [5, 5]),
        ([[0.6, -0.6], [0.8, 0.8]], [0, -8], [0, 0], [4.9, 4.9], None),
        ([[0.6, -0.6], [0.8, 0.8]], [5, -1], [0, 0], [50, 50], None),
        ([[1, 2, 1], [0, 1, -1]], [-18, 2], [3, 5, 7], [3, 5, 7], None),  # off by 2 N
        ([[1, 2, 1], [0, 1, -1]], [-20, 2], [3, 5, 7], [3, 5, 7], [3, 5, 7]),
    ],
)  # fmt: skip
def test_small_programs(W, w, lower, upper, expected):
    code, t = exact(TensionProblem(W, w, lower, upper), np.zeros(len(lower)))
    assert code == (INFEASIBLE if expected is None else FEASIBLE)
    if expected is not None:
        np.testing.assert_allclose(t, expected, rtol=0.0, atol=1e-14)


@given(st.integers(1, 3), seeds, st.sampled_from([1e2, 1e6]))
def test_fixed_tensions_from_a_far_reference(r, seed, distance):
    """The bounds leave one point, and the reference brings its rounding."""
    rng = np.random.default_rng(seed)
    W, only = rng.normal(size=(3, 3 + r)), rng.uniform(5.0, 10.0, 3 + r)
    problem = TensionProblem(W, -W @ only, only, only)
    code, t = exact(problem, distance * rng.normal(size=3 + r))
    assert code == FEASIBLE
    np.testing.assert_array_equal(t, only)


@given(st.integers(1, 4), seeds)
def test_projection_is_the_nearest_point(r, seed):
    """The angle at it towards any other feasible point is obtuse; feasible points stay."""
    rng = np.random.default_rng(seed)
    N = np.linalg.qr(rng.normal(size=(r + 4, r)))[0].T.copy()
    start, bounds = rng.normal(size=r + 4) * 5.0, (np.full(r + 4, -6.0), np.full(r + 4, 6.0))
    work, nearest = np.empty((3 * r + 6, r + 6)), start.copy()
    if project_on_polytope(nearest, N, *bounds, 0.0, work) != FEASIBLE:
        return
    for _ in range(5):
        other = start + N.T @ rng.normal(size=r) * 5.0
        assert project_on_polytope(other, N, *bounds, 0.0, work) == FEASIBLE
        assert (start - nearest) @ (other - nearest) <= 1e-9
        before = other.copy()
        assert project_on_polytope(other, N, *bounds, 0.0, work) == FEASIBLE
        np.testing.assert_array_equal(other, before)


@pytest.mark.parametrize("place", ["W", "w", "reference"])
def test_nan_is_never_feasible(place):
    arrays = {
        "W": np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]]), "w": np.array([-1.0, -1.0]),
        "lower": np.zeros(3), "upper": np.full(3, 10.0), "reference": np.zeros(3),
    }  # fmt: skip
    arrays[place].flat[0] = np.nan
    t = np.empty(3)
    assert nearest_tensions(*arrays.values(), t) != FEASIBLE
    for kernel in (pseudo_inverse, closed_form, improved_closed_form, puncture, kernel_line):
        work, scale = np.empty(workspace_shape(2, 3)), np.ones(2)
        if place != "reference":
            assert kernel(work, *arrays.values(), scale, t) != FEASIBLE


# Closed forms, for well conditioned problems.


regular = problems(shapes=("normal", "twins")).filter(lambda p: np.linalg.cond(p.W) < 1e3)


def judged(problem, code, t, expected):
    """The formula, and whether it keeps the bounds."""
    size = max(np.max(np.abs(expected)), np.max(problem.upper))
    allowed = FORMULA * max(np.linalg.cond(problem.W), 1.0) * size
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=allowed)
    inside = np.min(np.minimum(expected - problem.lower, problem.upper - expected))
    if abs(inside) > allowed:
        assert code == (FEASIBLE if inside > 0.0 else NOT_FOUND)


@given(regular)
def test_pseudo_inverse_and_closed_form(problem):
    W, w, middle = problem.W, problem.wrench, (problem.lower + problem.upper) / 2.0
    judged(problem, *run(pseudo_inverse, problem), -np.linalg.pinv(W) @ w)
    nearest = middle - np.linalg.pinv(W) @ (w + W @ middle)
    judged(problem, *run(closed_form, problem), nearest)
    for kernel in (improved_closed_form, puncture):
        code, t = run(kernel, problem)
        if code == FEASIBLE:
            assert problem.residual(t) <= 1e-10
            assert within(t, *numbers(problem)[2:])
        assert code == FEASIBLE or run(closed_form, problem)[0] != FEASIBLE


def by_fixing(problem):
    """`improved_closed_form` written for reading; None where it gives up."""
    W, w, lower, upper = problem.W, problem.wrench, problem.lower, problem.upper
    n, m = W.shape
    t, free = (lower + upper) / 2.0, np.ones(m, bool)
    while np.sum(free) >= n:
        middle = (lower + upper)[free] / 2.0
        rest = w + W[:, ~free] @ t[~free]
        t[free] = middle - np.linalg.pinv(W[:, free]) @ (rest + W[:, free] @ middle)
        beyond = np.where(free, np.maximum(lower - t, t - upper), -1.0)
        worst = np.argmax(beyond)
        if beyond[worst] <= 1e-12 * max(np.max(upper), 1.0):
            return t
        t[worst], free[worst] = np.clip(t[worst], lower[worst], upper[worst]), False
    return None


@given(regular)
def test_improved_closed_form_is_that_of_numpy(problem):
    code, t = run(improved_closed_form, problem)
    assume(abs(largest_margin(problem)) > 1e-6 * np.max(problem.upper))
    expected = by_fixing(problem)
    if expected is None or code != FEASIBLE:
        assert code != FEASIBLE or expected is not None
        return
    np.testing.assert_allclose(t, expected, rtol=0.0, atol=1e-8 * np.max(problem.upper))


@given(regular)
def test_puncture_ends_at_the_first_bound_on_a_line_to_low_tensions(problem):
    code, t = run(puncture, problem)
    if code != FEASIBLE:
        return
    W, w, lower, upper = problem.W, problem.wrench, problem.lower, problem.upper
    _, first = run(closed_form, problem)
    low = lower - np.linalg.pinv(W) @ (w + W @ lower)
    way, size = low - first, np.max(upper)
    steps = np.where(way < 0.0, lower - first, upper - first)[np.abs(way) > 1e-9 * size]
    share = min(1.0, np.min(steps / way[np.abs(way) > 1e-9 * size], initial=1.0))
    np.testing.assert_allclose(t, first + max(share, 0.0) * way, rtol=0.0, atol=1e-8 * size)


@given(problems(redundancies=(1,), shapes=("normal",)))
def test_kernel_line_is_the_middle_of_all_feasible_tensions(problem):
    assume(np.linalg.cond(problem.W) < 1e3)
    lower, upper = problem.lower, problem.upper
    code, t = run(kernel_line, problem)
    h = np.linalg.svd(problem.W)[2][-1]
    ends = np.sort(np.array([(lower - t) / h, (upper - t) / h]), axis=0)
    least, most = np.max(ends[0]), np.min(ends[1])
    size = np.max(np.abs(t)) + np.max(upper)
    rounding = FORMULA * size * np.linalg.cond(problem.W) / np.min(np.abs(h))
    assert least + most == pytest.approx(0.0, abs=rounding)
    if abs(most - least) > rounding:
        assert (code == FEASIBLE) == (most > least)
    assert problem.residual(t) <= FORMULA * 1e2


@settings(max_examples=60)
@given(problems(redundancies=(1, 2, 3), shapes=("normal",)))
def test_dykstra_converges_to_the_point_nearest_to_its_start(problem):
    assume(np.linalg.cond(problem.W) < 1e3)
    middle = (problem.lower + problem.upper) / 2.0
    code, t = run(alternating_projections, problem, middle, 20_000)
    proof, expected = exact(problem, middle)
    if code == FEASIBLE:
        assert proof == FEASIBLE
        np.testing.assert_allclose(t, expected, rtol=0.0, atol=1e-6 * np.max(problem.upper))


def test_dykstra_stops_after_its_rounds():
    """Balance touches the bounds in a corner at an angle of 0.01: e times nearer in 10^4 rounds."""
    W, upper = np.array([[0.01, 1.0]]), np.array([10.0, 4.0])
    problem = TensionProblem(W, -W @ upper, np.zeros(2), upper)
    (early, first), (late, second) = (
        run(alternating_projections, problem, upper / 2.0, rounds) for rounds in (10_000, 20_000)
    )
    assert early == late == NOT_FOUND
    ratio = np.linalg.norm(second - upper) / np.linalg.norm(first - upper)
    assert ratio == pytest.approx(np.exp(-1.0), rel=1e-2)


def test_within_lets_rounding_pass_and_nothing_else():
    lower, upper = np.zeros(2), np.full(2, 60.0)
    for t, expected in (([0, 60], True), ([-1e-14, 60 + 1e-14], True), ([-1e-9, 5], False),
                        ([5, 60 + 1e-9], False), ([np.nan, 5], False)):  # fmt: skip
        assert within(np.array(t, float), lower, upper) == expected


# Least slack.


@settings(max_examples=150)
@given(problems(redundancies=(0, 1, 2, 3, 5)))
def test_no_cable_can_reduce_the_slack(problem):
    lower, upper, scale = problem.lower, problem.upper, problem.scale_of_rows
    A, b, t = problem.W / scale[:, None], problem.wrench / scale, np.empty(len(lower))
    assert least_slack(*numbers(problem), writable(scale), t)
    assert np.all((t >= lower) & (t <= upper))
    gradient = A.T @ (A @ t + b)
    sizes = np.linalg.norm(A, axis=0) * (np.abs(b).sum() + np.sum(np.abs(A) @ t))
    assert np.all(gradient[t < upper] >= -1e-11 * sizes[t < upper])
    assert np.all(gradient[t > lower] <= 1e-11 * sizes[t > lower])


@pytest.mark.parametrize(
    ("W", "w", "lower", "upper", "scale", "expected"),
    [
        ([[1, 0], [0, 1]], [-3, -4], [0, 0], [9, 9], [1, 1], [3, 4]),
        ([[0, 1, -1]], [-100], [3, 0, 2], [9, 40, 8], [1], [3, 40, 2]),
        # A lever of 2 m against 10 N m and 30 N: (20 / L^2 + 30) / (4 / L^2 + 1).
        ([[2], [1]], [-10, -30], [0], [100], [1e-3, 1], [5.000006249998437]),
        ([[2], [1]], [-10, -30], [0], [100], [1, 1], [10]),
        ([[2], [1]], [-10, -30], [0], [100], [1e3, 1], [29.9999000004]),
    ],
)  # fmt: skip
def test_small_slack(W, w, lower, upper, scale, expected):
    arrays = [np.array(values, float) for values in (W, w, lower, upper, scale)]
    t = np.full(len(lower), np.nan)
    assert least_slack(*arrays, t)
    np.testing.assert_allclose(t, expected, rtol=1e-12)


# The polygon.


@st.composite
def strips(draw):
    """A point, a basis of a plane and bounds: lower <= t + N' eta <= upper."""
    m, rng = draw(st.integers(2, 9)), np.random.default_rng(draw(seeds))
    N = np.linalg.qr(rng.normal(size=(m, 2)))[0].T.copy()
    lower, upper = rng.uniform(0.0, 10.0, m), rng.uniform(20.0, 60.0, m)
    return lower + (upper - lower) * rng.uniform(-0.2, 1.2, m), N, lower, upper


def signed_area(vertices):
    x, y = vertices - vertices[:, :1]
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def centroid(hull):
    """Mean of the centroids of a fan of triangles, weighted by area."""
    corners = hull.points[hull.vertices]
    a, b = corners[1:-1] - corners[0], corners[2:] - corners[0]
    areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return corners[0] + areas @ (a + b) / (3.0 * np.sum(areas))


@given(strips())
def test_polygon_is_that_of_scipys_half_spaces(strip):
    t, N, lower, upper = strip
    vertices, size = polygon_vertices(*strip), np.max(upper)
    planes = np.vstack([np.column_stack([N.T, t - upper]), np.column_stack([-N.T, lower - t])])
    if vertices.shape[1] == 0:
        return
    assert np.max(planes[:, :2] @ vertices + planes[:, 2:]) <= 1e-12 * size
    for choose in (polygon_barycenter, polygon_steiner_point):
        assert np.max(planes[:, :2] @ choose(vertices) + planes[:, 2]) <= 1e-12 * size
    area, center = signed_area(vertices), polygon_barycenter(vertices)
    extent = np.max(np.ptp(vertices, axis=1))
    assert area >= -1e-12 * size**2
    if np.min(-planes[:, :2] @ center - planes[:, 2]) > 1e-3 * size:
        hull = ConvexHull(HalfspaceIntersection(planes, center).intersections)
        assert area == pytest.approx(hull.volume, rel=1e-7)
        np.testing.assert_allclose(center, centroid(hull), rtol=0.0, atol=1e-7 * extent)


@given(strips())
def test_an_empty_polygon_is_infeasible(strip):
    t, N, lower, upper = strip
    W = np.linalg.svd(N)[2][2:]
    if len(W):
        margin = largest_margin(TensionProblem(W, -W @ t, lower, upper))
        if abs(margin) > 1e-6:
            assert (polygon_vertices(*strip).shape[1] > 0) == (margin > 0.0)


def box(lower, upper):
    """Two cables that are the coordinates of the plane, and one that is their sum."""
    N = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    return polygon_vertices(np.zeros(3), N, np.array(lower, float), np.array(upper, float))


@pytest.mark.parametrize(
    ("lower", "upper", "middle"),
    [
        ([0, 0.5, 0], [1, 0.5, 9], (0.5, 0.5)),  # one tension is fixed: a segment
        ([0, 0, 1], [1, 1, 1], (0.5, 0.5)),  # the third one is: a diagonal
        ([0.25, 0.75, 0], [0.25, 0.75, 9], (0.25, 0.75)),  # two are: a point
        ([0, 0, 0], [1, 1, 0], (0.0, 0.0)),  # a corner is left
        ([0, 0, 3], [1, 1, 4], None),
        ([0.5, 0.5, 0], [1, 1, 0.999999], None),
    ],
)
def test_polygons_without_area(lower, upper, middle):
    vertices = box(lower, upper)
    assert (vertices.shape[1] == 0) == (middle is None)
    if middle is not None:
        assert signed_area(vertices) == pytest.approx(0.0, abs=ROUNDING)
        for choose in (polygon_barycenter, polygon_steiner_point):
            np.testing.assert_allclose(choose(vertices), middle, rtol=0.0, atol=ROUNDING)


def test_polygons_by_hand():
    corners = {(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 1.0)}
    cut = box([0, 0, 0], [1, 1, 1.5])
    assert {tuple(corner) for corner in cut.T.round(12)} == corners
    assert signed_area(cut) == pytest.approx(0.875, rel=1e-14)
    triangle = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]).T.copy()
    np.testing.assert_allclose(polygon_barycenter(triangle), [1 / 3, 1 / 3], rtol=1e-14)
    np.testing.assert_allclose(polygon_steiner_point(triangle), [3 / 8, 3 / 8], rtol=1e-14)
    angles = 2.0 * np.pi * np.arange(7) / 7
    regular = np.array([3.0 + np.cos(angles), -2.0 + np.sin(angles)])
    for choose in (polygon_barycenter, polygon_steiner_point):
        np.testing.assert_allclose(choose(regular), [3.0, -2.0], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("cut", [1e-3, 1e-9, 1e-12])
def test_points_move_by_no_more_than_a_cut_corner(cut):
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]).T.copy()
    whole = np.array([(0, 0), (1, 0), (1, 1 - cut), (1 - cut, 1), (0, 1)], float).T.copy()
    for choose in (polygon_barycenter, polygon_steiner_point):
        assert np.linalg.norm(choose(whole) - choose(square)) <= cut + ROUNDING


@pytest.mark.parametrize("shift", [(-2e-16, 0.0), (0.0, 2e-16), (0.0, 0.0), (2e-16, -2e-16)])
@pytest.mark.parametrize("first", range(5))
def test_a_double_corner_counts_once(shift, first):
    corners = np.array([(0, 0), (1, 0), (1, 1), (1 + shift[0], 1 + shift[1]), (0, 1)], float)
    vertices = np.roll(corners, first, axis=0).T.copy()
    np.testing.assert_allclose(polygon_steiner_point(vertices), 0.5, rtol=0.0, atol=1e-13)


def test_points_do_not_jump_where_three_bounds_meet():
    """A bound is shifted by 1e-9 N; bounds may meet at small angles, which lengthens the step."""
    rng, count = np.random.default_rng(0), 0
    for _ in range(300):
        N = np.linalg.qr(rng.normal(size=(6, 2)))[0].T.copy()
        t, lower, upper = np.full(6, 5.0), np.zeros(6), np.full(6, 10.0)
        lower[:3] = t[:3] + N[:, :3].T @ (2.0 * rng.normal(size=2))
        shifts = np.outer([0.0, 1e-9, -1e-9], np.eye(6)[1])
        polygons = [polygon_vertices(t, N, lower - shift, upper) for shift in shifts]
        if np.all(lower <= upper) and all(
            p.shape[1] > 2 and signed_area(p) > 1.0 for p in polygons
        ):
            count += 1
            for choose in (polygon_barycenter, polygon_steiner_point):
                points = np.array([choose(polygon) for polygon in polygons])
                assert np.max(np.linalg.norm(points - points[0], axis=1)) <= 1e-6
    assert count > 50
