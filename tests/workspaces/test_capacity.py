"""Margins, closure, payload and the available wrenches against Qhull and linear programs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from cdpr_drake.errors import TensionProblemError, WrenchSetError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.workspaces.available_wrenches import available_wrenches
from cdpr_drake.workspaces.demanded_wrenches import (
    Demand,
    MotionDemand,
    SpatialSet,
    accelerating,
    resisting,
    weight_wrenches,
)
from cdpr_drake.workspaces.static_feasibility import statically_feasible, wrench_matrices
from cdpr_drake.workspaces.wrench_capacity import (
    capacity_margins,
    closure_margins,
    largest_payloads,
    margin_slopes,
    scaled_matrices,
)
from cdpr_drake.workspaces.wrench_facets_kernel import many_closures, many_margins, wedge_terms
from tests.workspaces.workspace_cases import random_poses, robot_case

ROUNDING = 1e-9
"""Of margins, relative to the largest tension; Qhull's own facets are good to some 1e-12."""

SHAPES = [(2, 3), (3, 3), (3, 4), (3, 6), (6, 6), (6, 7), (6, 8), (6, 9)]


def corners(lower, upper):
    return np.array(list(product(*zip(lower, upper, strict=True))))


def margins_of(W, lower, upper, points):
    """The kernel on matrices that no robot has."""
    n = W.shape[1]
    margins, full = np.empty(len(W)), np.empty(len(W))
    worst = np.empty((len(W), n + 1))
    still = np.concatenate([np.eye(n), np.zeros((2, n))])[np.newaxis]
    arguments = (W, lower, upper, points, still, *wedge_terms(n), margins, worst, full)
    over_rows(many_margins, len(W), 1, *arguments)
    return margins, worst, full


@pytest.mark.parametrize(("n", "m"), SHAPES)
def test_margins_are_those_of_qhull(n, m):
    random = np.random.default_rng(10 * n + m)
    W = random.normal(size=(4, n, m))
    lower, upper = random.uniform(0, 1, m), random.uniform(2, 5, m)
    points = random.normal(scale=4.0, size=(4, 3, n))
    margins, worst, _ = margins_of(W, lower, upper, points)
    for k in range(len(W)):
        hull = ConvexHull(corners(lower, upper) @ W[k].T)
        room = -(points[k] @ hull.equations[:, :-1].T + hull.equations[:, -1])
        assert margins[k] == pytest.approx(room.min(), abs=ROUNDING * 5)
        normal, point = worst[k, :n], points[k, int(worst[k, n])]
        reach = np.maximum(normal @ W[k] * lower, normal @ W[k] * upper).sum()
        assert reach - normal @ point == pytest.approx(margins[k], abs=ROUNDING * 5)


@pytest.mark.parametrize(("n", "m"), SHAPES)
def test_the_available_wrenches_are_the_hull_of_all_corners(n, m):
    random = np.random.default_rng(m)
    W = random.normal(size=(n, m))
    lower, upper = np.zeros(m), random.uniform(1, 3, m)
    scale = random.uniform(0.5, 2.0, n)
    found = available_wrenches(W, lower, upper, scale)
    hull = ConvexHull(corners(lower, upper) @ W.T)
    assert found.volume == pytest.approx(hull.volume, rel=1e-9)
    theirs = hull.points[hull.vertices]
    assert len(found.vertices) == len(theirs)
    near = np.linalg.norm(found.vertices[:, None] - theirs, axis=2).min(axis=1)
    assert near.max() < 1e-8
    middle = W @ (0.5 * (lower + upper))
    scaled = ConvexHull(hull.points / scale)
    room = -(scaled.equations[:, :-1] @ (middle / scale) + scaled.equations[:, -1])
    assert found.margin(middle) == pytest.approx(room.min(), abs=ROUNDING * 5)


def test_a_section_is_cut_out_of_the_set():
    random = np.random.default_rng(3)
    W, lower, upper = random.normal(size=(6, 8)), np.ones(8), np.full(8, 9.0)
    found = available_wrenches(W, lower, upper)
    at = W @ random.uniform(3, 7, 8)
    for rows in ((3, 4), (0, 1, 2)):
        edge = found.section(rows, at)
        assert len(edge) > len(rows)
        for corner in edge:
            wrench = at.copy()
            wrench[list(rows)] = corner
            assert abs(found.margin(wrench)) < 1e-6
        wrench = at.copy()
        wrench[list(rows)] = edge.mean(axis=0)
        assert found.margin(wrench) > 0.0
    assert len(found.section((3, 4), at + 1e3)) == 0


def test_a_flat_set_is_refused():
    W = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
    with pytest.raises(WrenchSetError, match="flat"):
        available_wrenches(W, np.zeros(3), np.ones(3))
    with pytest.raises(WrenchSetError, match="flat"):
        available_wrenches(np.eye(2), np.ones(2), np.ones(2))
    with pytest.raises(TensionProblemError, match="above upper"):
        available_wrenches(np.eye(2), np.ones(2), np.zeros(2))


def test_a_singular_wrench_matrix_has_no_margin():
    W = np.zeros((3, 3, 4))
    W[0, :2] = [[1, -1, 0.5, 0], [0, 1, 1, -1]]  # no moment
    W[1, 0] = 1.0  # one row only
    W[2] = np.nan
    margins, _, full = margins_of(W, np.zeros(4), np.ones(4), np.zeros((3, 1, 3)))
    assert margins[0] <= ROUNDING
    assert full[0] <= 1e-9
    assert list(margins[1:]) == [-np.inf, -np.inf]
    assert list(full[1:]) == [0.0, 0.0]


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_margin_of_weight_alone_has_the_sign_of_static_feasibility(name):
    robot, case = robot_case(name)
    poses = random_poses(robot, 300)
    found = capacity_margins(case, *poses)
    np.testing.assert_array_equal(found.feasible, statically_feasible(case, *poses))


@pytest.mark.parametrize("name", ["acrobot_large", "acrobot_fully_constrained", "planar"])
def test_static_feasibility_is_that_of_highs(name):
    robot, case = robot_case(name, (1.0, 60.0))
    positions, rotations = random_poses(robot, 150, seed=7)
    found = statically_feasible(case, positions, rotations)
    assert 0.03 < found.mean() < 0.97
    W = scaled_matrices(case, positions, rotations)
    loads = weight_wrenches(case, rotations)[:, list(case.rows)] / case.row_scale()
    for k, feasible in enumerate(found):
        assert feasible == solvable(W[k], -loads[k], case)


def solvable(W, wrench, case):
    bounds = list(zip(case.lower, case.upper, strict=True))
    return linprog(np.zeros(W.shape[1]), A_eq=W, b_eq=wrench, bounds=bounds, method="highs").success


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_wrench_feasible_means_that_every_corner_can_be_held(name):
    robot, case = robot_case(name, (0.5, 60.0))
    required = SpatialSet(box=np.array([0.1, 0.1, 0.1, 3.0, 3.0, 3.0]))
    positions, rotations = random_poses(robot, 40, seed=1, turn=0.1)
    found = capacity_margins(case, positions, rotations, resisting(case, required, rotations))
    assert 0.1 < found.feasible.mean() < 0.95
    W = wrench_matrices(positions, rotations, case.cables)[:, list(case.rows)]
    loads = weight_wrenches(case, rotations)[:, list(case.rows)]
    every = required.corners(case.rows)
    assert len(every) == 2 ** len(case.rows)
    for k in range(len(positions)):
        held = all(solvable(W[k], -(loads[k] + corner), case) for corner in every)
        assert held == found.feasible[k]


def test_a_box_its_corners_and_points_on_an_ellipsoid_have_the_same_margins():
    robot, case = robot_case("acrobot_large")
    positions, rotations = random_poses(robot, 60, seed=2)
    half = np.array([0.2, 0.1, 0.3, 2.0, 1.0, 4.0])
    as_box = SpatialSet(vertices=np.ones((1, 6)), box=half)
    as_points = SpatialSet(vertices=as_box.corners(case.rows))
    one, other = (
        capacity_margins(case, positions, rotations, resisting(case, each, rotations)).margins
        for each in (as_box, as_points)
    )
    np.testing.assert_allclose(one, other, atol=ROUNDING * 60)
    # An ellipsoid is the limit of the polytopes of its points.
    ball = SpatialSet(ellipsoid=half)
    random = np.random.default_rng(0)
    exact = capacity_margins(case, positions, rotations, resisting(case, ball, rotations))
    tips = exact.normals / case.row_scale() * half
    tips = half * tips / np.linalg.norm(tips, axis=1, keepdims=True)
    for k in range(len(positions)):
        around = random.normal(size=(50, 6))
        around = half * around / np.linalg.norm(around, axis=1, keepdims=True)
        turn = rotations[k : k + 1]
        some = resisting(case, SpatialSet(vertices=np.vstack([around, tips[k], -tips[k]])), turn)
        margin = capacity_margins(case, positions[k : k + 1], turn, some).margins
        assert margin[0] == pytest.approx(exact.margins[k], abs=1e-7)


def test_dynamic_at_zero_acceleration_is_static():
    robot, case = robot_case("acrobot_large")
    body = rigid_platform(robot)
    positions, rotations = random_poses(robot, 200, seed=4)
    still = MotionDemand(body.mass, body.p_PCo, body.I_PPo, SpatialSet())
    found = capacity_margins(case, positions, rotations, accelerating(case, still, rotations))
    np.testing.assert_allclose(found.margins, capacity_margins(case, positions, rotations).margins)


def test_accelerating_needs_the_rate_of_momentum():
    """Against finite differences of linear and angular momentum along a motion."""
    robot, case = robot_case("acrobot_large")
    body = rigid_platform(robot)
    p_PCo = np.array([0.03, -0.02, 0.05])
    I_PPo = body.I_PPo + np.array([[0.02, 0.003, 0], [0.003, 0.03, -0.002], [0, -0.002, 0.04]])
    angles, w = np.array([0.3, -0.2, 0.5]), np.array([1.0, -2.0, 1.5])
    alpha, a, v = np.array([0.5, 0.2, -1.0]), np.array([1.0, 2.0, -3.0]), np.array([0.3, 0.1, 0.2])
    R0 = rotation_from_angles(angles).matrix()

    def momenta(t):
        turn = w * t + 0.5 * alpha * t * t  # good to second order about t = 0
        size = np.linalg.norm(turn)
        K = np.cross(np.eye(3), turn / size) if size else np.zeros((3, 3))
        R = (np.eye(3) + np.sin(size) * K + (1 - np.cos(size)) * K @ K) @ R0
        # The commutator of w and alpha comes in at t^3 only.
        w_t, v_t = w + alpha * t, v + a * t
        position = v * t + 0.5 * a * t * t
        c = R @ p_PCo
        linear = body.mass * (v_t + np.cross(w_t, c))
        about_po = R @ I_PPo @ R.T @ w_t + body.mass * np.cross(c, v_t)
        return linear, about_po + np.cross(position, linear)  # about where Po was

    h = 1e-5
    (l0, h0), (l1, h1) = momenta(-h), momenta(h)
    force, moment = (l1 - l0) / (2 * h), (h1 - h0) / (2 * h)
    motion = MotionDemand(
        body.mass, p_PCo, I_PPo, SpatialSet(vertices=np.concatenate([alpha, a])[None]),
        np.concatenate([w, v])[None],
    )  # fmt: skip
    demand = accelerating(case, motion, R0[None])
    weightless = demand.points[0, 0] + weight_wrenches(case, R0[None])[0]
    np.testing.assert_allclose(weightless, np.concatenate([moment, force]), atol=1e-6)


def test_the_spread_of_accelerations_is_the_inertia():
    robot, case = robot_case("caroca")
    body = rigid_platform(robot)
    box = SpatialSet(box=np.array([1.0, 2.0, 3.0, 1.0, 1.0, 2.0]))
    corners_too = SpatialSet(vertices=box.corners(case.rows))
    positions, rotations = random_poses(robot, 30, seed=5)
    v = np.array([[0.5, -0.5, 1.0, 0, 0, 0], [0, 0, 0, 1, 1, 1]])
    one, other = (
        capacity_margins(
            case, positions, rotations,
            accelerating(
                case, MotionDemand(body.mass, body.p_PCo, body.I_PPo, each, v), rotations
            ),
        ).margins
        for each in (box, corners_too)
    )  # fmt: skip
    np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize(("n", "m"), [(2, 3), (3, 4), (3, 6), (6, 7), (6, 8), (6, 10)])
def test_closure_is_a_positive_null_vector(n, m):
    random = np.random.default_rng(n * m)
    W = random.normal(size=(60, n, m))
    for k in range(0, 60, 2):  # every other one is closed for certain, but for rounding
        t = random.uniform(0.1, 1.0, m)
        W[k, :, -1] = -(W[k, :, :-1] @ t[:-1]) / t[-1]
    found = np.empty(60)
    over_rows(many_closures, 60, 1, W, *wedge_terms(n), found)
    for k in range(60):
        # max s subject to W t = 0, t >= s, sum t = 1
        A = np.vstack([np.column_stack([W[k], np.zeros(n)]), [*np.ones(m), 0.0]])
        A_ub = np.column_stack([-np.eye(m), np.ones(m)])
        best = linprog(
            [*np.zeros(m), -1.0], A_ub=A_ub, b_ub=np.zeros(m), A_eq=A, b_eq=[*np.zeros(n), 1.0],
            bounds=[(0, None)] * m + [(None, None)], method="highs",
        )  # fmt: skip
        assert (found[k] > 1e-9) == (best.success and -best.fun > 1e-9)


def test_closure_knows_no_weight_and_no_suspended_robot_has_it():
    robot, case = robot_case("acrobot_fully_constrained")
    poses = random_poses(robot, 200, turn=0.1)
    found = closure_margins(case, *poses)
    _, heavy = robot_case("acrobot_fully_constrained", (3.0, 9.0), mass=50.0)
    np.testing.assert_array_equal(found, closure_margins(heavy, *poses))
    assert 0.05 < np.mean(found > 0.0) < 1.0
    robot, case = robot_case("acrobot_large")
    below = random_poses(robot, 200, turn=0.1)
    below[0][:, 2] *= 0.8
    assert np.all(closure_margins(case, *below) <= 0.0)


def test_the_largest_payload_is_a_linear_program():
    robot, case = robot_case("acrobot_large", (0.0, 60.0))
    positions, rotations = random_poses(robot, 60, seed=6)
    found = largest_payloads(case, positions, rotations, robot.gravity)
    W = wrench_matrices(positions, rotations, case.cables)
    loads = weight_wrenches(case, rotations)
    assert 0.1 < np.mean(np.isnan(found)) < 0.9
    for k, payload in enumerate(found):
        per_kg = loads[k] / robot.platform.mass
        best = linprog(
            [*np.zeros(8), -1.0], A_eq=np.column_stack([W[k], per_kg]), b_eq=-loads[k],
            bounds=[*zip(case.lower, case.upper, strict=True), (0, None)], method="highs",
        )  # fmt: skip
        assert best.success == np.isfinite(payload)
        if best.success:
            assert payload == pytest.approx(-best.fun, rel=1e-6, abs=1e-6)
    flat, planar = robot_case("planar")
    assert np.all(np.isinf(largest_payloads(planar, *random_poses(flat, 5), 9.81)[:1]))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SpatialSet(vertices=np.zeros((0, 6))), ["vertices", "at least one"]),
        (lambda: SpatialSet(vertices=np.full((1, 6), np.inf)), ["vertices", "without bounds"]),
        (lambda: SpatialSet(box=np.full(6, -1.0)), ["box", "-1"]),
        (lambda: SpatialSet(ellipsoid=np.full(6, np.inf)), ["ellipsoid", "finite"]),
        (lambda: SpatialSet(ellipsoid=np.ones(6)).corners((3, 4)), ["ellipsoid", "vertices"]),
        (
            lambda: MotionDemand(1.0, np.zeros(3), np.eye(3), SpatialSet(), np.zeros((0, 6))),
            ["velocities"],
        ),
    ],
)
def test_sets_that_make_no_sense(make, words):
    with pytest.raises(WrenchSetError) as refused:
        make()
    for word in words:
        assert word in str(refused.value)


def test_a_demand_is_plain_data():
    assert SpatialSet().is_zero()
    assert not SpatialSet(box=np.ones(6)).is_zero()
    assert set(Demand.__dataclass_fields__) == {"points", "spread"}


SLOPE = 2e-5  # relative to the largest slope; central differences over 1e-5 m of exact margins


@pytest.mark.parametrize("name", ["acrobot_large", "ipanema_1"])
def test_slopes_of_the_margin_are_its_differences(name):
    """Under a polytope, a box and an ellipsoid of moments and forces, by every point of a cable."""
    robot, case = robot_case(name)
    # Off the middle, where one facet alone is the nearest.
    p = robot.home.position[np.newaxis] + np.array([0.03, -0.05, 0.02])
    R = rotation_from_angles(np.array([0.04, -0.03, 0.05])).matrix()[np.newaxis]
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
        wanted = np.empty_like(found)
        for axis, cable in np.ndindex(found.shape):
            ends = []
            for step in (1e-5, -1e-5):
                moved = getattr(case.cables, points).copy()
                moved[axis, cable] += step
                ends.append(margin(replace(case.cables, **{points: moved})))
            wanted[axis, cable] = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose(found, wanted, atol=SLOPE * np.max(np.abs(wanted)))
