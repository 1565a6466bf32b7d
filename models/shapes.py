"""Shapes of platform and frame where they are no boxes: spheres, cylinders, meshes, beams.

`PlatformShape`, `FrameBeam` and `Frame` are sections of a robot file.
"""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.schema.declarations import (
    In,
    OneOf,
    Point,
    Refusal,
    Scope,
    Switch,
    Text,
    filled,
    number_words,
    settings,
    values,
)
from cdpr_drake.schema.input_files import input_bytes, input_path, input_there, inputs_held

if TYPE_CHECKING:  # slow to import, and most robots are boxes
    from pydrake.geometry import Shape
    from pydrake.multibody.tree import SpatialInertia

BOX, SPHERE, CYLINDER, MESH = "box", "sphere", "cylinder", "mesh"

MESH_SUFFIXES = (".obj", ".gltf")
"""Files that Drake draws, renders and integrates over."""

_NEEDS = {BOX: "size", SPHERE: "radius", CYLINDER: "radius", MESH: "file"}


@settings
class PlatformShape:
    """The platform's shape within its box, with which pulleys and clearances reckon."""

    kind: Annotated[str, OneOf((BOX, SPHERE, CYLINDER, MESH)), "Kind of shape."]
    size: Annotated[np.ndarray | None, In("m", 3, gt=0.0), "Edges of a box."] = None
    radius: Annotated[float | None, In("m", gt=0.0), "Radius of a sphere or cylinder."] = None
    height: Annotated[float | None, In("m", gt=0.0), "Height of a cylinder, along z."] = None
    file: Annotated[
        Text | None,
        "File of a mesh, from the robot file's folder: Wavefront OBJ or glTF; its "
        "triangles must enclose a volume if the inertia follows from it.",
    ] = None
    scale: Annotated[float, In("-", gt=0.0), "Scale of a mesh, to metres."] = 1.0
    position: Annotated[
        np.ndarray | None,
        In("m", 3),
        "Its middle, or a mesh's origin, in P; null: the middle of the platform's box.",
    ] = None
    angles_deg: Annotated[
        np.ndarray, In("deg", 3), "Angles (phi, theta, psi) of its axes, as of a pose."
    ] = values(0.0, 0.0, 0.0)

    def missing(self) -> str:
        """The key that its kind needs and that is not there; empty: none."""
        if getattr(self, _NEEDS[self.kind]) is None:
            return _NEEDS[self.kind]
        return "height" if self.kind == CYLINDER and self.height is None else ""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What its kind needs and is not there."""
        missing, folder = self.missing(), (scope.path or Path()).parent
        if missing:
            yield missing, "null", f"a value, for the kind {self.kind}"
        elif self.kind == MESH and mesh_path(str(self.file), folder) is None:
            yield "file", self.file, f"an .obj or .gltf file, from {folder}"

    def pose(self, middle: Array) -> RigidTransform:
        """X_PS of the shape [m]; `middle` is that of the platform's box."""
        place = middle if self.position is None else self.position
        return pose_from_angles(np.asarray(place, float), np.radians(self.angles_deg))

    def shape(self) -> "Shape":
        """The shape in its own frame, as Drake has it."""
        from pydrake.geometry import Box, Cylinder, Mesh, Sphere

        if self.kind == BOX:
            assert self.size is not None
            return Box(*(float(edge) for edge in self.size))
        if self.kind == MESH:
            assert self.file is not None
            return Mesh(str(mesh_in_place(Path(self.file))), self.scale)
        assert self.radius is not None
        if self.kind == SPHERE:
            return Sphere(self.radius)
        assert self.height is not None
        return Cylinder(self.radius, self.height)

    def extent(self, middle: Array) -> tuple[Array, Array]:
        """Lower and upper corner in P of its bounding box along the axes of P, (3,) [m].

        Raises:
            RobotFileError: The mesh cannot be read.
        """
        X_PS, size = self.pose(middle), np.zeros(3)
        R = X_PS.rotation().matrix()
        if self.kind == MESH:
            from cdpr_drake.models.drake_parsing import drake_refusals

            assert self.file is not None
            with drake_refusals(f"{self.file}: cannot be read as a mesh"):
                file = mesh_in_place(Path(self.file))
                corners = _mesh_corners(str(file), self.scale, file.stat().st_mtime_ns)
            points = R @ corners + X_PS.translation()[:, np.newaxis]
            return points.min(axis=1), points.max(axis=1)
        if self.kind == BOX:
            size = np.abs(R) @ np.asarray(self.size, float) / 2.0
        elif self.kind == SPHERE:
            size = np.full(3, self.radius)
        else:
            assert self.radius is not None
            assert self.height is not None
            axis = R[:, 2]
            size = self.radius * np.sqrt(np.maximum(1.0 - axis**2, 0.0))
            size = size + self.height / 2.0 * np.abs(axis)
        return X_PS.translation() - size, X_PS.translation() + size

    def inertia(self, mass: float, middle: Array) -> "SpatialInertia":
        """Spatial inertia about Po in P of a homogeneous body of this shape and mass [kg, m].

        Raises:
            RobotFileError: The mesh encloses no volume.
        """
        from pydrake.multibody.tree import CalcSpatialInertia, SpatialInertia

        X_PS = self.pose(middle)
        if self.kind == MESH:
            file = mesh_in_place(Path(str(self.file)))
            unit = _mesh_inertia(str(file), self.scale, file.stat().st_mtime_ns)
        else:
            unit = CalcSpatialInertia(self.shape(), 1.0)
        whole = SpatialInertia(mass, unit.get_com(), unit.get_unit_inertia())
        return whole.ReExpress(X_PS.rotation()).Shift(-X_PS.translation())


_NO_INERTIA = (
    "found no volume that its triangles enclose; accepted where platform.inertia_of is shape: an "
    ".obj file of closed surfaces, wound so that their normals point outward"
)


def _check_closed(file: str) -> None:
    """Checks that each edge of a mesh has a triangle on either side, wound alike.

    Drake takes the volume of any triangles, whether they enclose one or not.

    Raises:
        RobotFileError: Otherwise, or the mesh is no OBJ.
    """
    from pydrake.geometry import ReadObjToTriangleSurfaceMesh

    if not file.lower().endswith(".obj"):
        raise RobotFileError(f"{file}: {_NO_INERTIA}")
    mesh = ReadObjToTriangleSurfaceMesh(file)
    corners = np.array([mesh.vertex(i) for i in range(mesh.num_vertices())])
    # Files may repeat corners, once for each texture.
    _, same = np.unique(corners.round(12), axis=0, return_inverse=True)
    edges: set[tuple[int, int]] = set()
    count = 0
    for k in range(mesh.num_triangles()):
        triangle = [int(same.ravel()[mesh.element(k).vertex(j)]) for j in range(3)]
        edges |= {(triangle[j], triangle[(j + 1) % 3]) for j in range(3)}
        count += 3
    if len(edges) != count or any((b, a) not in edges for a, b in edges):
        raise RobotFileError(f"{file}: {_NO_INERTIA}")


@lru_cache(maxsize=8)
def _mesh_corners(file: str, scale: float, changed: int) -> Array:
    """Of the convex hull, shape (3, n) [m], read once for each state of its file."""
    from pydrake.geometry import Mesh

    from cdpr_drake.models.drake_parsing import try_mesh  # which few robots need

    try_mesh(Path(file))
    hull = Mesh(file, scale).GetConvexHull()
    return np.array([hull.vertex(i) for i in range(hull.num_vertices())]).T


@lru_cache(maxsize=8)
def _mesh_inertia(file: str, scale: float, changed: int) -> "SpatialInertia":
    """Of a mesh with a density of 1 kg/m^3, read once for each state of its file.

    Raises:
        RobotFileError: It encloses no volume.
    """
    from pydrake.geometry import Mesh
    from pydrake.multibody.tree import CalcSpatialInertia

    from cdpr_drake.models.drake_parsing import drake_refusals

    with drake_refusals(f"{file}: {_NO_INERTIA}"):
        _check_closed(file)
        return CalcSpatialInertia(Mesh(file, scale), 1.0)


def mesh_files(file: Path) -> list[Path]:
    """A mesh and the files that it names: materials of an OBJ, parts of a glTF.

    Raises:
        RobotFileError: A glTF is no JSON, or its buffers and images are no lists of objects.
    """
    words = input_bytes(file).decode("utf-8", "replace")
    if file.suffix.lower() == ".obj":
        named = [line.split(maxsplit=1)[1].strip() for line in words.splitlines()
                 if line.startswith("mtllib ")]  # fmt: skip
    else:
        try:
            from cdpr_drake.schema.json_text import load_json

            content = load_json(words)
            uris = [item.get("uri", "data:") for key in ("buffers", "images")
                    for item in content.get(key, [])]  # fmt: skip
            named = [uri for uri in uris if not uri.startswith("data:")]
        except (AttributeError, TypeError, ValueError) as problem:
            raise RobotFileError(f"{file}: is no glTF: {problem}") from problem
    return [file, *(file.parent / name for name in named if input_there(file.parent / name))]


def mesh_in_place(file: Path) -> Path:
    """Where Drake reads a mesh: the file itself, or a copy of what was read before."""
    return file if inputs_held() is None else input_path(file, mesh_files(file))


def mesh_path(file: str, folder: Path) -> Path | None:
    """Where the file of a mesh is; None: it is not there, or no file that Drake reads."""
    path = (folder / file).resolve()
    return path if input_there(path) and path.suffix.lower() in MESH_SUFFIXES else None


@settings
class FrameBeam:
    """A beam of the frame, of square section."""

    start: Annotated[Point, "One end of its middle line in W."]
    end: Annotated[Point, "The other end."]
    width: Annotated[
        float | None, In("m", gt=0.0), "Width; null: the thickness of the frame's beams."
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A beam without length."""
        if not self.length() > 0.0:
            yield "", "both ends in one point", "ends apart"

    def length(self) -> float:
        """From end to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def axes(self) -> Array:
        """Its axes in W as columns, the last one along it, shape (3, 3)."""
        z = (self.end - self.start) / self.length()
        other = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        x = np.cross(other, z)
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(z, x), z])

    def size(self, width: float) -> Array:
        """Edges along its axes, shape (3,) [m]; with a width for those that give none."""
        wide = width if self.width is None else self.width
        return np.array([wide, wide, self.length()])


BEAM_SHARE = 1.0 / 30.0
"""Thickness of a beam of the longest edge, as of ACROBOT, where a file does not give it."""


@settings
class Frame:
    """The robot's frame, a box of beams that the platform must stay in unless it was assumed."""

    lower: Annotated[Point, "Lower corner in W."]
    upper: Annotated[Point, "Upper corner in W."]
    beam: Annotated[
        float | None,
        In("m", gt=0.0),
        "Thickness of the beams, for drawing; null: a share of the longest edge.",
    ] = None
    beams: Annotated[list[FrameBeam], "Its beams, instead of those on the edges of the box."] = (
        filled(list)
    )
    assumed: Annotated[
        Switch,
        "True if its corners were assumed, as the robot's source gives none. Such a frame"
        " bounds default grids; it refuses no pose and limits no workspace hull.",
    ] = False

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A frame that nothing is inside of, and beams that are thicker than it is wide."""
        smallest = float(np.min(self.upper - self.lower))
        if smallest <= 0.0:
            found = f"lower {number_words(self.lower)}, upper {number_words(self.upper)}"
            yield "", found, "lower < upper"
        elif self.beam is not None and self.beam > smallest:
            yield "beam", f"{self.beam:g}", f"at most {smallest:g} [m], the frame's width"

    def bounds(self) -> tuple[Array, Array]:
        """Corners that Po must lie within, shape (3,) each [m]; infinite where it was assumed."""
        if self.assumed:
            return np.full(3, -np.inf), np.full(3, np.inf)
        return np.asarray(self.lower, float), np.asarray(self.upper, float)

    def beam_width(self) -> float:
        """Thickness of the beams that are drawn [m]."""
        if self.beam is not None:
            return self.beam
        return BEAM_SHARE * float(np.max(self.upper - self.lower))


FITS = 1e-6
"""Share of its longest edge by which a shape may reach out of the platform's box: rounding."""
