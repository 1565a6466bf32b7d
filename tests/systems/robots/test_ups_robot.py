"""Rods in place of cables: where they are, and how they accelerate the platform."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake.errors import CableModelError, RobotFileError
from cdpr_drake.geometry.poses import cross_matrix, pose_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import add_ups_robot, rod_masses
from cdpr_drake.systems.robots.cable_robot import holding_tensions
from cdpr_drake.systems.robots.ups_robot import UpsRobot

CLOSED = 1e-14
"""Of a gap between points about one metre from the origin [m]."""

SOLVER = 2e-3
"""Of the solver's accelerations, whose loops are as stiff as its step allows, relative."""


@pytest.fixture(scope="module")
def in_plant():
    robot = load_robot("acrobot_small")
    plant = MultibodyPlant(1e-3)
    ups = add_ups_robot(plant, robot, rod_masses(robot))
    plant.Finalize()
    return ups, plant.CreateDefaultContext()


def test_every_cable_has_a_universal_a_prismatic_and_a_spherical_joint(in_plant):
    ups, _ = in_plant
    plant = ups.in_plant.plant
    assert plant.num_velocities() == 6 + 8 * 3
    assert plant.num_constraints() == 8
    assert plant.num_actuators() == 8


def test_the_loops_are_closed_at_home(in_plant):
    ups, context = in_plant
    ups.set_pose(context, ups.in_plant.robot.home.transform())
    assert np.max(ups.gaps(context)) < CLOSED


@given(
    position=st.tuples(*[st.floats(-0.25, 0.25)] * 2, st.floats(0.05, 0.6)),
    angles=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)
@settings(max_examples=30)
def test_the_loops_are_closed_at_every_pose_and_the_rods_as_long_as_cables(
    in_plant, position, angles
):
    ups, context = in_plant
    X_WP = pose_from_angles(np.array(position), np.array(angles))
    ups.set_pose(context, X_WP)
    assert np.max(ups.gaps(context)) < CLOSED
    robot, plant = ups.in_plant.robot, ups.in_plant.plant
    lengths = [plant.get_joint(index).get_translation(context) for index in ups.prismatic]
    expected = cable_lengths(X_WP, robot.exit_points(), robot.anchor_points())
    np.testing.assert_allclose(lengths, expected, rtol=1e-13)


def acceleration_from_rest(robot, X_WP, tensions, masses):
    """By hand: rods move with the platform, so their masses add to its inertia and weight."""
    A, B = robot.exit_points(), robot.anchor_points()
    R = np.kron(np.eye(2), X_WP.rotation().matrix())
    M = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    g = np.array([0.0, 0.0, -robot.gravity])
    p_PPcm_W = X_WP.rotation().multiply(robot.center_of_mass())
    F = -length_jacobian(X_WP, A, B).T @ tensions
    F += robot.platform.mass * np.concatenate([np.cross(p_PPcm_W, g), g])
    rod_lengths = cable_lengths(robot.home.transform(), A, B)
    for a, b, mass, rod in zip(A.T, B.T, masses, rod_lengths, strict=True):
        p_PB_W = X_WP.rotation().multiply(b)
        along = X_WP.multiply(b) - a
        length = np.linalg.norm(along)
        u = along / length
        J_B = np.hstack([-cross_matrix(p_PB_W), np.eye(3)])
        J_u = (np.eye(3) - np.outer(u, u)) @ J_B / length
        J_middle, J_turn = J_B - 0.5 * rod * J_u, cross_matrix(u) @ J_u
        M = M + mass * J_middle.T @ J_middle + mass * rod**2 / 12.0 * J_turn.T @ J_turn
        F = F + J_middle.T @ (mass * g)
    return np.linalg.solve(M, F)


@pytest.mark.parametrize("times", [0.01, 1.0, 100.0])
def test_rods_add_their_inertia_and_weight(times):
    robot = load_robot("acrobot_small")
    X_WP = pose_from_angles(np.array([0.1, -0.05, 0.3]), np.array([0.1, -0.2, 0.3]))
    tensions = holding_tensions(robot, robot.home.transform()) * np.linspace(0.8, 1.3, 8)
    masses = times * rod_masses(robot)
    step = 1e-4
    block = UpsRobot(robot, masses, step)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_pose(context, X_WP)
    block.GetInputPort("tensions").FixValue(context, tensions)
    simulator.AdvanceTo(step)
    plant_context = block.plant.GetMyContextFromRoot(context)
    V = block.ups.in_plant.body.EvalSpatialVelocityInWorld(plant_context).get_coeffs()
    expected = acceleration_from_rest(robot, X_WP, tensions, masses)
    np.testing.assert_allclose(V / step, expected, atol=SOLVER * np.max(np.abs(expected)))


def test_ports_are_these():
    robot = load_robot("caroca")
    block = UpsRobot(robot, rod_masses(robot), 1e-3)
    assert (block.num_input_ports(), block.num_output_ports()) == (1, 1)
    context = block.CreateDefaultContext()
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    assert X_WP.IsNearlyEqualTo(robot.home.transform(), 1e-12)
    assert block.GetInputPort("tensions").size() == 8


def test_rods_weigh_what_cables_weigh():
    robot = load_robot("acrobot_small")
    lengths = cable_lengths(
        RigidTransform(robot.home.position), robot.exit_points(), robot.anchor_points()
    )
    np.testing.assert_allclose(rod_masses(robot), 0.00305 * lengths)


def test_what_cannot_be_is_named():
    plant = MultibodyPlant(1e-3)
    with pytest.raises(RobotFileError, match="robot planar: motion: found 2T1R; accepted"):
        add_ups_robot(plant, load_robot("planar"), np.ones(4))
    with pytest.raises(CableModelError, match=r"masses of rods: found .*; accepted: 8 numbers > 0"):
        add_ups_robot(plant, load_robot("caroca"), np.zeros(8))
