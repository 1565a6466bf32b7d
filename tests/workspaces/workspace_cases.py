"""Robots, poses, boxes of poses and what is true at a pose, for all tests of workspaces."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from scipy.optimize import linprog

from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.proofs.box_judges import CertifiedKind
from cdpr_drake.proofs.certified_boxes import PoseBox
from cdpr_drake.workspaces.cable_interference import clearances
from cdpr_drake.workspaces.demanded_wrenches import resisting, weight_wrenches
from cdpr_drake.workspaces.single_failure import survives_breaks
from cdpr_drake.workspaces.static_feasibility import (
    StaticCase,
    statically_feasible,
    wrench_matrices,
)
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, closure_margins

# Robots and poses.


@cache
def robot_case(name, limits=None):
    """A robot and its static case; nobody changes either."""
    robot = load_robot(name)
    return robot, static_case(robot, limits)


def rotations_of(angles):
    return np.array([rotation_from_angles(a).matrix() for a in angles])


def upright(count):
    return np.tile(np.eye(3), (count, 1, 1))


def random_poses(robot, count, seed=0, turn=0.3):
    """Positions in the frame and turns, in the plane where the robot has one."""
    random = np.random.default_rng(seed)
    positions = random.uniform(robot.frame.lower, robot.frame.upper, (count, 3))
    angles = random.uniform(-turn, turn, (count, 3))
    if robot.is_planar():
        positions[:, 2] = robot.plane_height
        angles[:, :2] = 0.0
    return positions, rotations_of(angles)


def random_rotation(random):
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q if np.linalg.det(q) > 0 else q[:, [1, 0, 2]]


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=0)


def pulleys_at(cables, ends, random, radius=(0.02, 0.01)):
    """The same cables over pulleys at the frame, the platform, or both; axes across the cables."""
    m = cables.count
    along = unit(np.array([[0.0], [0.0], [0.3]]) + cables.p_PB - cables.p_WA)
    r, s = (random.uniform(0.3, 1.0, m) * size for size in radius)
    axes = []
    for sign in (1.0, -1.0):
        across = random.normal(size=(3, m))
        across = unit(across - along * np.sum(across * along, axis=0))
        axes.append(unit(across + sign * random.uniform(-0.6, 0.6, m) * along))
    radii = r if "A" in ends else np.zeros(m), s if "B" in ends else np.zeros(m)
    over = replace(cables, pulley_radius=radii[0], swivel_axis=axes[0])
    return over.over_platform_pulleys(radii[1], axes[1])


def pentagon():
    """A point on five cables from the corners of a regular pentagon of radius 1 m, no weight."""
    turns = np.pi / 2.0 + 2.0 * np.pi * np.arange(5) / 5.0
    corners = np.array([np.cos(turns), np.sin(turns), np.zeros(5)])
    cables = CableSet.make(corners, np.zeros((3, 5)), 1e4)
    return StaticCase(
        cables, np.full(5, 1e-3), np.full(5, 1e3), 0.0, np.zeros(3), wrench=np.zeros(6), rows=(3, 4)
    )


# Wrenches by linear programs.


def solvable(W, wrench, lower, upper):
    """True if HiGHS finds tensions for a wrench of the cables."""
    bounds = np.c_[lower, upper]
    program = linprog(np.zeros(W.shape[1]), A_eq=W, b_eq=wrench, bounds=bounds, method="highs")
    return program.status == 0


def loaded(case, positions, rotations):
    """Wrench matrices, and weights with the case's own wrench, in the rows of a case."""
    rows = list(case.rows)
    matrices = wrench_matrices(positions, rotations, case.cables)
    return matrices[:, rows], weight_wrenches(case, rotations)[:, rows]


def held_by_highs(case, positions, rotations, broken=None):
    """Per pose: True if tensions balance the load; a broken cable pulls nothing.

    Where a cable does not run to its pulley, nothing is held.
    """
    lower, upper = case.bounds()
    if broken is not None:
        lower[broken] = upper[broken] = 0.0
    numbers = zip(*loaded(case, positions, rotations), strict=True)
    return np.array([
        np.all(np.isfinite(W)) and solvable(W, -load, lower, upper) for W, load in numbers
    ])  # fmt: skip


# Boxes.


def box_about(middle, half):
    middle, half = np.asarray(middle, float), np.asarray(half, float)
    return PoseBox(middle - half, middle + half)


def frame_box(robot, turn=0.0):
    """The whole frame, turned by so much about all axes (of a planar robot: about z) [rad]."""
    lower, upper = robot.frame.lower.copy(), robot.frame.upper.copy()
    angles = np.zeros(3) + turn
    if robot.is_planar():
        lower[2] = upper[2] = robot.plane_height
        angles[:2] = 0.0
    return PoseBox(np.concatenate([lower, -angles]), np.concatenate([upper, angles]))


def drawn(boxes, count, seed=0):
    """Poses in the boxes, a half of them in corners, and their boxes' verdicts."""
    random = np.random.default_rng(seed)
    which = random.integers(0, len(boxes.poses), count)
    share = random.uniform(-1, 1, (count, 6))
    share[::2] = np.sign(share[::2])
    poses = boxes.poses[which] + share * boxes.halves[which] * (1.0 - 1e-9)
    return poses[:, :3], rotations_of(poses[:, 3:]), boxes.verdicts[which]


def holds(task, p, R):
    """What a task asks, by the functions of single poses."""
    case, required = task.case, task.required
    if task.kind == CertifiedKind.STATIC:
        return statically_feasible(case, p, R)
    if task.kind == CertifiedKind.WRENCH_FEASIBLE:
        return capacity_margins(case, p, R, resisting(case, required, R)).feasible
    if task.kind == CertifiedKind.WRENCH_CLOSURE:
        return closure_margins(case, p, R) > 0.0
    if task.kind == CertifiedKind.SINGLE_FAILURE:
        return survives_breaks(case, p, R, required)
    gaps = clearances(task.around, p, R)
    if task.kind == CertifiedKind.COLLISION_FREE:
        return gaps[:, 4] > task.clearance
    return gaps[:, :4].min(axis=1) > task.clearance


def volumes(boxes, verdict):
    """Volume of the boxes of a verdict, over the axes that vary."""
    volumes = np.prod(np.where(boxes.halves > 0.0, 2.0 * boxes.halves, 1.0), axis=1)
    return volumes[boxes.verdicts == verdict].sum() / volumes.sum()


def check(boxes, tasks, count=3000, seed=0):
    """Fails if a proven box breaks its promise, or shares are wrong; counts of poses proven."""
    positions, rotations, verdicts = drawn(boxes, count, seed)
    truth = np.all([holds(task, positions, rotations) for task in tasks], axis=0)
    assert not np.any(truth[verdicts == OUTSIDE])
    assert np.all(truth[verdicts == INSIDE])
    shares = [volumes(boxes, verdict) for verdict in (INSIDE, OUTSIDE, OPEN)]
    assert [boxes.inside, boxes.outside, boxes.open] == pytest.approx(shares)
    assert boxes.curve[-1, 1:] == pytest.approx(shares)
    return np.sum(verdicts == INSIDE), np.sum(verdicts == OUTSIDE)


# Distances by Drake.


def instance(shape, X, name):
    geometry = GeometryInstance(X, shape, name)
    geometry.set_proximity_properties(ProximityProperties())
    return geometry


def capsule(p, q, radius, name="capsule"):
    R = RotationMatrix.MakeFromOneVector(q - p, 2)
    shape = Capsule(float(radius), float(np.linalg.norm(q - p)))
    return instance(shape, RigidTransform(R, 0.5 * (p + q)), name)


def box(row, name="box"):
    """Of a row of `box_row`."""
    X = RigidTransform(RotationMatrix(row[:9].reshape(3, 3)), row[9:12])
    return instance(Box(2.0 * row[12:]), X, name)


def solid(shape, name):
    """Of a `ConvexShape`: a sphere, a capsule, or the hull of points without a radius."""
    if len(shape.points) == 1:
        return instance(Sphere(shape.radius), RigidTransform(shape.points[0]), name)
    if len(shape.points) == 2:
        return capsule(*shape.points, shape.radius, name)
    assert shape.radius == 0.0
    return instance(Convex(shape.points.T, name), RigidTransform(), name)


class DrakeScene:
    """Shapes that move as one body, and shapes that stand."""

    def __init__(self, moving, standing):
        self.scene = SceneGraph()
        self.source = self.scene.RegisterSource("tests")
        self.frame = self.scene.RegisterFrame(self.source, GeometryFrame("moving"))
        self.moving = [
            self.scene.RegisterGeometry(self.source, self.frame, one) for one in moving
        ]  # fmt: skip
        self.standing = [self.scene.RegisterAnchoredGeometry(self.source, one) for one in standing]
        self.context = self.scene.CreateDefaultContext()

    def distances(self, X):
        """Signed distances where the body is, per moving and standing shape."""
        poses = FramePoseVector()
        poses.set_value(self.frame, X)
        self.scene.get_source_pose_port(self.source).FixValue(self.context, poses)
        query = self.scene.get_query_output_port().Eval(self.context)
        distance = query.ComputeSignedDistancePairClosestPoints
        return np.array([[distance(a, b).distance for b in self.standing] for a in self.moving])
