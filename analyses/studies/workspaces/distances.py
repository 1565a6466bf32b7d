"""Clearances against Drake's geometry queries, another computation of the same distances."""

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

from cdpr_drake.analyses.workspaces import surroundings
from cdpr_drake.arrays import Array
from cdpr_drake.models import load_robot
from cdpr_drake.spatial import rotation_from_angles
from cdpr_drake.workspaces import Surroundings, clearances

ROBOTS = ("acrobot_large", "caroca")
"""Whose poses are compared, as many of each."""

POSES, QUICK_POSES = 5000, 20
"""Poses of each robot."""

TURN = 0.3
"""Largest angle of the poses [rad]."""

BELOW, ABOVE = 5e-4, 1e-6
"""Drake's distances of capsules are those of points that its iterations stop at: too large by up to
the first, too small by up to the second [m]."""

SEED = 20
"""Of the poses."""


@dataclass(frozen=True)
class DistanceTask:
    """Sweep task: at which random poses do clearances differ from Drake's distances?

    Attributes:
        robot: Name of the robot.
    """

    robot: str

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `wrong` of the poses start to stop, shape (n,), and `differences` [m]."""
        robot = load_robot(self.robot)
        around = surroundings(robot)
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
        same = (theirs - BELOW < ours) & (ours < theirs + ABOVE)
        wrong = np.where(apart, ~same, ours > ABOVE)
        differences = np.where(apart, np.abs(ours - theirs), 0.0)
        return {"wrong": wrong.any(axis=1), "differences": differences.max(axis=1)}


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
        u = (B - A) / np.linalg.norm(B - A)
        cables.append(capsule(A, B, radius))
        to_platform.append(capsule(A, B - around.anchor_free * u, radius))
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
