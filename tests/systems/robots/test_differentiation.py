"""Blocks on AutoDiffXd: derivatives are those of differences, frequencies those of time and K."""

import numpy as np
import pytest

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.models.robots import robot_of
from tests.models.test_platform_pulleys import robot_content
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    POSE,
    behaving,
    linearized,
    read,
    settings_of,
    started,
)

DERIVATIVES = 1e-6
"""Central differences against AutoDiff, relative to the largest derivative."""

ELASTIC = settings_of(model="elastic", pulleys=True)
CATENARY = settings_of(model="catenary", pulleys=True)


def creeping():
    return behaving(load_robot("acrobot_small"), **ALL_BEHAVIOUR)


def over_platform_pulleys():
    return robot_of(robot_content())


CASES = {
    "straight": ("acrobot_small", settings_of(), POSE),
    "elastic": ("acrobot_small", ELASTIC, POSE),
    "catenary": ("acrobot_small", CATENARY, POSE),
    "pulleys at the platform": (over_platform_pulleys, settings_of(pulleys=True), POSE),
    "planar": ("planar", settings_of(), None),
    "planar, elastic": ("planar", ELASTIC, None),
    "planar, catenary": ("planar", CATENARY, None),
    "behaving": (creeping, settings_of(pulleys=True), POSE),
    "torque": ("acrobot_small", settings_of("torque"), None),
    "velocity": ("acrobot_small", settings_of("velocity"), None),
    "position": ("acrobot_small", settings_of("position"), None),
    "motors and catenaries": ("acrobot_small", settings_of("velocity", "catenary", True), POSE),
}


@pytest.mark.parametrize("case", CASES)
def test_linearisation_is_the_derivative_of_differences(case):
    name, how, X_WP = CASES[case]
    robot = name() if callable(name) else load_robot(name)
    block, _, context = started(CableRobot, robot, how, X_WP=X_WP)
    x0 = context.get_continuous_state_vector().CopyToVector()
    m, motors = len(robot.cables), how.winches.kind == "motor"
    if motors:  # turning, so that friction is that of sliding
        x0[13 + m : 13 + 2 * m] = np.linspace(-0.1, 0.12, m)
        context.SetContinuousState(x0)
    linear = linearized(block, context)
    A, step = np.empty((len(x0), len(x0))), 1e-8
    for j, e in enumerate(np.eye(len(x0))):
        ends = []
        for sign in (1.0, -1.0):
            context.SetContinuousState(x0 + sign * step * e)
            ends.append(block.EvalTimeDerivatives(context).CopyToVector())
        A[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(linear.A(), A, rtol=0.0, atol=DERIVATIVES * np.max(np.abs(A)))
    if not motors and case != "behaving":
        # A winch that pays out changes its length at once, and the damping of its cable.
        np.testing.assert_array_equal(linear.B()[-m:], np.eye(m))


def test_a_robot_at_rest_on_motors_is_stable():
    robot = load_robot("acrobot_small")
    block, _, context = started(CableRobot, robot, CASES["motors and catenaries"][1], X_WP=POSE)
    assert np.max(np.linalg.eigvals(linearized(block, context).A()).real) < 1e-3


def test_frequencies_are_those_of_the_stiffness_matrix():
    """Undamped: eigenvalues of the Diagram against stiffness and mass by their own formulas."""
    robot = load_robot("acrobot_small")
    block, _, context = started(CableRobot, robot, ELASTIC, X_WP=POSE)
    values = np.linalg.eigvals(linearized(block, context).A())
    platform, l0 = rigid_platform(robot), read(block, context, "unstrained_lengths")
    K = platform_stiffness(robot.cable_set(), "elastic", platform, POSE, l0).total
    expected = 2 * np.pi * natural_modes(K, platform, POSE).frequencies
    np.testing.assert_allclose(np.sort(values.imag[values.imag > 1.0]), expected, rtol=1e-6)


def test_forces_of_broken_cables_are_the_same_on_autodiff():
    robot = load_robot("planar")
    block, found, m = CableForces(CableRobot(robot).in_plant, breakable=True), [], 4
    inputs = {
        "platform_state": [0.01, 0.02, 0.03, 0.1, -0.2, 0.3],
        "unstrained_lengths": np.full(m, 0.5),
        "unstrained_length_rates": np.zeros(m),
        "broken": (np.arange(m) == 1).astype(float),
    }
    for system in (block, block.ToAutoDiffXd()):
        context = system.CreateDefaultContext()
        for name, values in inputs.items():
            system.GetInputPort(name).FixValue(context, np.array(values))
        numbers = read(system, context, "generalized_force", "tensions")
        found.append(np.array([getattr(x, "value", lambda x=x: x)() for x in numbers], float))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert found[0][-m + 1] == 0.0
    assert np.all(np.delete(found[0][-m:], 1) > 0.0)
