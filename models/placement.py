"""A robot somewhere else in the world."""

from __future__ import annotations

from copy import deepcopy

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot


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
