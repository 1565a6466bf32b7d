"""The static workspace that follows a robot while somebody changes it.

While a point moves it is coarse, and of several robots the newest counts. When nothing has moved
for a while it is computed again, finer. The numbers are those of `cdpr workspace` of the robot's
file with as many poses: kind static, a level platform, a grid in the box of the frame.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import Event

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot

if TYPE_CHECKING:  # what computes is imported at the first sketch
    from cdpr_drake.studio.scene import Draw, RobotScene
    from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
    from cdpr_drake.workspaces.volume import WorkspaceVolume

REST = 0.7
"""Time without a change after which a workspace is refined [s]: a slow browser tells of the hand
that moves twice a second only."""

COARSE, FINE = 1_000, 20_000
"""About so many poses while a point moves, and when it rests: a few and some tens of
milliseconds."""

IN_NO_FILE = ""
"""Name of a robot that is in no catalogue: its grid is in the box of its frame."""


@dataclass(frozen=True, eq=False)
class WorkspaceSketch:
    """A static workspace on a grid.

    Attributes:
        robot: Whose it is.
        poses: About so many were wanted.
        problem: Why the robot has none; empty: it has.
        counts: Points of the grid along x, y, z.
        volume: Of the cells whose corners are all inside; None: the robot has none.
        solid: Vertices, shape (n, 3) [m], and triangles, shape (k, 3); None: it is empty, or the
            robot moves along a line.
    """

    robot: Robot
    poses: int
    problem: str = ""
    counts: tuple[int, int, int] = (0, 0, 0)
    volume: WorkspaceVolume | None = None
    solid: tuple[Array, np.ndarray] | None = None


def sketch_workspace(robot: Robot, poses: int) -> WorkspaceSketch:
    """The static workspace of a robot on a grid of about so many poses."""
    from cdpr_drake.analyses.workspaces.robot_conditions import static_case
    from cdpr_drake.workspaces.static_feasibility import statically_feasible
    from cdpr_drake.workspaces.volume import (
        VolumeRule,
        surface_quads,
        triangles,
        workspace_volume,
    )

    try:
        case, grid = static_case(robot), sketch_grid(robot, poses)
        places = statically_feasible(case, grid.positions(), grid.rotations())
    except CdprError as refusal:
        return WorkspaceSketch(robot, poses, str(refusal))
    places = places.reshape(grid.shape[1:])
    vertices, faces = triangles(surface_quads(places, grid.axes))
    volume = workspace_volume(places, grid.axes, VolumeRule.CORNERS)
    solid = (vertices, faces) if len(faces) else None
    return WorkspaceSketch(robot, poses, "", grid.shape[1:], volume, solid)


def sketch_grid(robot: Robot, poses: int) -> WorkspaceGrid:
    """A grid of about so many poses, as far apart along x as along y and z, in a robot's frame."""
    from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
    from cdpr_drake.workspaces.pose_grid import grid_by_count

    defaults = workspace_defaults(robot, IN_NO_FILE)
    size = defaults.upper - defaults.lower
    moving = size > 0.0
    step = (float(np.prod(size[moving])) / poses) ** (1.0 / max(int(np.count_nonzero(moving)), 1))
    counts = np.where(moving, np.maximum(np.round(size / step), 2.0), 1.0).astype(int)
    return grid_by_count(defaults.lower, defaults.upper, counts.tolist())


class LiveWorkspace:
    """What a session sees of the workspace of the robot that it changes.

    Attributes:
        sketch: The workspace as it is drawn; None: there is none.
        is_wanted: True if it is computed and drawn.
        changed: Called when any of these has changed.
    """

    def __init__(self, draw: Callable[[Draw, Callable[[Any], None]], None]) -> None:
        """With `draw` of a workbench."""
        self._draw = draw
        self.sketch: WorkspaceSketch | None = None
        self.is_wanted, self.changed = True, Event[[]]()
        self._robot: Robot | None = None
        self._drawn: WorkspaceSketch | None = None
        self._refining: asyncio.TimerHandle | None = None

    def want(self, wanted: bool) -> None:
        """Computes and draws it from now on, or takes it out of the scene."""
        self.is_wanted = wanted
        self._redraw(COARSE)

    def follow(self, robot: Robot | None) -> None:
        """Is about a robot from now on, at the next `draw`; None: about none."""
        self._robot = robot
        if self._refining is not None:
            self._refining.cancel()

    def compute(self, poses: int = COARSE) -> None:
        """Computes the workspace of the newest robot, unless it is there; see `draw`."""
        robot, drawn = self._robot if self.is_wanted else None, self._drawn
        if robot is None:
            self._drawn = None
        elif drawn is None or drawn.robot is not robot or drawn.poses < poses:
            self._drawn = sketch_workspace(robot, poses)

    def draw(self, scene: RobotScene, poses: int = COARSE) -> None:
        """Draws it on a grid of about so many poses, or more; in the calculator's thread."""
        self.compute(poses)
        scene.show_workspace(None if self._drawn is None else self._drawn.solid)

    def take(self) -> None:
        """Tells what was drawn, and refines it after a rest; in the thread of the page."""
        sketch = self._drawn
        if sketch is not self.sketch:
            self.sketch = sketch
            self.changed.emit()
            if sketch is not None and not sketch.problem and sketch.poses < FINE:
                loop = asyncio.get_running_loop()
                self._refining = loop.call_later(REST, self._redraw, FINE)

    def _redraw(self, poses: int) -> None:
        self._draw(lambda scene: self.draw(scene, poses), lambda _: self.take())
