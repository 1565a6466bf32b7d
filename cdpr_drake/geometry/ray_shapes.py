"""Shapes on which rays end, the beams of range sensors, and what a sensor makes of distances.

`RayScene` holds `RayShape`s as `ray_casting_kernel` takes them. Beams stand in the sensor's frame
S; `reported_ranges` serves range sensors and the pixels of depth cameras.

Source: Ericson, Real-Time Collision Detection, 2005; ROS's LaserScan and REP 117.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.ray_casting_kernel import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    HALF_SPACE,
    MESH,
    SPHERE,
    cast_rays,
)
from cdpr_drake.geometry.triangle_meshes import BLOCK_SIZE, triangle_blocks


@dataclass(frozen=True)
class RayShape:
    """One shape in its own frame G; the functions of this module make them.

    Attributes:
        kind: A kind of `ray_casting_kernel`, as `BOX`.
        size: As `ray_casting_kernel.cast_rays` explains, shape (3,) [m].
        reach: Radius round Go that holds all of it [m].
        triangles: Corners of a mesh, shape (n, 3, 3) [m]; None for others.
    """

    kind: int
    size: Array
    reach: float
    triangles: Array | None = None


def box(edges: Array) -> RayShape:
    """A box with its middle at Go, edges along the axes of G, shape (3,) [m]."""
    return RayShape(BOX, np.array(edges, float), 0.5 * float(np.linalg.norm(edges)))


def sphere(radius: float) -> RayShape:
    """A sphere about Go, radius [m]."""
    return RayShape(SPHERE, np.array([radius, 0.0, 0.0]), radius)


def cylinder(radius: float, length: float) -> RayShape:
    """A cylinder along z of G with its middle at Go [m]."""
    return RayShape(CYLINDER, np.array([radius, length, 0.0]), float(np.hypot(radius, length / 2)))


def capsule(radius: float, length: float) -> RayShape:
    """A capsule along z of G with its middle at Go; `length` is that of its straight part [m]."""
    return RayShape(CAPSULE, np.array([radius, length, 0.0]), radius + length / 2)


def ellipsoid(half_axes: Array) -> RayShape:
    """An ellipsoid about Go, half axes along x, y, z of G, shape (3,) [m]."""
    return RayShape(ELLIPSOID, np.array(half_axes, float), float(np.max(half_axes)))


def half_space() -> RayShape:
    """All that is below z = 0 of G."""
    return RayShape(HALF_SPACE, np.zeros(3), np.inf)


def mesh(triangles: Array) -> RayShape:
    """Triangles in G, corner by corner, shape (n, 3, 3) [m]; they need enclose nothing."""
    reach = float(np.max(np.linalg.norm(triangles.reshape(-1, 3), axis=1), initial=0.0))
    return RayShape(MESH, np.zeros(3), reach * (1.0 + 1e-9), np.asarray(triangles, float))


class RayScene:
    """Shapes at poses that may change, and the rays that end on them."""

    def __init__(self, shapes: Sequence[RayShape]) -> None:
        """With shapes; all at the world's origin at first."""
        self._kinds = np.array([shape.kind for shape in shapes], np.int64)
        self._sizes = np.array([shape.size for shape in shapes]).reshape(-1, 3)
        self._reach = np.array([shape.reach for shape in shapes], float)
        self._poses = np.tile(np.append(np.eye(3).ravel(), np.zeros(3)), (len(shapes), 1))
        boxes, rows, first = [np.empty((0, 6))], [np.empty((0, 9))], [0]
        for shape in shapes:
            count = 0
            if shape.triangles is not None:
                mine, packed = triangle_blocks(shape.triangles)
                boxes.append(mine)
                rows.append(packed)
                count = len(mine)
            first.append(first[-1] + count)
        self._blocks = np.array(first, np.int64)
        self._boxes, self._triangles = np.concatenate(boxes), np.concatenate(rows)

    def place(self, number: int, X_WG: RigidTransform) -> None:
        """Puts a shape, by its place in the list, at a pose [m]."""
        self._poses[number, :9] = X_WG.rotation().matrix().ravel()
        self._poses[number, 9:] = X_WG.translation()

    def cast(self, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Distances to the first surfaces on rays.

        Args:
            origins: In W, shape (k, 3), or one for all rays, shape (3,) [m].
            directions: Unit vectors in W, shape (k, 3).

        Returns:
            Distances, infinite where a ray meets nothing, shape (k,) [m], and numbers of the
            shapes, -1 there, shape (k,).
        """
        directions = np.ascontiguousarray(directions, dtype=float)
        count = len(directions)
        starts = np.empty((count, 3))
        starts[:] = origins
        ranges = np.empty(count)
        hits: Any = np.empty(count, np.int64)
        cast_rays(
            starts, directions, self._kinds, self._sizes, self._poses, self._reach,
            self._blocks, self._boxes, self._triangles, BLOCK_SIZE, ranges, hits,
        )  # fmt: skip
        return ranges, hits


def fan_angles(first: float, last: float, count: int) -> Array:
    """Angles of the beams of a laser scanner, evenly from the first to the last, shape (k,) [rad].

    One beam looks between the two.
    """
    if count == 1:
        return np.array([0.5 * (first + last)])
    return np.linspace(first, last, count)


def fan_directions(angles: Array) -> Array:
    """Directions of beams in the plane z = 0 of the sensor's frame S, shape (k, 3).

    The angle is from x, the front, towards y, the left, as ROS's message LaserScan has it.
    """
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])


def reported_ranges(ranges: Array, noise: Array, limits: tuple[float, float], step: float) -> Array:
    """What a range sensor says of distances, shape (k,) [m].

    Beyond the largest range, and where there is nothing: inf; below the smallest: -inf, as ROS's
    REP 117 has it. Noise counts before the limits are looked at.

    Args:
        ranges: True distances, inf for nothing, shape (k,) [m].
        noise: What is read beyond them, shape (k,) [m].
        limits: Smallest and largest range [m].
        step: Step between readings [m]; 0: none.
    """
    read = ranges + noise
    if step > 0.0:
        read = step * np.round(read / step)
    low, high = limits
    return np.where(read > high, np.inf, np.where(read < low, -np.inf, read))
