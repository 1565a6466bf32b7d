"""The robot in one block: ports, default context, holding tensions, steps."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.errors import InfeasibleTensionError, RobotFileError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step, holding_tensions
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

SETTLED = 2e-5
"""The platform settles by the change of the cables' stretch, within half a second [m]."""


def port_names(system):
    inputs = [system.get_input_port(i).get_name() for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i).get_name() for i in range(system.num_output_ports())]
    return inputs, outputs


def test_ports_are_public():
    inputs, outputs = port_names(CableRobot(load_robot("acrobot_small")))
    assert inputs == ["cable_velocities", "applied_wrench"]
    assert sorted(outputs) == [
        "X_WP", "body_accelerations", "body_poses", "body_velocities", "drum_tensions", "lengths",
        "platform_state", "query_object", "sags", "slack", "surplus_lengths", "tensions",
        "unstrained_length_rates", "unstrained_lengths",
    ]  # fmt: skip


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_default_context_is_the_home_pose_and_simulates(name):
    robot = load_robot(name)
    block = CableRobot(robot)
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    assert X_WP.IsNearlyEqualTo(robot.home.transform(), 1e-12)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    tensions = block.GetOutputPort("tensions").Eval(context).copy()
    np.testing.assert_allclose(block.set_at_equilibrium(context, X_WP), tensions, rtol=1e-6)
    np.testing.assert_array_equal(block.GetOutputPort("unstrained_lengths").Eval(context), l0)
    Simulator(block, context).AdvanceTo(0.01)


def test_pose_that_cannot_be_held_is_named():
    robot = load_robot("acrobot_small")
    with pytest.raises(InfeasibleTensionError, match=r"acrobot_small cannot hold .* 0\.55"):
        holding_tensions(robot, RigidTransform([0.55, 0.55, 0.3]))


def test_step_gets_shorter_as_the_platform_climbs():
    robot = load_robot("acrobot_small")
    steps = [automatic_step(robot, RigidTransform([0, 0, z]), "runge_kutta3") for z in (0.1, 0.8)]
    assert 0.0 < steps[1] < steps[0]


def motors(mode="velocity"):
    return WinchSettings(kind="motor", mode=mode)


@pytest.mark.parametrize("mode", ["torque", "velocity", "position"])
def test_winches_with_motors_bring_their_ports(mode):
    command = {"torque": "motor_torques", "velocity": "cable_velocities"}
    inputs, outputs = port_names(
        CableRobot(load_robot("planar"), CableRobotSettings(winches=motors(mode)))
    )
    assert inputs == [command.get(mode, "commanded_lengths"), "applied_wrench"]
    added = {"motor_angles", "motor_speeds", "applied_torques", "friction_torques"}
    assert added <= set(outputs)


def hanging(robot, mode, command):
    block = CableRobot(robot, CableRobotSettings(winches=motors(mode)))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    tensions = block.set_at_equilibrium(context, robot.home.transform())
    block.get_input_port(0).FixValue(context, command(block, context, tensions))
    step = automatic_step(
        robot, robot.home.transform(), "runge_kutta3", CableRobotSettings(winches=motors(mode))
    )
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    return block, simulator, context


def test_torques_within_friction_of_the_tensions_leave_the_platform_where_it_is():
    """And the motors exactly: the platform only settles to where the cables hold it."""
    robot = load_robot("acrobot_small")
    law = robot.winch_law()
    rho = law.drum.length_per_angle(np.zeros(8))

    def command(block, context, tensions):
        return -rho * tensions + 0.5 * law.friction.static * np.array([1, -1] * 4)

    block, simulator, context = hanging(robot, "torque", command)
    angles = block.GetOutputPort("motor_angles").Eval(context).copy()
    simulator.AdvanceTo(0.5)
    np.testing.assert_array_equal(block.GetOutputPort("motor_angles").Eval(context), angles)
    distance, _ = pose_error(robot.home.transform(), block.GetOutputPort("X_WP").Eval(context))
    assert distance < SETTLED


def test_without_friction_the_same_torques_move_it():
    robot = load_robot("acrobot_small")
    robot.winch.friction = None
    rho = robot.winch_law().drum.length_per_angle(np.zeros(8))

    def command(block, context, tensions):
        return -rho * tensions + 0.015 * np.array([1, -1] * 4)

    block, simulator, _ = hanging(robot, "torque", command)
    simulator.AdvanceTo(0.2)
    X_WP = block.GetOutputPort("X_WP").Eval(simulator.get_context())
    assert pose_error(robot.home.transform(), X_WP)[0] > 20.0 * SETTLED


def test_position_loops_hold_the_robot():
    def command(block, context, tensions):
        return block.GetOutputPort("unstrained_lengths").Eval(context).copy()

    robot = load_robot("caroca")
    block, simulator, context = hanging(robot, "position", command)
    simulator.AdvanceTo(0.2)
    distance, _ = pose_error(robot.home.transform(), block.GetOutputPort("X_WP").Eval(context))
    assert distance < SETTLED


def test_unknown_motors_are_named():
    robot = load_robot("acrobot_small")
    robot.winch.inertia = None
    with pytest.raises(RobotFileError, match=r"acrobot_small: winch\.inertia: found null"):
        CableRobot(robot, CableRobotSettings(winches=motors()))


def test_steps_follow_motors_that_vibrate_with_the_platform():
    robot = load_robot("acrobot_small")
    pose = robot.home.transform()
    ideal = automatic_step(robot, pose, "runge_kutta3")
    assert automatic_step(robot, pose, "runge_kutta3", CableRobotSettings(winches=motors())) < ideal
    robot.winch.inertia = 3e-7
    light = automatic_step(robot, pose, "runge_kutta3", CableRobotSettings(winches=motors()))
    assert light < 0.5 * ideal
