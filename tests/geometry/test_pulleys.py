"""Cables over pulleys at one end or both: constructions by hand, least lengths and differences."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.optimize import minimize, root

from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import cable_line
from cdpr_drake.geometry.pulley_kernel import (
    pulley_geometry,
    pulley_jacobian,
    pulley_lengths,
    pulley_line,
    unit_vector_derivative,
)
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning, free_line, line_by_pose
from tests.geometry.geometry_cases import few, slopes, unit, vector

ROUNDING = 1e-12  # lengths near 1 m, radii and tangents by one square root
AWAY = 0.02  # distance [m] of B from the swivel axis and of the free part from zero
Z = (0.0, 0.0, 1.0)
ORIGIN = np.zeros(3)

radii = st.floats(1e-3, 0.2)


def row(B, radius, axis=Z, A=(0.0, 0.0, 0.0)):
    A, B = (np.array(p, float)[:, np.newaxis] for p in (A, B))
    return CableSet.make(A, B, 1e5, pulley_radius=radius, swivel_axis=axis).packed()[0]


def at(p):
    """The motion of a platform without rotation at p."""
    return motion_of(RigidTransform(p))


def over(B, radius, axis=Z, A=(0.0, 0.0, 0.0)):
    """Free length, arc, tangent point and direction of a cable from A to B."""
    free, arc, *rest = pulley_geometry(at(B), row(ORIGIN, radius, axis, A))
    return free, arc, np.array(rest[:3]), np.array(rest[3:6])


def usable(B, axis, r):
    h = B @ axis
    rho = np.linalg.norm(B - h * axis)
    return rho > AWAY and (rho - r) ** 2 + h**2 > (r + AWAY) ** 2


@given(vector, vector, radii, unit)
def test_the_free_part_touches_the_groove(A, B, r, axis):
    """Textbook construction: centre, tangent point on the circle, right angle, lengths."""
    assume(usable(B, axis, r))
    free, arc, T, u = over(B, r, axis)
    out = B - (B @ axis) * axis
    out /= np.linalg.norm(out)
    spoke = (T - r * out) / r
    cosine, sine = spoke @ out, spoke @ axis
    # The groove is followed from A over its far side; without a kink the cable runs on.
    numbers = np.linalg.norm(spoke), spoke @ u, np.linalg.norm(u), u @ np.cross(axis, out)
    np.testing.assert_allclose(numbers, [1.0, 0.0, 1.0, 0.0], rtol=0, atol=ROUNDING / r)
    np.testing.assert_allclose(T + free * u, B, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(arc, r * (np.pi - np.arctan2(sine, cosine)), atol=ROUNDING)
    np.testing.assert_allclose(u, sine * out - cosine * axis, rtol=0, atol=ROUNDING / r)
    # A pulley elsewhere is the same pulley; a shift by metres rounds over distances of AWAY.
    there = over(A + B, r, axis, A)
    np.testing.assert_allclose(there[:2], [free, arc], rtol=0, atol=1e-11)
    np.testing.assert_allclose(there[2] - A, T, rtol=0, atol=1e-11)
    np.testing.assert_allclose(there[3], u, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("B", "free", "turns", "T", "u"),
    [
        ((0.7, 0.0, 0.1), 0.6, 0.25, (0.1, 0.0, 0.1), (1.0, 0.0, 0.0)),  # leaves at the top
        ((0.2, 0.0, -0.5), 0.5, 0.5, (0.2, 0.0, 0.0), (0.0, 0.0, -1.0)),  # straight down
    ],
)
def test_a_quarter_and_half_a_turn(B, free, turns, T, u):
    found = over(B, 0.1)
    np.testing.assert_allclose(found[:2], [free, 0.2 * np.pi * turns], atol=ROUNDING)
    np.testing.assert_allclose(found[2:], [T, u], atol=ROUNDING)


@few
@given(st.floats(0.05, 1.0), st.floats(-1.0, 1.0), st.floats(0.01, 0.3))
def test_length_is_stationary_over_points_where_the_cable_could_leave_the_groove(rho, h, r):
    """Virtual work: pulled at B, the frictionless cable leaves where its length is stationary."""
    assume(usable(np.array([rho, 0.0, h]), np.array(Z), r))
    free, arc, *_ = over((rho, 0.0, h), r)

    def way(arc):
        alpha = np.pi - arc / r
        T = r * np.array([1.0 + np.cos(alpha), np.sin(alpha)])
        return arc + np.hypot(rho - T[0], h - T[1])

    assert abs(way(arc) - (free + arc)) < ROUNDING
    # The second derivative is zero too: leaving earlier is a chord through the groove.
    near = 1e-3 * min(r, free)
    assert abs(way(arc + near) - way(arc - near)) / (2 * near) < 1e-5
    assert way(arc + near) >= way(arc) - ROUNDING >= way(arc - near) - 2 * ROUNDING


@few
@given(vector, vector, vector)
def test_without_radius_it_is_the_straight_cable_bit_by_bit(A, arm, p):
    assume(np.linalg.norm(p + arm - A) > 1e-3)
    cable = row(arm, 0.0, A=A)
    line = cable_line(at(p), cable)
    assert pulley_line(at(p), cable) == line
    assert pulley_geometry(at(p), cable) == (line[0], 0.0, *A, *line[1:])


@few
@given(vector)
def test_a_small_pulley_tends_to_the_straight_cable(B):
    """The difference is of the order of the radius."""
    assume(usable(B, np.array(Z), 1e-9))
    straight, small = (np.array(pulley_line(at(B), row(ORIGIN, r))) for r in (0.0, 1e-9))
    assert np.max(np.abs(small - straight)) < 1e-9 * 10.0 / AWAY


@given(vector, st.one_of(st.just(0.0), radii), unit)
def test_jacobian_and_turning_are_slopes_of_lengths_and_lines(B, r, axis):
    assume(usable(B, axis, r) and np.linalg.norm(B) > 0.1)
    arm = np.array([0.05, -0.08, 0.03])
    X, cable = RigidTransform(B - arm), row(arm, r, axis)
    lengths, again, J, H = np.empty(1), np.empty(1), np.empty((1, 6)), np.empty((3, 3))
    pulley_jacobian(motion_of(X), cable[np.newaxis], lengths, J)
    pulley_lengths(motion_of(X), cable[np.newaxis], again)
    assert lengths[0] == again[0]
    unit_vector_derivative(motion_of(X), cable, H)
    by_pose = slopes(lambda X: pulley_line(motion_of(X), cable)[:4], X)
    # Third derivatives are below 1e3 / m^2; turning out of the plane goes as 1 / rho^3.
    np.testing.assert_allclose(J[0], by_pose[0], rtol=0, atol=2e-8)
    np.testing.assert_allclose(H, by_pose[1:, 3:], atol=1e-5, rtol=1e-5)
    np.testing.assert_allclose(H, H.T, atol=1e-9)


def test_no_cable_runs_inside_the_groove_or_on_the_swivel_axis():
    for B in ((0.1, 0.0, 0.0), (0.0, 0.0, 0.5)):
        assert np.all(np.isnan(pulley_line(at(B), row(ORIGIN, 0.1))[:4]))


@pytest.mark.parametrize("rho", 10.0 ** np.arange(-16, -2))
def test_right_over_the_entry_nothing_lies_in_the_groove(rho):
    """Round-off of the angle must not add a whole turn."""
    free, arc, *_ = over((rho, 0.0, 0.5), 0.05)
    assert 0.0 <= arc < 0.01
    assert abs(free + arc - 0.5) < 2 * rho + ROUNDING


# Pulleys at the platform, and at both ends.

two_radii = st.floats(0.005, 0.15)
any_radius = st.one_of(st.just(0.0), two_radii)


def made(A, B, axis, anchor_axis, r, s):
    A, B, n, k = (np.array(v, float)[:, np.newaxis] for v in (A, B, axis, anchor_axis))
    n, k = n / np.linalg.norm(n), k / np.linalg.norm(k)
    cable = CableSet.make(A, B, 1e5, pulley_radius=r, swivel_axis=n)
    return cable.over_platform_pulleys(s, k)


def swapped(cable):
    """The cable with exit and anchor point swapped, its pulley at the exit point."""
    return CableSet.make(cable.p_PB, cable.p_WA, 1e5, pulley_radius=cable.anchor_pulley_radius,
                         swivel_axis=cable.anchor_swivel_axis)  # fmt: skip


@st.composite
def cables(draw, r=two_radii, s=two_radii):
    """A cable and a pose at which it runs well away from both swivel axes."""
    A, B, far, angles = (2.0 * draw(vector) for _ in range(4))
    cable = made(A, 0.3 * B, draw(unit), draw(unit), draw(r), draw(s))
    X = RigidTransform(RollPitchYaw(angles), far)
    line = free_line(motion_of(X), cable.packed()[0])
    sine_A, sine_B, rho_A, rho_B = line[7], line[9], line[11], line[12]
    assume(np.isfinite(line[0]) and line[0] > 0.3)
    assume(cable.pulley_radius[0] == 0.0 or (sine_A > 0.1 and rho_A > 0.05))
    assume(sine_B > 0.1 and rho_B > 0.05)
    return cable, X


@few
@given(cables(r=any_radius))
def test_jacobian_and_line_over_two_pulleys_are_slopes(case):
    cable, X = case
    packed, turning = cable.packed()[0], np.empty((6, 6))
    line_by_pose(motion_of(X), packed, turning)

    def line(X):
        length, ux, uy, uz, *arm = pulley_line(motion_of(X), packed)
        return [length, *np.cross(arm, [ux, uy, uz]), ux, uy, uz]

    J, by_pose = cable_jacobian(X, cable)[0], slopes(line, X)
    lengths = slopes(lambda X: line(X)[0], X, step=1e-5)
    np.testing.assert_allclose(J, lengths, rtol=0, atol=1e-8)
    np.testing.assert_allclose(turning, by_pose[1:], rtol=0, atol=2e-6)
    # Moment by translation and force by turn are the same second derivative of the length.
    np.testing.assert_allclose(turning[3:, :3], turning[:3, 3:].T, rtol=0, atol=1e-8)
    np.testing.assert_allclose(turning[3:, 3:], turning[3:, 3:].T, rtol=0, atol=1e-8)


@few
@given(cables(r=any_radius))
def test_ends_may_be_swapped(case):
    cable, X = case
    other = swapped(cable)
    if cable.pulley_radius[0] > 0.0:
        other = other.over_platform_pulleys(cable.pulley_radius, cable.swivel_axis)
    here, there = cable_paths(X, cable), cable_paths(X.inverse(), other)
    np.testing.assert_allclose(there.lengths, here.lengths, rtol=ROUNDING)
    np.testing.assert_allclose(there.arcs, here.arcs, atol=ROUNDING)
    np.testing.assert_allclose(X.rotation().matrix() @ there.u_W, -here.u_W, atol=1e-11)
    if cable.pulley_radius[0] == 0.0:
        end = (here.p_WT + here.free * here.u_W)[:, 0]
        np.testing.assert_allclose(end, X.multiply(there.p_WT[:, 0]), atol=ROUNDING)


@few
@given(cables(r=any_radius, s=st.just(1e-14)))
def test_a_small_pulley_at_the_platform_is_none(case):
    cable, X = case
    without = CableSet.make(cable.p_WA, cable.p_PB, 1e5, pulley_radius=cable.pulley_radius,
                            swivel_axis=cable.swivel_axis)  # fmt: skip
    there = cable_paths(X, without)
    assume(there.free[0] > 0.3)
    here = cable_paths(X, cable)
    np.testing.assert_allclose(here.lengths, there.lengths, atol=ROUNDING)
    np.testing.assert_allclose(here.J, there.J, atol=ROUNDING)
    D, same = np.empty((3, 3)), np.empty((3, 3))
    unit_vector_derivative(motion_of(X), cable.packed()[0], D)
    unit_vector_derivative(motion_of(X), without.packed()[0], same)
    np.testing.assert_allclose(D, same, atol=1e-10)


def wheel(foot, n, e, r):
    """Point of a swivelled wheel at an arc from where the cable enters, and the way out there."""
    y = np.cross(n, e)

    def point(swivel, arc):
        forward, alpha = np.cos(swivel) * e + np.sin(swivel) * y, np.pi - arc / r
        out = np.cos(alpha) * forward + np.sin(alpha) * n
        return foot + r * (forward + out), out

    return point


@settings(max_examples=12)
@given(cables())
def test_no_shorter_way_goes_round_both_wheels(case):
    """Least length over both swivels; wherever these stand, the cable leaves each groove where the
    wheel's tangent plane holds the other tangent point.
    """
    cable, X = case
    free, arc_A, arc_B, _, _, eA, eB, *_ = free_line(motion_of(X), cable.packed()[0])
    r, s = cable.pulley_radius[0], cable.anchor_pulley_radius[0]
    foot, axis = X.multiply(cable.p_PB[:, 0]), X.rotation() @ cable.anchor_swivel_axis[:, 0]
    exit_wheel = wheel(cable.p_WA[:, 0], cable.swivel_axis[:, 0], np.array(eA), r)
    end_wheel = wheel(foot, axis, np.array(eB), s)

    def outside(arcs, swivels):
        (P, out), (Q, beyond) = exit_wheel(swivels[0], arcs[0]), end_wheel(swivels[1], arcs[1])
        return [(Q - P) @ out / r, (P - Q) @ beyond / s]

    def length(swivels):
        arcs = root(outside, [arc_A, arc_B], args=(swivels,), tol=1e-13).x
        P, Q = exit_wheel(swivels[0], arcs[0])[0], end_wheel(swivels[1], arcs[1])[0]
        return np.linalg.norm(Q - P) + np.sum(arcs)

    np.testing.assert_allclose(outside([arc_A, arc_B], [0.0, 0.0]), 0.0, atol=1e-9)
    best = minimize(length, [0.05, -0.08], method="BFGS", options={"gtol": 1e-7})
    assert best.fun == pytest.approx(free + arc_A + arc_B, abs=1e-9)


def test_without_a_pulley_at_the_platform_nothing_is_added():
    cable, K = made((0, 0, 2), (0.1, 0.2, 0), Z, Z, 0.05, 0.0), np.zeros((6, 6))
    add_platform_turning(at([0.5, 0.4, 0.3]), cable.packed()[0], 10.0, K)
    assert not K.any()


def test_two_wheels_in_a_plane_are_an_open_and_a_crossed_belt():
    """Both axes along z, in one plane: textbook tangents of two circles."""
    X, both, apart = RigidTransform([3.0, 0.0, 0.0]), 0.2, 2.8
    # From below on the left, and from below on the right: over the top of both, level.
    level = cable_paths(X, made(ORIGIN, ORIGIN, Z, Z, 0.1, 0.1))
    np.testing.assert_allclose(level.u_W[:, 0], [1.0, 0.0, 0.0], atol=ROUNDING)
    assert level.lengths[0] == pytest.approx(apart + np.pi / 2 * both, abs=ROUNDING)
    # From below on the left, from above on the right: the line crosses between the centres.
    crossed = cable_paths(X, made(ORIGIN, ORIGIN, Z, (0, 0, -1), 0.1, 0.1))
    assert crossed.free[0] == pytest.approx(np.sqrt(apart**2 - both**2), abs=ROUNDING)
    arcs = both * (np.pi / 2 + np.arcsin(both / apart))
    assert crossed.arcs[0] == pytest.approx(arcs, abs=ROUNDING)


def test_a_line_is_found_wherever_pulleys_are_apart():
    random, missed = np.random.default_rng(7), 0
    for _ in range(1000):
        A, p, n, k = random.normal(size=(4, 3))
        r, s = random.uniform(0.005, 0.15, 2)
        X = RigidTransform(RollPitchYaw(random.uniform(-3, 3, 3)), p)
        if np.linalg.norm(A - p) > 0.8:
            free = pulley_geometry(motion_of(X), made(A, ORIGIN, n, k, r, s).packed()[0])[0]
            missed += not np.isfinite(free)
    assert missed <= 2  # next to a swivel axis, where a wheel has no direction
