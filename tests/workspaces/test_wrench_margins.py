"""Feasibility, margins, closure, payloads, breaks: against Qhull, linear programs, closed forms."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.available_wrenches import available_wrenches
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting, weight_wrenches
from cdpr_drake.workspaces.single_failure import (
    break_margins,
    breaks_survived,
    survives_breaks,
    without_cable,
)
from cdpr_drake.workspaces.static_feasibility import (
    StaticCase,
    statically_feasible,
    wrench_matrices,
)
from cdpr_drake.workspaces.wrench_capacity import (
    capacity_margins,
    closure_margins,
    largest_payloads,
    margin_slopes,
)
from cdpr_drake.workspaces.wrench_facets_kernel import many_closures, many_margins, wedge_terms
from tests.workspaces.workspace_cases import (
    held_by_highs,
    loaded,
    pentagon,
    random_poses,
    robot_case,
    rotations_of,
    solvable,
    upright,
)

ROUNDING = 1e-12
MARGIN = 1e-9  # of margins, relative to the largest tension; Qhull's facets are good to some 1e-12
SLOPE = 2e-5  # relative to the largest slope; central differences over 1e-5 m of exact margins
SHAPES = [(2, 3), (3, 3), (3, 4), (3, 6), (6, 6), (6, 7), (6, 8), (6, 9)]


# Available wrenches.


def corners(lower, upper):
    return np.array(list(product(*zip(lower, upper, strict=True))))


def margins_of(W, lower, upper, points):
    """The kernel on matrices that no robot has."""
    n = W.shape[1]
    margins, full, worst = np.empty(len(W)), np.empty(len(W)), np.empty((len(W), n + 1))
    still = np.concatenate([np.eye(n), np.zeros((2, n))])[np.newaxis]
    arguments = (W, lower, upper, points, still, *wedge_terms(n), margins, worst, full)
    over_rows(many_margins, len(W), 1, *arguments)
    return margins, worst, full


def room(hull, points):
    """How deep points lie in a hull of Qhull, the least of them."""
    return np.min(-(points @ hull.equations[:, :-1].T + hull.equations[:, -1]))


@pytest.mark.parametrize(("n", "m"), SHAPES)
def test_margins_and_available_wrenches_are_those_of_qhull(n, m):
    random = np.random.default_rng(10 * n + m)
    W = random.normal(size=(2, n, m))
    lower, upper = random.uniform(0, 1, m), random.uniform(2, 5, m)
    points = random.normal(scale=4.0, size=(2, 3, n))
    margins, worst, _ = margins_of(W, lower, upper, points)
    for k in range(len(W)):
        hull = ConvexHull(corners(lower, upper) @ W[k].T)
        assert margins[k] == pytest.approx(room(hull, points[k]), abs=MARGIN * 5)
        normal, point = worst[k, :n], points[k, int(worst[k, n])]
        reach = np.maximum(normal @ W[k] * lower, normal @ W[k] * upper).sum()
        assert reach - normal @ point == pytest.approx(margins[k], abs=MARGIN * 5)
    scale = random.uniform(0.5, 2.0, n)
    wrenches = available_wrenches(W[-1], lower, upper, scale)
    assert wrenches.volume == pytest.approx(hull.volume, rel=1e-9)
    theirs = hull.points[hull.vertices]
    assert len(wrenches.vertices) == len(theirs)
    near = np.linalg.norm(wrenches.vertices[:, None] - theirs, axis=2).min(axis=1)
    assert near.max() < 1e-8
    middle = W[-1] @ (0.5 * (lower + upper))
    scaled = ConvexHull(hull.points / scale)
    assert wrenches.margin(middle) == pytest.approx(room(scaled, middle / scale), abs=MARGIN * 5)


def test_a_section_is_cut_out_of_the_set():
    random = np.random.default_rng(3)
    W = random.normal(size=(6, 8))
    wrenches = available_wrenches(W, np.ones(8), np.full(8, 9.0))
    at = W @ random.uniform(3, 7, 8)
    for rows in ((3, 4), (0, 1, 2)):
        edge = wrenches.section(rows, at)
        assert len(edge) > len(rows)
        wrench = at.copy()
        for corner in edge[:40]:
            wrench[list(rows)] = corner
            assert abs(wrenches.margin(wrench)) < 1e-6
        wrench[list(rows)] = edge.mean(axis=0)
        assert wrenches.margin(wrench) > 0.0
    assert len(wrenches.section((3, 4), at + 1e3)) == 0


def test_a_singular_wrench_matrix_has_no_margin():
    W = np.zeros((3, 3, 4))
    W[0, :2] = [[1, -1, 0.5, 0], [0, 1, 1, -1]]  # no moment
    W[1, 0] = 1.0  # one row only
    W[2] = np.nan
    margins, _, full = margins_of(W, np.zeros(4), np.ones(4), np.zeros((3, 1, 3)))
    assert margins[0] <= MARGIN
    assert full[0] <= 1e-9
    assert list(margins[1:]) == [-np.inf, -np.inf]
    assert list(full[1:]) == [0.0, 0.0]


# Weight alone.


@pytest.mark.parametrize(
    ("name", "limits", "wrench"),
    [
        ("acrobot_large", (1.0, 60.0), None),
        ("acrobot_large", (1.0, 60.0), [0.2, -0.1, 0.05, 3.0, -2.0, 1.0]),
        ("acrobot_fully_constrained", (1.0, 60.0), None),
        ("planar", (1.0, 60.0), None),
        ("caroca", None, None),
    ],
)
def test_static_feasibility_is_that_of_highs_and_of_margins(name, limits, wrench):
    robot, case = robot_case(name, limits)
    if wrench:
        case = replace(case, wrench=np.array(wrench))
    poses = random_poses(robot, 150, seed=7)
    feasible = statically_feasible(case, *poses)
    assert 0.03 < feasible.mean() < 0.97
    np.testing.assert_array_equal(feasible, held_by_highs(case, *poses))
    np.testing.assert_array_equal(feasible, capacity_margins(case, *poses).feasible)
    wide, narrow = replace(case, lower=0.5 * case.lower), replace(case, upper=0.5 * case.upper)
    assert np.all(feasible <= statically_feasible(wide, *poses))
    assert np.all(statically_feasible(narrow, *poses) <= feasible)


def test_wrench_matrices_and_weights_are_those_of_single_poses():
    robot, _ = robot_case("acrobot_large")
    case = static_case(robot, pulleys=False)
    poses = random_poses(robot, 20)
    weight = robot.platform.mass, case.p_PCo, robot.gravity
    matrices = wrench_matrices(*poses, case.cables)
    for p, R, W, w in zip(*poses, matrices, weight_wrenches(case, poses[1]), strict=True):
        X_WP = RigidTransform(RotationMatrix(R), p)
        expected = wrench_matrix(X_WP, case.cables.p_WA, case.cables.p_PB)
        np.testing.assert_allclose(W, expected, atol=ROUNDING)
        np.testing.assert_allclose(w, gravity_wrench(X_WP, *weight), atol=1e-9)


def test_over_pulleys_it_agrees_with_tension_problems():
    robot, _ = robot_case("caroca")
    cables = robot.cable_set()
    mixed = replace(cables, pulley_radius=np.where(np.arange(8) % 2, cables.pulley_radius, 0.0))
    random = np.random.default_rng(4)
    lower, upper = robot.frame.lower, robot.frame.upper
    positions = random.uniform(0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper, (120, 3))
    rotations = rotations_of(random.uniform(-0.6, 0.6, (120, 3)))
    straight = static_case(robot, pulleys=False)
    assert not straight.cables.has_pulleys()
    without = statically_feasible(straight, positions, rotations)
    for chosen in (cables, mixed):
        feasible = statically_feasible(replace(straight, cables=chosen), positions, rotations)
        assert 0.1 < np.mean(feasible) < 0.9
        assert np.any(feasible != without)
        many = wrench_matrices(positions, rotations, chosen)
        for W, held, p, R in zip(many, feasible, positions, rotations, strict=True):
            problem = tension_problem(robot, RigidTransform(RotationMatrix(R), p), cables=chosen)
            np.testing.assert_allclose(W, problem.W, atol=ROUNDING)
            assert held == (exact_tensions(problem) is not None)


def point_mass(radius=0.0):
    """Forces only, on three cables from a triangle at height 1."""
    p_WA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    cables = replace(CableSet.make(p_WA, np.zeros((3, 3)), 1.0), pulley_radius=np.full(3, radius))
    return StaticCase(
        cables, np.zeros(3), np.full(3, 1e6), 10.0, np.zeros(3), wrench=np.zeros(6), rows=(3, 4, 5)
    )


def test_a_point_mass_on_three_cables_is_held_below_the_triangle_only():
    positions = np.random.default_rng(2).uniform([-0.5, -0.5, 0.0], [1.5, 1.5, 0.9], (500, 3))
    x, y = positions[:, 0], positions[:, 1]
    inside = (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0)
    np.testing.assert_array_equal(
        statically_feasible(point_mass(), positions, upright(500)), inside
    )


@pytest.mark.parametrize(
    ("radius", "place"), [(0.0, [0.0, 0.0, 1.0]), (0.05, [0.05, 0.03, 1.0])], ids=["exit", "groove"]
)
def test_an_anchor_point_on_an_exit_point_or_in_a_groove_is_not_feasible(radius, place):
    positions = np.array([place, [0.3, 0.3, 0.5]])
    feasible = statically_feasible(point_mass(radius), positions, upright(2))
    assert list(feasible) == [False, True]


# Wrenches beside the weight.


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_wrench_feasible_means_that_every_corner_can_be_held(name):
    robot, case = robot_case(name, (0.5, 60.0))
    required = SpatialSet(box=np.array([0.1, 0.1, 0.1, 3.0, 3.0, 3.0]))
    poses = random_poses(robot, 15, seed=1, turn=0.1)
    capacity = capacity_margins(case, *poses, resisting(case, required, poses[1]))
    assert 0.1 < capacity.feasible.mean() < 0.95
    every = required.corners(case.rows)
    assert len(every) == 2 ** len(case.rows)
    for W, load, feasible in zip(*loaded(case, *poses), capacity.feasible, strict=True):
        bounds = case.lower, case.upper
        assert feasible == all(solvable(W, -(load + corner), *bounds) for corner in every)


def test_a_box_its_corners_and_points_on_an_ellipsoid_have_the_same_margins():
    robot, case = robot_case("acrobot_large")
    positions, rotations = random_poses(robot, 40, seed=2)
    half = np.array([0.2, 0.1, 0.3, 2.0, 1.0, 4.0])

    def capacity(required, at=slice(None)):
        demand = resisting(case, required, rotations[at])
        return capacity_margins(case, positions[at], rotations[at], demand)

    box = SpatialSet(vertices=np.ones((1, 6)), box=half)
    points = SpatialSet(vertices=box.corners(case.rows))
    np.testing.assert_allclose(capacity(box).margins, capacity(points).margins, atol=MARGIN * 60)
    # An ellipsoid is the limit of the polytopes of its points.
    exact = capacity(SpatialSet(ellipsoid=half))
    tips = exact.normals / case.row_scale() * half
    random = np.random.default_rng(0)
    for k, tip in enumerate(tips):
        around = np.vstack([random.normal(size=(50, 6)), tip, -tip])
        around = half * around / np.linalg.norm(around, axis=1, keepdims=True)
        margins = capacity(SpatialSet(vertices=around), slice(k, k + 1)).margins
        assert margins[0] == pytest.approx(exact.margins[k], abs=1e-7)


@pytest.mark.parametrize("name", ["acrobot_large", "ipanema_1"])
def test_slopes_of_the_margin_are_its_differences(name):
    """Under a polytope, a box and an ellipsoid of moments and forces, by every point of a cable."""
    robot, case = robot_case(name)
    # Off the middle, where one facet alone is the nearest.
    p = robot.home.position[np.newaxis] + np.array([0.03, -0.05, 0.02])
    R = rotations_of([[0.04, -0.03, 0.05]])
    weight = robot.platform.mass * robot.gravity
    required = SpatialSet(
        vertices=weight * np.array([[0.02, 0.0, 0.01, 0.1, 0.0, 0.0], [0, 0.01, 0, 0, 0.2, 0.1]]),
        box=weight * np.array([0.01, 0.0, 0.02, 0.0, 0.05, 0.0]),
        ellipsoid=weight * np.array([0.02, 0.03, 0.01, 0.2, 0.1, 0.1]),
    )

    def margin(cables):
        changed = replace(case, cables=cables)
        return capacity_margins(changed, p, R, resisting(changed, required, R)).margins[0]

    slopes = margin_slopes(case, p, R, resisting(case, required, R))
    for points, found in (("p_WA", slopes.exits[0]), ("p_PB", slopes.anchors[0])):
        expected = np.empty_like(found)
        for axis, cable in np.ndindex(found.shape):
            ends = []
            for step in (1e-5, -1e-5):
                moved = getattr(case.cables, points).copy()
                moved[axis, cable] += step
                ends.append(margin(replace(case.cables, **{points: moved})))
            expected[axis, cable] = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose(found, expected, atol=SLOPE * np.max(np.abs(expected)))


def test_the_largest_payload_is_a_linear_program():
    robot, case = robot_case("acrobot_large", (0.0, 60.0))
    poses = random_poses(robot, 60, seed=6)
    payloads = largest_payloads(case, *poses, robot.gravity)
    assert 0.1 < np.mean(np.isnan(payloads)) < 0.9
    for W, load, payload in zip(*loaded(case, *poses), payloads, strict=True):
        best = linprog(
            [*np.zeros(8), -1.0], A_eq=np.column_stack([W, load / robot.platform.mass]),
            b_eq=-load, bounds=[*zip(case.lower, case.upper, strict=True), (0, None)],
            method="highs",
        )  # fmt: skip
        assert best.success == np.isfinite(payload)
        if best.success:
            assert payload == pytest.approx(-best.fun, rel=1e-6, abs=1e-6)
    flat, planar = robot_case("planar")
    assert np.all(np.isinf(largest_payloads(planar, *random_poses(flat, 5), 9.81)[:1]))


def test_sets_that_ask_nothing_are_zero():
    assert SpatialSet().is_zero()
    assert not SpatialSet(box=np.ones(6)).is_zero()


# Closure.


@pytest.mark.parametrize(("n", "m"), [(2, 3), (3, 4), (3, 6), (6, 7), (6, 8), (6, 10)])
def test_closure_is_a_positive_null_vector(n, m):
    random = np.random.default_rng(n * m)
    W = random.normal(size=(30, n, m))
    for one in W[::2]:  # every other one is closed for certain, but for rounding
        t = random.uniform(0.1, 1.0, m)
        one[:, -1] = -(one[:, :-1] @ t[:-1]) / t[-1]
    margins = np.empty(30)
    over_rows(many_closures, 30, 1, W, *wedge_terms(n), margins)
    for one, margin in zip(W, margins, strict=True):
        # max s subject to W t = 0, t >= s, sum t = 1
        A = np.vstack([np.column_stack([one, np.zeros(n)]), [*np.ones(m), 0.0]])
        A_ub = np.column_stack([-np.eye(m), np.ones(m)])
        best = linprog(
            [*np.zeros(m), -1.0], A_ub=A_ub, b_ub=np.zeros(m), A_eq=A, b_eq=[*np.zeros(n), 1.0],
            bounds=[(0, None)] * m + [(None, None)], method="highs",
        )  # fmt: skip
        assert (margin > 1e-9) == (best.success and -best.fun > 1e-9)


def test_closure_knows_no_weight_and_no_suspended_robot_has_it():
    robot, case = robot_case("acrobot_fully_constrained")
    poses = random_poses(robot, 200, turn=0.1)
    margins = closure_margins(case, *poses)
    heavy = static_case(robot, (3.0, 9.0), mass=50.0)
    np.testing.assert_array_equal(margins, closure_margins(heavy, *poses))
    assert 0.05 < np.mean(margins > 0.0) < 1.0
    robot, case = robot_case("acrobot_large")
    positions, rotations = random_poses(robot, 200, turn=0.1)
    positions[:, 2] *= 0.8
    assert np.all(closure_margins(case, positions, rotations) <= 0.0)


# Breaks of single cables.

PUSH = SpatialSet(box=np.array([0, 0, 0, 1.0, 1.0, 1.0]))  # a newton along each axis of W


@pytest.mark.parametrize("name", ["segesta", "acrobot_large"])
def test_every_subset_of_cables_holds_as_linear_programs_say(name):
    robot, case = robot_case(name)
    positions, rotations = random_poses(robot, 20, seed=3, turn=0.02)
    if name == "segesta":  # where some survive, as most random poses do not
        frame = robot.frame
        positions[::2] = frame.lower + np.array([0.5, 0.5, 0.4]) * (frame.upper - frame.lower)
        positions[::2] += np.random.default_rng(4).uniform(-0.05, 0.05, (10, 3))
    every = [None, *range(case.cables.count)]
    theirs = np.array([held_by_highs(case, positions, rotations, one) for one in every])
    survives = survives_breaks(case, positions, rotations)
    np.testing.assert_array_equal(survives, np.all(theirs, axis=0))
    count = np.where(theirs[0], np.sum(theirs[1:], axis=0), 0)
    np.testing.assert_array_equal(breaks_survived(case, positions, rotations), count)
    assert survives.any() == (name == "segesta")
    assert not survives.all()
    # At these poses the counts of ACROBOT, with its fitted centre of mass, are 0 and 4 alone.
    assert len(np.unique(count)) > (2 if name == "segesta" else 1)


def test_margins_of_breaks_agree_with_verdicts():
    case = pentagon()
    positions = np.random.default_rng(2).uniform(-0.5, 0.5, (300, 3)) * [1.0, 1.0, 0.0]
    held, pushed = (
        survives_breaks(case, positions, upright(300), required) for required in (None, PUSH)
    )
    for verdicts, required in ((held, None), (pushed, PUSH)):
        assert verdicts.any()
        assert not verdicts.all()
        margins = break_margins(case, positions, upright(300), required)
        clear = np.abs(margins) > 1e-6
        np.testing.assert_array_equal(verdicts[clear], margins[clear] > 0.0)
    assert np.all(pushed <= held)


def test_a_smallest_tension_can_spoil_what_the_rest_would_hold():
    """With all cables the point must stand, too: one that pulls at least 1 kN takes it away."""
    case = pentagon()
    lower, upper = np.full(5, 1e-3), np.full(5, 10.0)
    lower[0], upper[0] = 1000.0, 2000.0
    tight = replace(case, lower=lower, upper=upper)
    place = np.zeros((1, 3)), upright(1)
    assert statically_feasible(without_cable(tight, 0), *place)[0]
    assert not statically_feasible(tight, *place)[0]
    assert not survives_breaks(tight, *place)[0]
    assert survives_breaks(case, *place)[0]
    assert breaks_survived(case, *place)[0] == 5
