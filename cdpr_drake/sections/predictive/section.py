"""Section `predictive` of dynamic control, and its block: a program over the time ahead."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Annotated, Any

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import WRENCH
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_from_state
from cdpr_drake.models.robot_schema import CameraMount, Robot
from cdpr_drake.planning.horizon import Horizon, View
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.schema.declarations import In, Refusal, Scope, Text, settings
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.sections import Section
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


@settings
class PredictiveSettings(Section):
    """Predictive control in the place of computed torque, at the rate of `controller`.

    Its program takes a millisecond or more: rates of 50 to 200 Hz are usual.
    """

    words = "Tensions by a program over the time ahead, in the place of computed torque"
    report = "cdpr_drake.sections.predictive.report:SUBJECTS"

    steps: Annotated[int, In(ge=2, le=100), "Steps of control that it looks ahead."] = 10
    mount: Annotated[
        Text | None,
        "Mounting on the platform of the camera that keeps `points` in view; null: none.",
    ] = None
    points: Annotated[np.ndarray | None, In("m", None, 3), "Points in W that stay in view."] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What sees nothing, and what it does not go with."""
        scenario = scope.whole
        if (self.mount is None) != (self.points is None):
            yield "mount" if self.mount is None else "points", "null", "both, or neither"
        elif self.mount is not None and self.mount not in (known := _mounts(scope.robot)):
            names = ", ".join(known) or "null, as there is none"
            yield "mount", repr(self.mount), f"{names}, on the platform of {scope.robot.name}"
        if scenario.perturbations.believed_robot is not None:
            yield "/perturbations.believed_robot", "beside predictive", "one of both"
        if scenario.controller.balance != WRENCH:
            found = f"{scenario.controller.balance} beside predictive"
            yield "/controller.balance", found, WRENCH

    def tension_blocks(self, settings: Any, robot: Robot) -> Mapping[str, Any]:
        """Makes a `PredictiveDistributor`."""
        view = None
        if self.mount is not None and self.points is not None:
            mount = _mounts(robot)[self.mount]
            slopes = load_camera(mount.model).view_slopes()
            view = View(mount.pose.transform(), slopes, self.points.T)
        return {
            "distributor": partial(
                PredictiveDistributor, trajectory=settings.trajectory, steps=self.steps, view=view,
                dynamics=settings.dynamics,
            )
        }  # fmt: skip


def _mounts(robot: Robot) -> dict[str, CameraMount]:
    """Mountings of cameras on the platform, by name."""
    return {mount.name: mount for mount in robot.cameras if mount.parent == "platform"}


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
        trajectory: PoseTrajectory,
        steps: int,
        view: View | None = None,
        dynamics: PlatformDynamics | None = None,
        balance: str = WRENCH,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant.
            method: As that of `TensionDistributor`.
            limits: Smallest and largest tension [N]; None: the robot's.
            rate: Updates per second [Hz].
            reference: As that of `TensionDistributor`.
            cables: What it believes of the cables.
            trajectory: The desired motion.
            steps: Steps ahead, of a period of control each.
            view: What a camera shall keep in view; None: nothing.
            dynamics: What is believed of the platform; None: as its file has it.
            balance: What tensions balance: the wrench.

        Raises:
            TensionProblemError: As `TensionDistributor`.
            PlanningError: The number of steps or the balance is not accepted.
        """
        if balance != WRENCH:
            raise PlanningError(f"balance: found {balance}; accepted by predictive: {WRENCH}")
        super().__init__(in_plant, method, limits, rate, reference, cables)
        robot = self._robot = in_plant.robot
        low, high = robot.tension_limits(limits)
        speed = robot.winch.rated_cable_speed()
        limits_ahead = MotionLimits(lower=low, upper=high, cable_speed=speed)
        task = PathTask(cables, dynamics or platform_dynamics(robot), limits_ahead)
        self._horizon = Horizon(task, trajectory, steps, 1.0 / rate, view)

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
