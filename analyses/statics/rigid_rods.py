"""How far rods in place of cables, with their mass, take a platform from massless cables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.robots.ups_robot import UpsRobot

MASSLESS_STEP = 1e-3
"""Step of the third order method for massless cables, whose only state is the platform's [s]."""


@dataclass(frozen=True)
class UpsDeviation:
    """How rods of one mass differ from massless cables.

    Attributes:
        mass: Of all rods together [kg].
        time_step: Of the discrete plant [s].
        distance: Between the platforms at the end [m].
        angle: The same [rad].
        moved: Way of the platform on massless cables [m].
        gap: Largest distance between a rod's end and its anchor point at the end [m].
    """

    mass: float
    time_step: float
    distance: float
    angle: float
    moved: float
    gap: float


def massless_motion(
    robot: Robot, X_WP: RigidTransform, tensions: Array, time: float
) -> RigidTransform:
    """Pose after `time` [s] from rest at X_WP under constant tensions [N] of massless cables."""
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    cables = builder.AddSystem(TensionDrivenCables(in_plant))
    source = builder.AddSystem(ConstantVectorSource(tensions))
    state = plant.get_state_output_port(in_plant.model_instance)
    builder.Connect(state, cables.GetInputPort("platform_state"))
    builder.Connect(source.get_output_port(), cables.GetInputPort("tensions"))
    builder.Connect(
        cables.GetOutputPort("generalized_force"), plant.get_applied_generalized_force_input_port()
    )
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    in_plant.set_pose(context, X_WP)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", MASSLESS_STEP).set_fixed_step_mode(True)
    simulator.AdvanceTo(time)
    return in_plant.pose(context)


def ups_deviation(
    robot: Robot,
    tensions: Array,
    masses: Array,
    time: float,
    time_step: float = 1e-4,
    X_WP: RigidTransform | None = None,
) -> UpsDeviation:
    """Moves a robot from rest under constant tensions, on rods and on massless cables.

    Args:
        robot: The robot, spatial.
        tensions: Shape (m,) [N].
        masses: Of the rods, shape (m,) [kg].
        time: How long [s].
        time_step: Of the discrete plant with rods [s].
        X_WP: Where from; home if None [m].

    Raises:
        RobotFileError: The robot is planar.
    """
    start = robot.home.transform() if X_WP is None else X_WP
    block = UpsRobot(robot, masses, time_step)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_pose(context, start)
    block.GetInputPort("tensions").FixValue(context, tensions)
    simulator.AdvanceTo(time)
    end = block.GetOutputPort("X_WP").Eval(context)
    gaps = block.ups.gaps(block.plant.GetMyContextFromRoot(context))
    reference = massless_motion(robot, start, tensions, time)
    distance, angle = pose_error(reference, end)
    moved = float(np.linalg.norm(reference.translation() - start.translation()))
    return UpsDeviation(
        float(np.sum(masses)), time_step, distance, angle, moved, float(np.max(gaps))
    )
