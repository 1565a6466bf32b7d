"""A static workspace in few poses, for who changes a robot and wants to see what that does.

The numbers are those of `cdpr workspace` of the robot's file with as many poses: kind static, a
level platform, a grid in the box of the frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from cdpr_drake.workspaces.volume import (
    VolumeRule,
    WorkspaceVolume,
    surface_quads,
    triangles,
    workspace_volume,
)

IN_NO_FILE = ""
"""Name of a robot that is in no catalogue: its grid is in the box of its frame."""


@dataclass(frozen=True, eq=False)
class WorkspaceSketch:
    """A static workspace on a grid.

    Attributes:
        counts: Points of the grid along x, y, z.
        volume: Of the cells whose corners are all inside.
        solid: Vertices, shape (n, 3) [m], and triangles, shape (k, 3); None: it is empty, or the
            robot moves along a line.
    """

    counts: tuple[int, int, int]
    volume: WorkspaceVolume
    solid: tuple[Array, np.ndarray] | None


class SketchWork:
    """A sketch in the making, some poses at a time."""

    def __init__(self, robot: Robot, poses: int) -> None:
        """Begins.

        Args:
            robot: The robot.
            poses: About how many poses the grid shall have.

        Raises:
            CdprError: The robot has no static workspace.
        """
        self._case = static_case(robot, pulleys=True)
        self._grid = sketch_grid(robot, poses)
        self._inside = np.zeros(self._grid.size, bool)
        self._done = 0

    def go_on(self, poses: int) -> WorkspaceSketch | None:
        """Judges so many poses more; the sketch, once these were the last ones.

        Raises:
            CdprError: The robot has no static workspace.
        """
        start, stop = self._done, min(self._done + poses, self._grid.size)
        grid = self._grid
        self._inside[start:stop] = statically_feasible(
            self._case, grid.positions(start, stop), grid.rotations(start, stop)
        )
        self._done = stop
        if stop < grid.size:
            return None
        inside = self._inside.reshape(grid.shape[1:])
        vertices, faces = triangles(surface_quads(inside, grid.axes))
        return WorkspaceSketch(
            grid.shape[1:],
            workspace_volume(inside, grid.axes, VolumeRule.CORNERS),
            (vertices, faces) if len(faces) else None,
        )


def sketch_grid(robot: Robot, poses: int) -> WorkspaceGrid:
    """A grid of about so many poses, as far apart along x as along y and z, in a robot's frame."""
    defaults = workspace_defaults(robot, IN_NO_FILE)
    size = defaults.upper - defaults.lower
    moving = size > 0.0
    step = (float(np.prod(size[moving])) / poses) ** (1.0 / max(int(np.count_nonzero(moving)), 1))
    counts = np.where(moving, np.maximum(np.round(size / step), 2.0), 1.0).astype(int)
    return grid_by_count(defaults.lower, defaults.upper, counts.tolist())
