"""Sets of wrenches and obstacles as users write them.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.errors import CableGeometryError, DataFileError, WrenchSetError
from cdpr_drake.geometry.convex_shapes import ConvexShape, mesh_vertices
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import array, number, section, sections, text
from cdpr_drake.schema.typed_yaml import load_typed
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS
from cdpr_drake.workspaces.cable_interference import Obstacles, box_row
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet


@dataclass(kw_only=True)
class WrenchSetFile:
    """Wrenches about Po in W: every sum of one of the polytope, the box and the ellipsoid."""

    vertices: np.ndarray = array(
        "Vertices of a polytope, moments then forces.", "N m, N", (None, 6), np.zeros((1, 6))
    )
    box: np.ndarray = array("Half widths of a box.", "N m, N", (6,), np.zeros(6), at_least=0.0)
    ellipsoid: np.ndarray = array(
        "Semi-axes of an ellipsoid.", "N m, N", (6,), np.zeros(6), at_least=0.0
    )


@dataclass(kw_only=True)
class ObstacleBox:
    """A box that stands in the robot's frame."""

    pose: Pose = section("Pose of its middle in W.", Pose)
    size: np.ndarray = array("Its edges.", "m", (3,), above=0.0)


@dataclass(kw_only=True)
class ObstacleSphere:
    """A ball that stands in the robot's frame."""

    position: np.ndarray = array("Its middle in W.", "m", (3,))
    radius: float = number("Its radius.", "m", above=0.0)


@dataclass(kw_only=True)
class ObstacleCapsule:
    """What is within a radius of a line in the robot's frame."""

    start: np.ndarray = array("One end of the line in W.", "m", (3,))
    end: np.ndarray = array("The other.", "m", (3,))
    radius: float = number("The radius.", "m", above=0.0)


@dataclass(kw_only=True)
class ObstacleMesh:
    """The convex hull of a mesh that stands in the robot's frame."""

    file: str = text("Mesh in metres, beside this file: .obj; .stl and .ply with trimesh.")
    pose: Pose = section("Pose of the mesh in W.", Pose)
    scale: float = number("What its coordinates are multiplied by.", "-", 1.0, above=0.0)


@dataclass(kw_only=True)
class ObstacleFile:
    """What cables and platform may not touch."""

    boxes: list[ObstacleBox] = sections("Boxes.", required=False)
    spheres: list[ObstacleSphere] = sections("Balls.", required=False)
    capsules: list[ObstacleCapsule] = sections("Capsules.", required=False)
    meshes: list[ObstacleMesh] = sections("Convex hulls of meshes.", required=False)


def load_wrench_set(path: Path) -> SpatialSet:
    """Reads a set of wrenches; keys as `WrenchSetFile`.

    Raises:
        DataFileError: The file cannot be read, or a value is not accepted.
        WrenchSetError: The set has nothing but zero, or is empty.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of a set of wrenches")
    found = load_typed(WrenchSetFile, path)
    try:
        wrenches = SpatialSet(found.vertices, found.box, found.ellipsoid)
    except WrenchSetError as problem:
        raise WrenchSetError(f"{path}: {problem}") from problem
    if wrenches.is_zero():
        raise WrenchSetError(
            f"{path}: found no wrench but zero; accepted: vertices, a box or an ellipsoid; the "
            "weight alone is --kind static"
        )
    return wrenches


def load_obstacles(path: Path) -> Obstacles:
    """Reads boxes, balls, capsules and convex hulls of meshes; keys as `ObstacleFile`.

    Raises:
        DataFileError: The file or a mesh cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of obstacles")
    found = load_typed(ObstacleFile, path)
    if not (found.boxes or found.spheres or found.capsules or found.meshes):
        raise DataFileError(
            f"{path}: found no obstacle; accepted: some of boxes, spheres, capsules, meshes"
        )
    X = [box.pose.transform() for box in found.boxes]
    boxes = [
        box_row(pose.translation(), box.size, pose.rotation().matrix())
        for pose, box in zip(X, found.boxes, strict=True)
    ]
    solids = [
        ConvexShape.sphere(one.position, one.radius, f"sphere {k}")
        for k, one in enumerate(found.spheres, 1)
    ]
    solids += [
        ConvexShape.capsule(one.start, one.end, one.radius, f"capsule {k}")
        for k, one in enumerate(found.capsules, 1)
    ]
    for k, one in enumerate(found.meshes):
        try:
            vertices = one.scale * mesh_vertices(path.parent / one.file)
            solids.append(ConvexShape.mesh(vertices, name=one.file).moved(one.pose.transform()))
        except CableGeometryError as problem:
            raise DataFileError(f"{path}: meshes[{k}].file: {problem}") from problem
    return Obstacles(np.array(boxes, float).reshape(-1, BOX_COLUMNS), tuple(solids))
