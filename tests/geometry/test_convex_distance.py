"""Signed distances of convex shapes against programs, Drake's queries and Qhull."""

import inspect
import re

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    Capsule,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.spatial import ConvexHull

from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry import convex_distance_kernel
from cdpr_drake.geometry.convex_distance_kernel import convex_distance, convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, mesh_vertices, packed
from cdpr_drake.workspaces.cable_distance_kernel import (
    boxes_distance,
    segment_box_distance,
    segments_distance,
)
from cdpr_drake.workspaces.cable_interference import box_row

DIGITS = 1e-12
"""Of distances of hulls of some metres: a thousand times their rounding [m]."""

PROGRAM_DIGITS = 1e-6
"""Clarabel stops at a gap of 1e-8 of the squared distance, here of up to 30 m^2."""

TOUCHING_DIGITS = 1e-3
"""The same for distances near 0, whose square it knows to 1e-6 [m]."""

DRAKE_DIGITS = 1e-5
"""FCL, by which Drake finds distances of boxes from each other, stops at 1e-6 relative [m]."""


def found(P, Q, function=convex_distance):
    p, q, n = np.empty(3), np.empty(3), np.empty(3)
    d = function(P, Q, p, q, n, convex_work(len(P), len(Q)))
    return d, p, q, n


def check(P, Q, function=convex_distance):
    """All that the kernel promises of itself; returns the distance."""
    d, p, q, n = found(P, Q, function)
    assert np.linalg.norm(n) == pytest.approx(1.0, abs=DIGITS)
    assert np.min(P @ n) - np.max(Q @ n) == pytest.approx(d, abs=DIGITS)
    assert p - q == pytest.approx(d * n, abs=DIGITS)
    for points, point in ((P, p), (Q, q)):
        assert np.max(points @ n) + DIGITS >= point @ n >= np.min(points @ n) - DIGITS
    return d


def program_distance(P, Q):
    """By a program of the points' shares, solved by Clarabel."""
    program = MathematicalProgram()
    x, y = program.NewContinuousVariables(len(P)), program.NewContinuousVariables(len(Q))
    z = np.concatenate([x, y])
    A = np.hstack([P.T, -Q.T])
    program.AddQuadraticCost(2.0 * A.T @ A, np.zeros(len(z)), z, is_convex=True)
    program.AddBoundingBoxConstraint(0.0, 1.0, z)
    for part in (x, y):
        program.AddLinearEqualityConstraint(np.ones((1, len(part))), [1.0], part)
    result = ClarabelSolver().Solve(program)
    assert result.is_success()
    return np.linalg.norm(A @ result.GetSolution(z))


def random_hulls(random, count):
    """Some far, some near, some overlapping; a third on a coarse lattice: faces in parallel."""
    for number in range(count):
        k, l = random.integers(1, 16, 2)  # noqa: E741
        P = random.normal(size=(k, 3))
        Q = random.normal(size=(l, 3)) * random.choice([0.1, 1.0, 3.0])
        Q += random.normal(size=3) * random.choice([0.0, 1.0, 3.0])
        if number % 3 == 0:
            P, Q = np.round(P), np.round(2.0 * Q) / 2.0
        yield P, Q


def test_distances_are_those_of_a_program():
    apart = 0
    for P, Q in random_hulls(np.random.default_rng(0), 500):
        d = check(P, Q)
        apart += d > 0.0
        assert max(d, 0.0) == pytest.approx(program_distance(P, Q), abs=TOUCHING_DIGITS)
        if d > 0.01:
            assert d == pytest.approx(program_distance(P, Q), abs=PROGRAM_DIGITS)
    assert 100 < apart < 400


def check_depths(function, count):
    deep = 0
    for P, Q in random_hulls(np.random.default_rng(1), count):
        w = (P[:, np.newaxis] - Q).reshape(-1, 3)
        if np.linalg.matrix_rank(w - w[0], tol=1e-9) < 3:
            continue
        place = np.max(ConvexHull(w).equations[:, 3])  # of the origin, below 0 inside
        if place < 0.0:
            deep += 1
            assert check(P, Q, function) == pytest.approx(place, abs=DIGITS)
    assert deep > count // 10


def test_depths_are_those_of_the_hull_of_all_differences():
    check_depths(convex_distance, 2000)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("if work[row, 6] < depth:", "if work[row, 6] > -1.0 and depth == np.inf:"),
        ("SAME_PLANE = 1e-12", "SAME_PLANE = -1.0"),
        ("if _side(work, i, j, k, skipped) > 0.0:", "if skipped == 0:"),
    ],
)
def test_mutants_of_the_kernel_are_found(old, new):
    source = inspect.getsource(convex_distance_kernel)
    assert old in source
    names = {"__name__": "mutant"}
    exec(re.sub(r"@njit\(.*\)\n", "", source.replace(old, new)), names)

    def try_it():
        check_depths(names["convex_distance"], 400)
        for P, Q in random_hulls(np.random.default_rng(0), 300):
            d = check(P, Q, names["convex_distance"])
            assert d == pytest.approx(check(P, Q), abs=DIGITS)

    with pytest.raises((AssertionError, ZeroDivisionError)):
        try_it()


def drake_distance(one, other, X, Y):
    scene = SceneGraph()
    source = scene.RegisterSource("shapes")
    poses, ids = FramePoseVector(), []
    for name, shape, pose in (("a", one, X), ("b", other, Y)):
        frame = scene.RegisterFrame(source, GeometryFrame(name))
        instance = GeometryInstance(RigidTransform(), shape, name)
        instance.set_proximity_properties(ProximityProperties())
        ids.append(scene.RegisterGeometry(source, frame, instance))
        poses.set_value(frame, pose)
    context = scene.CreateDefaultContext()
    scene.get_source_pose_port(source).FixValue(context, poses)
    query = scene.get_query_output_port().Eval(context)
    return query.ComputeSignedDistancePairClosestPoints(*ids).distance


def ours(shape):
    """A shape of Drake, in its own frame."""
    if isinstance(shape, Sphere):
        return ConvexShape.sphere(np.zeros(3), shape.radius())
    if isinstance(shape, Capsule):
        end = np.array([0.0, 0.0, 0.5 * shape.length()])
        return ConvexShape.capsule(-end, end, shape.radius())
    return ConvexShape.box_at(np.zeros(3), shape.size())


def test_shapes_are_as_far_apart_as_drake_says():
    random = np.random.default_rng(2)
    shapes = [Box(0.4, 0.3, 0.2), Box(1.0, 0.1, 0.1), Sphere(0.2), Capsule(0.1, 0.5)]
    overlapping = 0
    for number in range(400):
        a, b = (shapes[k] for k in random.integers(0, len(shapes), 2))
        X, Y = (
            RigidTransform(
                RotationMatrix.MakeFromOneVector(random.normal(size=3), 2),
                random.normal(size=3) * (0.15 if number % 2 else 0.6),
            )
            for _ in range(2)
        )
        d, p, q, n = ours(a).moved(X).distance(ours(b).moved(Y))
        overlapping += d < 0.0
        assert p - q == pytest.approx(d * n, abs=DIGITS)
        assert d == pytest.approx(drake_distance(a, b, X, Y), abs=DRAKE_DIGITS)
    assert overlapping > 60


def test_boxes_and_segments_are_as_far_apart_as_the_kernels_of_cables_say():
    random = np.random.default_rng(3)
    for _ in range(500):
        turns = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(2)]
        rows = [box_row(random.normal(size=3), random.uniform(0.0, 1.0, 3), turn) for turn in turns]
        P, Q = (ConvexShape.box(row).points for row in rows)
        d = check(P, Q)
        assert max(d, 0.0) == pytest.approx(boxes_distance(*rows, np.empty((2, 3))), abs=DIGITS)
        cable, other = random.normal(size=(2, 2, 3))
        d = check(cable, Q)
        assert max(d, 0.0) == pytest.approx(segment_box_distance(*cable, rows[1]), abs=DIGITS)
        assert check(cable, other) == pytest.approx(segments_distance(*cable, *other), abs=DIGITS)


CUBE = ConvexShape.box_at(np.zeros(3), np.ones(3)).points
X, Y, Z = np.eye(3)


@pytest.mark.parametrize(
    ("P", "Q", "distance"),
    [
        (CUBE, CUBE + X, 0.0),  # faces touch
        (CUBE, CUBE + X + Y, 0.0),  # edges
        (CUBE, CUBE + X + Y + Z, 0.0),  # corners
        (CUBE, CUBE + 1.25 * X + 0.5 * Y, 0.25),  # faces in parallel
        (CUBE, CUBE, -1.0),
        (CUBE, CUBE + (1.0 + 1e-11) * X, 1e-11),
        (CUBE, CUBE + (1.0 - 1e-11) * X, -1e-11),
        (CUBE, 0.001 * CUBE + 0.4 * X, -0.1005),  # one within the other
        (CUBE, np.zeros((1, 3)), -0.5),
        (np.zeros((1, 3)), np.zeros((1, 3)), 0.0),
        (np.array([-X, X]), np.array([-Y, Y]), 0.0),  # segments that cross
        (np.array([-X, X]), np.array([-X, X]) + Z, 1.0),
        (np.array([-X, X]), np.array([0.0 * X, 3.0 * X]), 0.0),  # in one line
        (np.array([-X, X]), np.array([0.5 * X]), 0.0),
        (np.array([X, X, X]), CUBE, 0.5),  # points more than once
        (np.array([X, Y, -X]), np.array([0.1 * Y - Z, 0.1 * Y + Z]), -0.1),  # through a triangle
        (np.array([X, Y, -X]), np.array([X, Y, Z - 2.0 * X]), 0.0),
    ],
)
def test_degenerate_hulls(P, Q, distance):
    assert check(P, Q) == pytest.approx(distance, abs=1e-15 if distance > -0.2 else DIGITS)
    assert check(Q, P) == pytest.approx(distance, abs=1e-15 if distance > -0.2 else DIGITS)


def test_hulls_of_many_points():
    random = np.random.default_rng(4)
    ball = ConvexShape.mesh((lambda x: x / np.linalg.norm(x, axis=1, keepdims=True))(
        random.normal(size=(400, 3))
    ))  # fmt: skip
    assert check(ball.points, ball.points + 3.0 * X) == pytest.approx(1.0, abs=0.05)
    d = check(ball.points, ball.points + 1.5 * X)
    w = (ball.points[:, np.newaxis] - ball.points - 1.5 * X).reshape(-1, 3)
    hull = ConvexHull(w)
    assert d == pytest.approx(np.max(hull.equations[:, 3]), abs=DIGITS)


def test_shapes_keep_the_corners_of_a_hull_and_move():
    random = np.random.default_rng(5)
    mesh = ConvexShape.mesh(np.concatenate([CUBE, random.uniform(-0.4, 0.4, (50, 3))]), 0.1)
    assert np.array_equal(mesh.points, CUBE)
    pose = RigidTransform(RotationMatrix.MakeZRotation(0.3), [1.0, 2.0, 3.0])
    moved = mesh.moved(pose)
    middle, radius = moved.enclosing_ball()
    assert middle == pytest.approx([1.0, 2.0, 3.0])
    assert np.max(np.linalg.norm(moved.points - middle, axis=1)) + 0.1 <= radius + DIGITS
    points, starts, radii = packed([mesh, ConvexShape.sphere(X, 0.5)])
    assert points.shape == (9, 3)
    assert starts.tolist() == [0, 8, 9]
    assert radii.tolist() == [0.1, 0.5]
    assert [array.shape for array in packed([])] == [(0, 3), (1,), (0,)]


def test_what_is_no_shape_is_refused_by_name(tmp_path):
    with pytest.raises(CableGeometryError, match="plate: found 4 vertices in one plane"):
        ConvexShape.mesh(np.array([X, Y, -X, -Y]), name="plate")
    with pytest.raises(CableGeometryError, match="plate: found 3 vertices in one plane"):
        ConvexShape.mesh(np.array([X, Y, -X]), name="plate")
    with pytest.raises(CableGeometryError, match=r"ball: found radius -1; accepted: >= 0 \[m\]"):
        ConvexShape.sphere(X, -1.0, "ball")
    with pytest.raises(CableGeometryError, match=r"shape: found points of shape \(0, 3\)"):
        ConvexShape(np.zeros((0, 3)))
    with pytest.raises(CableGeometryError, match="not finite"):
        ConvexShape(np.array([[np.nan, 0.0, 0.0]]))
    with pytest.raises(CableGeometryError, match=r"box: found shape \(3,\); accepted: \(15,\)"):
        ConvexShape.box(X)
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 zero\n")
    with pytest.raises(CableGeometryError, match="line 2: found 'v 1 0 zero'"):
        mesh_vertices(path)
    path.write_text("f 1 2 3\n")
    with pytest.raises(CableGeometryError, match="found no vertices"):
        mesh_vertices(path)
    with pytest.raises(CableGeometryError, match="there is no such mesh"):
        mesh_vertices(tmp_path / "b.obj")
