"""Equilibria and small oscillations against closed forms, elastic and inextensible."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.errors import ForwardKinematicsError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_statics import rigid_platform, wrench_balance
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.stiffness import inextensible_modes, natural_modes, platform_stiffness
from tests.motion.small_robots import BEAM, MOTIONS, small_robot

G = 9.81
RELATIVE = 1e-6
"""Of a frequency against its closed form."""

SETTLED = 1e-8
"""Of a pose of rest [m]."""


def rest_and_modes(robot, l0, model="elastic", guess=None):
    """Pose of rest, tensions and natural modes with unstrained lengths."""
    cables, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    start = robot.home.transform() if guess is None else guess
    rest = equilibrium_near(cables, model, platform, l0, start)
    if model == "inextensible":
        modes = inextensible_modes(cables, platform, rest.X_WP, rest.tensions)
    else:
        K = platform_stiffness(cables, model, platform, rest.X_WP, l0).total
        modes = natural_modes(K, platform, rest.X_WP)
    return rest, modes


def stiffness_of(robot):
    return robot.stiffness()[0]


def test_a_point_on_one_cable_swings_and_bounces():
    robot, l0, m = small_robot("pendulum"), np.array([1.5]), 2.0
    rest, modes = rest_and_modes(robot, l0)
    k = stiffness_of(robot) / l0[0]
    length = l0[0] + m * G / k
    assert rest.X_WP.translation()[2] == pytest.approx(2.0 - length, abs=SETTLED)
    expected = np.sqrt([G / length, G / length, k / m]) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, expected, rtol=RELATIVE)
    rest, modes = rest_and_modes(robot, l0, "inextensible")
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.5], atol=SETTLED)
    np.testing.assert_allclose(modes.frequencies, np.sqrt(G / 1.5) / (2 * np.pi), rtol=RELATIVE)
    assert rest.tensions[0] == pytest.approx(m * G, rel=RELATIVE)


def test_a_body_on_one_cable_is_a_double_pendulum():
    centered = {"mass": 3.0, "size": [0.4, 0.3, 0.2], "box_center": [0.0, 0.0, 0.0]}
    robot = small_robot("body_pendulum", platform=centered)
    L, b, m = 1.45, 0.05, 3.0
    rest, modes = rest_and_modes(robot, np.array([L]), "inextensible")
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.5], atol=SETTLED)
    found = []
    for inertia in (m / 12.0 * (0.3**2 + 0.2**2), m / 12.0 * (0.4**2 + 0.2**2)):
        M = np.array([[m * L**2, m * L * b], [m * L * b, m * b**2 + inertia]])
        K = m * G * np.diag([L, b])
        found += list(np.linalg.eigvals(np.linalg.solve(M, K)))
    expected = np.sort(np.sqrt(np.append(found, 0.0))) / (2.0 * np.pi)  # it spins freely
    np.testing.assert_allclose(modes.frequencies, expected, rtol=RELATIVE)


def test_a_point_mass_on_three_cables_hangs_symmetrically():
    turns = 2.0 * np.pi * np.arange(3) / 3.0
    pairs = [[float(1.2 * np.cos(a)), float(1.2 * np.sin(a)), 2.0] for a in turns]
    cables = [
        {"name": f"c{k}", "exit_point": A, "anchor_point": [0.0, 0.0, 0.0]}
        for k, A in enumerate(pairs)
    ]
    home = {"position": [0.0, 0.0, 0.5]}
    robot = small_robot("tripod", cables=cables, home=home)
    m, length = 2.0, np.hypot(1.2, 1.5)
    s, c = 1.5 / length, 1.2 / length
    t = m * G / (3.0 * s)
    E = stiffness_of(robot)
    l0 = np.full(3, length / (1.0 + t / E))
    rest, modes = rest_and_modes(robot, l0)
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.5], atol=SETTLED)
    np.testing.assert_allclose(rest.tensions, t, rtol=RELATIVE)
    k, turned = E / l0[0], t / length  # along a cable, and across it
    side = 1.5 * (k * c**2 + turned * s**2) + 1.5 * turned
    up = 3.0 * (k * s**2 + turned * c**2)
    expected = np.sort(np.sqrt(np.array([side, side, up]) / m)) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, expected, rtol=RELATIVE)
    report = static_at_pose(robot, robot.home.transform(), "elastic", False)
    np.testing.assert_allclose(report.tensions, t, rtol=RELATIVE)
    assert static_at_pose(robot, robot.home.transform(), "inextensible", False).frequencies is None


def parallelogram():
    """A box on four parallel cables: a platform that swings as a point on each of them."""
    corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)]
    cables = [
        {"name": f"c{k}", "exit_point": [x, y, 1.8], "anchor_point": [x, y, 0.0]}
        for k, (x, y) in enumerate(corners)
    ]
    body = {"mass": 3.0, "size": [1.0, 0.8, 0.1], "box_center": [0.0, 0.0, 0.0]}
    return small_robot("hanging_four", platform=body, cables=cables,
                       home={"position": [0.0, 0.0, 0.3]})  # fmt: skip


def test_an_underactuated_platform_on_four_parallel_cables():
    robot, m, L = parallelogram(), 3.0, 1.5
    inertia = m / 12.0 * np.array([0.8**2 + 0.1**2, 1.0 + 0.1**2, 1.0 + 0.8**2])
    K_zz = m * G / L * (0.5**2 + 0.4**2)
    expected = [np.sqrt(G / L), np.sqrt(G / L), np.sqrt(K_zz / inertia[2])]
    E = stiffness_of(robot)
    l0 = np.full(4, L / (1.0 + m * G / 4.0 / E))
    rest, modes = rest_and_modes(robot, l0)
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.3], atol=SETTLED)
    k = E / l0[0]
    tilt = [np.sqrt(4 * k * 0.4**2 / inertia[0]), np.sqrt(4 * k * 0.5**2 / inertia[1])]
    elastic = np.sort([*expected, np.sqrt(4 * k / m), *tilt]) / (2 * np.pi)
    np.testing.assert_allclose(modes.frequencies, elastic, rtol=RELATIVE)
    report = static_at_pose(robot, robot.home.transform(), "elastic", False)
    np.testing.assert_allclose(report.tensions, m * G / 4.0, rtol=RELATIVE)


def test_the_same_on_cables_that_keep_their_lengths():
    robot = small_robot("hanging_four")
    cables = robot.cable_set().without_pulleys()
    l0 = cable_paths(robot.home.transform(), cables).lengths
    report = static_at_lengths(robot, l0, "inextensible", False)
    assert report.frequencies is not None
    assert len(report.frequencies) == 2  # six less four
    stiff = small_robot("hanging_four", cable={
        "youngs_modulus": 5e13 / 10, "diameter": 0.02, "linear_density": 0.004,
        "retardation_time": 1e-3})  # fmt: skip
    elastic, modes = rest_and_modes(stiff, l0, guess=report.X_WP)
    distance = elastic.X_WP.translation() - report.X_WP.translation()
    np.testing.assert_allclose(distance, 0.0, atol=1e-6)
    np.testing.assert_allclose(modes.frequencies[:2], report.frequencies, rtol=1e-5)


def test_a_lift_and_a_slope_on_springs():
    robot, m = small_robot("lift"), 2.0
    l0 = np.array([1.4, 2.3])
    rest, modes = rest_and_modes(robot, l0)
    z = rest.X_WP.translation()[2]
    E = stiffness_of(robot)
    up, low = np.array([0.4, 2.0 - z]), np.array([0.4, -2.0 - z])
    along = []
    for v, length in ((up, l0[0]), (low, l0[1])):
        now = np.linalg.norm(v)
        t = E * (now / length - 1.0)
        along.append((t * v[1] / now, E / length * (v[1] / now) ** 2 + t / now * (v[0] / now) ** 2))
    assert sum(force for force, _ in along) == pytest.approx(m * G, rel=RELATIVE)
    expected = np.sqrt(sum(k for _, k in along) / m) / (2.0 * np.pi)
    assert modes.frequencies[0] == pytest.approx(expected, rel=RELATIVE)
    np.testing.assert_array_equal(rest.X_WP.translation()[:2], [0.3, 0.0])


def test_a_point_in_an_upright_plane_on_two_cables():
    robot = small_robot("upright_point")
    l0 = cable_paths(robot.home.transform(), robot.cable_set()).lengths
    rest, modes = rest_and_modes(robot, l0, "inextensible")
    np.testing.assert_allclose(rest.X_WP.translation(), [0.2, 0.1, 0.3], atol=SETTLED)
    assert len(modes.frequencies) == 0
    one = {"cables": [{"name": "a", "exit_point": [0.2, 0.1, 1.3], "anchor_point": [0, 0, 0]}]}
    rest, modes = rest_and_modes(small_robot("upright_point", **one), np.array([1.0]),
                                 "inextensible")  # fmt: skip
    assert modes.frequencies == pytest.approx([np.sqrt(G) / (2 * np.pi)], rel=RELATIVE)


def test_a_beam_on_one_cable_has_five_motions():
    top = [{"name": "a", "exit_point": [0.0, 0.0, 2.0], "anchor_point": [0.0, 0.0, 0.3]}]
    robot = small_robot("beam", cables=top, home={"position": [0.0, 0.0, 0.7]})
    L, b, m = 1.0, 0.3, 2.0
    rest, modes = rest_and_modes(robot, np.array([L]), "inextensible")
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.7], atol=SETTLED)
    inertia = m / 12.0 * (BEAM["size"][0] ** 2 + BEAM["size"][2] ** 2)
    M = np.array([[m * L**2, m * L * b], [m * L * b, m * b**2 + inertia]])
    two = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, m * G * np.diag([L, b])))) / (2 * np.pi)
    np.testing.assert_allclose(modes.frequencies, np.sort(np.repeat(two, 2)), rtol=RELATIVE)


def test_gravity_along_y_turns_a_pendulum_over():
    cables = [{"name": "a", "exit_point": [0.0, 1.5, 0.5], "anchor_point": [0.0, 0.0, 0.0]}]
    robot = small_robot("pendulum", cables=cables, gravity_direction=[0.0, -2.0, 0.0])
    rest, modes = rest_and_modes(robot, np.array([1.5]), "inextensible",
                                 RigidTransform([0.05, 0.02, 0.4]))  # fmt: skip
    np.testing.assert_allclose(rest.X_WP.translation(), [0.0, 0.0, 0.5], atol=SETTLED)
    np.testing.assert_allclose(modes.frequencies, np.sqrt(G / 1.5) / (2 * np.pi), rtol=RELATIVE)
    assert rest.energy == pytest.approx(0.0, abs=1e-6)  # at the height of the origin


@pytest.mark.parametrize("name", MOTIONS)
def test_every_type_rests_with_as_many_modes_as_freedom(name):
    robot = small_robot(name)
    cables = robot.cable_set().without_pulleys()
    l0 = cable_paths(robot.home.transform(), cables).lengths * (1.0 - 1e-4)
    report = static_at_lengths(robot, l0, "elastic", False)
    motion = robot.motion_type()
    assert len(report.frequencies) == len(report.principal) == motion.freedom
    assert report.stiffness.shape == (motion.freedom, motion.freedom)
    R = report.X_WP.rotation().matrix()
    B = motion.basis(R)
    np.testing.assert_allclose(B @ B.T @ report.modes, report.modes, atol=1e-9)
    balance = wrench_balance(robot, report.X_WP)
    off = balance.W @ report.tensions + balance.wrench
    np.testing.assert_allclose(off, 0.0, atol=1e-6 * 2.0 * G)


@pytest.mark.parametrize("name", [n for n in MOTIONS if n not in ("pendulum", "body_pendulum")])
def test_lengths_give_the_pose_back(name):
    robot = small_robot(name)
    motion, home = robot.motion_type(), robot.home.transform()
    cables = robot.cable_set().without_pulleys()
    if robot.is_underactuated():
        with pytest.raises(ForwardKinematicsError, match="the pose follows from equilibrium"):
            ForwardKinematics(cables, motion)
        return
    fk = ForwardKinematics(cables, motion)
    R = home.rotation().matrix()
    twist = motion.twist(np.full(motion.freedom, 0.02), R)
    X_WP = RigidTransform(
        rotation_from_vector(twist[:3]) @ home.rotation(), home.translation() + twist[3:]
    )
    found = fk.pose(fk.lengths(X_WP), home)
    p_PB = cables.p_PB  # a beam's turn about itself is not told by them
    np.testing.assert_allclose(found.X_WP.multiply(p_PB), X_WP.multiply(p_PB), atol=1e-8)
    assert found.J.shape == (len(robot.cables), motion.freedom)
