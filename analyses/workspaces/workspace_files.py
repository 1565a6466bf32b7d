"""Sets of wrenches and obstacles as users write them.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WrenchSetError
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import array, section, sections
from cdpr_drake.schema.typed_yaml import load_typed
from cdpr_drake.workspaces.cable_interference import box_row
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
class ObstacleFile:
    """Boxes that cables and platform may not touch."""

    boxes: list[ObstacleBox] = sections("The boxes.")


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


def load_obstacles(path: Path) -> Array:
    """Reads boxes, shape (o, 15), rows of `cable_interference.box_row`; keys as `ObstacleFile`.

    Raises:
        DataFileError: The file cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of obstacles")
    boxes = load_typed(ObstacleFile, path).boxes
    X = [box.pose.transform() for box in boxes]
    return np.array(
        [
            box_row(pose.translation(), box.size, pose.rotation().matrix())
            for pose, box in zip(X, boxes, strict=True)
        ]
    )
