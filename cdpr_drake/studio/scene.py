"""Scenes in Meshcat: the robot of a workbench, and the robot of a run.

`RobotScene` draws cables and points in the colours of their numbers; `RunScene` draws a run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat, private_door
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import nth_look, rgb
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

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
        self._name, self._size = "", 0.0
        self._dark, self._solids = False, ""
        self._points = (0, 0.0)  # how many there are, and the size that they are made for
        self._picture: RobotPicture | None = None
        self._workspace: Solid | None = None
        self._keeps_shader = False

    def show(self, robot: Robot, X_WP: RigidTransform, tensions: Array) -> None:
        """Draws a robot at a pose.

        Args:
            robot: The robot.
            X_WP: Pose of the platform [m].
            tensions: Shape (m,) [N]; a slack cable is red, one with NaN grey.
        """
        if robot is not self._robot or self._picture is None:
            self._place(robot)
        assert self._picture is not None
        self._picture.draw(X_WP, tensions)
        anchors = X_WP.multiply(robot.cable_set().p_PB)
        for k in range(len(robot.cables)):
            self.meshcat.SetTransform(f"{ANCHORS}/{k}", RigidTransform(anchors[:, k]))

    def _place(self, robot: Robot) -> None:
        """Puts another robot into the scene, or the same one after a change."""
        size = float(np.linalg.norm(robot.frame.upper - robot.frame.lower))
        # Who looks at a point that moves keeps the view.
        look = robot.name != self._name or abs(size - self._size) > 0.25 * size
        colors = [nth_look(k).color for k in range(len(robot.cables))]
        full_scale, solids = robot.tension_limits()[1], _solids(robot)
        if solids == self._solids and self._picture is not None and not look:
            # A diagram takes memory that Drake is slow to give back, and the same solids need none.
            if not self._picture.cables.move_to(robot, full_scale):
                self.meshcat.Delete("cables")
                self._picture.cables = CablePictures(self.meshcat, robot, full_scale, colors=colors)
        else:
            self.meshcat.Delete("cables")
            self.meshcat.Delete("visualizer")
            self._picture = RobotPicture(
                robot, full_scale, meshcat=self.meshcat, colors=colors, look=look
            )
            self.set_dark(self._dark)
            self._points = (0, 0.0)
        self._solids = solids
        if self._points != (len(colors), size):
            self._make_points(colors, size)
        for k, p_WA in enumerate(robot.cable_set().p_WA.T):
            self.meshcat.SetTransform(f"{EXITS}/{k}", RigidTransform(p_WA))
        self._robot, self._name, self._size = robot, robot.name, size

    def _make_points(self, colors: list[str], size: float) -> None:
        """Makes the points that can be dragged, for a frame of a size [m]; they only move then."""
        self.meshcat.Delete("studio")
        for k, color in enumerate(colors):
            for path in (EXITS, ANCHORS):
                shape = Sphere(POINT_SIZE * size * (1.0 if path == EXITS else 0.6))
                self.meshcat.SetObject(f"{path}/{k}", shape, Rgba(*rgb(color)))
        self._points = len(colors), size

    @property
    def robot(self) -> Robot | None:
        """The robot that is drawn; None: none yet."""
        return self._robot

    def show_workspace(self, solid: Solid | None) -> None:
        """Draws the workspace that follows the robot, or takes it out."""
        if solid is self._workspace:
            return
        self._workspace = solid
        if solid is None:
            self.meshcat.Delete(WORKSPACE)
        else:
            if not self._keeps_shader:
                inside = np.tile(solid[0].mean(axis=0), (3, 1))
                add_solid(self.meshcat, SHADER, inside, np.array([[0, 1, 2]]), WORKSPACE_COLOR)
                self._keeps_shader = True
            add_solid(self.meshcat, WORKSPACE, *solid, WORKSPACE_COLOR)

    def set_dark(self, dark: bool) -> None:
        """Paints the background for a dark page, or a light one."""
        self._dark = dark
        top, bottom = BACKGROUNDS[dark]
        self.meshcat.SetProperty("/Background/<object>", "top_color", top)
        self.meshcat.SetProperty("/Background/<object>", "bottom_color", bottom)

    def redraw(self) -> None:
        """The next `show` draws everything anew, as after others have drawn into the scene."""
        self._robot, self._solids, self._workspace = None, "", None


def _solids(robot: Robot) -> str:
    """What the solids of a scene follow from: all but the cables, with eight digits."""
    return repr(
        (robot.name, robot.motion, robot.axis, robot.plane_height, robot.home, robot.platform,
         robot.frame, robot.cameras)
    )  # fmt: skip


Draw = Callable[[RobotScene], Any]
"""What draws into a scene."""

PATHS = ("visualizer", "cables", "studio", WORKSPACE)
"""What is taken out of a scene before a run's robot is put there."""


class RunScene:
    """The robot of a run in a Meshcat; all of it belongs to the thread that made that.

    Attributes:
        robot: The robot.
    """

    def __init__(self, meshcat: Meshcat, scenario: Scenario | TensionScenario) -> None:
        """Puts the robot of a scenario and all that is round it into a scene."""
        for path in PATHS:
            meshcat.Delete(path)
        robot = self.robot = load_robot(scenario.robot)
        servo, cables, world = None, None, None
        if isinstance(scenario, Scenario):
            servo = scenario
        else:
            cables, world = (
                CableSettings(model=ELASTIC, pulleys=scenario.cables.pulleys),
                scenario.world,
            )
        self._picture = RobotPicture(
            robot, robot.tension_limits()[1], servo, cables, meshcat=meshcat, world=world,
            colors=[nth_look(k).color for k in range(len(robot.cables))],
        )  # fmt: skip

    def draw(self, sample: Mapping[str, Any]) -> None:
        """Draws a sample of the run."""
        unstrained = sample["unstrained"]
        self._picture.draw(
            pose_from_row(np.array(sample["pose"], float)),
            _numbers(sample["tensions"]),
            float(sample["t"]),
            None if unstrained is None else _numbers(unstrained),
        )


def _numbers(values: list[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], float)
