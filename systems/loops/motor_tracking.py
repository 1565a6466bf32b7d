"""Dynamic control of a robot with motors and elastic cables, without a diagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.control.task_space import TaskGains, tracking_wrench_at
from cdpr_drake.control.tension_controller_kernel import winch_torque
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.loops.robot_motion import DRUM_TENSIONS, LENGTHS, TENSIONS, RobotMotion
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.tensions.control_step_kernel import update_tensions_at
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, PoseTrajectory


@dataclass(frozen=True, kw_only=True)
class TrackingSettings:
    """How a robot follows a motion by motor torques.

    Attributes:
        gains: Of computed torque.
        torque: The tension loop of every winch, and how tensions are distributed.
        simulated: Cables and winches as they truly are; winches with motors by torque.
        rule: How the robot is integrated.
    """

    gains: TaskGains
    torque: TorqueControl
    simulated: CableRobotSettings
    rule: StepRule


class MotorTracking:
    """A robot that follows a trajectory: wrench, tensions, and torques by a loop for each winch.

    Computed torque and distribution are those of `build_tension_control`, for the robot that is
    believed in; each winch is told the speed that the desired motion gives its cable, and closes
    the rest by its measured tension, with the friction that is believed compensated. Poses, twists
    and tensions are read without noise.

    Source: Gazebo thesis 6.1; servoing thesis 5.2.3.
    """

    def __init__(
        self,
        robot: Robot,
        believed: Robot,
        trajectory: PoseTrajectory,
        settings: TrackingSettings,
    ) -> None:
        """At rest where the trajectory begins.

        Args:
            robot: The robot as it is.
            believed: As its controller believes it to be.
            trajectory: The desired motion.
            settings: Controller and simulation.

        Raises:
            RobotFileError: A file does not say enough of the motors.
            TensionProblemError: Method or limits do not fit the robot.
            CableGeometryError: A cable cannot run.
        """
        torque = settings.torque
        limits = None if torque.limits is None else tuple(float(t) for t in torque.limits)
        low, high = robot.tension_limits(limits)  # type: ignore[arg-type]
        cables = settings.simulated.cables.cable_set(believed)
        control = build_tension_control(
            believed,
            TensionControlSettings(
                trajectory=trajectory, gains=settings.gains, method=torque.method,
                limits=(low + torque.margin, high - torque.margin), rate=torque.rate,
                cables=cables, dynamics=platform_dynamics(believed), rule=StepRule(),
            ),
        )  # fmt: skip
        self._control, self._trajectory = control, trajectory
        blocks = control.blocks
        self._law, self._step = blocks.controller.packed(), blocks.distributor.packed()
        winch = believed.winch_law()
        radius = float(np.mean(winch.drum.radii(cables.count)))
        self._loop = torque.tension_controller(radius, winch.friction, low).packed()
        self._packed, self._period = cables.packed(), 1.0 / torque.rate
        self._motion = RobotMotion(robot, settings.simulated, settings.rule)
        self._motion.begin(self._motion.resting(trajectory.pose(0.0)))
        m = cables.count
        self._wrench, self._tensions = np.zeros(6), np.full(m, low)
        self._verdict, self._gathered = np.zeros(1), np.zeros(m)
        self._steps, self.failures = 0, 0

    @property
    def time(self) -> float:
        """Time that is reached [s]."""
        return self._steps * self._period

    def run(
        self,
        duration: float,
        log_rate: float,
        tell: Callable[[float], bool] = lambda time: True,
    ) -> dict[str, Array]:
        """Goes on for some time and gives its log.

        Args:
            duration: How long [s].
            log_rate: Rows per second; a whole number of control steps lies between two [Hz].
            tell: Told the time ten times a second; False ends the run.

        Returns:
            "time" and, by name, shape (n, size): "X_WP", "X_WP_desired" as `pose_row`,
            "desired_wrench", "tensions" and "measured_tensions" at the drums, "lengths",
            "unstrained_lengths", "applied_torques", "friction_torques".

        Raises:
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        every = max(round(1.0 / (log_rate * self._period)), 1)
        often = max(round(0.1 / self._period), 1)
        rows: dict[str, list[Array]] = {}
        end = self._steps + round(duration / self._period)
        while self._steps < end:
            self._decide()
            if self._steps % every == 0:
                for name, value in self._row().items():
                    rows.setdefault(name, []).append(value)
            if self._steps % often == 0 and not tell(self.time):
                break
            self._steps += 1
            self._motion.advance(self.time)
        log = {name: np.array(values) for name, values in rows.items()}
        log["time"] = log["time"][:, 0]
        return log

    def _decide(self) -> None:
        """One step of control: torques for the time until the next one."""
        motion, time = self._motion, self.time
        state = np.ascontiguousarray(motion.platform_state())
        tracking_wrench_at(self._law.table, time, state, self._wrench)
        code = update_tensions_at(
            self._step.table, state, self._wrench, self._tensions, self._verdict
        )
        self.failures += code != FEASIBLE
        row = self._trajectory.motion(time)
        wanted = np.empty((2, len(self._tensions)))
        cable_motions(row[: MOTION_SIZE - 6], self._packed, 0.0, wanted)
        measured, speeds = motion.cables()[DRUM_TENSIONS], motion.length_rates()
        torques = np.empty(len(self._tensions))
        for i in range(len(torques)):
            torques[i], self._gathered[i] = winch_torque(
                self._tensions[i], measured[i], speeds[i], wanted[1, i], False,
                self._gathered[i], self._period, self._loop,
            )  # fmt: skip
        motion.command(torques)

    def _row(self) -> dict[str, Array]:
        motion = self._motion
        table, torques = motion.cables(), motion.torques()
        return {
            "time": np.array([self.time]),
            "X_WP": pose_row(motion.pose()),
            "X_WP_desired": pose_row(self._trajectory.pose(self.time)),
            "desired_wrench": self._wrench.copy(),
            "tensions": table[TENSIONS].copy(),
            "measured_tensions": table[DRUM_TENSIONS].copy(),
            "lengths": table[LENGTHS].copy(),
            "unstrained_lengths": motion.unstrained_lengths().copy(),
            "applied_torques": torques[0].copy(),
            "friction_torques": torques[1].copy(),
        }
