"""A platform that rubs as it turns: how far it comes, what a loop takes, and what it is without."""

import numpy as np
import pytest

from cdpr_drake.dynamics.free_run_kernel import free_run
from cdpr_drake.dynamics.hysteretic_run_kernel import bend_contacts, hysteretic_run
from cdpr_drake.dynamics.robot_arrays import Drive, pack_robot
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.statics.rigid_platform import RigidPlatform

INERTIA, SLIP, STEP = 0.12, 0.08, 0.005
K = np.array([3.0, 3.0, 5.0])
"""About the axes of P [N m/rad]."""

SECOND_ORDER = 2e-6
"""Of angles of a radian: steps of a millisecond, w h of 5e-3, its square over 12."""

LOOP = 1e-4
"""Of a loop's energy: steps of 1e-4 of the amplitude, summed by trapezoids."""


def body():
    """A ball without weight on slack cables, and its state, turning about an axis."""
    exits = np.array([[1.0, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1]], float).T
    cables = CableSet.make(exits, np.zeros((3, 4)), stiffness=1e5, retardation=0.0)
    platform = RigidPlatform(2.0, np.zeros(3), INERTIA * np.eye(3), 0.0)
    robot = pack_robot(platform, cables, "kelvin_voigt", Drive(), home=np.full(4, 9.0))
    state = np.zeros(17)
    state[0], state[13:] = 1.0, 9.0
    return robot, state


def run(speed, count, stiffness=K):
    robot, state = body()
    state[7:10] = speed
    states, tensions = np.empty((count, 17)), np.empty((count, 4))
    bent = np.zeros(3)
    bad = hysteretic_run(
        robot, state, np.zeros(4), STEP, 1e-3, states, tensions, np.zeros(4), stiffness, SLIP, bent
    )
    assert bad == INTEGRATION_OK
    return states, bent


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turning_body_loses_what_the_contacts_take(axis):
    """Along one direction z = a (1 - exp(-s / a)), whose moment over the way s is the energy
    I w^2 / 2 that is lost; while it has not come back."""
    speed = np.zeros(3)
    speed[axis] = 5.0
    states, bent = run(speed, 60)
    turn = 2.0 * np.arctan2(states[:, 1 + axis], states[:, 0])
    w = states[:, 7 + axis]
    onward = np.flatnonzero(w <= 0.0)[0] if np.any(w <= 0.0) else len(w)
    s = turn[:onward]
    assert s[-1] > 3.0 * SLIP  # it slips
    lost = K[axis] * SLIP * (s - SLIP * (1.0 - np.exp(-s / SLIP)))
    expected = np.sqrt(25.0 - 2.0 * lost / INERTIA)
    np.testing.assert_allclose(w[:onward], expected, atol=5.0 * SECOND_ORDER * 5.0)
    if onward == len(w):
        assert bent[axis] == pytest.approx(SLIP * (1.0 - np.exp(-turn[-1] / SLIP)), abs=1e-6)


def test_the_moment_turns_with_the_platform():
    """K differs about z of P: turned by a right angle about x, that axis lies along -y of W."""
    robot, state = body()
    state[:4] = np.sqrt(0.5) * np.array([1.0, 1.0, 0.0, 0.0])
    state[8] = -5.0  # about z of P
    states, tensions = np.empty((30, 17)), np.empty((30, 4))
    asked = (np.zeros(4), STEP, 1e-3, states, tensions, np.zeros(4))
    assert hysteretic_run(robot, state, *asked, K, SLIP, np.zeros(3)) == INTEGRATION_OK
    straight, _ = run([0.0, 0.0, 5.0], 30)
    np.testing.assert_allclose(-states[:, 8], straight[:, 9], rtol=1e-9)


def test_a_loop_takes_the_area_that_dahl_gives():
    """Between turns of +-A for long: z runs from -z_A to z_A on s -> a - (a + z_A) exp(-s / a), so
    that z_A = a tanh(A / a), and a loop takes K times the area between its branches."""
    A, n = 0.2, 4000
    bent, area = np.zeros(3), 0.0
    for k in range(3):
        area = 0.0
        for sign in (1.0, -1.0):
            for _ in range(n):
                before = bent[2]
                bend_contacts(bent, np.array([0.0, 0.0, sign]), SLIP, 2.0 * A / n)
                area += sign * 0.5 * (before + bent[2]) * 2.0 * A / n
        assert k == 0 or abs(bent[2]) == pytest.approx(SLIP * np.tanh(A / SLIP), rel=1e-4)
    a, top = SLIP, SLIP * np.tanh(A / SLIP)
    expected = 2.0 * (2.0 * A * a - a * (a + top) * (1.0 - np.exp(-2.0 * A / a)))
    assert area == pytest.approx(expected, rel=LOOP)


def test_without_stiffness_it_is_a_free_run():
    states, _ = run([1.0, 2.0, 3.0], 20, np.zeros(3))
    robot, state = body()
    state[7:10] = [1.0, 2.0, 3.0]
    free, tensions = np.empty((20, 17)), np.empty((20, 4))
    free_run(robot, state, np.zeros(4), STEP, 1e-3, free, tensions, np.zeros(4))
    np.testing.assert_allclose(states, free, rtol=0.0, atol=1e-13)
