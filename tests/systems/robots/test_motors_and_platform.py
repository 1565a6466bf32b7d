"""Platform, cables and motors together: energy, differentiation, vibrations."""

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings

ENERGY = 1e-5
"""Change of the energy in a quarter of a second, relative to what the motors put in."""

DERIVATIVES = 1e-6
"""Central differences against AutoDiff, relative to the largest derivative."""


def free_robot():
    """ACROBOT with cables a hundred times softer and nothing that takes energy."""
    robot = load_robot("acrobot_small")
    robot.cable.youngs_modulus /= 100.0
    robot.cable.retardation_time = 0.0
    robot.winch.friction = None
    return robot


def energy(block, context, robot, torques):
    """Of platform, motors and cables, less what constant motor torques put in [J]."""
    plant_context = block.plant.GetMyContextFromRoot(context)
    total = block.plant.CalcKineticEnergy(plant_context)
    total += block.plant.CalcPotentialEnergy(plant_context)
    l0, strain = strains(block, context, robot)
    total += np.sum(0.5 * robot.stiffness() * l0 * strain**2)
    speeds = block.GetOutputPort("motor_speeds").Eval(context)
    total += 0.5 * robot.winch.inertia * np.sum(speeds**2)
    return total - torques @ block.GetOutputPort("motor_angles").Eval(context)


def strains(block, context, robot):
    """Unstrained lengths [m] and strains of taut cables, zero for slack ones."""
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    lengths = cable_lengths(X_WP, robot.exit_points(), robot.anchor_points())
    return l0, np.maximum(lengths / l0 - 1.0, 0.0)


def wound_stretch(block, context, robot):
    """Power that stretched cable takes onto the drum with it, t e / 2 per length [W].

    dV/dl0 of an elastic cable is -t (1 + e / 2), the drum feels t.
    """
    _, strain = strains(block, context, robot)
    rates = block.GetOutputPort("unstrained_length_rates").Eval(context)
    return float(np.sum(0.5 * robot.stiffness() * strain**2 * rates))


def test_platform_cables_and_motors_hold_what_the_torques_put_in():
    robot = free_robot()
    block = CableRobot(
        robot, CableRobotSettings(winches=WinchSettings(kind="motor", mode="torque"))
    )
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    tensions = block.set_at_equilibrium(context, robot.home.transform())
    rho = robot.winch_law().drum.length_per_angle(np.zeros(8))
    torques = -rho * tensions * np.array([1.3, 1.0, 0.9, 1.2, 1.0, 1.1, 0.8, 1.2])
    block.GetInputPort("motor_torques").FixValue(context, torques)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-4).set_fixed_step_mode(True)
    start, wound, before = energy(block, context, robot, torques), 0.0, 0.0
    angles = block.GetOutputPort("motor_angles").Eval(context).copy()
    for time in np.arange(1, 251) * 1e-3:
        simulator.AdvanceTo(time)
        power = wound_stretch(block, context, robot)
        wound, before = wound + 0.5e-3 * (power + before), power
    turned = block.GetOutputPort("motor_angles").Eval(context) - angles
    put_in = np.abs(torques) @ np.abs(turned)
    assert put_in > 0.05
    drift = energy(block, context, robot, torques) + wound - start
    assert abs(drift) < ENERGY * put_in


@pytest.mark.parametrize("mode", ["torque", "velocity", "position"])
def test_the_diagram_with_motors_differentiates(mode):
    robot = load_robot("acrobot_small")
    block = CableRobot(robot, CableRobotSettings(winches=WinchSettings(kind="motor", mode=mode)))
    context = block.CreateDefaultContext()
    tensions = block.set_at_equilibrium(context, robot.home.transform())
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)
    rho = robot.winch_law().drum.length_per_angle(np.zeros(8))
    commands = {"torque": -rho * tensions, "velocity": np.full(8, 0.05), "position": l0 + 0.01}
    block.get_input_port(0).FixValue(context, commands[mode])
    state = context.get_continuous_state_vector().CopyToVector()
    # Turning, so that friction is that of sliding.
    state[13 + 8 : 13 + 16] = np.linspace(-0.1, 0.12, 8)
    context.SetContinuousState(state)
    ports = block.get_input_port(0).get_index(), block.GetOutputPort("tensions").get_index()
    A = Linearize(block, context, *ports, equilibrium_check_tolerance=np.inf).A()
    found = np.empty_like(A)
    for i in range(len(state)):
        step = np.zeros(len(state))
        step[i] = 1e-7
        ends = []
        for sign in (1.0, -1.0):
            context.SetContinuousState(state + sign * step)
            ends.append(block.EvalTimeDerivatives(context).CopyToVector())
        found[:, i] = (ends[0] - ends[1]) / 2e-7
    assert np.max(np.abs(A - found)) < DERIVATIVES * np.max(np.abs(found))
