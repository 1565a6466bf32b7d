"""Robots by either engine: how the tests of this room make, start, push and read them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.cable_schema import BehaviourSettings
from cdpr_drake.models.platform_schema import HysteresisSettings
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import FailureSettings
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    WinchSettings,
)
from tests.models.robots import content_of, robot_of

ENGINES = (CableRobot, CompiledCableRobot)

BY_ENGINE = pytest.mark.parametrize("kind", ENGINES, ids=["plant", "compiled"])

SAME_STEPS = 1e-9
"""Difference of states, relative to 1 m, rad, m/s or rad/s, where both engines take the same steps
by the same method: rounding, times what the motion makes of it."""

CLOSED_FORM = 1e-6
"""Relative, of what an engine integrates, or of differences, against a closed form."""

POSE = RigidTransform([0.05, -0.08, 0.3])
"""A pose of ACROBOT's small platform off all symmetries, where all cables are taut."""

ALL_BEHAVIOUR = {
    "stiffening": 2e-3, "expansion": 1.2e-5, "warmer": 15.0, "sheave_friction": 0.05,
    "creep_stiffness": 0.4, "creep_time": 0.05,
}  # fmt: skip

HALF = 0.08
"""Half of the width of a parallelogram [m]."""


def made(kind, *args, **options):
    """A block of the kind; a compiled one goes from event to event, in as long steps as asked."""
    if kind is CompiledCableRobot:
        options.setdefault("command_period", HELD)
    return kind(*args, **options)


def settings_of(mode="ideal", model=None, pulleys=False, damping=None, events=None):
    """Of a robot; a mode other than ideal is that of motors, a damping acts on all velocities."""
    return CableRobotSettings(
        cables=CableSettings(model=model, pulleys=pulleys),
        winches=WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode),
        damping=DampingSettings(translation=damping, rotation=damping),
        failures=None if events is None else FailureSettings(events=events),
    )


def fix_commands(block, context, command=0.0):
    """Fixes commands of winches: velocities, torques, or lengths from where they are now."""
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() == "brakes":
            port.FixValue(context, np.zeros(port.size()))
        elif port.get_name() == "commanded_lengths":
            groups = block.robot.winch_groups().first_cables()
            lengths = read(block, context, "unstrained_lengths")[list(groups)]
            port.FixValue(context, lengths + command)
        elif port.get_name() in ("cable_velocities", "motor_torques"):
            port.FixValue(context, np.zeros(port.size()) + command)


def integrate(block, simulator, step, method="runge_kutta3"):
    """By fixed steps."""
    if isinstance(block, CompiledCableRobot):
        block.integrate_by(StepRule(method=method, max_step=step))
    else:
        ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)


def started(
    kind, robot, how=None, step=1e-3, *, command=0.0, wrench=None, X_WP=None,
    method="runge_kutta3", held=True,
):  # fmt: skip
    """A block at rest if held, its simulator with fixed steps, its context with fixed commands.

    In place of a kind it takes a block that is there already.
    """
    block = made(kind, robot, how) if isinstance(kind, type) else kind
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    if held:
        block.set_at_equilibrium(context, X_WP or robot.home.transform())
    fix_commands(block, context, command)
    if wrench is not None:
        block.GetInputPort("applied_wrench").FixValue(context, wrench)
    integrate(block, simulator, step, method)
    return block, simulator, context


def even_step(duration, longest, looks):
    """The longest step that looks at even times are a multiple of [s]."""
    return duration / looks / math.ceil(duration / looks / longest - 1e-9)


def read(block, context, *names):
    """What ports give now, one after the other."""
    return np.concatenate([block.GetOutputPort(name).Eval(context) for name in names])


def pose(block, context):
    return block.GetOutputPort("X_WP").Eval(context)


def place(block, context):
    return pose(block, context).translation().copy()


def port_names(system):
    """Of inputs, and of outputs, in their order."""
    inputs = [system.get_input_port(i).get_name() for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i).get_name() for i in range(system.num_output_ports())]
    return inputs, outputs


def put(block, context, X_WP):
    """Moves the platform of a plant, and leaves the cables' unstrained lengths as they are."""
    block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)


def moved(X_WP, displacement):
    """X_WP after a small displacement (rotation vector, translation) in W, shape (6,)."""
    turn = rotation_from_vector(displacement[:3])
    return RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + displacement[3:])


def linearized(block, context, output="tensions"):
    """About where the context stands, from the commands of the winches to an output."""
    return Linearize(
        block, context, block.get_input_port(0).get_index(),
        block.GetOutputPort(output).get_index(), equilibrium_check_tolerance=np.inf,
    )  # fmt: skip


def behaving(robot, **behaviour):
    return replace(robot, cable=replace(robot.cable, behaviour=BehaviourSettings(**behaviour)))


def rubbing(robot, tilt, turn, slip):
    section = HysteresisSettings(tilt=tilt, turn=turn, slip=slip)
    return replace(robot, platform=replace(robot.platform, hysteresis=section))


def without(robot, cable):
    return replace(robot, cables=[c for k, c in enumerate(robot.cables) if k != cable])


def parallelograms():
    """A robot file: a platform on three pairs of parallel cables, each on a winch.

    It moves without turning.
    """
    content = content_of()
    cables = []
    for k in range(3):
        out = np.array([np.cos(2.1 * k + 0.3), np.sin(2.1 * k + 0.3), 0.0])
        along = HALF * np.array([-out[1], out[0], 0.0])
        for j, sign in enumerate((1.0, -1.0)):
            exit_point = 0.5 * out + sign * along + [0.0, 0.0, 1.1]
            anchor = 0.1 * out + sign * along + [0.0, 0.0, 0.03]
            cables.append({"name": f"P{k}{'ab'[j]}", "winch": f"W{k}",
                           "exit_point": exit_point.tolist(),
                           "anchor_point": anchor.tolist()})  # fmt: skip
    content["cables"] = cables
    content["platform"]["mass"] = 5.0
    content["home"] = {"position": [0.0, 0.0, 0.4], "angles_deg": [0.0, 0.0, 0.0]}
    content["slack_readings"] = None
    return content


def bundled():
    return robot_of(parallelograms())
