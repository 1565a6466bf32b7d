"""A robot left to itself: pendulums whose frequencies are known, energy, what each instant has."""

import numpy as np
import pytest

from cdpr_drake.dynamics.advance_kernel import robot_energy
from cdpr_drake.dynamics.free_run_kernel import free_run
from cdpr_drake.dynamics.robot_arrays import Drive, pack_robot
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.statics.rigid_platform import RigidPlatform

LENGTH, MASS, GRAVITY, EA = 2.0, 5.0, 9.81, 1e5
STEP, COUNT = 0.01, 1501

PERIOD_TOLERANCE = 1e-4
"""Of a period over 15 s: amplitudes of 0.02 rad lengthen it by 3e-5, stretched cables by nothing
that is not in the formula."""

ENERGY_TOLERANCE = 1e-6
"""Of the swing's energy: steps of 1 ms of third order over 15 s."""


def pendulum(inertia, anchors, exits, start, turn=(0.0, 0.0, 0.0)):
    """States of a platform on cables of its own length, from rest beside its pose of rest."""
    cables = CableSet.make(
        np.array(exits, float).T, np.array(anchors, float).T, stiffness=EA, retardation=0.0
    )
    platform = RigidPlatform(MASS, np.zeros(3), np.diag(inertia), GRAVITY)
    m = cables.count
    l0 = np.full(m, LENGTH / (1.0 + MASS * GRAVITY / m / EA))
    robot = pack_robot(platform, cables, "kelvin_voigt", Drive(), home=l0)
    state = np.zeros(13 + m)
    half = 0.5 * np.array(turn)
    state[:4] = [1.0, *half] / np.linalg.norm([1.0, *half])
    state[4:7], state[13:] = start, l0
    states, tensions = np.empty((COUNT, 13 + m)), np.empty((COUNT, m))
    first = robot_energy(robot, state)
    bad = free_run(robot, state, np.zeros(m), STEP, 1e-3, states, tensions, np.zeros(4))
    assert bad == INTEGRATION_OK
    assert abs(robot_energy(robot, state) - first) < ENERGY_TOLERANCE * MASS * GRAVITY
    np.testing.assert_array_equal(states[-1], state)
    return states, tensions


def period(values):
    """Mean time between crossings upwards of zero [s]."""
    k = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    crossings = (k - values[k] / (values[k + 1] - values[k])) * STEP
    return float(np.mean(np.diff(crossings)))


def test_body_on_one_cable_swings_as_two_pendulums():
    """A cable in the centre of mass: sqrt(l / g), whatever the body's inertia."""
    x = 0.02 * LENGTH
    z = -np.sqrt(LENGTH**2 - x**2)
    states, tensions = pendulum(
        (0.1, 0.1, 0.1), [(0, 0, 0)], [(0, 0, 0)], (x, 0.0, z)
    )  # fmt: skip
    expected = 2.0 * np.pi * np.sqrt(LENGTH / GRAVITY)
    assert period(states[:, 4]) == pytest.approx(expected, rel=PERIOD_TOLERANCE)
    assert np.all(tensions > 0.99 * MASS * GRAVITY)


def test_trifilar_pendulum_turns_as_its_inertia_says():
    """Three upright cables at a radius a: omega^2 = m g a^2 / (l I)."""
    a, inertia = 0.3, 0.4
    at = [(a * np.cos(f), a * np.sin(f), 0.0) for f in np.radians((0.0, 120.0, 240.0))]
    angle = 0.02
    rise = LENGTH - np.sqrt(LENGTH**2 - 2.0 * a**2 * (1.0 - np.cos(angle)))
    states, _ = pendulum(
        (0.2, 0.2, inertia), at, at, (0.0, 0.0, -LENGTH + rise), (0.0, 0.0, angle)
    )  # fmt: skip
    expected = 2.0 * np.pi * np.sqrt(LENGTH * inertia / (MASS * GRAVITY)) / a
    assert period(states[:, 3]) == pytest.approx(expected, rel=PERIOD_TOLERANCE)
