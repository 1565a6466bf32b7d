"""The wrench of computed torque against the inverse dynamics of Drake's MultibodyPlant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import MultibodyForces

from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    computed_torque,
    floating_wrench,
    planar_wrench,
)
from cdpr_drake.errors import ControlGainError
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS, gravity_wrench
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.trajectories.pose_trajectory import motion_row
from tests.control.awkward_robots import GAINS, awkward_robot, plant_of, spatial, triple, turn

ORACLE = 1e-10
"""Difference from Drake's inverse dynamics, relative to the largest component: some hundred
products in another order, of terms that partly cancel."""

ROUNDING = 1e-12
"""A quaternion of another sign or size, relative."""

FLOATING = awkward_robot("acrobot_large")
PLANAR = awkward_robot("planar")
FLOATING_PLANT = plant_of(FLOATING)
PLANAR_PLANT = plant_of(PLANAR)


DAMPING = 7.0, 0.9


def inverse_dynamics(plant, in_plant, context, accelerations):
    """Generalized force of the cables for these generalized accelerations, against the damping.

    The damping's force is that of the block which brakes the simulated platform.
    """
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    brake = DampingSettings(translation=DAMPING[0], rotation=DAMPING[1]).block(in_plant)
    state = plant.GetPositionsAndVelocities(context)
    forces.mutable_generalized_forces()[:] += brake.D() @ state
    return plant.CalcInverseDynamics(context, accelerations, forces)


def sine_error(R_WP, R_WD):
    """2 sin(theta / 2) u, the vector part of the error's quaternion twice, in W."""
    theta_u = rotation_vector(R_WD @ R_WP.inverse())
    theta = np.linalg.norm(theta_u)
    return theta_u * np.sinc(theta / (2.0 * np.pi))


def close(found, expected, tolerance):
    return np.max(np.abs(found - expected)) <= tolerance * np.max(np.abs(expected))


@given(turn, triple, spatial, turn, triple, spatial, spatial)
def test_is_the_inverse_dynamics_of_a_floating_plant(r, p, V_WP, off, p_WD, V_WD, A_WD):
    plant, in_plant, context = FLOATING_PLANT
    X_WP = RigidTransform(rotation_from_vector(r), p)
    X_WD = RigidTransform(rotation_from_vector(off) @ X_WP.rotation(), p_WD)
    plant.SetFreeBodyPose(context, in_plant.body, X_WP)
    plant.SetVelocities(context, V_WP)
    e = np.concatenate([sine_error(X_WP.rotation(), X_WD.rotation()), p_WD - p])
    Kp, Kd = np.repeat([90.0, 120.0], 3), np.repeat([18.0, 25.0], 3)
    expected = inverse_dynamics(plant, in_plant, context, A_WD + Kp * e + Kd * (V_WD - V_WP))
    dynamics = PlatformDynamics(platform_inertia(FLOATING), FLOATING.gravity, damping=DAMPING)
    found = computed_torque(X_WP, V_WP, X_WD, V_WD, A_WD, dynamics=dynamics, gains=GAINS)
    assert close(found, expected, ORACLE)


@given(triple, triple, st.floats(-3.0, 3.0), triple, triple, triple)
def test_is_the_inverse_dynamics_of_a_planar_plant(q, v, off, p_WD, v_WD, a_WD):
    """State and acceleration (x, y, theta) of the joint; what leaves the plane does not count."""
    plant, in_plant, context = PLANAR_PLANT
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    R_WD = RotationMatrix.MakeZRotation(q[2] + off)
    e = np.array([*(p_WD[:2] - q[:2]), 2.0 * np.sin(off / 2.0)])
    Kp, Kd = np.array([120.0, 120.0, 90.0]), np.array([25.0, 25.0, 18.0])
    expected = inverse_dynamics(plant, in_plant, context, a_WD + Kp * e + Kd * (v_WD - v))
    V_WD, A_WD = np.full(6, 7.0), np.full(6, -3.0)
    V_WD[[3, 4, 2]], A_WD[[3, 4, 2]] = v_WD, a_WD
    dynamics = PlatformDynamics(
        platform_inertia(PLANAR), PLANAR.gravity, PLANAR_ROWS, damping=DAMPING
    )
    found = np.empty(6)
    planar_wrench(
        np.concatenate([q, v]),
        motion_row(RigidTransform(R_WD, p_WD), V_WD, A_WD),
        dynamics.packed(),
        GAINS.packed(),
        PLANAR.plane_height,
        found,
    )
    assert close(found[[3, 4, 2]], expected, ORACLE)
    np.testing.assert_array_equal(found[[0, 1, 5]], np.zeros(3))


def test_at_rest_it_carries_the_weight():
    X_WP = RigidTransform(rotation_from_vector([0.3, -0.5, 0.2]), [0.1, 0.2, 0.3])
    dynamics = PlatformDynamics(platform_inertia(FLOATING), FLOATING.gravity)
    found = computed_torque(
        X_WP, np.zeros(6), X_WP, np.zeros(6), np.zeros(6), dynamics=dynamics, gains=GAINS
    )
    weight = gravity_wrench(
        X_WP, FLOATING.platform.mass, FLOATING.center_of_mass(), FLOATING.gravity
    )
    assert close(found, -weight, ROUNDING)


@pytest.mark.parametrize(("of_state", "of_desired"), [(-1.0, 1.0), (1.0, -1.0), (1.1, 0.9)])
def test_sign_and_size_of_quaternions_do_not_matter(of_state, of_desired):
    """Integration lets the plant's quaternion drift from length 1."""
    X_WD = RigidTransform(rotation_from_vector([0.4, -1.2, 0.8]), [0.1, 0.0, 0.4])
    desired = motion_row(X_WD, np.ones(6), -np.ones(6))
    q = rotation_from_vector([-0.9, 0.2, 1.1]).ToQuaternion().wxyz()
    state = np.concatenate([q, [0.1, 0.2, 0.5, 1.0, -0.5, 0.3, 0.2, 0.1, -0.4]])
    packed = PlatformDynamics(platform_inertia(FLOATING)).packed(), GAINS.packed()
    expected, found = np.empty(6), np.empty(6)
    floating_wrench(state, desired, *packed, expected)
    state[:4] *= of_state
    desired[:4] *= of_desired
    floating_wrench(state, desired, *packed, found)
    assert close(found, expected, ROUNDING)


def test_one_gain_serves_rotation_and_translation():
    np.testing.assert_array_equal(TaskGains(4.0, 2.0).packed(), [4.0, 2.0, 4.0, 2.0])
    np.testing.assert_array_equal(GAINS.packed(), [90.0, 18.0, 120.0, 25.0])


@pytest.mark.parametrize("gain", [-1.0, np.nan, np.inf, (1.0, -2.0), (1.0, 2.0, 3.0)])
def test_refuses_gains_that_cannot_be(gain):
    with pytest.raises(ControlGainError, match="stiffness of a computed torque"):
        TaskGains(gain, 1.0).packed()
    with pytest.raises(ControlGainError, match="damping of a computed torque"):
        TaskGains(1.0, gain).packed()
