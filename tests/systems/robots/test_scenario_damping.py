"""Damping of the platform: exponential decay by its closed form, and nothing without it."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, DampingSettings

DECAY = 1e-6
"""Relative; the integrator is asked for an accuracy of 1e-9."""


def test_a_sliding_platform_slows_down_as_the_exponential():
    robot = load_robot("planar")
    damping = DampingSettings(translation=2.0, rotation=0.0)
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    brake = builder.AddSystem(damping.block(in_plant))
    state = plant.get_state_output_port(in_plant.model_instance)
    builder.Connect(state, brake.get_input_port())
    builder.Connect(brake.get_output_port(), plant.get_applied_generalized_force_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inner = plant.GetMyMutableContextFromRoot(context)
    start = np.array([0.3, 0.1, 0.0])
    plant.SetVelocities(inner, start)
    simulator = Simulator(diagram, context)
    simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    simulator.AdvanceTo(1.0)
    expected = start * np.exp(-2.0 / robot.platform.mass)
    np.testing.assert_allclose(plant.GetVelocities(inner), expected, rtol=DECAY, atol=1e-12)


def test_rotation_is_braked_by_its_own_number():
    robot = load_robot("acrobot_small")
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    block = DampingSettings(translation=2.0, rotation=0.5).block(in_plant)
    context = block.CreateDefaultContext()
    block.get_input_port().FixValue(context, [1, 0, 0, 0, 5, 6, 7, 1, 2, 3, -1, -2, -3])
    force = block.get_output_port().Eval(context)
    np.testing.assert_allclose(force, [-0.5, -1.0, -1.5, 2.0, 4.0, 6.0])


def test_power_of_the_damping_is_never_positive():
    robot = load_robot("acrobot_small")
    block = CableRobot(
        robot, CableRobotSettings(damping=DampingSettings(translation=3.0, rotation=0.1))
    )
    assert {system.get_name() for system in block.GetSystems()} >= {"damping", "applied_force"}
    assert "damping" not in {system.get_name() for system in CableRobot(robot).GetSystems()}
    gain = block.GetSubsystemByName("damping").D()
    damping = gain[:, -6:]
    assert np.all(np.linalg.eigvalsh(damping + damping.T) < 0.0)
    assert np.all(gain[:, :-6] == 0.0)


def test_a_hanging_robot_with_damping_rests_where_it_hangs():
    robot = load_robot("caroca")
    block = CableRobot(
        robot, CableRobotSettings(damping=DampingSettings(translation=40.0, rotation=0.8))
    )
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    plant = block.plant
    rates = block.EvalTimeDerivatives(context).CopyToVector()
    assert np.abs(rates).max() < 1e-6
    assert plant.num_velocities() == 6
