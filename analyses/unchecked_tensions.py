"""Control by tensions as the Gazebo thesis runs it: what a method computes is applied unchecked."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, DiscreteValues

from cdpr_drake.arrays import Array
from cdpr_drake.computed_torque import TaskGains
from cdpr_drake.errors import CdprError
from cdpr_drake.models import Robot, RobotInPlant, add_robot
from cdpr_drake.pose_trajectory import PoseTrajectory
from cdpr_drake.systems import (
    ComputedTorque,
    PlatformPose,
    PoseTrajectorySource,
    TensionControl,
    TensionDistributor,
    TensionDrivenCables,
)
from cdpr_drake.tension_methods import METHODS
from cdpr_drake.tension_step import wrench_matrix_at

BALANCE = 1e-6
"""Tensions balance the wrench if they miss it by at most this, relative to the cables' forces."""


class UncheckedDistributor(TensionDistributor):
    """A `TensionDistributor` that puts out what its method computes, outside the bounds too.

    Its ports are those of `TensionDistributor`; `failures` counts the control steps whose tensions
    left the bounds all the same. An exact method has no answer where there is none within the
    bounds, and what does not balance the wrench is none either: then the last tensions are held.
    """

    def _update(self, context: Context, state: DiscreteValues) -> None:
        before = state.get_value(self._failures)[0]
        super()._update(context, state)
        failed = state.get_value(self._failures)[0] > before
        if not failed or METHODS[self._method].exact or not np.all(np.isfinite(self._t)):
            return
        missing = self._W @ self._t - self._wrench(context)[self._rows]
        if np.linalg.norm(missing) <= BALANCE * np.linalg.norm(np.abs(self._W) @ np.abs(self._t)):
            state.get_mutable_value(self._tensions)[:] = self._t


class RodCables(TensionDrivenCables):
    """`TensionDrivenCables` that also push, as the prismatic joints of the thesis' simulator do.

    Ports as there; `slack` still tells where a real cable would not push.
    """

    def __init__(self, in_plant: RobotInPlant) -> None:
        """For a robot whose plant is finalized; spatial robots only."""
        super().__init__(in_plant)
        if in_plant.robot.is_planar():
            raise CdprError(f"robot {in_plant.robot.name} is planar; accepted: a spatial robot")
        self._W: Array = np.empty((6, len(in_plant.robot.cables)))

    def _calc_floating_force(self, context: Context, output: BasicVector) -> None:
        wrench_matrix_at(self._state(context), self._cables, 0.0, self._W)
        out = output.get_mutable_value()
        out[:] = 0.0
        # The speeds of a floating joint are V_WP, so that its generalized force is F_P_W.
        out[self._start : self._start + 6] = self._W @ self._tensions(context)


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
        method: A name of `tension_methods.METHODS`.
        limits: Smallest and largest tension [N]; None: the robot's.
        rate: Control steps per second [Hz].
        push: Whether a negative tension pushes; otherwise it acts as zero, as in a real cable.

    Raises:
        TensionProblemError: The method or the limits do not fit the robot.

    Source: Gazebo thesis 6.4; its published simulator, github.com/oKermorgant/cdpr, folder cdpr3,
    puts the tensions on prismatic joints as they are.
    """
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    source = builder.AddNamedSystem("trajectory", PoseTrajectorySource(trajectory))
    controller = builder.AddNamedSystem("controller", ComputedTorque(in_plant, gains, rate=None))
    distributor = builder.AddNamedSystem(
        "distributor", UncheckedDistributor(in_plant, method, limits, rate)
    )
    cables = builder.AddNamedSystem(
        "cables", RodCables(in_plant) if push else TensionDrivenCables(in_plant)
    )
    pose = builder.AddNamedSystem("platform_pose", PlatformPose(in_plant))
    state = plant.get_state_output_port(in_plant.model_instance)
    for system in (controller, distributor, cables, pose):
        builder.Connect(state, system.GetInputPort("platform_state"))
    for before, out, after, into in (
        (source, "motion", controller, "desired_motion"),
        (controller, "desired_wrench", distributor, "desired_wrench"),
        (distributor, "tensions", cables, "tensions"),
    ):
        builder.Connect(before.GetOutputPort(out), after.GetInputPort(into))
    builder.Connect(
        cables.GetOutputPort("generalized_force"), plant.get_applied_generalized_force_input_port()
    )
    for system, name in ((pose, "X_WP"), (distributor, "tensions"), (distributor, "failures")):
        builder.ExportOutput(system.GetOutputPort(name), name)
    diagram = builder.Build()
    diagram.set_name(f"{robot.name}_unchecked_control")
    return TensionControl(robot, trajectory, diagram, in_plant)
