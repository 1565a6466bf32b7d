"""Laws that answer forces as functions: against computed torque, closed forms, and work by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from scipy.integrate import solve_ivp

from cdpr_drake.control.force_laws import (
    Admittance,
    displaced,
    hybrid_wrench,
    impedance_wrench,
    in_world,
    port_energy,
    pose_deviation,
)
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import ControlGainError
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics

ROUNDING = 1e-12
TURN = RotationMatrix(RollPitchYaw(0.3, -0.2, 0.7))


def test_an_impedance_of_the_inertias_own_gains_is_computed_torque():
    """K = Kp M and D = Kd M give the same wrench, since M is that about Po in W."""
    dynamics, random = platform_dynamics(load_robot("acrobot_large")), np.random.default_rng(2)
    X = RigidTransform(rotation_from_vector(0.3 * random.normal(size=3)), random.normal(size=3))
    X_D = RigidTransform(rotation_from_vector(0.3 * random.normal(size=3)), random.normal(size=3))
    V, V_D, A_D = random.normal(size=(3, 6))
    how = {"dynamics": dynamics}
    expected = computed_torque(X, V, X_D, V_D, A_D, gains=TaskGains(90.0, 14.0), **how)
    feed = computed_torque(X, V, X_D, V_D, A_D, gains=TaskGains(0.0, 0.0), **how)
    M = np.empty((6, 6))
    rest = computed_torque(X, V, X_D, V, np.zeros(6), gains=TaskGains(0.0, 0.0), **how)
    for k in range(6):
        one = computed_torque(X, V, X_D, V, np.eye(6)[k], gains=TaskGains(0.0, 0.0), **how)
        M[:, k] = one - rest
    found = impedance_wrench(feed, pose_deviation(X, X_D), V_D - V, 90.0 * M, 14.0 * M)
    np.testing.assert_allclose(found, expected, atol=ROUNDING * np.abs(expected).max())


def test_an_admittance_is_exact_for_a_constant_wrench():
    mass, damping, stiffness = np.full(6, 2.0), np.full(6, 3.0), np.array([50.0] * 3 + [0.0] * 3)
    wrench, period = np.arange(1.0, 7.0), 0.05
    law, y, rate = Admittance(mass, damping, stiffness, period), np.zeros(6), np.zeros(6)
    for _ in range(20):
        y, rate = law.step(y, rate, wrench)

    def rates(_, s):
        return np.concatenate([s[6:], (wrench - damping * s[6:] - stiffness * s[:6]) / mass])

    end = solve_ivp(rates, (0.0, 1.0), np.zeros(12), rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(np.concatenate([y, rate]), end, atol=1e-8)
    np.testing.assert_allclose(law.acceleration(y, rate, wrench), rates(0.0, end)[6:], atol=1e-7)


def test_a_deviation_undoes_a_displacement():
    X = RigidTransform(TURN, [0.1, 0.2, 0.3])
    y = np.array([1e-4, -2e-4, 3e-4, 0.01, -0.02, 0.03])
    # 2 sin(angle / 2) of the angle: they differ by its cube over 24.
    np.testing.assert_allclose(pose_deviation(X, displaced(X, y)), y, atol=1e-11)


def test_a_hybrid_wrench_is_each_along_its_axes():
    follows, presses = np.random.default_rng(1).normal(size=(2, 6))
    pressed = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    F = hybrid_wrench(follows, presses, TURN, pressed)
    R = np.kron(np.eye(2), TURN.matrix())
    np.testing.assert_allclose(
        R.T @ F, np.where(pressed > 0.0, R.T @ presses, R.T @ follows), atol=ROUNDING
    )
    np.testing.assert_allclose(in_world(TURN, pressed) @ F, in_world(TURN, pressed) @ presses)


def test_work_of_a_port_by_hand():
    poses = [pose_row(RigidTransform([0.01 * k, 0.0, 0.0])) for k in range(5)]
    wrenches = np.tile([0.0, 0.0, 0.0, 3.0, 9.0, 0.0], (5, 1))
    np.testing.assert_allclose(port_energy(np.array(poses), wrenches), 0.03 * np.arange(5))
    turns = [
        pose_row(RigidTransform(RotationMatrix.MakeZRotation(0.001 * k), [0, 0, 0]))
        for k in range(5)
    ]
    moments = np.tile([0.0, 0.0, 2.0, 0.0, 0.0, 0.0], (5, 1))
    energy = port_energy(np.array(turns), moments)
    np.testing.assert_allclose(energy, 0.002 * np.arange(5), rtol=1e-6)


def test_an_admittance_needs_mass():
    with pytest.raises(ControlGainError, match="axis 1 of 6: found mass 0"):
        Admittance(np.zeros(6), np.ones(6), np.ones(6), 0.01)
