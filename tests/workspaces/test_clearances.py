"""Distances against Drake's geometry queries, a fine sampling and closed forms."""

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder
from scipy.spatial import KDTree

from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.cable_distance_kernel import (
    boxes_distance,
    segment_box_distance,
    segments_distance,
)
from cdpr_drake.workspaces.cable_interference import Surroundings, beams, box_row, clearances
from tests.workspaces.workspace_cases import random_poses

ROUNDING = 1e-12

DRAKE = 1e-6
"""Drake's distance queries of boxes (FCL's iterations) are good to this [m]."""

CAPSULE = 1e-4
"""Those of capsules are too large by up to this [m]: they are distances of points that FCL stops
at."""

THIN = 1e-3
"""Radius of Drake's capsules [m], which may not be 0."""


def random_rotation(random):
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q if np.linalg.det(q) > 0 else q[:, [1, 0, 2]]


class DrakePair:
    """Two shapes that float, and Drake's distance between them."""

    def __init__(self, one, other):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
        for name, shape in (("one", one), ("other", other)):
            body = self.plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
            friction = CoulombFriction(0.5, 0.5)
            self.plant.RegisterCollisionGeometry(body, RigidTransform(), shape, name, friction)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()

    def distance(self, X_one, X_other):
        context = self.plant.GetMyMutableContextFromRoot(self.context)
        for name, X in (("one", X_one), ("other", X_other)):
            self.plant.SetFreeBodyPose(context, self.plant.GetBodyByName(name), X)
        query = self.plant.get_geometry_query_input_port().Eval(context)
        (pair,) = query.ComputeSignedDistancePairwiseClosestPoints()
        return pair.distance


def along(p, q):
    """Pose of a capsule whose axis is the segment p to q."""
    z = (q - p) / np.linalg.norm(q - p)
    return RigidTransform(RotationMatrix.MakeFromOneVector(z, 2), 0.5 * (p + q))


def test_segments_against_drake():
    random = np.random.default_rng(0)
    lengths = (1.3, 0.8)
    pair = DrakePair(*[Capsule(THIN, length) for length in lengths])
    for _ in range(200):
        p, r = random.uniform(-1, 1, (2, 3))
        d = random.normal(size=(2, 3))
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        q, s = p + lengths[0] * d[0], r + lengths[1] * d[1]
        theirs = pair.distance(along(p, q), along(r, s)) + 2 * THIN
        ours = segments_distance(p, q, r, s)
        if theirs > 2 * THIN:  # below it the capsules overlap, and FCL gives a depth
            assert theirs - CAPSULE < ours < theirs + DRAKE


def test_segments_and_boxes_against_drake():
    random = np.random.default_rng(1)
    size = np.array([0.5, 0.3, 0.8])
    pair = DrakePair(Capsule(THIN, 1.1), Box(*size))
    seen = 0
    for _ in range(200):
        p = random.uniform(-1, 1, 3)
        d = random.normal(size=3)
        q = p + 1.1 * d / np.linalg.norm(d)
        R, middle = random_rotation(random), random.uniform(-0.5, 0.5, 3)
        theirs = pair.distance(along(p, q), RigidTransform(RotationMatrix(R), middle)) + THIN
        ours = segment_box_distance(p, q, box_row(middle, size, R))
        if theirs > THIN:
            assert theirs - CAPSULE < ours < theirs + DRAKE
            seen += 1
        else:
            assert ours <= THIN + DRAKE
    assert 50 < seen < 200


def test_boxes_against_drake():
    random = np.random.default_rng(2)
    sizes = np.array([0.5, 0.3, 0.8]), np.array([0.2, 0.9, 0.4])
    pair, ends = DrakePair(*[Box(*size) for size in sizes]), np.empty((2, 3))
    seen = 0
    for _ in range(200):
        placed = [(random_rotation(random), random.uniform(-0.5, 0.5, 3)) for _ in sizes]
        theirs = pair.distance(*[RigidTransform(RotationMatrix(R), p) for R, p in placed])
        rows = [box_row(p, size, R) for (R, p), size in zip(placed, sizes, strict=True)]
        ours = boxes_distance(*rows, ends)
        if theirs > 0.0:
            assert ours == pytest.approx(theirs, abs=DRAKE)
            seen += 1
        else:
            assert ours == 0.0
    assert 30 < seen < 200


@pytest.mark.parametrize(
    ("segments", "distance"),
    [
        ([[0, 0, 0], [1, 0, 0], [0.5, 1, 1], [0.5, -1, 1]], 1.0),  # crossing
        ([[0, 0, 0], [1, 0, 0], [0, 0, 2], [1, 0, 2]], 2.0),  # parallel
        ([[0, 0, 0], [1, 0, 0], [3, 0, 0], [2, 0, 0]], 1.0),  # in one line
        ([[0, 0, 0], [0, 0, 0], [3, 4, 0], [3, 4, 0]], 5.0),  # points
        ([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 0, 0]], 0.0),
    ],
)
def test_segments_of_every_kind(segments, distance):
    p, q, r, s = np.array(segments, float)
    assert segments_distance(p, q, r, s) == pytest.approx(distance, abs=ROUNDING)
    assert segments_distance(s, r, q, p) == pytest.approx(distance, abs=ROUNDING)


@pytest.mark.parametrize(
    ("ends", "distance"),
    [
        ([[2, 0, 0], [3, 0, 0]], 1.0),
        ([[-5, 2, 0], [5, 2, 0]], 1.0),  # along a face
        ([[-5, 0.5, 0], [5, 0.5, 0]], 0.0),  # through
        ([[0.1, 0, 0], [0.2, 0, 0]], 0.0),  # within
        ([[2, 2, -5], [2, 2, 5]], np.sqrt(2)),  # past an edge
        ([[3, 0, 0], [0, 3, 0]], np.sqrt(0.5)),  # past an edge, slanting
        ([[2, 2, 2], [2, 2, 2]], np.sqrt(3)),
    ],
)
def test_segments_and_a_box_of_every_kind(ends, distance):
    box = box_row(np.zeros(3), np.full(3, 2.0))
    p, q = np.array(ends, float)
    assert segment_box_distance(p, q, box) == pytest.approx(distance, abs=ROUNDING)
    assert segment_box_distance(q, p, box) == pytest.approx(distance, abs=ROUNDING)


def acrobot(pulleys=False):
    robot = load_robot("acrobot_large")
    cables = robot.cable_set(pulleys)
    size = robot.platform.size
    return robot, Surroundings(
        cables, np.full(8, 0.001), box_row([0, 0, size[2] / 2], size)[None],
        beams(robot.frame.lower, robot.frame.upper, robot.frame.beam),
        box_row([0.2, 0.1, 0.5], [0.1, 0.1, 0.1])[None], exit_free=0.02, anchor_free=0.05,
    )  # fmt: skip


@pytest.mark.parametrize("pulleys", [False, True])
def test_clearances_are_the_least_of_their_parts(pulleys):
    """Against points along the cables, which are never nearer than the truth."""
    robot, around = acrobot(pulleys)
    positions, rotations = random_poses(robot, 12, seed=1, turn=0.2)
    found = clearances(around, positions, rotations)
    shares = np.linspace(0, 1, 801)
    fine = 1.3 / 800  # between neighbours
    for k in range(12):
        X_WP = RigidTransform(RotationMatrix(rotations[k]), positions[k])
        paths = cable_paths(X_WP, around.cables)
        B = (positions[k][:, None] + rotations[k] @ around.cables.p_PB).T
        A = B - (paths.u_W * paths.free).T if pulleys else around.cables.p_WA.T
        points = A[:, None] + shares[:, None] * (B - A)[:, None]  # (8, n, 3)
        near = [KDTree(points[i]).query(points[j])[0].min() for i in range(8) for j in range(i)]
        assert found[k, 0] <= min(near) - 0.002 + ROUNDING
        assert found[k, 0] >= min(near) - 0.002 - fine
        body = np.abs((points - positions[k]) @ rotations[k] - [0, 0, 0.035])
        gap = np.linalg.norm(np.maximum(body - robot.platform.size / 2, 0.0), axis=2)
        gap[np.linalg.norm(points - B[:, None], axis=2) < 0.05] = np.inf
        assert abs(found[k, 1] - (gap.min() - 0.001)) < fine
        gap = np.full(points.shape[:2], np.inf)
        for row in around.fixtures:
            to = np.linalg.norm(np.maximum(np.abs(points - row[9:12]) - row[12:], 0.0), axis=2)
            gap = np.minimum(gap, to)
        gap[np.linalg.norm(points - A[:, None], axis=2) < 0.02] = np.inf
        assert abs(found[k, 2] - (gap.min() - 0.001)) < fine


def test_cables_that_share_a_point_are_not_compared():
    _, around = acrobot()
    assert len(around.pairs()) == 28
    p_WA = around.cables.p_WA.copy()
    p_WA[:, 1] = p_WA[:, 0]
    joined = type(around.cables).make(p_WA, around.cables.p_PB, 1.0)
    assert len(Surroundings(joined, np.zeros(8)).pairs()) == 27


def test_nothing_to_meet_is_infinitely_far():
    robot, around = acrobot()
    alone = Surroundings(around.cables, around.radius)
    found = clearances(alone, *random_poses(robot, 3))
    assert np.all(np.isfinite(found[:, 0]))
    assert np.all(np.isinf(found[:, 1:]))


def test_a_platform_in_the_frame_has_no_clearance():
    robot, around = acrobot()
    found = clearances(around, [[0.0, 0.0, 0.6], robot.frame.upper], np.tile(np.eye(3), (2, 1, 1)))
    assert found[0, 4] > 0.0
    assert found[1, 4] == 0.0


def test_refuses():
    _, around = acrobot()
    with pytest.raises(WorkspaceError, match="exit_free"):
        Surroundings(around.cables, around.radius, exit_free=-1.0)
    with pytest.raises(WorkspaceError, match="box"):
        box_row(np.zeros(3), [1.0, -1.0, 1.0])
