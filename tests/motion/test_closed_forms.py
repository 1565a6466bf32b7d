"""Equilibria and small oscillations against closed forms, elastic and inextensible."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.statics.robot_at_rest import static_at_lengths, static_at_pose
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_statics import rigid_platform, wrench_balance
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.stiffness import inextensible_modes, natural_modes, platform_stiffness
from tests.motion.small_robots import BEAM, MOTIONS, small_robot

G = 9.81
RELATIVE = 1e-6  # of a frequency against its closed form
SETTLED = 1e-8  # of a pose of rest [m]


def cable(name, exit_point, anchor_point=(0.0, 0.0, 0.0)):
    return {
        "name": name, "exit_point": list(map(float, exit_point)),
        "anchor_point": list(map(float, anchor_point)),
    }  # fmt: skip


def home_at(*p):
    return {"position": list(p)}


def check_rest(robot, l0, model, p, angular, guess=None):
    """Rest at p, with natural modes at these angular frequencies [rad/s]; returns the rest."""
    cables, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    start = robot.home.transform() if guess is None else guess
    rest = equilibrium_near(cables, model, platform, np.array(l0, float), start)
    if model == "inextensible":
        modes = inextensible_modes(cables, platform, rest.X_WP, rest.tensions)
    else:
        K = platform_stiffness(cables, model, platform, rest.X_WP, np.array(l0, float)).total
        modes = natural_modes(K, platform, rest.X_WP)
    if p is not None:
        np.testing.assert_allclose(rest.X_WP.translation(), p, atol=SETTLED)
    expected = np.sort(angular(rest) if callable(angular) else angular) / (2.0 * np.pi)
    assert len(modes.frequencies) == len(expected)
    np.testing.assert_allclose(modes.frequencies, expected, rtol=RELATIVE)
    return rest


def stiffness_of(robot):
    return robot.stiffness()[0]


def double_pendulum(m, L, b, inertia):
    """Squares of the angular frequencies of a body of that inertia, at b below a cable of L."""
    M = np.array([[m * L**2, m * L * b], [m * L * b, m * b**2 + inertia]])
    return list(np.linalg.eigvals(np.linalg.solve(M, m * G * np.diag([L, b]))))


def test_a_point_on_one_cable_swings_and_bounces():
    robot, m = small_robot("pendulum"), 2.0
    k = stiffness_of(robot) / 1.5
    length = 1.5 + m * G / k
    squares = [G / length, G / length, k / m]
    check_rest(robot, [1.5], "elastic", [0.0, 0.0, 2.0 - length], np.sqrt(squares))
    swings = np.sqrt([G / 1.5, G / 1.5])
    rest = check_rest(robot, [1.5], "inextensible", [0.0, 0.0, 0.5], swings)
    assert rest.tensions[0] == pytest.approx(m * G, rel=RELATIVE)


def test_gravity_along_y_turns_a_pendulum_over():
    cables, down = [cable("a", (0.0, 1.5, 0.5))], [0.0, -2.0, 0.0]
    robot = small_robot("pendulum", cables=cables, gravity_direction=down)
    guess, swings = RigidTransform([0.05, 0.02, 0.4]), np.sqrt([G / 1.5, G / 1.5])
    rest = check_rest(robot, [1.5], "inextensible", [0.0, 0.0, 0.5], swings, guess)
    assert rest.energy == pytest.approx(0.0, abs=1e-6)  # at the height of the origin


def test_a_body_on_one_cable_is_a_double_pendulum():
    """Which spins freely."""
    body = {"mass": 3.0, "size": [0.4, 0.3, 0.2], "box_center": [0.0, 0.0, 0.0]}
    robot = small_robot("body_pendulum", platform=body)
    inertias = [3.0 / 12.0 * (a**2 + 0.2**2) for a in (0.3, 0.4)]
    squares = [x for inertia in inertias for x in double_pendulum(3.0, 1.45, 0.05, inertia)]
    check_rest(robot, [1.45], "inextensible", [0.0, 0.0, 0.5], np.sqrt([*squares, 0.0]))


def test_a_beam_on_one_cable_has_five_motions():
    top = [cable("a", (0.0, 0.0, 2.0), (0.0, 0.0, 0.3))]
    robot = small_robot("beam", cables=top, home=home_at(0.0, 0.0, 0.7))
    inertia = 2.0 / 12.0 * (BEAM["size"][0] ** 2 + BEAM["size"][2] ** 2)
    squares = double_pendulum(2.0, 1.0, 0.3, inertia)
    check_rest(robot, [1.0], "inextensible", [0.0, 0.0, 0.7], np.sqrt(np.repeat(squares, 2)))


def test_a_point_mass_on_three_cables_hangs_symmetrically():
    turns = 2.0 * np.pi * np.arange(3) / 3.0
    cables = [cable(f"c{a:.0f}", (1.2 * np.cos(a), 1.2 * np.sin(a), 2.0)) for a in turns]
    robot = small_robot("tripod", cables=cables, home=home_at(0.0, 0.0, 0.5))
    m, length, E = 2.0, np.hypot(1.2, 1.5), stiffness_of(robot)
    s, c = 1.5 / length, 1.2 / length
    t = m * G / (3.0 * s)
    l0 = np.full(3, length / (1.0 + t / E))
    k, turned = E / l0[0], t / length  # along a cable, and across it
    side = 1.5 * (k * c**2 + turned * s**2) + 1.5 * turned
    up = 3.0 * (k * s**2 + turned * c**2)
    squares = np.array([side, side, up]) / m
    rest = check_rest(robot, l0, "elastic", [0.0, 0.0, 0.5], np.sqrt(squares))
    np.testing.assert_allclose(rest.tensions, t, rtol=RELATIVE)
    home = robot.home.transform()
    tensions = static_at_pose(robot, home, "elastic", False).tensions
    np.testing.assert_allclose(tensions, t, rtol=RELATIVE)
    assert static_at_pose(robot, home, "inextensible", False).frequencies is None


def test_an_underactuated_platform_on_four_parallel_cables():
    """A platform that swings as a point on each of them."""
    corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)]
    cables = [cable(f"c{k}", (*p, 1.8), (*p, 0.0)) for k, p in enumerate(corners)]
    body = {"mass": 3.0, "size": [1.0, 0.8, 0.1], "box_center": [0.0, 0.0, 0.0]}
    robot = small_robot("hanging_four", platform=body, cables=cables, home=home_at(0.0, 0.0, 0.3))
    m, L, E = 3.0, 1.5, stiffness_of(robot)
    inertia = m / 12.0 * np.array([0.8**2 + 0.1**2, 1.0 + 0.1**2, 1.0 + 0.8**2])
    l0 = np.full(4, L / (1.0 + m * G / 4.0 / E))
    k = E / l0[0]
    turning = m * G / L * (0.5**2 + 0.4**2) / inertia[2]
    tilts = 4 * k * 0.4**2 / inertia[0], 4 * k * 0.5**2 / inertia[1]
    squares = [G / L, G / L, turning, 4 * k / m, *tilts]
    check_rest(robot, l0, "elastic", [0.0, 0.0, 0.3], np.sqrt(squares))
    tensions = static_at_pose(robot, robot.home.transform(), "elastic", False).tensions
    np.testing.assert_allclose(tensions, m * G / 4.0, rtol=RELATIVE)


def test_stiff_cables_are_as_those_that_keep_their_lengths():
    robot = small_robot("hanging_four")
    l0 = cable_paths(robot.home.transform(), robot.cable_set()).lengths
    report = static_at_lengths(robot, l0, "inextensible", False)
    assert len(report.frequencies) == 2  # six less four
    rope = {"youngs_modulus": 5e12, "diameter": 0.02, "linear_density": 0.004,
            "retardation_time": 1e-3}  # fmt: skip
    stiff = static_at_lengths(small_robot("hanging_four", cable=rope), l0, "elastic", False)
    distance = stiff.X_WP.translation() - report.X_WP.translation()
    np.testing.assert_allclose(distance, 0.0, atol=1e-6)
    np.testing.assert_allclose(stiff.frequencies[:2], report.frequencies, rtol=1e-5)


def test_a_lift_on_springs():
    robot, m, l0 = small_robot("lift"), 2.0, np.array([1.4, 2.3])

    def frequency(rest):
        rise = np.array([2.0, -2.0]) - rest.X_WP.translation()[2]
        length, E = np.hypot(0.4, rise), stiffness_of(robot)
        t, up = E * (length / l0 - 1.0), rise / length
        assert np.sum(t * up) == pytest.approx(m * G, rel=RELATIVE)
        return np.sqrt([np.sum(E / l0 * up**2 + t / length * (0.4 / length) ** 2) / m])

    rest = check_rest(robot, l0, "elastic", None, frequency)
    np.testing.assert_array_equal(rest.X_WP.translation()[:2], [0.3, 0.0])


def test_a_point_in_an_upright_plane_on_one_and_two_cables():
    robot = small_robot("upright_point")
    l0 = cable_paths(robot.home.transform(), robot.cable_set()).lengths
    check_rest(robot, l0, "inextensible", [0.2, 0.1, 0.3], [])
    single = small_robot("upright_point", cables=[cable("a", (0.2, 0.1, 1.3))])
    check_rest(single, [1.0], "inextensible", None, [np.sqrt(G)])


@pytest.mark.parametrize("name", MOTIONS)
def test_every_type_rests_with_as_many_modes_as_freedom(name):
    robot = small_robot(name)
    motion, cables = robot.motion_type(), robot.cable_set().without_pulleys()
    l0 = cable_paths(robot.home.transform(), cables).lengths * (1.0 - 1e-4)
    report = static_at_lengths(robot, l0, "elastic", False)
    assert len(report.frequencies) == len(report.principal) == motion.freedom
    assert report.stiffness.shape == (motion.freedom, motion.freedom)
    B = motion.basis(report.X_WP.rotation().matrix())
    np.testing.assert_allclose(B @ B.T @ report.modes, report.modes, atol=1e-9)
    balance = wrench_balance(robot, report.X_WP)
    off = balance.W @ report.tensions + balance.wrench
    np.testing.assert_allclose(off, 0.0, atol=1e-6 * 2.0 * G)


UNDERACTUATED = ("pendulum", "body_pendulum", "hanging_four", "tilted_gravity")


@pytest.mark.parametrize("name", [name for name in MOTIONS if name not in UNDERACTUATED])
def test_lengths_give_the_pose_back(name):
    robot = small_robot(name)
    assert not robot.is_underactuated()
    motion, home = robot.motion_type(), robot.home.transform()
    cables = robot.cable_set().without_pulleys()
    fk = ForwardKinematics(cables, motion)
    twist = motion.twist(np.full(motion.freedom, 0.02), home.rotation().matrix())
    turn = rotation_from_vector(twist[:3]) @ home.rotation()
    X_WP = RigidTransform(turn, home.translation() + twist[3:])
    solution = fk.pose(fk.lengths(X_WP), home)
    p_PB = cables.p_PB  # a beam's turn about itself is not told by them
    np.testing.assert_allclose(solution.X_WP.multiply(p_PB), X_WP.multiply(p_PB), atol=1e-8)
    assert solution.J.shape == (len(robot.cables), motion.freedom)
