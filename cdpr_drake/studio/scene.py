"""The scene of a workbench in Meshcat: its robot, with cables and points in their colours."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat, private_door
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import nth_look, rgb
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures

EXITS, ANCHORS = "studio/exit", "studio/anchor"
"""Paths of the points in the scene, below which each has its number."""

WORKSPACE = "studio_workspace"
"""Path of the workspace that follows; not below that of the points, which a change deletes."""

SHADER = "studio_shader"
"""Path of a triangle without area that is drawn like the workspace. A browser compiles its shader
anew for each workspace that replaces the only one, which takes it longer than to draw.
"""

WORKSPACE_COLOR = Rgba(0.94, 0.76, 0.48, 0.45)
"""Its colour; those that were computed by a command are green and blue."""

Solid = tuple[Array, np.ndarray]
"""Vertices, shape (n, 3) [m], and triangles, shape (k, 3)."""

R_EW = (
    RotationMatrix.MakeXRotation(np.radians(-65.0)) @ RotationMatrix.MakeZRotation(np.radians(5.0))
).matrix()
"""The eye's axes: right, up, back. It is 25 deg above and 5 deg to the left of the front: there all
points of the robots of the package lie apart."""

FIELD = 50.0
"""The eye's angle of view, up [deg]."""

REACH = 0.88 * np.tan(np.radians(FIELD / 2.0)) * np.array([1.25, 1.0])
"""What a robot fills of it across and up, per distance; `scene.js` has at least that across."""

POINT_SIZE = 0.011
"""Radius of a point, of the diagonal of the frame."""

BACKGROUNDS = {
    False: ([0.92, 0.94, 0.97], [0.98, 0.98, 0.98]),
    True: ([0.40, 0.43, 0.47], [0.50, 0.52, 0.55]),
}
"""Colours of the scene's background above and below, by whether the page is dark."""


class RobotScene:
    """A robot in a Meshcat of its own; all of it belongs to the thread of the calculator."""

    def __init__(self) -> None:
        """Opens Meshcat, which only the server's relay reaches."""
        self.meshcat: Meshcat = open_meshcat()
        self.door = str(private_door(self.meshcat))
        self._robot: Robot | None = None
        self._picture: RobotPicture
        self._workspace: Solid | None = None
        self._dark, self._solids = False, ""

    def show(self, robot: Robot, X_WP: RigidTransform, tensions: Array) -> None:
        """Draws a robot at a pose, with tensions, shape (m,) [N]: slack is red, NaN is grey."""
        if robot is not self._robot:
            self._place(robot)
        self._picture.draw(X_WP, tensions)
        anchors = X_WP.multiply(robot.cable_set().p_PB)
        for k in range(len(robot.cables)):
            self.meshcat.SetTransform(f"{ANCHORS}/{k}", RigidTransform(anchors[:, k]))

    def _place(self, robot: Robot) -> None:
        """Puts another robot into the scene, or the same one after a change."""
        before, solids = self._robot, _solids(robot)
        colors = [nth_look(k).color for k in range(len(robot.cables))]
        full_scale, size, meshcat = robot.tension_limits()[1], _size(robot), self.meshcat
        if before is None or solids != self._solids:
            # Who looks at a point that moves keeps the view.
            look = (
                before is None or robot.name != before.name
                or abs(size - _size(before)) > 0.25 * size
            )  # fmt: skip
            for path in ("cables", "visualizer", "studio"):
                meshcat.Delete(path)
            if solids == self._solids:  # pydrake frees no diagram, and the same solids need none
                self._picture.show()
            else:
                self._picture = RobotPicture(
                    robot, full_scale, meshcat=meshcat, colors=colors, look=look
                )
            if look:
                look_at_robot(meshcat, robot)
            self.set_dark(self._dark)
            for k, color in enumerate(colors):
                for path, share in ((EXITS, 1.0), (ANCHORS, 0.6)):
                    shape = Sphere(POINT_SIZE * size * share)
                    meshcat.SetObject(f"{path}/{k}", shape, Rgba(*rgb(color)))
            p_WP = np.tile(robot.home.position, (3, 1))
            add_solid(meshcat, SHADER, p_WP, np.array([[0, 1, 2]]), WORKSPACE_COLOR)
        if not self._picture.cables.move_to(robot, full_scale):
            meshcat.Delete("cables")
            self._picture.cables = CablePictures(meshcat, robot, full_scale, colors=colors)
        for k, p_WA in enumerate(robot.cable_set().p_WA.T):
            meshcat.SetTransform(f"{EXITS}/{k}", RigidTransform(p_WA))
        self._robot, self._solids = robot, solids

    def show_workspace(self, solid: Solid | None) -> None:
        """Draws the workspace that follows the robot, or takes it out."""
        if solid is not self._workspace:
            self._workspace = solid
            if solid is None:
                self.meshcat.Delete(WORKSPACE)
            else:
                add_solid(self.meshcat, WORKSPACE, *solid, WORKSPACE_COLOR)

    def set_dark(self, dark: bool) -> None:
        """Paints the background for a dark page, or a light one."""
        self._dark = dark
        for name, color in zip(("top_color", "bottom_color"), BACKGROUNDS[dark], strict=True):
            self.meshcat.SetProperty("/Background/<object>", name, color)

    def redraw(self) -> None:
        """The next `show` draws everything anew, as after others have drawn into the scene."""
        self._robot = self._workspace = None


def look_at_robot(meshcat: Meshcat, robot: Robot) -> None:
    """Looks at a robot with its frame from the front and above; all of it fills the window."""
    cables = robot.cable_set()
    corners = list(product(*zip(robot.frame.lower, robot.frame.upper, strict=True)))
    anchors = robot.home.transform().multiply(cables.p_PB)
    p = R_EW @ np.column_stack([np.array(corners).T, cables.p_WA, anchors])
    # A point is in the window if |p - eye| <= REACH (eye - p)_z, across and up.
    first, last = (np.max(sign * p[:2].T + REACH * p[2:].T, axis=0) for sign in (-1.0, 1.0))
    distance = float(np.max((first + last) / (2.0 * REACH)))
    eye = np.array([*(last - first) / 2.0, distance])
    depth = distance - float(np.mean([np.min(p[2]), np.max(p[2])]))
    meshcat.SetCameraPose(R_EW.T @ eye, R_EW.T @ (eye - [0.0, 0.0, depth]))
    for name, value in (("fov", FIELD), ("near", 5e-3 * depth), ("far", 50.0 * depth)):
        meshcat.SetProperty("/Cameras/default/rotated/<object>", name, value)


def _size(robot: Robot) -> float:
    """Diagonal of the frame [m]."""
    return float(np.linalg.norm(robot.frame.upper - robot.frame.lower))


def _solids(robot: Robot) -> str:
    """What the solids of a scene follow from, with eight digits: all but places of the cables."""
    return repr(
        (robot.name, robot.motion, robot.axis, robot.plane_height, robot.home, robot.platform,
         robot.frame, robot.cameras, len(robot.cables))
    )  # fmt: skip


Draw = Callable[[RobotScene], Any]
"""What draws into a scene."""
