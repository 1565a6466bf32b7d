"""The law of time of a path within a box of accelerations, kept at every instant.

Where the cables can give every acceleration within a box, and the platform does not turn, tensions
need not be asked: the motion keeps their limits if it keeps the box. The passes of `path_timing`
find it at stations, with the components of the acceleration in the place of tensions. Between
stations the acceleration X' u + X'' x is a polynomial of s; the control points of its Bernstein
form bound it, and the speed, exactly. If they are above, the whole motion is slowed down to them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.planning.set_curve import control_points
from cdpr_drake.planning.station_kernel import BASIS, T_0, T_U, T_X
from cdpr_drake.trajectories.pose_path import DEGREE, POSE_NUMBERS, PosePath
from cdpr_drake.trajectories.timed_path import TimedPath

STILL = 1e-12
"""A platform that turns by no more than this per metre does not turn [rad/m]."""

ROUNDING = 1e-9
"""Limits that are missed by less, relative to them, are kept."""

MOST_SLOWER = 20
"""Times that a motion is slowed down until samples keep the limits of the winches."""


@dataclass(frozen=True, eq=False)
class BoxTask(PathTask):
    """A platform that may accelerate within a box, in the place of a robot with tensions.

    Attributes:
        box: Half widths, shape (3,); infinite: no limit [m/s^2].
    """

    box: Array = field(default_factory=lambda: np.full(3, np.inf))

    def stations(self, points: Array) -> tuple[Array, Array]:
        """As `PathTask.stations`, with 1 + (a component over its limit) for a tension, 0 to 2."""
        out, slopes = np.zeros((len(points), BASIS, 3)), points[:, 10:13]
        out[:, T_0] = 1.0
        out[:, T_U], out[:, T_X] = slopes / self.box, points[:, 16:19] / self.box
        return out, np.linalg.norm(slopes, axis=1)


@dataclass(frozen=True, eq=False)
class BoxTiming:
    """A motion within a box of accelerations.

    Attributes:
        plan: The motion, of the robot.
        accelerations: Bound of each component at any instant, shape (3,) [m/s^2].
        speed: Bound of the speed of Po at any instant [m/s].
        slowed: By which factor the whole motion takes longer than stations alone ask.
    """

    plan: PathPlan
    accelerations: Array
    speed: float
    slowed: float


def time_within_box(
    task: PathTask, path: PosePath, box: Array, stations: int = STATIONS
) -> BoxTiming:
    """The fastest motion from rest to rest whose acceleration stays in a box at every instant.

    The speed of Po is kept below its limit and below the largest cable speed, which no cable then
    exceeds, as the platform does not turn. Accelerations of cables and torques of motors are
    limits of samples: where they are missed, the motion is slowed down.

    Args:
        task: The robot and its limits.
        path: The path, without turns.
        box: Half widths, shape (3,), above 0 [m/s^2].
        stations: As of `plan_along_path`.

    Raises:
        PlanningError: The path turns, the box is not accepted, or the winches cannot do it at any
            speed.
    """
    box = np.asarray(box, float)
    if box.shape != (3,) or not np.all(box > 0.0):
        raise PlanningError("accelerations: accepted: three half widths above 0 [m/s^2]")
    looks = path.points(np.linspace(0.0, path.length, 50))
    if np.max(np.abs(looks[:, [7, 8, 9, 13, 14, 15]])) > STILL:
        raise PlanningError(
            "accelerations: found a path that turns; accepted: one without turns, as other "
            "inertial terms are not within the box"
        )
    lim = task.limits
    limits = MotionLimits(lower=0.0, upper=2.0, speed=min(lim.speed, lim.cable_speed))
    within = BoxTask(task.cables, task.dynamics, limits, task.names, box=box)
    found = plan_along_path(within, path, stations)
    times = _with_bounds(found.trajectory)
    over = max(float(np.max(times[0] / box)), (times[1] / limits.speed) ** 2, 1.0)
    slowed = np.sqrt(over)
    motion = _slower(found.trajectory, over)
    for _ in range(MOST_SLOWER):
        plan = PathPlan(task, path, motion, found.reachable / over, found.largest / over)
        if not (np.isfinite(lim.torque) or np.isfinite(lim.cable_acceleration)):
            break
        most = float(np.max(plan.samples().uses))
        if most <= 1.0 + ROUNDING:
            break
        motion, over, slowed = _slower(motion, most**2), over * most**2, slowed * most
    else:
        raise PlanningError(
            f"path: the winches' limits are missed, by {most - 1.0:.3g} of them, at any speed; "
            "accepted: a path along which the motors hold the platform"
        )
    bounds = _with_bounds(motion)
    return BoxTiming(plan, bounds[0], bounds[1], float(slowed))


def _slower(motion: TimedPath, over: float) -> TimedPath:
    """A motion with its squared speeds divided by that."""
    assert motion.path is not None
    return TimedPath.make(
        motion.path, motion.stations, motion.squared_speeds / over, motion.start_time
    )


def _with_bounds(motion: TimedPath) -> tuple[Array, float]:
    """Bounds of acceleration, shape (3,) [m/s^2], and speed of Po [m/s], over all stretches."""
    rows, ways = motion.stretches(), np.diff(motion.stations)
    x = motion.squared_speeds
    most, fastest = np.zeros(3), 0.0
    for row, way, first, last in zip(rows, ways, x[:-1], x[1:], strict=True):
        c = row[4:].reshape(DEGREE + 1, POSE_NUMBERS)[:, 4:] * way ** np.arange(DEGREE + 1)[:, None]
        slope = np.arange(1, 6)[:, None] * c[1:] / way
        bend = np.arange(1, 5)[:, None] * slope[1:] / way
        bent = np.zeros((5, 3))  # bend times x, which goes from first to last
        bent[:4] += first * bend
        bent[1:] += (last - first) * bend
        # d2s/dt2 is constant; control points of its product and of the bend in degree 4
        points = control_points(slope * row[3] + bent)
        most = np.maximum(most, np.max(np.abs(points), axis=0))
        speeds = np.linalg.norm(control_points(slope), axis=1)
        fastest = max(fastest, float(np.max(speeds)) * np.sqrt(max(first, last)))
    return most, float(fastest)
