"""The law of time of a path within a box of accelerations, kept at every instant.

Where the cables can give every acceleration within a box, and the platform does not turn, tensions
need not be asked: the motion keeps their limits if it keeps the box. The passes of `path_timing`
find it at stations, with the components of the acceleration in the place of tensions. Between
stations the acceleration X' u + X'' x is a polynomial of s; the control points of its Bernstein
form bound it, and the speed, exactly. If they are above, the whole motion is slowed down to them.

Where the platform turns, the box is one of accelerations of its centre of mass and of moments about
it, I alpha + w x I w in P, so that gyroscopic terms are in it (`inertial_wrenches`); both are
linear in (u, x), too, and `turning_bounds` bounds them between stations.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.planning.station_kernel import BASIS, T_0, T_U, T_X
from cdpr_drake.proofs.set_curve import control_points
from cdpr_drake.proofs.turning_bounds import turning_bounds
from cdpr_drake.trajectories.pose_path import DEGREE, POSE_NUMBERS, PosePath
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.inertial_wrenches import inertia_about_mass_centre

STILL = 1e-12
"""A platform that turns by no more than this per metre does not turn [rad/m]."""

ROUNDING = 1e-9
"""Limits that are missed by less, relative to them, are kept."""

MOST_SLOWER = 20
"""Times that a motion is slowed down until samples keep the limits of winches, and of tensions
against damping."""

LEAST_SLOWER = 1.1
"""Factor by which a damped platform is slowed down at least each time: most of what its tensions
use of their limits is not due to speed."""


@dataclass(frozen=True, eq=False)
class BoxTask(PathTask):
    """A platform that may accelerate within a box, in the place of a robot with tensions.

    Attributes:
        box: Half widths, shape (3,); infinite: no limit [m/s^2].
        moments: Half widths of moments about Co in P, shape (3,); None: it does not turn [N m].
        shares: Of the one speed limit, that of Po and that of anchor points, at most 1 [-].
    """

    box: Array = field(default_factory=lambda: np.full(3, np.inf))
    moments: Array | None = None
    shares: tuple[float, float] = (1.0, 1.0)

    def stations(self, points: Array, x: Array | None = None) -> tuple[Array, Array]:
        """As `PathTask.stations`, with 1 + (a component over its limit) for a tension, 0 to 2;
        there is no damping, whatever x."""
        if self.moments is not None:
            return self._turning(points)
        out, slopes = np.zeros((len(points), BASIS, 3)), points[:, 10:13]
        out[:, T_0] = 1.0
        out[:, T_U], out[:, T_X] = slopes / self.box, points[:, 16:19] / self.box
        return out, np.linalg.norm(slopes, axis=1)

    def _turning(self, points: Array) -> tuple[Array, Array]:
        """Accelerations of Co, then moments, over their limits; the faster of Po and anchors."""
        assert self.moments is not None
        limits = np.concatenate([self.box, self.moments])
        slopes, bends = inertial_terms(points, *mass_of(self))
        felt = _felt(self)
        out = np.zeros((len(points), BASIS, 6))
        out[:, T_0] = 1.0
        out[:, T_U], out[:, T_X] = felt * slopes / limits, felt * bends / limits
        r = _rotations(points) @ self.cables.p_PB
        moved = points[:, 10:13, np.newaxis] + np.cross(points[:, 7:10, np.newaxis], r, axis=1)
        own, fastest = (
            np.linalg.norm(points[:, 10:13], axis=1),
            np.max(np.linalg.norm(moved, axis=1), axis=1),
        )
        return out, np.maximum(own * self.shares[0], fastest * self.shares[1])


def mass_of(task: PathTask) -> tuple[Array, Array]:
    """Centre of mass in P, shape (3,) [m], and inertia about it in P, shape (3, 3) [kg m^2]."""
    M = task.dynamics.M_PPo_P
    c = np.asarray(M.get_com(), float)
    about_Po = M.CalcRotationalInertia().CopyToFullMatrix3()
    return c, inertia_about_mass_centre(M.get_mass(), c, about_Po)


def mass_centres(task: PathTask, points: Array) -> Array:
    """p_WCo at points of a path, shape (n, 3) [m]."""
    return np.asarray(points[:, 4:7] + _rotations(points) @ mass_of(task)[0], float)


def inertial_terms(points: Array, p_PCo: Array, I_PCo: Array) -> tuple[Array, Array]:
    """Accelerations of Co in W and moments about it in P, linear in u and in x.

    Args:
        points: Points of a path, shape (n, 19), or of a motion with velocities for X' and
            accelerations for X''.
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PCo: Inertia about it in P, shape (3, 3) [kg m^2].

    Returns:
        What is multiplied by u, and by x, shape (n, 6) each: acceleration, then moment.
    """
    R = _rotations(points)
    w, v, alpha, a = (points[:, k : k + 3] for k in (7, 10, 13, 16))
    c = R @ p_PCo
    w_P, alpha_P = (np.einsum("nji,nj->ni", R, one) for one in (w, alpha))
    slopes = np.hstack([v + np.cross(w, c), w_P @ I_PCo.T])
    bends = np.hstack(
        [
            a + np.cross(alpha, c) + np.cross(w, np.cross(w, c)),
            alpha_P @ I_PCo.T + np.cross(w_P, w_P @ I_PCo.T),
        ]
    )
    return slopes, bends


def _rotations(points: Array) -> Array:
    """R_WP of points of a path, shape (n, 3, 3)."""
    return np.asarray(Rotation.from_quat(points[:, [1, 2, 3, 0]]).as_matrix(), float)


def _felt(task: PathTask) -> Array:
    """1 for components, accelerations and then moments, that the platform can feel, else 0."""
    felt = np.zeros(6)
    felt[list(task.dynamics.motions)] = 1.0
    return np.roll(felt, 3)


@dataclass(frozen=True, eq=False)
class BoxTiming:
    """A motion within a box of accelerations.

    Attributes:
        plan: The motion, of the robot.
        accelerations: Bound of each component at any instant, of Po, or where the platform turns
            of its centre of mass, shape (3,) [m/s^2].
        speed: Bound of the speed of Po at any instant [m/s].
        slowed: By which factor the whole motion takes longer than stations alone ask.
        moments: Bound of each component of the moment about Co in P at any instant, shape (3,);
            None: the platform does not turn [N m].
    """

    plan: PathPlan
    accelerations: Array
    speed: float
    slowed: float
    moments: Array | None = None


def time_within_box(
    task: PathTask, path: PosePath, box: Array, stations: int = STATIONS,
    moments: Array | None = None,
) -> BoxTiming:  # fmt: skip
    """The fastest motion from rest to rest whose acceleration stays in a box at every instant.

    The speed of Po is kept below its limit and below the largest cable speed, which no cable then
    exceeds, as the platform does not turn; where it turns, those of the anchor points are.
    Accelerations of cables and torques of motors are limits of samples, and so are tensions where
    the platform is damped, as the box holds no damping: where they are missed, the motion is slowed
    down.

    Args:
        task: The robot and its limits.
        path: The path.
        box: Half widths, shape (3,), above 0 [m/s^2].
        stations: As of `plan_along_path`.
        moments: Half widths of moments about Co in P, shape (3,), above 0, see
            `inertial_wrenches.moment_box`; the box is then one of accelerations of Co. None: the
            path has no turns [N m].

    Raises:
        PlanningError: The path turns, the box is not accepted, or the winches cannot do it at any
            speed.
    """
    box = np.asarray(box, float)
    if box.shape != (3,) or not np.all(box > 0.0):
        raise PlanningError("accelerations: accepted: three half widths above 0 [m/s^2]")
    if moments is None:
        looks = path.points(np.linspace(0.0, path.length, 50))
        if np.max(np.abs(looks[:, [7, 8, 9, 13, 14, 15]])) > STILL:
            raise PlanningError(
                "accelerations: found a path that turns; accepted: one without turns, as other "
                "inertial terms are not within the box"
            )
    elif np.shape(moments) != (3,) or not np.all(np.asarray(moments) > 0.0):
        raise PlanningError("moments: accepted: three half widths above 0 [N m]")
    lim = task.limits
    limits = MotionLimits(lower=0.0, upper=2.0, speed=min(lim.speed, lim.cable_speed))
    within = BoxTask(
        task.cables, replace(task.dynamics, damping=(0.0, 0.0)), limits, task.names, box=box,
        moments=moments, shares=_shares(limits.speed, lim.speed, lim.cable_speed),
    )  # fmt: skip
    found = plan_along_path(within, path, stations)
    over = _over(within, found.trajectory)
    slowed = np.sqrt(over)
    motion = _slower(found.trajectory, over)
    for _ in range(MOST_SLOWER):
        plan = PathPlan(task, path, motion, found.reachable / over, found.largest / over)
        if not (
            np.isfinite(lim.torque)
            or np.isfinite(lim.cable_acceleration)
            or task.dynamics.is_damped
        ):
            break
        most = float(np.max(plan.samples().uses))
        if most <= 1.0 + ROUNDING:
            break
        by = max(most, LEAST_SLOWER) if task.dynamics.is_damped else most
        motion, over, slowed = _slower(motion, by**2), over * by**2, slowed * by
    else:
        raise PlanningError(
            f"path: limits of cables and winches are missed, by {most - 1.0:.3g} of them, at any "
            "speed; accepted: a path along which the motors hold the platform"
        )
    if moments is None:
        bounds = _with_bounds(motion)
        return BoxTiming(plan, bounds[0], bounds[1], float(slowed))
    whole = turning_bounds(motion, *mass_of(task), task.cables.p_PB)
    felt = _felt(task)
    return BoxTiming(
        plan, felt[:3] * whole.accelerations, whole.speed, float(slowed), felt[3:] * whole.moments
    )


def _shares(least: float, speed: float, cable_speed: float) -> tuple[float, float]:
    """Of the least of two speeds, what it is of each; of no limit at all nothing is asked."""
    if not np.isfinite(least):
        return 1.0, 1.0
    return least / speed, least / cable_speed


def _over(within: BoxTask, motion: TimedPath) -> float:
    """By which factor squared speeds are too large for the box at any instant, at least 1."""
    if within.moments is None:
        times = _with_bounds(motion)
        return max(float(np.max(times[0] / within.box)), (times[1] / within.limits.speed) ** 2, 1.0)
    found = turning_bounds(motion, *mass_of(within), within.cables.p_PB)
    felt = _felt(within)
    uses = felt * np.concatenate([found.accelerations, found.moments])
    most = float(np.max(uses / np.concatenate([within.box, within.moments])))
    fastest = max(found.speed * within.shares[0], found.anchor_speed * within.shares[1])
    return max(most, (fastest / within.limits.speed) ** 2, 1.0)


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
