"""Places in dynamic control by cable tensions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import WRENCH
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    floating_wrench,
    planar_wrench,
)
from cdpr_drake.errors import ClientEndedError
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_from_state
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.sections.remote.place import (
    CONTROLLER,
    DISTRIBUTOR,
    TRAJECTORY,
    Read,
    Remote,
    tension_ports,
)
from cdpr_drake.systems.controllers.computed_torque import PoseTracking
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, PoseTrajectory, write_motion

LEAST_NORM = 1e-6
"""Of a quaternion that is scaled to norm 1, and the inverse of the largest one."""


class _View:
    """What a process can see that follows from the platform's state and the time."""

    def __init__(self, robot: Robot, trajectory: PoseTrajectory) -> None:
        self._robot, self._stretches = robot, trajectory.stretches()

    def motion(self, time: float) -> Array:
        """Desired motion of the scenario at a time [s], shape (19,)."""
        motion = np.empty(MOTION_SIZE)
        write_motion(time, self._stretches, motion)
        return motion

    def see(self, state: Array, name: str, time: float) -> Array:
        """What stands at platform_state, X_WP or desired_motion."""
        if name == "platform_state":
            return state
        if name == "X_WP":
            return pose_row(pose_from_state(self._robot, state))
        return self.motion(time)


def _holding(robot: Robot) -> Array:
    """F_P_W that holds the platform at home, shape (6,) [N m, N]."""
    X_WP = robot.home.transform()
    return -gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), robot.gravity)


class RemoteTracking(PoseTracking):
    """A `PoseTracking` whose wrench, or whose desired motion, comes from a process outside.

    Ports are those of `PoseTracking`, and these:

    ============== ============== ===== ========================================================
    port           type           unit  meaning
    ============== ============== ===== ========================================================
    tensions       vector(m)      N     in, as commanded until now
    lengths        vector(m)      m     in, of the cables
    desired_motion vector(19)     any   out, pose, velocity and acceleration asked for
    ============== ============== ===== ========================================================

    The wrench follows its inputs at once, so the process is asked whenever a wrench is needed: at
    each step of the distributor, and for each row of a log that is none.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        trajectory: PoseTrajectory,
        gains: TaskGains,
        dynamics: PlatformDynamics | None = None,
        *,
        place: str,
        balance: str = WRENCH,
    ) -> None:
        """Arguments as of `PoseTracking`; place is CONTROLLER or TRAJECTORY."""
        super().__init__(in_plant, trajectory, gains, dynamics, balance=balance)
        robot = in_plant.robot
        self._dynamics, self._gains = self.dynamics.packed(), gains.packed()
        self._height, self.view = robot.plane_height, _View(robot, trajectory)
        inputs, outputs = tension_ports(place, robot)
        resting = {
            CONTROLLER: {"desired_wrench": _holding(robot)},
            TRAJECTORY: {"desired_motion": self.view.motion(0.0)},
        }
        self.outside = Remote(place, inputs, outputs, resting[place])
        self._by_motion = place == TRAJECTORY
        for name in ("tensions", "lengths"):
            self.DeclareVectorInputPort(name, len(robot.cables))
        state = self.GetInputPort("platform_state").get_index()
        needs = {self.time_ticket(), self.input_port_ticket(state)}
        self.DeclareVectorOutputPort("desired_motion", MOTION_SIZE, self._calc_motion, needs)

    def logged(self) -> tuple[str, ...]:
        """As of `PoseTracking`, and the desired motion where that is commanded."""
        return (*super().logged(), *(["desired_motion"] if self._by_motion else []))

    def given_motion(self, time: float, read: Read) -> Array:
        """Desired motion at a time [s], shape (19,); `read` says what stands at outputs.

        Raises:
            ClientEndedError: Its quaternion is none, or nobody is there.
        """
        if not self._by_motion:
            return self.view.motion(time)
        motion = np.asarray(self.outside.ask(time, read)["desired_motion"])
        norm = math.hypot(*motion[:4])
        if not LEAST_NORM <= norm <= 1.0 / LEAST_NORM:
            raise ClientEndedError(
                "the client's message was not accepted: desired_motion: found a quaternion of norm "
                f"{norm:g}; accepted: a pose, of norm {LEAST_NORM:g} to {1.0 / LEAST_NORM:g}"
            )
        return motion

    def write_wrench(
        self, time: float, state: Array, motion: Array, read: Read, out: Array
    ) -> None:
        """Writes F_P_W that is asked for, shape (6,) [N m, N].

        Args:
            time: Time [s].
            state: State of the platform.
            motion: As `given_motion` says.
            read: What stands at outputs.
            out: Gets the wrench.
        """
        if not self._by_motion:
            out[:] = self.outside.ask(time, read)["desired_wrench"]
        elif self._height is None:
            floating_wrench(state, motion, self._dynamics, self._gains, out)
        else:
            planar_wrench(state, motion, self._dynamics, self._gains, self._height, out)

    def _reader(self, context: Context) -> Callable[[str], Array]:
        def read(name: str) -> Array:
            if name in ("tensions", "lengths"):
                return self.GetInputPort(name).Eval(context)
            return self.view.see(self._state(context), name, context.get_time())

        return read

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.given_motion(context.get_time(), self._reader(context)))

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        self.write_wrench(
            context.get_time(),
            self._state(context),
            self.GetOutputPort("desired_motion").Eval(context),
            self._reader(context),
            output.get_mutable_value(),
        )

    def _calc_desired_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(pose_from_row(self.GetOutputPort("desired_motion").Eval(context)[:7]))


class RemoteDistributor(TensionDistributor):
    """A `TensionDistributor` whose tensions come from a process outside.

    Ports are those of `TensionDistributor`, and lengths, vector(m) [m], in. The process is asked at
    each update; `feasible` is 1, and there are no failures: nobody here knows what it wants.
    """

    source = "client"

    def __init__(
        self,
        in_plant: RobotInPlant,
        *settings: Any,
        trajectory: PoseTrajectory,
        balance: str = WRENCH,
    ) -> None:
        """With the desired motion that the process can see, and what a `TensionDistributor` takes.

        Raises:
            TensionProblemError: As `TensionDistributor`.
        """
        super().__init__(in_plant, *settings, balance=balance)
        robot = in_plant.robot
        self.view = _View(robot, trajectory)
        inputs, outputs = tension_ports(DISTRIBUTOR, robot)
        self.outside = Remote(
            DISTRIBUTOR, inputs, outputs, {"tensions": self.packed().bounds[0].copy()}
        )
        self.DeclareVectorInputPort("lengths", len(robot.cables))

    def given_tensions(self, time: float, read: Read) -> Array:
        """Commanded tensions at a time [s], shape (m,) [N]; `read` says what stands at outputs.

        Raises:
            ClientEndedError: One is negative, or nobody is there.
        """
        found = self.outside.ask(time, read)["tensions"]
        least = min(found.tolist())  # NumPy's takes several times as long for a few numbers
        if least < 0.0:
            raise ClientEndedError(
                f"the client's message was not accepted: tensions: found {least:g}; accepted: at "
                "least 0 [N], a cable does not push"
            )
        return found

    def _update(self, context: Context, state: DiscreteValues) -> None:
        held = state.get_mutable_value(self._tensions)

        def read(name: str) -> Array:
            if name == "desired_wrench":
                return self._wrench(context)
            if name == "tensions":
                return held
            if name == "lengths":
                return self.GetInputPort(name).Eval(context)
            return self.view.see(self._state(context), name, context.get_time())

        held[:] = self.given_tensions(context.get_time(), read)
        state.get_mutable_value(self._feasible)[0] = 1.0
