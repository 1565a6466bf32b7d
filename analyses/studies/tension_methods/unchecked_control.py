"""Control by tensions as the Gazebo thesis runs it: what a method computes is applied unchecked."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.control.computed_torque import TaskGains
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.tension_control import TensionControl, build_tension_control
from cdpr_drake.systems.tension_control.tension_distributor import TensionDistributor
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

BALANCE = 1e-6
"""Tensions balance the wrench if they miss it by at most this, relative to the cables' forces."""


class UncheckedDistributor(TensionDistributor):
    """A `TensionDistributor` that puts out what its method computes, outside the bounds too.

    Its ports are those of `TensionDistributor`; `failures` counts the control steps whose tensions
    left the bounds all the same. An exact method has no answer where there is none within the
    bounds, and what does not balance the wrench is none either: then the last tensions are held.
    """

    def _update(self, context: Context, state: DiscreteValues) -> None:
        super()._update(context, state)
        met = state.get_value(self._feasible)[0] == 1.0
        if met or METHODS[self._method].exact or not np.all(np.isfinite(self._t)):
            return
        missing = self._W @ self._t - self._wrench(context)[self._rows]
        if np.linalg.norm(missing) <= BALANCE * np.linalg.norm(np.abs(self._W) @ np.abs(self._t)):
            state.get_mutable_value(self._tensions)[:] = self._t


def build_unchecked_control(
    robot: Robot,
    trajectory: PoseTrajectory,
    gains: TaskGains,
    method: str,
    limits: tuple[float, float] | None = None,
    rate: float = 1000.0,
    push: bool = True,
) -> TensionControl:
    """As `build_tension_control`, but tensions out of bounds are applied.

    Args:
        robot: The robot.
        trajectory: The desired motion of the platform.
        gains: Kp and Kd.
        method: A name of `tensions.METHODS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        rate: Control steps per second [Hz].
        push: Whether a negative tension pushes; otherwise it acts as zero, as in a real cable.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.

    Source: Gazebo thesis 6.4; its published simulator, github.com/oKermorgant/cdpr, folder cdpr3,
    puts the tensions on prismatic joints as they are.
    """
    return build_tension_control(
        robot,
        trajectory,
        gains,
        method,
        limits,
        rate,
        distributor=UncheckedDistributor,
        push=push,
    )
