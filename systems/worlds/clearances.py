"""How far platform and cables are from the bodies of a world.

The platform's distances are Drake's, of convex shapes from each other, negative where they overlap;
a mesh counts as its convex hull. That from the ground is the height of its lowest point. A cable is
a straight line with a radius: its distance from boxes is that of `workspaces`, from spheres and
cylinders that of the nearest point of the line; it is 0 less the radius where the cable passes
through. Cables touch nothing: they pass through obstacles, and this is what tells.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from pydrake.geometry import (
    Box,
    Cylinder,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import platform_box
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.worlds.world import World, WorldBody
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_distance
from cdpr_drake.workspaces.cable_interference import box_row

COMPARED = (Box, Sphere, Cylinder)
"""Shapes that cables are compared with."""

HALVINGS = 60
"""Thirds that are cut from a cable in search of its nearest point: 1e-10 of its length is left."""


class WorldClearances:
    """Distances of a robot's platform and cables from a world."""

    def __init__(self, robot: Robot, world: World, cables: CableSet) -> None:
        """For the cables as they are simulated."""
        self.world, self._cables = world, cables
        self._radius = 0.5 * float(np.max(robot.diameters()))
        X_PBox, box = platform_box(robot)
        half = 0.5 * box.size()
        self._corners = np.array([
            X_PBox.translation() + half * signs for signs in product((-1.0, 1.0), repeat=3)
        ]).T  # fmt: skip
        self._scene = SceneGraph()
        source = self._scene.RegisterSource("clearances")
        self._platform_frame, (self._platform,) = self._register(source, "P", [(box, X_PBox)])
        self._frames: list[FrameId] = []
        self._geometries: list[list[GeometryId]] = []
        for number, body in enumerate(self._obstacles()):
            parts = [(part.shape, part.X_BG) for part in body.solids()]
            frame, geometries = self._register(source, f"B{number}", parts)
            self._frames.append(frame)
            self._geometries.append(geometries)
        self._context = self._scene.CreateDefaultContext()
        self._poses = self._scene.get_source_pose_port(source)

    def _obstacles(self) -> tuple[WorldBody, ...]:
        return self.world.bodies[0 if self.world.ground is None else 1 :]

    def _register(
        self, source: object, name: str, parts: list[tuple[Shape, RigidTransform]]
    ) -> tuple[FrameId, list[GeometryId]]:
        frame = self._scene.RegisterFrame(source, GeometryFrame(name))
        geometries = []
        for number, (shape, X_FG) in enumerate(parts):
            instance = GeometryInstance(X_FG, shape, f"{name}_{number}")
            instance.set_proximity_properties(ProximityProperties())
            geometries.append(self._scene.RegisterGeometry(source, frame, instance))
        return frame, geometries

    def platform(self, X_WP: RigidTransform, time: float) -> Array:
        """Distances of the platform from the bodies at a pose and a time [s], shape (b,) [m]."""
        found = []
        if self.world.ground is not None:
            lowest = float(np.min((X_WP @ self._corners)[2]))
            found.append(lowest - self.world.ground)
        poses = FramePoseVector()
        poses.set_value(self._platform_frame, X_WP)
        for frame, body in zip(self._frames, self._obstacles(), strict=True):
            poses.set_value(frame, body.motion.at(time))
        self._poses.FixValue(self._context, poses)
        query = self._scene.get_query_output_port().Eval(self._context)
        for geometries in self._geometries:
            found.append(
                min(
                    (
                        query.ComputeSignedDistancePairClosestPoints(self._platform, other).distance
                        for other in geometries
                    ),
                    default=np.inf,
                )
            )
        return np.array(found)

    def cables(self, X_WP: RigidTransform, time: float) -> Array:
        """Least distances of any cable from the bodies, shape (b,) [m]; those from shapes that
        cables are not compared with, and where a cable cannot run, are NaN."""
        bodies = self.world.bodies
        out = np.full(len(bodies), np.nan)
        try:
            starts = cable_paths(X_WP, self._cables).p_WT.T
        except CableGeometryError:
            return out
        ends = np.ascontiguousarray((X_WP @ self._cables.p_PB).T)
        starts = np.ascontiguousarray(starts)
        first = 0
        if self.world.ground is not None:
            lowest = min(float(np.min(starts[:, 2])), float(np.min(ends[:, 2])))
            out[0], first = lowest - self.world.ground - self._radius, 1
        for k, body in enumerate(bodies[first:], start=first):
            if _is_compared(body):
                X_WB = body.motion.at(time)
                least = min(
                    _lines_distance(starts, ends, part.shape, X_WB @ part.X_BG)
                    for part in body.solids()
                )
                out[k] = least - self._radius
        return out


def _is_compared(body: WorldBody) -> bool:
    solids = body.solids()
    return bool(solids) and all(isinstance(part.shape, COMPARED) for part in solids)


def _lines_distance(starts: Array, ends: Array, shape: Shape, X_WG: RigidTransform) -> float:
    """Least distance of straight lines, shape (m, 3) each [m], from a solid shape at X_WG [m]."""
    if isinstance(shape, Box):
        row = box_row(X_WG.translation(), shape.size(), X_WG.rotation().matrix())
        return min(
            float(segment_box_distance(start, end, row))
            for start, end in zip(starts, ends, strict=True)
        )
    X_GW = X_WG.inverse()
    p, q = X_GW @ starts.T, X_GW @ ends.T
    if isinstance(shape, Sphere):
        d = q - p
        share = np.clip(-np.sum(p * d, axis=0) / np.maximum(np.sum(d * d, axis=0), 1e-300), 0, 1)
        gaps = np.linalg.norm(p + share * d, axis=0) - shape.radius()
        return max(float(np.min(gaps)), 0.0)
    return _lines_cylinder_distance(p, q, shape.radius(), 0.5 * shape.length())


def _lines_cylinder_distance(p: Array, q: Array, radius: float, half: float) -> float:
    """Least distance of lines p to q, shape (3, m) [m], from a solid cylinder about z.

    The distance from a convex solid is a convex function along a line, whose least value is closed
    in by thirds.
    """

    def gap(share: Array) -> Array:
        x, y, z = p + share * (q - p)
        over = np.maximum(np.hypot(x, y) - radius, 0.0)
        return np.hypot(over, np.maximum(np.abs(z) - half, 0.0))

    low, high = np.zeros(p.shape[1]), np.ones(p.shape[1])
    for _ in range(HALVINGS):
        third = (high - low) / 3.0
        left, right = low + third, high - third
        falls = gap(left) > gap(right)
        low, high = np.where(falls, left, low), np.where(falls, high, right)
    return float(np.min(gap(0.5 * (low + high))))
