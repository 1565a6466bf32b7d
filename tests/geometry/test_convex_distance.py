"""Signed distances of convex shapes against programs, Drake's queries and Qhull."""

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

from cdpr_drake.geometry.convex_distance_kernel import convex_distance, convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.workspaces.cable_distance_kernel import (
    boxes_distance,
    segment_box_distance,
    segments_distance,
)
from cdpr_drake.workspaces.cable_interference import box_row

DIGITS = 1e-11
"""Of distances of hulls of some metres, ten thousand times their rounding [m]: of hulls a
thousandth of their size apart the normal has three digits less."""

PROGRAM_DIGITS = 1e-6
"""Clarabel stops at a gap of 1e-8 of the squared distance, here of up to 30 m^2."""

TOUCHING_DIGITS = 1e-3
"""The same for distances near 0, whose square it knows to 1e-6 [m]."""

DRAKE_DIGITS = 1e-5
"""FCL, by which Drake finds distances of boxes from each other, stops at 1e-6 relative [m]."""


def check(P, Q):
    """All that the kernel promises of itself; returns the distance."""
    p, q, n = np.empty(3), np.empty(3), np.empty(3)
    d = convex_distance(P, Q, p, q, n, convex_work(len(P), len(Q)))
    along_P, along_Q = P @ n, Q @ n
    assert abs(np.linalg.norm(n) - 1.0) < DIGITS
    assert abs(np.min(along_P) - np.max(along_Q) - d) < DIGITS
    assert np.max(np.abs(p - q - d * n)) < DIGITS
    assert np.min(along_P) - DIGITS <= p @ n <= np.max(along_P) + DIGITS
    assert np.min(along_Q) - DIGITS <= q @ n <= np.max(along_Q) + DIGITS
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
    for P, Q in random_hulls(np.random.default_rng(0), 200):
        d, expected = check(P, Q), program_distance(P, Q)
        apart += d > 0.0
        assert abs(max(d, 0.0) - expected) < TOUCHING_DIGITS
        assert d < 0.01 or abs(d - expected) < PROGRAM_DIGITS
    assert 40 < apart < 160


def test_depths_are_those_of_the_hull_of_all_differences():
    deep = 0
    for P, Q in random_hulls(np.random.default_rng(1), 600):
        w = (P[:, np.newaxis] - Q).reshape(-1, 3)
        if np.linalg.matrix_rank(w - w[0], tol=1e-9) < 3:
            continue
        place = np.max(ConvexHull(w).equations[:, 3])  # of the origin, below 0 inside
        if place < 0.0:
            deep += 1
            assert abs(check(P, Q) - place) < DIGITS
    assert deep > 60


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
    random, overlapping = np.random.default_rng(2), 0
    shapes = [Box(0.4, 0.3, 0.2), Box(1.0, 0.1, 0.1), Sphere(0.2), Capsule(0.1, 0.5)]
    for number in range(150):
        a, b = (shapes[k] for k in random.integers(0, len(shapes), 2))
        turns = [RotationMatrix.MakeFromOneVector(random.normal(size=3), 2) for _ in range(2)]
        places = random.normal(size=(2, 3)) * (0.15 if number % 2 else 0.6)
        X, Y = (RigidTransform(R, place) for R, place in zip(turns, places, strict=True))
        d, p, q, n = ours(a).moved(X).distance(ours(b).moved(Y))
        overlapping += d < 0.0
        assert np.max(np.abs(p - q - d * n)) < DIGITS
        assert abs(d - drake_distance(a, b, X, Y)) < DRAKE_DIGITS
    assert overlapping > 25


def test_boxes_and_segments_are_as_far_apart_as_the_kernels_of_cables_say():
    random = np.random.default_rng(3)
    for _ in range(200):
        turns = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(2)]
        rows = [box_row(random.normal(size=3), random.uniform(0.0, 1.0, 3), turn) for turn in turns]
        P, Q = (ConvexShape.box(row).points for row in rows)
        cable = random.normal(size=(2, 3))
        expected = boxes_distance(*rows, np.empty((2, 3))), segment_box_distance(*cable, rows[1])
        assert abs(max(check(P, Q), 0.0) - expected[0]) < DIGITS
        assert abs(max(check(cable, Q), 0.0) - expected[1]) < DIGITS
    for _ in range(5000):  # their difference is flat: no corner may be taken for a fourth
        segments = random.normal(size=(4, 3))
        d = check(segments[:2], segments[2:])
        assert abs(d - segments_distance(*segments)) < DIGITS


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
    directions = random.normal(size=(400, 3))
    ball = ConvexShape.mesh(directions / np.linalg.norm(directions, axis=1, keepdims=True))
    assert check(ball.points, ball.points + 3.0 * X) == pytest.approx(1.0, abs=0.05)
    d = check(ball.points, ball.points + 1.5 * X)
    w = (ball.points[:, np.newaxis] - ball.points - 1.5 * X).reshape(-1, 3)
    assert d == pytest.approx(np.max(ConvexHull(w).equations[:, 3]), abs=DIGITS)


def test_shapes_keep_the_corners_of_a_hull_and_move():
    random = np.random.default_rng(5)
    mesh = ConvexShape.mesh(np.concatenate([CUBE, random.uniform(-0.4, 0.4, (50, 3))]), 0.1)
    assert np.array_equal(mesh.points, CUBE)
    pose = RigidTransform(RotationMatrix.MakeZRotation(0.3), [1.0, 2.0, 3.0])
    moved = mesh.moved(pose)
    assert moved.points == pytest.approx((pose @ CUBE.T).T)
    points, starts, radii = packed([mesh, ConvexShape.sphere(X, 0.5)])
    assert points.shape == (9, 3)
    assert starts.tolist() == [0, 8, 9]
    assert radii.tolist() == [0.1, 0.5]
    assert [array.shape for array in packed([])] == [(0, 3), (1,), (0,)]
