"""A wrench on the platform: both engines, against Newton and Euler, statics, and each other."""

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.analyses.statics.static_query import static_at_pose
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
)
from tests.systems.robots.engines import made

WRENCH = np.array([0.3, -0.2, 0.5, 4.0, -3.0, 2.0])

AS_NEWTON = 1e-9
"""Relative error of accelerations: those of the cables are rounded to 1e-16 of forces that are a
thousand times the wrench, and of the mass matrix's condition."""

SAME_STEPS = 1e-9
"""Difference of states of both engines by the same steps, see test_compiled_cable_robot."""


def at_home(kind, robot, settings=None):
    block = made(kind, robot, settings)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    still = np.zeros(len(robot.cables))
    block.GetInputPort("cable_velocities").FixValue(context, still)
    return block, simulator, context


def acceleration(block, context):
    """Of Po in W, (rotation, translation)."""
    A = block.GetOutputPort("body_accelerations").Eval(context)[int(block.in_plant.body_index)]
    return np.concatenate([A.rotational(), A.translational()])


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar", "nist_robocrane"])
def test_it_accelerates_as_newton_and_euler_say(kind, name):
    """At rest without it, so that what it adds is M^-1 w."""
    robot = load_robot(name)
    block, _, context = at_home(kind, robot)
    before = acceleration(block, context)
    block.GetInputPort("applied_wrench").FixValue(context, WRENCH)
    added = acceleration(block, context) - before
    R = np.kron(np.eye(2), robot.home.transform().rotation().matrix())
    M = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    motion = robot.motion_type()
    turned = robot.home.transform().rotation().matrix()
    S = motion.basis(turned)
    expected = S @ np.linalg.solve(S.T @ M @ S, S.T @ WRENCH)
    np.testing.assert_allclose(added, expected, atol=AS_NEWTON * np.abs(expected).max())


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_both_engines_move_alike(name):
    robot, states = load_robot(name), []
    for kind in (CableRobot, CompiledCableRobot):
        block, simulator, context = at_home(kind, robot)
        block.GetInputPort("applied_wrench").FixValue(context, WRENCH)
        if kind is CableRobot:
            ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-4).set_fixed_step_mode(True)
        else:
            block.integrate_by(StepRule(max_step=1e-4))
        simulator.AdvanceTo(0.05)
        states.append(block.GetOutputPort("platform_state").Eval(context))
    np.testing.assert_allclose(*states, atol=SAME_STEPS)


def test_left_open_it_is_none_to_the_bit():
    robot, states = load_robot("acrobot_large"), []
    for wrench in (None, np.zeros(6)):
        block, simulator, context = at_home(CompiledCableRobot, robot)
        if wrench is not None:
            block.GetInputPort("applied_wrench").FixValue(context, wrench)
        simulator.AdvanceTo(0.05)
        states.append(block.GetOutputPort("platform_state").Eval(context).copy())
    assert np.array_equal(*states)


def test_the_platform_gives_as_its_stiffness_says():
    """Half the difference of both signs leaves nothing of second order."""
    robot = load_robot("acrobot_large")
    how = CableRobotSettings(
        cables=CableSettings(model="elastic"),
        damping=DampingSettings(translation=2000.0, rotation=20.0),
    )
    small, poses = 1e-3 * WRENCH, []
    for sign in (1.0, -1.0):
        block, simulator, context = at_home(CompiledCableRobot, robot, how)
        block.integrate_by(StepRule(method="semi_implicit", max_step=2e-3))
        block.GetInputPort("applied_wrench").FixValue(context, sign * small)
        simulator.AdvanceTo(4.0)
        poses.append(block.GetOutputPort("platform_state").Eval(context)[:7].copy())
    one, other = poses
    turn = 2.0 * (one[1:4] - other[1:4]) * 0.5
    found = np.concatenate([turn, 0.5 * (one[4:] - other[4:])])
    K = static_at_pose(robot, robot.home.transform(), "elastic", False).stiffness
    expected = np.linalg.solve(K, small)
    SHARE = 1e-6  # of the deflection: what is left of third order and of the way to rest
    np.testing.assert_allclose(found, expected, atol=SHARE * np.abs(expected).max())


def test_in_somebodys_diagram():
    robot = load_robot("planar")
    builder = DiagramBuilder()
    block = builder.AddSystem(CableRobot(robot))
    push = builder.AddSystem(ConstantVectorSource(WRENCH))
    builder.Connect(push.get_output_port(), block.GetInputPort("applied_wrench"))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, np.zeros(len(robot.cables)))
    own = block.GetMyContextFromRoot(context)
    force = block.plant.get_applied_generalized_force_input_port()
    plant_context = block.plant.GetMyContextFromRoot(context)
    with_it = force.Eval(plant_context).copy()
    assert block.GetInputPort("applied_wrench").Eval(own) == pytest.approx(WRENCH)
    assert np.any(with_it != 0.0)
