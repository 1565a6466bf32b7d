"""Clearances against Drake's geometry queries, another computation of the same distances.

Drake stops its iterations for capsules at points that are not always the nearest, so its distances
are too large at some poses, by up to half a millimetre. These are settled by a third computation:
the nearest points of two segments, or of a segment and a box, are a bounded least squares problem.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    GeometryId,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.workspace_question import interference_bodies
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.cable_interference import Surroundings, clearances

ROBOTS = ("acrobot_large", "caroca")
"""Whose poses are compared, as many of each."""

POSES, QUICK_POSES = 5000, 20
"""Poses of each robot."""

TURN = 0.3
"""Largest angle of the poses [rad]."""

SAME = 1e-6
"""Distances that differ by less are the same [m]; Drake's iterations stop there."""

SEED = 20
"""Of the poses."""


@dataclass(frozen=True)
class DistanceTask:
    """Sweep task: at which random poses do clearances differ from the distances of others?

    Attributes:
        robot: Name of the robot.
    """

    robot: str

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Arrays of the poses start to stop, shape (n,): which are `wrong`, which were `settled` by
        least squares, and the largest `differences` from who decided [m]."""
        robot = load_robot(self.robot)
        around = interference_bodies(robot, pulleys=False)
        around = replace(around, radius=np.maximum(around.radius, 1e-4))  # a capsule has one
        positions, rotations = np.empty((stop - start, 3)), np.empty((stop - start, 3, 3))
        for k in range(stop - start):
            random = np.random.default_rng([SEED, start + k])
            positions[k] = random.uniform(robot.frame.lower, robot.frame.upper)
            rotations[k] = rotation_from_angles(random.uniform(-TURN, TURN, 3)).matrix()
        ours = clearances(around, positions, rotations)[:, :3]
        theirs = np.array(
            [drake_clearances(around, p, R) for p, R in zip(positions, rotations, strict=True)]
        )
        apart = theirs > 0.0  # below, Drake has a depth
        settled = np.any(apart & (np.abs(ours - theirs) > SAME), axis=1)
        for k in np.flatnonzero(settled).tolist():
            theirs[k] = least_squares_clearances(around, positions[k], rotations[k])
        differences = np.where(apart, np.abs(ours - theirs), 0.0)
        wrong = np.where(apart, differences > SAME, ours > SAME)
        return {
            "wrong": wrong.any(axis=1),
            "settled": settled,
            "differences": differences.max(axis=1),
        }


def least_squares_clearances(around: Surroundings, position: Array, rotation: Array) -> Array:
    """As `drake_clearances`, where nothing overlaps, by bounded least squares (SciPy's BVLS)."""
    from scipy.optimize import lsq_linear

    anchors = position[:, np.newaxis] + rotation @ around.cables.p_PB
    starts, ends = around.cables.p_WA.T, anchors.T
    units = ends - starts
    lengths = np.linalg.norm(units, axis=1)
    units /= lengths[:, np.newaxis]
    radii = around.radius

    def between(p: Array, q: Array, origin: Array, edges: Array, box: Array) -> float:
        """Distance of a segment from the points origin + edges s, |s| <= box."""
        A, bounds = np.column_stack([q - p, -edges]), (np.append(0.0, -box), np.append(1.0, box))
        found = lsq_linear(A, origin - p, bounds, method="bvls", tol=1e-15)
        return float(np.linalg.norm(found.fun))

    def to_box(p: Array, q: Array, row: Array, R: Array, origin: Array) -> float:
        edges = R @ row[:9].reshape(3, 3)
        return between(p, q, origin + R @ row[9:12], edges, row[12:])

    cables = [
        between(
            starts[i], ends[i], 0.5 * (starts[j] + ends[j]),
            0.5 * (ends[j] - starts[j])[:, np.newaxis], np.ones(1),
        ) - radii[i] - radii[j]
        for i, j in around.pairs().tolist()
    ]  # fmt: skip
    short = ends - around.anchor_free * units
    platform = [
        to_box(starts[i], short[i], row, rotation, position) - radii[i]
        for i in np.flatnonzero(lengths > around.anchor_free).tolist()
        for row in around.bodies
    ]
    late = starts + around.exit_free * units
    frame = [
        to_box(late[i], ends[i], row, np.eye(3), np.zeros(3)) - radii[i]
        for i in np.flatnonzero(lengths > around.exit_free).tolist()
        for row in around.fixtures
    ]
    return np.array([min(found, default=np.inf) for found in (cables, platform, frame)])


def drake_clearances(around: Surroundings, position: Array, rotation: Array) -> Array:
    """Cable-cable, cable-platform and cable-frame clearances by Drake, shape (3,) [m].

    Args:
        around: What there is; cables without pulleys.
        position: p_WP, shape (3,) [m].
        rotation: R_WP, shape (3, 3).
    """
    graph = SceneGraph()
    source = graph.RegisterSource("all")

    def add(shape: Shape, X: RigidTransform) -> GeometryId:
        instance = GeometryInstance(X, shape, f"g{graph.model_inspector().num_geometries()}")
        instance.set_proximity_properties(ProximityProperties())
        return graph.RegisterAnchoredGeometry(source, instance)

    def capsule(p: Array, q: Array, radius: float) -> GeometryId:
        turn = RotationMatrix.MakeFromOneVector(q - p, 2)
        shape = Capsule(radius, float(np.linalg.norm(q - p)))
        return add(shape, RigidTransform(turn, 0.5 * (p + q)))

    def box(row: Array, X: RigidTransform) -> GeometryId:
        pose = RigidTransform(RotationMatrix(row[:9].reshape(3, 3)), row[9:12])
        return add(Box(*(2.0 * row[12:])), X @ pose)

    X_WP = RigidTransform(RotationMatrix(rotation), position)
    bodies = [box(row, X_WP) for row in around.bodies]
    beams = [box(row, RigidTransform()) for row in around.fixtures]
    cables, to_platform, to_frame = [], [], []
    anchors = position[:, np.newaxis] + rotation @ around.cables.p_PB
    for A, B, radius in zip(around.cables.p_WA.T, anchors.T, around.radius, strict=True):
        length = float(np.linalg.norm(B - A))
        u = (B - A) / length
        cables.append(capsule(A, B, radius))
        if length > around.anchor_free:  # else nothing of it is compared
            to_platform.append(capsule(A, B - around.anchor_free * u, radius))
        if length > around.exit_free:
            to_frame.append(capsule(A + around.exit_free * u, B, radius))
    query = graph.get_query_output_port().Eval(graph.CreateDefaultContext())

    def least(pairs: list[tuple[GeometryId, GeometryId]]) -> float:
        found = [query.ComputeSignedDistancePairClosestPoints(*pair).distance for pair in pairs]
        return float(min(found, default=np.inf))

    return np.array(
        [
            least([(cables[i], cables[j]) for i, j in around.pairs().tolist()]),
            least([(one, body) for one in to_platform for body in bodies]),
            least([(one, beam) for one in to_frame for beam in beams]),
        ]
    )
