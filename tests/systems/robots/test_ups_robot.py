"""Rods in place of cables: where they are, and how they accelerate the platform."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.poses import cross_matrix, pose_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import add_ups_robot, rod_masses
from cdpr_drake.systems.robots.cable_robot import holding_tensions
from cdpr_drake.systems.robots.ups_robot import UpsRobot
from tests.systems.robots.engines import pose

CLOSED = 1e-14
"""Of a gap between points about one metre from the origin [m]."""

SOLVER = 2e-3
"""Of the solver's accelerations, whose loops are as stiff as its step allows, relative."""

ROBOT = load_robot("acrobot_small")
A, B = ROBOT.exit_points(), ROBOT.anchor_points()


@pytest.fixture(scope="module")
def in_plant():
    plant = MultibodyPlant(1e-3)
    ups = add_ups_robot(plant, ROBOT, rod_masses(ROBOT))
    plant.Finalize()
    return ups, plant.CreateDefaultContext()


def test_every_cable_has_a_universal_a_prismatic_and_a_spherical_joint(in_plant):
    ups, context = in_plant
    plant = ups.in_plant.plant
    assert plant.num_velocities() == 6 + 8 * 3
    assert plant.num_constraints() == 8
    assert plant.num_actuators() == 8
    ups.set_pose(context, ROBOT.home.transform())
    assert np.max(ups.gaps(context)) < CLOSED


@given(
    position=st.tuples(*[st.floats(-0.25, 0.25)] * 2, st.floats(0.05, 0.6)),
    angles=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)
@settings(max_examples=20)
def test_the_loops_are_closed_at_every_pose_and_the_rods_as_long_as_cables(
    in_plant, position, angles
):
    ups, context = in_plant
    X_WP = pose_from_angles(np.array(position), np.array(angles))
    ups.set_pose(context, X_WP)
    assert np.max(ups.gaps(context)) < CLOSED
    plant = ups.in_plant.plant
    lengths = [plant.get_joint(index).get_translation(context) for index in ups.prismatic]
    np.testing.assert_allclose(lengths, cable_lengths(X_WP, A, B), rtol=1e-13)


def acceleration_from_rest(X_WP, tensions, masses):
    """By hand: rods move with the platform, so their masses add to its inertia and weight."""
    turn = X_WP.rotation()
    R = np.kron(np.eye(2), turn.matrix())
    M = R @ platform_inertia(ROBOT).CopyToFullMatrix6() @ R.T
    g = np.array([0.0, 0.0, -ROBOT.gravity])
    F = -length_jacobian(X_WP, A, B).T @ tensions
    weight = np.concatenate([np.cross(turn.multiply(ROBOT.center_of_mass()), g), g])
    F += ROBOT.platform.mass * weight
    rods = cable_lengths(ROBOT.home.transform(), A, B)
    for a, b, mass, rod in zip(A.T, B.T, masses, rods, strict=True):
        along = X_WP.multiply(b) - a
        length = np.linalg.norm(along)
        u = along / length
        J_B = np.hstack([-cross_matrix(turn.multiply(b)), np.eye(3)])
        J_u = (np.eye(3) - np.outer(u, u)) @ J_B / length
        J_middle, J_turn = J_B - 0.5 * rod * J_u, cross_matrix(u) @ J_u
        M = M + mass * J_middle.T @ J_middle + mass * rod**2 / 12.0 * J_turn.T @ J_turn
        F = F + J_middle.T @ (mass * g)
    return np.linalg.solve(M, F)


@pytest.mark.parametrize("times", [0.01, 1.0, 100.0])
def test_rods_add_their_inertia_and_weight(times):
    X_WP = pose_from_angles(np.array([0.1, -0.05, 0.3]), np.array([0.1, -0.2, 0.3]))
    tensions = holding_tensions(ROBOT, ROBOT.home.transform()) * np.linspace(0.8, 1.3, 8)
    masses, step = times * rod_masses(ROBOT), 1e-4
    block = UpsRobot(ROBOT, masses, step)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    assert pose(block, context).IsNearlyEqualTo(ROBOT.home.transform(), 1e-12)
    block.set_pose(context, X_WP)
    block.GetInputPort("tensions").FixValue(context, tensions)
    simulator.AdvanceTo(step)
    plant_context = block.plant.GetMyContextFromRoot(context)
    V = block.ups.in_plant.body.EvalSpatialVelocityInWorld(plant_context).get_coeffs()
    expected = acceleration_from_rest(X_WP, tensions, masses)
    np.testing.assert_allclose(V / step, expected, atol=SOLVER * np.max(np.abs(expected)))


def test_rods_weigh_what_cables_weigh():
    lengths = cable_lengths(ROBOT.home.transform(), A, B)
    np.testing.assert_allclose(rod_masses(ROBOT), 0.00305 * lengths)
