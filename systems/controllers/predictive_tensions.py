"""Predictive control of the platform: tensions by a program over the time ahead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import WRENCH
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_from_state
from cdpr_drake.planning.horizon import Horizon, View
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


@dataclass(frozen=True)
class PredictiveTensions:
    """Makes a `PredictiveDistributor`, in the place of a `TensionDistributor`.

    Attributes:
        trajectory: The desired motion.
        steps: Steps ahead, of a period of control each.
        view: What the camera shall keep in view; None: nothing.
        dynamics: What is believed of the platform; None: as its file has it.
    """

    trajectory: PoseTrajectory
    steps: int
    view: View | None = None
    dynamics: PlatformDynamics | None = None

    def __call__(
        self,
        in_plant: RobotInPlant,
        method: str,
        limits: tuple[float, float] | None,
        rate: float,
        reference: Array | None,
        cables: CableSet,
        *,
        balance: str = WRENCH,
    ) -> PredictiveDistributor:
        """The block; arguments as those of `TensionDistributor`.

        Raises:
            PlanningError: It shall balance forces alone.
        """
        if balance != WRENCH:
            raise PlanningError(f"balance: found {balance}; accepted by predictive: {WRENCH}")
        return PredictiveDistributor(in_plant, method, limits, rate, reference, cables, ahead=self)


class PredictiveDistributor(TensionDistributor):
    """Finds tensions by a quadratic program over a horizon, see `planning.horizon.Horizon`.

    Ports are those of `TensionDistributor`, so that the two are exchanged for each other. The
    desired wrench is what it distributes, by the method, where its program is not solved; that
    counts as a request that was not met.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        method: str,
        limits: tuple[float, float] | None,
        rate: float,
        reference: Array | None,
        cables: CableSet,
        *,
        ahead: PredictiveTensions,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant.
            method: As that of `TensionDistributor`.
            limits: Smallest and largest tension [N]; None: the robot's.
            rate: Updates per second [Hz].
            reference: As that of `TensionDistributor`.
            cables: What it believes of the cables.
            ahead: How far it looks, along which motion.

        Raises:
            TensionProblemError: As `TensionDistributor`.
            PlanningError: The number of steps is not accepted.
        """
        super().__init__(in_plant, method, limits, rate, reference, cables)
        robot = self._robot = in_plant.robot
        low, high = robot.tension_limits(limits)
        speed = robot.winch.rated_cable_speed()
        limits_ahead = MotionLimits(lower=low, upper=high, cable_speed=speed)
        task = PathTask(cables, ahead.dynamics or platform_dynamics(robot), limits_ahead)
        self._horizon = Horizon(task, ahead.trajectory, ahead.steps, 1.0 / rate, ahead.view)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        platform = self._state(context)
        X_WP = pose_from_state(self._robot, platform)
        V_WP = np.zeros(6)
        if self._robot.is_planar():
            V_WP[[3, 4, 2]] = platform[3:6]
        else:
            V_WP[:] = platform[7:13]
        found = self._horizon.tensions(context.get_time(), X_WP, V_WP)
        if found is None:
            super()._update(context, state)
            state.get_mutable_value(self._feasible)[0] = 0.0
            state.get_mutable_value(self._failures)[0] += 1.0
            return
        state.get_mutable_value(self._tensions)[:] = found
        state.get_mutable_value(self._feasible)[0] = 1.0
