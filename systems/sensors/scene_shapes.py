"""The shapes of a scene graph as rays see them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    FrameId,
    GeometryId,
    GeometryVersion,
    HalfSpace,
    Mesh,
    QueryObject,
    Role,
    SceneGraphInspector,
    Sphere,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError, install_words
from cdpr_drake.geometry import ray_shapes
from cdpr_drake.geometry.triangle_meshes import fan_triangles, obj_triangles

ROLES = {"perception": Role.kPerception, "proximity": Role.kProximity}
"""What a ray may end on, by name: what cameras see, or what things bump into."""


class SceneShapes:
    """What rays meet in a scene, at the poses that its parts have now.

    Cables are no geometry of a scene, and are not met. Shapes are read again when the scene's
    geometry has changed. What this object keeps is a cache of the scene, no state.
    """

    def __init__(self, role: str = "perception", unseen: FrameId | None = None) -> None:
        """With one of `ROLES`; what is fixed to the frame `unseen` is left out."""
        self._role, self._unseen = ROLES[role], unseen
        self._version: GeometryVersion | None = None
        self._there: list[GeometryId] = []
        self._ids: list[GeometryId] = []
        self._scene = ray_shapes.RayScene([])

    def cast(
        self, query: QueryObject, origin: Array, directions: Array
    ) -> tuple[Array, list[GeometryId | None]]:
        """Distances to the first surfaces on rays from one point.

        Args:
            query: Of the scene graph, from a context.
            origin: In W, shape (3,) [m].
            directions: Unit vectors in W, shape (k, 3).

        Returns:
            Distances, infinite where there is nothing, shape (k,) [m], and what was met.

        Raises:
            SensorError: The scene has a shape that rays cannot be cast on.
        """
        inspector = query.inspector()
        version, there = inspector.geometry_version(), inspector.GetAllGeometryIds(self._role)
        # Both: a geometry that comes into a context with its role leaves the version as it was.
        if (
            self._version is None
            or there != self._there
            or not version.IsSameAs(self._version, self._role)
        ):
            self._read(inspector, there)
            self._version, self._there = GeometryVersion(version), there
        for number, geometry in enumerate(self._ids):
            self._scene.place(number, query.GetPoseInWorld(geometry))
        distances, hits = self._scene.cast(origin, directions)
        return distances, [self._ids[hit] if hit >= 0 else None for hit in hits]

    def _read(self, inspector: SceneGraphInspector, there: list[GeometryId]) -> None:
        self._ids = [
            geometry
            for geometry in there
            if self._unseen is None or inspector.GetFrameId(geometry) != self._unseen
        ]
        self._scene = ray_shapes.RayScene([_packed(inspector, geometry) for geometry in self._ids])


def _packed(inspector: SceneGraphInspector, geometry: GeometryId) -> ray_shapes.RayShape:
    shape, name = inspector.GetShape(geometry), inspector.GetName(geometry)
    if isinstance(shape, Box):
        return ray_shapes.box(shape.size())
    if isinstance(shape, Sphere):
        return ray_shapes.sphere(shape.radius())
    if isinstance(shape, Cylinder):
        return ray_shapes.cylinder(shape.radius(), shape.length())
    if isinstance(shape, Capsule):
        return ray_shapes.capsule(shape.radius(), shape.length())
    if isinstance(shape, Ellipsoid):
        return ray_shapes.ellipsoid(np.array([shape.a(), shape.b(), shape.c()]))
    if isinstance(shape, HalfSpace):
        return ray_shapes.half_space()
    if isinstance(shape, Convex):
        hull = shape.GetConvexHull()
        points = np.array([hull.vertex(i) for i in range(hull.num_vertices())])
        faces = [
            [hull.element(k).vertex(i) for i in range(hull.element(k).num_vertices())]
            for k in range(hull.num_elements())
        ]
        return ray_shapes.mesh(fan_triangles(points, faces))
    if isinstance(shape, Mesh):
        return ray_shapes.mesh(_mesh_triangles(shape, name) * shape.scale3())
    raise SensorError(
        f"geometry {name}: found a {type(shape).__name__}; accepted by range sensors: boxes, "
        "spheres, cylinders, capsules, ellipsoids, half spaces, meshes"
    )


def _mesh_triangles(shape: Mesh, name: str) -> Array:
    """Triangles as the file has them, shape (n, 3, 3)."""
    source = shape.source()
    where = f"geometry {name}"
    if source.extension() != ".obj":
        return _foreign_triangles(source, where)
    if source.is_path():
        return obj_triangles(Path(source.path()).read_text(encoding="utf-8"), where)
    contents = source.in_memory().mesh_file.contents()
    return obj_triangles(contents.decode("utf-8"), where)


def _foreign_triangles(source: Any, where: str) -> Array:
    """Triangles of a mesh that is no Wavefront file, by trimesh."""
    try:
        import trimesh
    except ImportError:
        raise SensorError(
            f"{where}: its mesh is a {source.extension()} file, which range sensors read by "
            f"trimesh, found none; {install_words('mesh')}, or use an .obj file"
        ) from None
    if not source.is_path():
        raise SensorError(
            f"{where}: found a mesh in memory of kind {source.extension()}; accepted by range "
            "sensors: a file, or .obj"
        )
    try:
        found = trimesh.load(str(source.path()), force="mesh")
        corners = np.asarray(found.triangles, float)
    except (ValueError, KeyError, AttributeError, IndexError, OSError) as problem:
        words = f"{where}: {source.path()}: no mesh that trimesh reads: {problem}"
        raise SensorError(words[:400]) from None
    if len(corners) == 0:
        raise SensorError(f"{where}: {source.path()}: found no triangles")
    # glTF has y upwards; Drake turns it so that z is.
    if source.extension() in (".gltf", ".glb"):
        corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
    return corners
