"""The static feasible workspace of a robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible


@dataclass(frozen=True, eq=False)
class StaticTask:
    """Sweep task: can the poses of a grid be held? Source: servoing thesis (1.25)."""

    case: StaticCase
    grid: WorkspaceGrid

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `feasible` of the poses start to stop, shape (n,)."""
        positions, rotations = self.grid.positions(start, stop), self.grid.rotations(start, stop)
        return {"feasible": statically_feasible(self.case, positions, rotations)}


def static_case(
    robot: Robot,
    limits: tuple[float, float] | None = None,
    mass: float | None = None,
    wrench: Array | None = None,
    pulleys: bool = True,
) -> StaticCase:
    """A robot's platform on its cables.

    Args:
        robot: The robot; a planar one balances (moment about z, f_x, f_y) only.
        limits: Smallest and largest tension [N]; None: the robot's.
        mass: Mass of the platform [kg]; None: the robot's.
        wrench: External wrench on the platform about Po in W, beside its weight, shape (6,)
            (moment, force) [N m, N].
        pulleys: True: cables run over the robot's pulleys. False: pulleys are ignored.

    Raises:
        TensionProblemError: Too few cables, or a number makes no sense.
    """
    low, high = robot.tension_limits(limits)
    if not (np.isfinite(high) and 0.0 <= low <= high):
        raise TensionProblemError(
            f"tension limits: found {low:g} to {high:g}; accepted: 0 <= lower <= upper [N]"
        )
    load = np.zeros(6) if wrench is None else np.asarray(wrench, float)
    if load.shape != (6,) or not np.all(np.isfinite(load)):
        raise TensionProblemError(
            f"wrench: found shape {load.shape}, or numbers that are not finite; accepted: 6 "
            "(moment [N m], force [N])"
        )
    m, rows = len(robot.cables), robot.motion_type().rows
    if rows is None:
        raise TensionProblemError(
            f"robot {robot.name}: found {robot.motion} with axis {robot.motion_type().axis}; "
            "accepted for workspaces: motions along axes of W, and not 2R3T"
        )
    return StaticCase(
        robot.cable_set(pulleys),
        np.full(m, low),
        np.full(m, high),
        (robot.platform.mass if mass is None else mass) * robot.gravity,
        robot.center_of_mass(),
        wrench=load,
        rows=rows,
        down=robot.down(),
    )
