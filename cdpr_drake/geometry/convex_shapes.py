"""Convex shapes: hulls of points, widened by a radius: balls, capsules, boxes, convex meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.convex_distance_kernel import convex_distance, convex_work

MOST_POINTS = 2000
"""Corners of a hull, at most."""

THINNEST = 1e-9
"""Least thickness of a mesh, as a share of its size: below, Qhull's facets mean nothing."""


@dataclass(frozen=True, eq=False)
class ConvexShape:
    """The convex hull of points, and all that is within a radius of it.

    Attributes:
        points: Shape (k, 3) [m], k > 0, in a frame that whoever has the shape says.
        radius: At least 0 [m].
        name: How messages call it.

    Raises:
        CableGeometryError: It is not accepted; names it.
    """

    points: Array
    radius: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        """Copies the points and checks them."""
        points = np.array(self.points, float, order="C")
        about = self.name or "shape"
        if points.ndim != 2 or points.shape[1:] != (3,) or len(points) == 0:
            raise CableGeometryError(
                f"{about}: found points of shape {points.shape}; accepted: (k, 3), k > 0 [m]"
            )
        if len(points) > MOST_POINTS:
            raise CableGeometryError(
                f"{about}: found {len(points)} points; accepted: up to {MOST_POINTS}"
            )
        if not np.all(np.isfinite(points)):
            raise CableGeometryError(f"{about}: found a point that is not finite; accepted: [m]")
        if not (np.isfinite(self.radius) and self.radius >= 0.0):
            raise CableGeometryError(f"{about}: found radius {self.radius:g}; accepted: >= 0 [m]")
        object.__setattr__(self, "points", points)

    @staticmethod
    def box(row: Array, name: str = "") -> ConvexShape:
        """A box from 15 numbers: rotation row by row (9), middle (3), half edges (3) [m].

        These are the rows of `workspaces.cable_interference.box_row`.
        """
        row = np.asarray(row, float)
        if row.shape != (15,):
            raise CableGeometryError(
                f"{name or 'box'}: found shape {row.shape}; accepted: (15,), rotation, middle and "
                "half edges [m]"
            )
        signs = np.array(list(product((-1.0, 1.0), repeat=3)))
        return ConvexShape(row[9:12] + (signs * row[12:]) @ row[:9].reshape(3, 3).T, name=name)

    @staticmethod
    def box_at(
        middle: Array, size: Array, rotation: Array | None = None, name: str = ""
    ) -> ConvexShape:
        """A box with a middle, edges, shape (3,) each [m], and axes as columns, shape (3, 3)."""
        R = np.eye(3) if rotation is None else np.asarray(rotation, float)
        half = 0.5 * np.asarray(size, float)
        return ConvexShape.box(
            np.concatenate([R.reshape(9), np.asarray(middle, float), half]), name
        )

    @staticmethod
    def sphere(middle: Array, radius: float, name: str = "") -> ConvexShape:
        """A ball about a point, shape (3,) [m]."""
        return ConvexShape(np.asarray(middle, float).reshape(1, -1), radius, name)

    @staticmethod
    def capsule(start: Array, end: Array, radius: float, name: str = "") -> ConvexShape:
        """What is within a radius of a segment; its ends have shape (3,) [m]."""
        return ConvexShape(np.array([start, end], float), radius, name)

    @staticmethod
    def mesh(vertices: Array, radius: float = 0.0, name: str = "") -> ConvexShape:
        """The convex hull of vertices, shape (k, 3) [m], of which corners of the hull are kept.

        Raises:
            CableGeometryError: They lie in a plane.
        """
        from scipy.spatial import ConvexHull, QhullError  # simulations without meshes need none

        vertices = np.array(vertices, float).reshape(-1, 3)
        about = name or "mesh"
        if not np.all(np.isfinite(vertices)):
            raise CableGeometryError(f"{about}: found a vertex that is not finite; accepted: [m]")
        flat = CableGeometryError(
            f"{about}: found {len(vertices)} vertices in one plane; accepted: four and more that "
            "are not"
        )
        if len(vertices) < 4:
            raise flat
        middle = np.mean(vertices, axis=0)
        extents = np.linalg.svd(vertices - middle, compute_uv=False)
        if extents[2] <= THINNEST * extents[0]:
            raise flat
        try:
            corners = np.sort(ConvexHull(vertices).vertices)
        except QhullError as problem:
            raise flat from problem
        return ConvexShape(vertices[corners], radius, name)

    def moved(self, X: RigidTransform) -> ConvexShape:
        """The shape given in the frame of A, for X_AB, of one given in that of B."""
        return ConvexShape((X @ self.points.T).T, self.radius, self.name)

    def distance(self, other: ConvexShape) -> tuple[float, Array, Array, Array]:
        """Signed distance from another shape in the same frame [m], below 0 where they overlap.

        Returns:
            It, a point of this surface and one of the other's, shape (3,) each [m], and the unit
            normal n from the other one to this: the first point less the second is distance n.
        """
        p, q, n = np.empty(3), np.empty(3), np.empty(3)
        work = convex_work(len(self.points), len(other.points))
        found = convex_distance(self.points, other.points, p, q, n, work)
        return (
            float(found) - self.radius - other.radius,
            p - self.radius * n,
            q + other.radius * n,
            n,
        )


def packed(shapes: Sequence[ConvexShape]) -> tuple[Array, np.ndarray, Array]:
    """Shapes as kernels take them.

    Returns:
        Points of all, shape (k, 3) [m]; where those of each begin, then k, shape (s + 1,); and
        radii, shape (s,) [m].
    """
    counts = [len(shape.points) for shape in shapes]
    points = np.concatenate([np.zeros((0, 3)), *(shape.points for shape in shapes)])
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return points, starts, np.array([shape.radius for shape in shapes], float)


def mesh_vertices(path: Path) -> Array:
    """Vertices of a mesh file, shape (k, 3) [m]: .obj, .stl, .ply and what else trimesh reads.

    Raises:
        CableGeometryError: It cannot be read; names it.
    """
    if not path.is_file():
        raise CableGeometryError(f"{path}: there is no such mesh")
    if path.suffix.lower() == ".obj":
        return _obj_vertices(path)
    try:
        import trimesh
    except ImportError:
        raise CableGeometryError(
            f"{path}: found {path.suffix}; accepted: .obj; more formats with trimesh, pip install "
            "cdpr_drake[mesh]"
        ) from None
    try:
        mesh = trimesh.load(path, force="mesh", process=False)
        return np.asarray(mesh.vertices, float)
    except Exception as problem:  # every reader of trimesh has its own
        raise CableGeometryError(f"{path}: cannot be read as a mesh: {problem}") from problem


def _obj_vertices(path: Path) -> Array:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise CableGeometryError(f"{path}: cannot be read as a mesh: {problem}") from problem
    found = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:1] != ["v"]:
            continue
        try:
            found.append([float(word) for word in words[1:4]])
            if len(found[-1]) != 3:
                raise ValueError
        except ValueError:
            raise CableGeometryError(
                f"{path}: line {number}: found {line[:60]!r}; accepted: v x y z [m]"
            ) from None
    if not found:
        raise CableGeometryError(f"{path}: found no vertices; accepted: lines v x y z [m]")
    return np.array(found)
