"""A plan on the simulated robot: does it keep the limits when feedback tracks it?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop
from cdpr_drake.systems.robots.compiled_step import StepRule

RATE = 1000.0  # steps of control and rows of the log per second [Hz]
MOMENT = 1e-9  # instants that are nearer are one [s]

GAINS = TaskGains(stiffness=100.0, damping=20.0)
"""Of the computed torque, as of the scenarios that come with the package."""

REST = 0.2  # how long the robot is looked at after the end of its motion [s]
METHOD = "quadratic_program"  # tension distribution: exact, for any redundancy
ROUNDING = 1e-9  # a limit that is missed by less, relative to it, is kept


@dataclass(frozen=True, eq=False, repr=False)
class TrackedPlan(Result):
    """What the simulated robot did.

    Attributes:
        limits: Limits of the robot, without reserve.
        log: As of `TensionLoop.read_log`, one row a control step.
        cable_speeds: From step to step, shape (n - 1, m) [m/s].
        cable_accelerations: At the steps between, shape (n - 2, m) [m/s^2].
        torques: Of the motors, friction aside, shape (n - 2, m) [N m]; NaN without their inertia.
    """

    limits: MotionLimits
    log: dict[str, Array]
    cable_speeds: Array
    cable_accelerations: Array
    torques: Array

    def tables(self) -> list[Table]:
        """Shares of limits."""
        rows = [(name, f"{share:.4f}") for name, share in self.uses().items()]
        headings = ("limit of the robot", "largest share used")
        return [Table("The simulated robot tracks it", headings, rows)]

    def lines(self) -> list[str]:
        """Whether limits were kept, and how exactly."""
        distance, angle = self.errors()
        verdict = "all limits kept" if self.keeps_limits() else "LIMITS MISSED; more reserve"
        return [
            f"{verdict}; steps without tensions: {self.missed_steps()}; error up to "
            f"{1e3 * distance:.3f} mm, {np.degrees(angle):.4f} deg"
        ]

    def missed_steps(self) -> int:
        """Control steps at which no tensions within the limits gave the wrench."""
        return int(self.log["failures"][-1, 0])

    def uses(self) -> dict[str, float]:
        """Largest share of each limit that was used, by its name; above 1: it was missed."""
        t, lim = self.log["tensions"][1:], self.limits
        middle, half = 0.5 * (lim.upper + lim.lower), 0.5 * (lim.upper - lim.lower)
        shares = {
            "tension": float(np.max(np.abs(t - middle)) / half),
            "cable speed": float(np.max(np.abs(self.cable_speeds)) / lim.cable_speed),
        }
        if np.isfinite(lim.cable_acceleration):
            most = float(np.max(np.abs(self.cable_accelerations)))
            shares["cable acceleration"] = most / lim.cable_acceleration
        if np.isfinite(lim.torque):
            shares["torque"] = float(np.max(np.abs(self.torques)) / lim.torque)
        if np.isfinite(lim.speed):
            steps = np.linalg.norm(np.diff(self.log["X_WP"][:, 4:], axis=0), axis=1)
            shares["speed of Po"] = float(np.max(steps)) * RATE / lim.speed
        return shares

    def keeps_limits(self) -> bool:
        """Whether no limit was missed, and tensions were found at every step."""
        return self.missed_steps() == 0 and max(self.uses().values()) <= 1.0 + ROUNDING

    def errors(self) -> tuple[float, float]:
        """Largest distance [m] and angle [rad] of the platform from the plan."""
        distance, angle = pose_rows_distance(self.log["X_WP"], self.log["X_WP_desired"])
        return float(np.max(distance)), float(np.max(angle))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        distance, angle = self.errors()
        return {
            "rate_hz": RATE,
            "keeps_limits": self.keeps_limits(),
            "steps_without_tensions": self.missed_steps(),
            "largest_share_of_limits": self.uses(),
            "largest_position_error_m": distance,
            "largest_rotation_error_rad": angle,
        }


def track_plan(
    robot: Robot, plan: PathPlan | FreePathSolution, limits: MotionLimits,
    on_progress: Callable[[float], None] = lambda time: None,
) -> TrackedPlan:  # fmt: skip
    """Simulates computed torque along a plan, by the compiled loop of dynamic control.

    Cables are those of the plan, massless and inextensible, with tensions as commanded; tensions
    are constant for a step of control.

    Args:
        robot: The robot.
        plan: The plan, from time 0 on: along a path, or of a free one.
        limits: Limits of the robot, without reserve; the tensions are distributed within them.
        on_progress: Called now and then with the simulated time [s].

    Raises:
        PlanningError: The program of a free path found no motion.
        CableGeometryError: A cable cannot run.
        DivergedError: Numbers are not finite any more.
    """
    motion = plan.motion() if isinstance(plan, FreePathSolution) else plan.trajectory
    settings = TensionControlSettings(
        trajectory=motion, gains=GAINS, method=METHOD, limits=(limits.lower, limits.upper),
        rate=RATE, cables=plan.task.cables,
        rule=StepRule(method="runge_kutta3", max_step=1.0 / RATE),
    )  # fmt: skip
    loop = TensionLoop(build_tension_control(robot, settings), RATE)
    end = motion.end_time + REST
    while loop.time < end:
        loop.advance_to(min(loop.time + 1.0, end))
        on_progress(loop.time)
    log = loop.read_log()
    speeds = np.diff(log["lengths"], axis=0) * RATE
    # Accelerations are constant for a step; these are means of two steps.
    accelerations = np.diff(speeds, axis=0) * RATE
    between = 0.5 * (log["tensions"][1:-1] + log["tensions"][2:])
    torques = np.full(accelerations.shape, np.nan)
    if limits.inertia > 0.0 or np.isfinite(limits.torque):
        torques = limits.inertia / limits.ratio * accelerations - limits.ratio * between
    return TrackedPlan(limits, log, speeds, accelerations, torques)
