"""The ten paths of the study, and what is found along each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.studies.planning.convex_timing import convex_time
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path

WAYPOINTS = 4
"""Poses of each path."""

REACHED = 0.99
"""A limit counts as reached from this share of it on."""


@dataclass(frozen=True)
class PathSpec:
    """A path through random poses.

    Attributes:
        robot: Name of the robot.
        corners: What it does at its poses, see `robot_limits.make_path`.
        seed: Of the poses.
        tensions: Smallest and largest tension [N].
        cable_acceleration: Largest acceleration of a cable; None: any [m/s^2].
    """

    robot: str
    corners: str
    seed: int
    tensions: tuple[float, float]
    cable_acceleration: float | None = None

    @property
    def name(self) -> str:
        """Robot, corners, seed."""
        return f"{self.robot} {self.corners} {self.seed}"

    def poses(self) -> list[RigidTransform]:
        """Its poses, the same by the same seed."""
        random = np.random.default_rng(self.seed)
        middle, half, angles = BOXES[self.robot]
        return [
            pose_from_angles(
                np.array(middle) + np.array(half) * random.uniform(-1.0, 1.0, 3),
                np.radians(np.array(angles) * random.uniform(-1.0, 1.0, 3)),
            )
            for _ in range(WAYPOINTS)
        ]


Box = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]

BOXES: dict[str, Box] = {
    "planar": ((0.0, 0.0, 0.3), (0.25, 0.25, 0.0), (0.0, 0.0, 10.0)),
    "acrobot_large": ((0.0, 0.0, 0.35), (0.2, 0.2, 0.15), (6.0, 6.0, 8.0)),
    "caroca": ((0.0, 0.0, 1.2), (0.8, 1.2, 0.4), (4.0, 4.0, 6.0)),
}
"""Where poses lie, by robot: middle and half widths [m], largest angles [deg]."""

PATHS = (
    PathSpec("planar", "smooth", 0, (1.0, 60.0)),
    PathSpec("acrobot_large", "smooth", 1, (1.0, 60.0)),
    PathSpec("caroca", "smooth", 2, (30.0, 1e4)),
    PathSpec("planar", "blend", 3, (1.0, 60.0)),
    PathSpec("acrobot_large", "blend", 4, (1.0, 60.0)),
    PathSpec("planar", "smooth", 5, (5.0, 30.0)),
    PathSpec("acrobot_large", "smooth", 6, (1.0, 20.0)),
    PathSpec("acrobot_large", "smooth", 7, (1.0, 60.0), 5.0),
    PathSpec("caroca", "blend", 8, (30.0, 1e4)),
    PathSpec("caroca", "smooth", 9, (30.0, 1500.0)),
)


def run_path(spec: PathSpec, stations: int, intervals: int) -> dict[str, Any]:
    """Plans along a path, tracks the plan, and asks the convex program.

    Args:
        spec: The path.
        stations: Of the plan.
        intervals: Of the convex program.

    Returns:
        plan_time_s, convex_time_s, and their relative difference; least_share, largest_share: of
        the limit that is nearest, where it is least and most along the plan, above 1 between
        stations only; reached: share of the instants at which a limit is reached, see `REACHED`;
        what `TrackedPlan.as_dict` tells; tracked_share: of the limit that is used most; curves
        stations_m, and there ds/dt of the plan, speed_m_s, and the largest that the limits admit
        at a point by itself, largest_speed_m_s.

    Raises:
        PlanningError: The path cannot be followed, or the convex program was not solved.
    """
    robot = load_robot(spec.robot)
    given = LimitSettings(
        tensions=spec.tensions, cable_acceleration=spec.cable_acceleration, reserve=RESERVE
    )
    task = path_task(robot, given)
    plan = plan_along_path(task, make_path(robot, spec.poses(), spec.corners), stations)
    uses = np.max(plan.samples().uses, axis=1)
    tracked = track_plan(robot, plan, robot_limits(robot, given))
    convex = convex_time(robot, task, plan.path, intervals)
    motion = plan.trajectory
    return {
        "plan_time_s": plan.duration,
        "convex_time_s": convex,
        "difference": plan.duration / convex - 1.0,
        "least_share": np.min(uses),
        "largest_share": np.max(uses),
        "reached": np.mean(uses >= REACHED),
        **tracked.as_dict(),
        "tracked_share": max(tracked.uses().values()),
        "stations_m": motion.stations,
        "speed_m_s": np.sqrt(motion.squared_speeds),
        "largest_speed_m_s": np.sqrt(plan.largest),
    }
