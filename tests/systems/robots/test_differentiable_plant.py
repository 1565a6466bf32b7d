"""The Diagram of plant, cables and winches on AutoDiffXd: linearised, and held against time."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

FREQUENCY = 5e-3
"""Relative difference of a frequency of the linear model from the one measured in time."""

DIFFERENCE = 1e-6
"""Relative to the largest entry, 2e6 1/s^2: differences of first derivatives, STEP wide."""

STEP = 1e-8
POSE = RigidTransform([0.05, -0.08, 0.3])
SETTINGS = [
    CableSettings(model="kelvin_voigt", pulleys=False),
    CableSettings(model="elastic", pulleys=True),
    CableSettings(model="catenary", pulleys=True),
]


def hanging(settings, name="acrobot_small", X_WP=POSE):
    robot = load_robot(name)
    block = CableRobot(robot, CableRobotSettings(cables=settings))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, X_WP)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    return block, context


def linearized(block, context):
    return Linearize(
        block,
        context,
        block.GetInputPort("cable_velocities").get_index(),
        block.GetOutputPort("tensions").get_index(),
    )


def state_derivative(block, context, x):
    context.SetContinuousState(x)
    return block.EvalTimeDerivatives(context).CopyToVector()


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("name", ["acrobot_small", "planar"])
def test_linearisation_is_the_derivative_of_differences(settings, name):
    robot = load_robot(name)
    X_WP = POSE if name == "acrobot_small" else robot.home.transform()
    block, context = hanging(settings, name, X_WP)
    linear = linearized(block, context)
    x0 = context.get_continuous_state_vector().CopyToVector()
    for j in range(len(x0)):
        e = np.zeros(len(x0))
        e[j] = STEP
        ahead, behind = (state_derivative(block, context, x0 + k * e) for k in (1, -1))
        slope = (ahead - behind) / (2 * STEP)
        assert np.max(np.abs(linear.A()[:, j] - slope)) < DIFFERENCE * 2e6
    # A winch that pays out changes its length at once, and the damping of its cable.
    m = len(robot.cables)
    np.testing.assert_array_equal(linear.B()[-m:], np.eye(m))


@pytest.mark.parametrize("settings", SETTINGS)
def test_frequencies_are_those_measured_in_time(settings):
    """Let go from a mode's shape, the platform swings at its frequency: times of 20 crossings."""
    block, context = hanging(settings)
    linear = linearized(block, context)
    values, vectors = np.linalg.eig(linear.A())
    oscillating = np.where(values.imag > 1.0)[0]
    assert len(oscillating) == 6
    slowest = oscillating[np.argsort(values[oscillating].imag)]
    for k in slowest[:2]:
        position = np.argmax(np.abs(vectors[:7, k]))  # of quaternion and place: what moves most
        shape = np.real(vectors[:, k] / vectors[position, k])
        block, context = hanging(settings)
        x0 = context.get_continuous_state_vector().CopyToVector()
        context.SetContinuousState(x0 + 2e-7 * shape)
        simulator = Simulator(block, context)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 5e-5).set_fixed_step_mode(True)
        period = 2 * np.pi / values[k].imag
        times = np.linspace(0.0, 11.0 * period, 400)
        path = []
        for time in times:
            simulator.AdvanceTo(time)
            path.append(context.get_continuous_state_vector()[position] - x0[position])
        path = np.array(path)
        before = np.where(path[:-1] * path[1:] < 0.0)[0]
        share = path[before] / (path[before] - path[before + 1])
        crossings = times[before] + share * (times[1] - times[0])
        measured = np.pi * (len(crossings) - 1) / (crossings[-1] - crossings[0])
        assert len(crossings) >= 20
        assert abs(measured / values[k].imag - 1.0) < FREQUENCY
        assert np.all(block.GetOutputPort("tensions").Eval(context) > 0.0)


def test_frequencies_are_those_of_the_stiffness_matrix():
    """Undamped: eigenvalues of the Diagram against stiffness and mass by their own formulas."""
    settings = CableSettings(model="elastic", pulleys=True)
    block, context = hanging(settings)
    values = np.linalg.eigvals(linearized(block, context).A())
    found = np.sort(values.imag[values.imag > 1.0])
    robot, l0 = block.robot, block.GetOutputPort("unstrained_lengths").Eval(context)
    platform = rigid_platform(robot)
    K = platform_stiffness(robot.cable_set(), "elastic", platform, POSE, l0).total
    expected = 2 * np.pi * natural_modes(K, platform, POSE).frequencies
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_winches_with_motors_convert_too():
    from cdpr_drake.systems.robots.settings import WinchSettings

    robot = load_robot("acrobot_small")
    block = CableRobot(
        robot,
        CableRobotSettings(
            cables=CableSettings(model="catenary", pulleys=True),
            winches=WinchSettings(kind="motor", mode="velocity"),
        ),
    )
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, POSE)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    linear = linearized(block, context)
    assert np.all(np.isfinite(linear.A()))
    assert np.max(np.linalg.eigvals(linear.A()).real) < 1e-3
