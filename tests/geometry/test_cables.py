"""Lengths, Jacobians, wrenches and rates of straight cables and arms against loops and slopes."""

import numpy as np
import pytest
from hypothesis import given
from pydrake.math import RigidTransform, RotationMatrix

import cdpr_drake as cdpr
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.calibration.station_kernel import LENGTH, U, cable_terms
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths, motion_of
from cdpr_drake.geometry.cable_rates import (
    base_adjoint,
    cable_rates_from_base_twist,
    cable_rates_from_platform_twist,
)
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import pack_cables
from cdpr_drake.geometry.poses import adjoint, exponential
from cdpr_drake.geometry.pulley_kernel import unit_vector_derivative
from cdpr_drake.geometry.straight_cables import (
    PLANAR_ROWS,
    cable_lengths,
    cable_vectors,
    gravity_wrench,
    length_jacobian,
    wrench_matrix,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.cable_derivatives_kernel import bend_gradient, exit_derivative
from tests.geometry.geometry_cases import P_PB, P_WA, few, poses, slopes, twist
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

ROUNDING = 1e-13  # a dozen products of numbers of size one
PATHS = 1e-12  # of robots of some metres
DIFFERENCE = 1e-8  # h^2 / length^2, plus 1e-16 / h, at lengths above 0.3 m
RATES = 1e-12  # of cable velocities of order one


@given(poses)
def test_lengths_vectors_and_jacobian_are_those_of_a_loop(X_WP):
    """Columns of the wrench matrix are minus the rows: tensions do the work of shortening."""
    lengths, rows = [], []
    p_AB_W, p_PB_W = cable_vectors(X_WP, P_WA, P_PB)
    for A, B, along, arm in zip(P_WA.T, P_PB.T, p_AB_W.T, p_PB_W.T, strict=True):
        np.testing.assert_allclose(A + along, X_WP @ B, atol=ROUNDING)
        np.testing.assert_allclose(arm, X_WP.rotation() @ B, atol=ROUNDING)
        lengths.append(np.linalg.norm(X_WP @ B - A))
        u = (X_WP @ B - A) / lengths[-1]
        rows.append(np.concatenate([np.cross(X_WP.rotation() @ B, u), u]))
    np.testing.assert_allclose(cable_lengths(X_WP, P_WA, P_PB), lengths, rtol=ROUNDING)
    J, W = length_jacobian(X_WP, P_WA, P_PB), wrench_matrix(X_WP, P_WA, P_PB)
    np.testing.assert_allclose(J, rows, atol=ROUNDING)
    np.testing.assert_array_equal(W, -J.T)
    by_differences = slopes(lambda X: cable_lengths(X, P_WA, P_PB), X_WP)
    np.testing.assert_allclose(J, by_differences, rtol=0, atol=DIFFERENCE)


@few
@given(poses)
def test_gravity_wrench_is_the_slope_of_the_potential_energy(X_WP):
    mass, p_PCo = 3.5, np.array([0.02, -0.03, 0.05])
    w = gravity_wrench(X_WP, mass, p_PCo, 9.0)
    slope = slopes(lambda X: mass * 9.0 * (X @ p_PCo)[2], X_WP)
    np.testing.assert_allclose(w, -slope, rtol=0, atol=mass * 9.0 * DIFFERENCE)
    w = gravity_wrench(RigidTransform(), 2.0, np.zeros(3))  # 9.81 m/s^2 by default
    np.testing.assert_array_equal(w, [0.0, 0.0, 0.0, 0.0, 0.0, -2.0 * 9.81])


def test_jacobian_takes_integers_and_slices():
    X_WP, A = RigidTransform([0.1, 0.0, 1.0]), np.array([[-2, 2], [0, 0], [3, 3]])
    B = np.asfortranarray(np.array([[0, 0, 1], [0, 0, 0], [1, 1, 1]]))[:, ::2]
    expected = length_jacobian(X_WP, A.astype(float), np.array(B, float, order="C"))
    np.testing.assert_array_equal(length_jacobian(X_WP, A, B), expected)


def test_a_platform_hanging_on_one_cable_is_pulled_up():
    W = wrench_matrix(RigidTransform([0.0, 0.0, 1.0]), [[0.0], [0.0], [3.0]], [[0.1], [0.0], [0.0]])
    assert W[5, 0] > 0.9  # the anchor point lies 0.1 m off the plumb line
    assert W[4, 0] == 0.0
    np.testing.assert_allclose(W[:3, 0], np.cross([0.1, 0.0, 0.0], W[3:, 0]), atol=ROUNDING)
    np.testing.assert_array_equal(np.eye(6)[list(PLANAR_ROWS)].sum(0), [0, 0, 1, 1, 1, 0])


def test_a_mirrored_robot_pulls_as_the_mirror_image():
    """In the plane x = 0 of a robot that is its own mirror image, equal tensions pull within it."""
    half_A = np.array([[0.8, 0.7, 1.5], [0.9, -0.6, 1.4]]).T
    half_B = np.array([[0.1, 0.1, 0.1], [0.1, -0.1, 0.0]]).T
    A, B = (np.hstack([half, np.diag([-1.0, 1.0, 1.0]) @ half]) for half in (half_A, half_B))
    X_WP = RigidTransform(RotationMatrix.MakeXRotation(0.2), [0.0, 0.1, 0.4])
    pull = wrench_matrix(X_WP, A, B) @ np.array([3.0, 5.0, 3.0, 5.0])
    np.testing.assert_allclose(pull[[1, 2, 3]], 0.0, atol=ROUNDING)
    lengths = cable_lengths(X_WP, A, B)
    np.testing.assert_allclose(lengths[:2], lengths[2:], rtol=ROUNDING)


A = 3.0 + np.random.default_rng(4).random((3, 8))
STRAIGHT = CableSet.make(A, P_PB, 1e5)
OVER_PULLEYS = CableSet.make(A, P_PB, 1e5, pulley_radius=0.05)


@pytest.mark.parametrize("cables", [STRAIGHT, OVER_PULLEYS], ids=["straight", "pulleys"])
@few
@given(X_WP=poses, X_PC=poses, V=twist)
def test_rates_through_platform_and_base_frame_are_those_of_the_jacobian(cables, X_WP, X_PC, V):
    """Servoing thesis A.3: A A_d = bA bA_d, for a camera C on the platform."""
    place, rows = (
        (X_WP.rotation().matrix().copy("C"), np.array(X_WP.translation())),
        cables.packed(),
    )
    mount = X_PC.rotation().matrix().copy("C"), np.array(X_PC.translation())
    V_P, rows = adjoint(X_PC) @ V, cables.packed()
    V_WP = np.concatenate([place[0] @ V_P[:3], place[0] @ V_P[3:]])
    expected = cable_jacobian(X_WP, cables) @ V_WP
    for rates in (
        cable_rates_from_platform_twist(*place, rows, V_P),
        cable_rates_from_base_twist(*place, rows, V_WP),
        cable_rates_from_base_twist(*place, rows, base_adjoint(place[0], *mount) @ V),
    ):
        np.testing.assert_allclose(rates, expected, rtol=0, atol=RATES)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_cables_and_paths_of_robots(name):
    robot = load_robot(name)
    home, cables = robot.home.transform(), robot.cable_set()
    T = np.full(cables.count, robot.cable.retardation_time)
    rows = pack_cables(robot.exit_points(), robot.anchor_points(), robot.stiffness(), T)
    np.testing.assert_array_equal(cables.packed()[:, :8], rows)
    assert np.all(cables.pulley_radius == robot.pulley.radius)
    np.testing.assert_allclose(cables.linear_weight, robot.cable.linear_density * robot.gravity)
    assert cables.has_pulleys() == (robot.pulley.radius > 0.0)
    plain = cables.without_pulleys()
    assert not plain.has_pulleys()
    paths = cable_paths(home, plain)
    lengths = cable_lengths(home, plain.p_WA, plain.p_PB)
    np.testing.assert_allclose(paths.lengths, lengths, rtol=0, atol=PATHS)
    J = length_jacobian(home, plain.p_WA, plain.p_PB)
    np.testing.assert_allclose(paths.J, J, rtol=0, atol=PATHS)
    np.testing.assert_array_equal(paths.p_WT, plain.p_WA)
    np.testing.assert_array_equal(paths.arcs, 0.0)
    turn = exponential(np.array([0.1, 0.05, -0.1, 0, 0, 0])).rotation()
    X_WP = home @ RigidTransform(turn, np.zeros(3))
    by_differences = slopes(lambda X: cable_paths(X, cables).lengths, X_WP)
    np.testing.assert_allclose(cable_paths(X_WP, cables).J, by_differences, atol=DIFFERENCE)


def test_the_parts_add_up_and_end_at_the_anchor_points():
    robot = load_robot("caroca")
    X_WP, cables = robot.home.transform(), robot.cable_set()
    paths = cable_paths(X_WP, cables)
    np.testing.assert_array_equal(paths.lengths, paths.free + paths.arcs)
    ends = paths.p_WT + paths.free * paths.u_W
    np.testing.assert_allclose(ends, X_WP.multiply(cables.p_PB), atol=PATHS)
    # A cable that falls steeply from a pulley of 75 mm covers more than a quarter of it.
    assert np.all(paths.arcs > 0.075 * np.pi / 2)
    assert np.all(paths.arcs < 0.075 * np.pi)


def test_packed_rows_hold_one_cable_each_with_its_own_numbers():
    p_WA, p_PB = np.array([[1.0, -1.0], [0.0, 0.1], [2.0, 2.1]]), P_PB[:, :2]
    cables = CableSet.make(p_WA, p_PB, 1e5, retardation=1e-4, pulley_radius=np.array([0.0, 0.05]))
    p_WA[0, 0] = 7.0
    assert cables.p_WA[0, 0] == 1.0
    rows = cables.packed()
    end = [1e5, 1e-4, 0.05, 0.0, 0.0, 0.0, 1.0]
    np.testing.assert_array_equal(rows[1], [-1.0, 0.1, 2.1, *p_PB[:, 1], *end, 0.0, 0.0, 0.0, 1.0])
    assert rows.flags.c_contiguous
    assert cables.count == 2


def test_a_swivel_axis_may_be_given_for_one_cable():
    robot = load_robot("acrobot_small")
    robot.cables[2].swivel_axis = np.array([0.0, 3.0, 4.0])
    axes = robot.cable_set().swivel_axis
    np.testing.assert_allclose(axes[:, 2], [0.0, 0.6, 0.8])
    np.testing.assert_array_equal(axes[:, 1], [0.0, 0.0, 1.0])


ARM = 0.1534  # between the middle of a sled and the belts [m]
CORNERS = np.array([[0.0, 3.0, 0.0, 3.0], [2.0, 2.0, 0.0, 0.0], [-0.1, -0.056, -0.034, -0.078]])
BOARD = CableSet.make(CORNERS, np.zeros((3, 4)), 1e5, swivel_axis=(0.0, 0.0, 1.0), arm=ARM)


@pytest.mark.parametrize("place", [(0.5, 1.6), (0.6, 1.4), (1.5, 1.0), (2.7, 0.2)])
def test_arms_stay_level_and_only_the_belt_is_inclined(place):
    """As MaslowKinematics::compute has it: the distance across, less the arm, and the height."""
    X_WP = RigidTransform([*place, 0.0])
    paths = cable_paths(X_WP, BOARD)
    belts = np.hypot(np.hypot(*(CORNERS[:2].T - place).T) - ARM, CORNERS[2])
    np.testing.assert_allclose(paths.lengths, belts, rtol=1e-14)
    np.testing.assert_array_equal(paths.arcs, 0.0)
    ends = paths.p_WT + paths.free * paths.u_W
    np.testing.assert_allclose(ends, np.tile([[*place, 0.0]], (4, 1)).T, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(paths.p_WT - CORNERS, axis=0), ARM)
    np.testing.assert_allclose(paths.p_WT[2], CORNERS[2])
    if place == (0.5, 1.6):  # published: 497.08 mm
        assert 1e3 * paths.lengths[0] == pytest.approx(497.08, abs=0.005)
    curve = cable_curves(BOARD, "elastic", X_WP, 0.99 * paths.lengths)[0]
    np.testing.assert_allclose(curve[:, 0], CORNERS[:, 0])
    np.testing.assert_allclose(np.linalg.norm(curve[:, 1] - CORNERS[:, 0]), ARM)
    np.testing.assert_allclose(curve[:, -1], X_WP.translation(), atol=1e-14)


def test_without_pulleys_there_are_no_arms():
    assert BOARD.has_pulleys()
    plain, X_WP = BOARD.without_pulleys(), RigidTransform([0.5, 1.6, 0.0])
    assert not plain.has_pulleys()
    straight = np.linalg.norm(CORNERS.T - X_WP.translation(), axis=1)
    np.testing.assert_allclose(cable_paths(X_WP, plain).lengths, straight)


TILTED = np.array([0.36, -0.48, 0.8])


def on_arms():
    """Cables with arms about a tilted axis, to a body that turns, and a pose of it."""
    rng = np.random.default_rng(3)
    p_WA, p_PB = rng.uniform(-2.0, 2.0, (3, 6)), rng.uniform(-0.2, 0.2, (3, 6))
    cables = CableSet.make(p_WA, p_PB, 1e5, swivel_axis=TILTED, arm=np.linspace(0.0, 0.3, 6))
    return cables, RigidTransform(RotationMatrix.MakeXRotation(0.3), [0.1, 0.2, -0.3])


def test_lines_ends_and_bends_on_arms_move_as_differences_say():
    (cables, X), v = on_arms(), (0.3, -0.7, 0.2)
    by_differences = slopes(lambda X: cable_paths(X, cables).lengths, X)
    np.testing.assert_allclose(cable_jacobian(X, cables), by_differences, rtol=0, atol=1e-7)
    lines, ends = (slopes(lambda X, n=n: getattr(cable_paths(X, cables), n), X)[..., 3:]
                   for n in ("u_W", "p_WT"))  # fmt: skip
    for i, row in enumerate(cables.packed()):
        turning, end, bend = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
        unit_vector_derivative(motion_of(X), row, turning)
        exit_derivative(motion_of(X), row, end)
        bend_gradient(motion_of(X), row, v, bend)
        np.testing.assert_allclose(turning, lines[:, i], rtol=0, atol=1e-7)
        np.testing.assert_allclose(end, ends[:, i], rtol=0, atol=1e-7)
        slope = slopes(lambda X, row=row: bend_gradient(motion_of(X), row, v, np.empty(3)), X)[3:]
        np.testing.assert_allclose(bend, slope, rtol=0, atol=1e-6)


def test_calibration_has_the_lengths_lines_and_turning_of_arms():
    cables, X = on_arms()
    numbers, vectors, hessians = np.empty((1, 6, 3)), np.empty((1, 6, 12)), np.empty((1, 6, 3, 3))
    R, p = X.rotation().matrix()[None].copy(), X.translation()[None].copy()
    cable_terms(R, p, cables.packed(), numbers, vectors, hessians)
    paths = cable_paths(X, cables)
    np.testing.assert_allclose(numbers[0, :, LENGTH], paths.lengths, rtol=1e-14)
    np.testing.assert_allclose(vectors[0, :, U : U + 3].T, paths.u_W, atol=1e-14)
    for row, hessian in zip(cables.packed(), hessians[0], strict=True):
        turning = np.empty((3, 3))
        unit_vector_derivative(motion_of(X), row, turning)
        np.testing.assert_allclose(hessian, turning, atol=1e-12)


def test_tensions_of_a_sled_balance_across_the_board():
    """Of maslow_4 as it ships, whose board carries its weight and what belts pull down."""
    robot, X_WP = load_robot("maslow_4"), RigidTransform([0.8, 2.6, 0.0])
    tensions = cdpr.solve_static(robot, X_WP).tensions
    u_W = cable_paths(X_WP, robot.cable_set()).u_W
    np.testing.assert_allclose((u_W @ tensions)[:2], 0.0, atol=1e-8)
    assert np.abs(u_W[2]).max() > 0.01
