"""Robots of one structure with parameters of their own, and what moves one of them alone."""

import numpy as np
from pydrake.systems.analysis import Simulator

from cdpr_drake.models.cable_schema import BehaviourSettings
from cdpr_drake.models.robot_draws import ParameterCovariance, drawn_robots
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings

PERIOD = 0.01
ROBOT = load_robot("acrobot_small")
STILL = np.zeros(8)


def settings(mode="ideal", model="elastic", pulleys=False, **more):
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    return CableRobotSettings(
        cables=CableSettings(model=model, pulleys=pulleys), winches=winches, **more
    )


ELASTIC, DAMPED = settings(), settings(model="kelvin_voigt")


def behaving(**behaviour):
    """A robot whose cables do more than the elastic law."""
    robot = load_robot("acrobot_small")
    robot.cable.behaviour = BehaviourSettings(**behaviour)
    return robot


def varied(robot, count, seed=0):
    """Robots with other masses, points and stiffnesses."""
    deviations = {"mass": 0.02 * robot.platform.mass}
    for cable, stiffness in zip(robot.cables, robot.stiffness(), strict=True):
        for x in "xy":  # in the plane of planar ones
            deviations[f"{cable.name}.exit_point.{x}"] = 3e-3
            deviations[f"{cable.name}.anchor_point.{x}"] = 1e-3
        deviations[f"{cable.name}.stiffness"] = 0.1 * stiffness
    return drawn_robots(robot, count, ParameterCovariance.independent(deviations), seed)


def alone(robot, how, commands, wrenches=None, rule=None):
    """State at the end, and tensions, of a robot that moves by itself in a diagram."""
    block = CompiledCableRobot(robot, how, rule=rule, floor=False, command_period=HELD)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    simulator.Initialize()
    for k, command in enumerate(commands):
        block.get_input_port(0).FixValue(context, command)
        if wrenches is not None:
            block.GetInputPort("applied_wrench").FixValue(context, wrenches[k])
        simulator.AdvanceTo(context.get_time() + PERIOD)
    own = block.motion.GetMyContextFromRoot(context)
    tensions = block.GetOutputPort("tensions").Eval(context)
    return block.motion.state(own).copy(), np.array(tensions)


def alone_by_tensions(robot, start, commands):
    """State at the end of a robot whose tensions are commanded, and these."""
    block = motion_by_tensions(robot, ELASTIC.cables.cable_set(robot), command_period=HELD)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_state(context, start)
    simulator.Initialize()
    for command in commands:
        block.get_input_port(0).FixValue(context, command)
        simulator.AdvanceTo(context.get_time() + PERIOD)
    return block.state(context).copy(), commands[-1]
