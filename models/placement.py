"""A robot somewhere else: in the world, or its file in another folder."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.hardware import MESH, mesh_files
from cdpr_drake.models.robot_schema import Robot


def portable_robot(robot: Robot) -> tuple[Robot, list[Path]]:
    """A robot whose file can lie in another folder, and the files of its mesh to lie beside it."""
    shape = robot.platform.shape
    if shape is None or shape.kind != MESH:
        return robot, []
    portable, file = deepcopy(robot), Path(str(shape.file))
    assert portable.platform.shape is not None
    portable.platform.shape.file = file.name
    return portable, mesh_files(file)


def moved_robot(robot: Robot, shift: Array, name: str | None = None) -> Robot:
    """The same robot with all of its frame shifted in W, for several robots in one world.

    Args:
        robot: The robot, which stays as it is.
        shift: Shift in W, shape (3,) [m].
        name: Another name; the same if None.
    """
    shift = np.asarray(shift, float)
    moved = deepcopy(robot)
    moved.name = name or robot.name
    for cable in moved.cables:
        cable.exit_point = cable.exit_point + shift
    for camera in moved.cameras:
        if camera.parent == "world":
            camera.pose.position = camera.pose.position + shift
    moved.frame.lower, moved.frame.upper = moved.frame.lower + shift, moved.frame.upper + shift
    for beam in moved.frame.beams:
        beam.start, beam.end = beam.start + shift, beam.end + shift
    moved.home.position = moved.home.position + shift
    if moved.plane_height is not None:
        moved.plane_height += float(shift[2])
    return moved
