"""The toy model is the catenary without damping, wherever models are chosen by name."""

from dataclasses import fields, replace

import numpy as np
from pydrake.systems.analysis import Simulator

from cdpr_drake.cables.states import cable_state
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

ROBOT = load_robot("acrobot_large")
HOME = ROBOT.home.transform()
CABLES = ROBOT.cable_set()


def undamped(cables):
    return replace(cables, retardation=np.zeros(cables.count))


def test_at_a_pose():
    held = hold_robot(ROBOT, HOME, CABLES, "undamped_catenary")
    same = hold_robot(ROBOT, HOME, CABLES, "catenary")
    np.testing.assert_array_equal(held.unstrained_lengths, same.unstrained_lengths)
    l0, V = held.unstrained_lengths, np.array([0.1, 0.0, 0.2, 0.1, -0.1, 0.2])
    found = cable_state(CABLES, "undamped_catenary", HOME, l0, V)
    expected = cable_state(undamped(CABLES), "catenary", HOME, l0, V)
    damped = cable_state(CABLES, "catenary", HOME, l0, V)
    for field in fields(found):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name))
    assert np.max(np.abs(found.tensions - damped.tensions)) > 1e-6


def test_in_a_simulation():
    robot = CableRobot(
        ROBOT, CableRobotSettings(cables=CableSettings(model="undamped_catenary", pulleys=True))
    )
    assert np.all(robot.forces.cable_set().retardation == 0.0)
    simulator = Simulator(robot)
    context = simulator.get_mutable_context()
    robot.set_at_equilibrium(context, HOME)
    robot.GetInputPort("cable_velocities").FixValue(context, np.zeros(CABLES.count))
    simulator.AdvanceTo(0.1)
    X_WP = robot.GetOutputPort("X_WP").Eval(context)
    assert np.linalg.norm(X_WP.translation() - HOME.translation()) < 1e-6
    assert np.all(robot.GetOutputPort("sags").Eval(context) > 0.0)
