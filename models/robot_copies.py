"""Copies of a robot: moved in its world, turned, or with files that can lie in another folder."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.camera_files import CAMERA_SUFFIXES
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.models.shapes import MESH, mesh_files

_UPRIGHT = 1e-12
"""Gravity that is no farther from -z, as a unit vector, is along it."""


def portable_robot(robot: Robot) -> tuple[Robot, list[Path]]:
    """A robot whose file can lie in another folder, and the files that go with it: of its mesh,
    and of its cameras, but for one of the same name as another."""
    shape = robot.platform.shape
    own: dict[str, str] = {}
    for mount in robot.cameras:
        if mount.model.lower().endswith(CAMERA_SUFFIXES):
            own.setdefault(Path(mount.model).name, mount.model)
    has_mesh = shape is not None and shape.kind == MESH
    if not has_mesh and not own:
        return robot, []
    portable = deepcopy(robot)
    for mount in portable.cameras:
        name = Path(mount.model).name
        if own.get(name) == mount.model:
            mount.model = name
    files = [Path(file) for file in own.values()]
    if has_mesh:
        assert portable.platform.shape is not None
        file = Path(str(portable.platform.shape.file))
        portable.platform.shape.file = file.name
        files = mesh_files(file) + files
    return portable, files


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


def gravity_turn(robot: Robot) -> RotationMatrix | None:
    """R_UW of the least turn after which gravity points along -z of a world U.

    None where it does so in W already, or where there is no gravity.
    """
    down = np.array(robot.down())
    if robot.gravity == 0.0 or np.array_equal(down, (0.0, 0.0, -1.0)):
        return None
    axis = np.array([-down[1], down[0], 0.0])  # down x (-z)
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return RotationMatrix.MakeXRotation(np.pi)
    return RotationMatrix(AngleAxis(np.arctan2(sine, -down[2]), axis / sine))


def turned_robot(robot: Robot, R_UW: RotationMatrix) -> Robot:
    """The same robot seen from a world U with the origin of W and other axes.

    The frame's box becomes the box along axes of U that encloses it; a robot in a plane or on a
    line keeps it, so that an `axis` of W becomes one of U.

    Args:
        robot: The robot, which stays as it is.
        R_UW: The axes of W in U.
    """
    R, turned = R_UW.matrix(), deepcopy(robot)
    turn = RigidTransform(R_UW, np.zeros(3))
    down = R @ np.array(robot.down())
    upright = float(np.linalg.norm(down - [0.0, 0.0, -1.0])) < _UPRIGHT
    turned.gravity_direction = np.array([0.0, 0.0, -1.0]) if upright else down
    turned.pulley.swivel_axis = R @ robot.pulley.swivel_axis
    for cable in turned.cables:
        cable.exit_point = R @ cable.exit_point
        if cable.swivel_axis is not None:
            cable.swivel_axis = R @ cable.swivel_axis
        if cable.rail is not None:
            cable.rail.axis = R @ cable.rail.axis
    for camera in turned.cameras:
        if camera.parent == "world":
            camera.pose = _pose(turn @ camera.pose.transform())
    low, high = robot.frame.lower, robot.frame.upper
    corners = R @ np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                            for z in (low[2], high[2])]).T  # fmt: skip
    turned.frame.lower, turned.frame.upper = corners.min(axis=1), corners.max(axis=1)
    for beam in turned.frame.beams:
        beam.start, beam.end = R @ beam.start, R @ beam.end
    turned.home = _pose(turn @ robot.home.transform())
    motion = robot.motion_type()
    if motion.num_moves < 3:
        turned.axis = R @ np.array(motion.axis)
        turned.plane_height = None
    return turned


def world_turn(robot: Robot, format: str) -> str:
    """What is to be said of a world that is turned for a format; empty: its files are in W.

    All formats but mjcf take gravity to be along -z. A robot whose gravity is not is written as
    seen from a world U, with the origin of W and -z along gravity.

    Args:
        robot: The robot.
        format: A name of `EXPORTS`.
    """
    turn = gravity_turn(robot)
    if turn is None or format == "mjcf":
        return ""
    down = ", ".join(f"{x:.9g}" for x in robot.down())
    rows = ", ".join(f"({', '.join(repr(float(x) + 0.0) for x in row)})" for row in turn.matrix())
    return (
        f"The world was turned by {np.degrees(turn.ToAngleAxis().angle()):.6g} deg: {format} has "
        f"gravity along -z, the robot has it along ({down}) in W. The world of what was written is "
        f"U, with the origin of W: p_U = R_UW p_W, R_UW by rows {rows}"
    )


def _pose(X: RigidTransform) -> Pose:
    return Pose(position=X.translation(), angles_deg=np.degrees(angles_from_rotation(X.rotation())))
