"""One cable over a pulley: against a plain construction, the shortest path and limits."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import cable_line
from cdpr_drake.geometry.pulley_kernel import (
    pulley_geometry,
    pulley_jacobian,
    pulley_lengths,
    pulley_line,
    unit_vector_derivative,
)

ROUNDING = 1e-12  # lengths near 1 m, radii and tangents by one square root
ELSEWHERE = 1e-11
"""Rounding of a shift by metres, over distances and free parts of AWAY."""

STEP = 1e-6
DIFFERENCE = 2e-8
"""Central differences: STEP^2 times third derivatives below 1e3 / m^2, and 1e-16 / STEP."""

AWAY = 0.02
"""Distance [m] of B from the swivel axis and of the free part from zero, in the properties."""

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

coordinate = st.floats(-1.0, 1.0)
points = st.tuples(coordinate, coordinate, coordinate).map(np.array)
axes = points.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
radii = st.floats(1e-3, 0.2)


def row(B, radius, axis=(0.0, 0.0, 1.0), A=(0.0, 0.0, 0.0)):
    one = lambda v: np.asarray(v, float)[:, np.newaxis]  # noqa: E731
    return CableSet.make(one(A), one(B), 1e5, pulley_radius=radius, swivel_axis=axis).packed()[0]


def at(p):
    """A platform without rotation at p."""
    return (*IDENTITY, *p)


def usable(B, axis, r):
    h = B @ axis
    rho = np.linalg.norm(B - h * axis)
    return rho > AWAY and (rho - r) ** 2 + h**2 > (r + AWAY) ** 2


@given(points, radii, axes)
def test_the_free_part_touches_the_groove(B, r, axis):
    """Textbook construction: centre, tangent point on the circle, right angle, lengths."""
    assume(usable(B, axis, r))
    free, arc, *rest = pulley_geometry(at(B), row(np.zeros(3), r, axis))
    T, u = np.array(rest[0:3]), np.array(rest[3:6])
    out = B - (B @ axis) * axis
    out /= np.linalg.norm(out)
    center = r * out
    np.testing.assert_allclose(np.linalg.norm(T - center), r, atol=ROUNDING)
    np.testing.assert_allclose((T - center) @ u, 0.0, atol=ROUNDING)
    np.testing.assert_allclose(T + free * u, B, atol=ROUNDING)
    np.testing.assert_allclose(np.linalg.norm(u), 1.0, atol=ROUNDING)
    np.testing.assert_allclose(u @ np.cross(axis, out), 0.0, atol=ROUNDING)
    # The groove is followed from A over its far side (along n) to T.
    start, end = -out, (T - center) / r
    angle = np.arctan2(end @ axis, end @ out)
    np.testing.assert_allclose(arc, r * (np.pi - angle), atol=ROUNDING)
    assert start @ out == -1.0 or abs(start @ out + 1.0) < ROUNDING
    # It runs on in the direction in which it leaves the groove, without a kink.
    leaving = np.sin(angle) * out - np.cos(angle) * axis
    np.testing.assert_allclose(u, leaving, atol=ROUNDING)


@given(points, points, radii, axes)
def test_a_pulley_elsewhere_is_the_same_pulley(A, B, r, axis):
    assume(usable(B, axis, r))
    free, arc, *here = pulley_geometry(at(B), row(np.zeros(3), r, axis))
    free_there, arc_there, *there = pulley_geometry(at(A + B), row(np.zeros(3), r, axis, A))
    np.testing.assert_allclose([free_there, arc_there], [free, arc], atol=ELSEWHERE)
    np.testing.assert_allclose(there[:3], A + here[:3], atol=ELSEWHERE)
    np.testing.assert_allclose(there[3:], here[3:], atol=ELSEWHERE)


def test_a_level_cable_leaves_at_the_top():
    """B level with the top of the groove: a quarter turn and a horizontal line."""
    r = 0.1
    free, arc, *rest = pulley_geometry(at((0.7, 0.0, r)), row(np.zeros(3), r))
    np.testing.assert_allclose([free, arc], [0.6, r * np.pi / 2], atol=ROUNDING)
    np.testing.assert_allclose(rest[:3], [r, 0.0, r], atol=ROUNDING)
    np.testing.assert_allclose(rest[3:6], [1.0, 0.0, 0.0], atol=ROUNDING)


def test_straight_down_is_half_a_turn():
    r = 0.1
    free, arc, *rest = pulley_geometry(at((2 * r, 0.0, -0.5)), row(np.zeros(3), r))
    np.testing.assert_allclose([free, arc], [0.5, r * np.pi], atol=ROUNDING)
    np.testing.assert_allclose(rest[3:6], [0.0, 0.0, -1.0], atol=ROUNDING)


@given(st.floats(0.05, 1.0), st.floats(-1.0, 1.0), st.floats(0.01, 0.3))
def test_length_is_the_least_over_points_where_the_cable_could_leave_the_groove(rho, h, r):
    """Virtual work: pulled at B, the frictionless cable leaves where its length is stationary."""
    assume(usable(np.array([rho, 0.0, h]), np.array([0.0, 0.0, 1.0]), r))
    free, arc, *_ = pulley_geometry(at((rho, 0.0, h)), row(np.zeros(3), r))

    def way(arc):
        alpha = np.pi - arc / r
        T = r * np.array([1.0 + np.cos(alpha), np.sin(alpha)])
        return arc + np.hypot(rho - T[0], h - T[1])

    assert abs(way(arc) - (free + arc)) < ROUNDING
    # Second derivative zero too: a straight chord that cuts the groove is shorter, so leaving
    # later is longer and leaving earlier is through the groove.
    near = 1e-3 * min(r, free)
    assert abs(way(arc + near) - way(arc - near)) / (2 * near) < 1e-5
    assert way(arc + near) >= way(arc) - ROUNDING >= way(arc - near) - 2 * ROUNDING


@given(points, points, points)
def test_without_radius_it_is_the_straight_cable_bit_by_bit(A, arm, p):
    assume(np.linalg.norm(p + arm - A) > 1e-3)
    cable = row(arm, 0.0, A=A)
    assert pulley_line(at(p), cable) == cable_line(at(p), cable)


@given(points, points, points)
def test_without_radius_nothing_lies_in_a_groove_and_the_cable_leaves_at_its_exit_point(A, arm, p):
    assume(np.linalg.norm(p + arm - A) > 1e-3)
    cable = row(arm, 0.0, A=A)
    length, *direction_and_arm = cable_line(at(p), cable)
    assert pulley_geometry(at(p), cable) == (length, 0.0, *A, *direction_and_arm)


@given(points)
def test_a_small_pulley_tends_to_the_straight_cable(B):
    """The difference is of the order of the radius."""
    axis = np.array([0.0, 0.0, 1.0])
    assume(usable(B, axis, 1e-9))
    straight = np.array(pulley_line(at(B), row(np.zeros(3), 0.0)))
    over = np.array(pulley_line(at(B), row(np.zeros(3), 1e-9)))
    assert np.max(np.abs(over - straight)) < 1e-9 * 10.0 / AWAY


@given(points, radii, axes, st.tuples(*[coordinate] * 6).map(np.array))
def test_jacobian_is_the_derivative_of_the_length(B, r, axis, V):
    arm = np.array([0.05, -0.08, 0.03])
    assume(usable(B, axis, r))
    cables = row(arm, r, axis)[np.newaxis]
    lengths, J = np.empty(1), np.empty((1, 6))
    pulley_jacobian(at(B - arm), cables, lengths, J)

    def length(t):
        angle = V[:3] * t
        R = np.eye(3) + _skew(angle) + _skew(angle) @ _skew(angle) / 2
        out = np.empty(1)
        pulley_lengths((*R.ravel(), *(B - arm + V[3:] * t)), cables, out)
        return out[0]

    slope = (length(STEP) - length(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(J[0] @ V, slope, atol=DIFFERENCE)
    assert lengths[0] == length(0.0)


@given(points, st.one_of(st.just(0.0), radii), axes)
def test_unit_vector_turns_as_differences_say(B, r, axis):
    assume(usable(B, axis, r) and np.linalg.norm(B) > 0.1)
    cable = row(np.zeros(3), r, axis)
    H = np.empty((3, 3))
    unit_vector_derivative(at(B), cable, H)
    for j, e in enumerate(np.eye(3)):
        ahead = np.array(pulley_line(at(B + STEP * e), cable)[1:4])
        behind = np.array(pulley_line(at(B - STEP * e), cable)[1:4])
        # Turning out of the plane goes as 1 / rho, its third derivative as 1 / rho^3.
        np.testing.assert_allclose(H[:, j], (ahead - behind) / (2 * STEP), atol=1e-5, rtol=1e-5)
    np.testing.assert_allclose(H, H.T, atol=1e-9)


def test_no_cable_runs_inside_the_groove_or_on_the_swivel_axis():
    for B in ((0.1, 0.0, 0.0), (0.0, 0.0, 0.5)):
        line = pulley_line(at(B), row(np.zeros(3), 0.1))
        assert np.all(np.isnan(line[:4]))


def test_right_over_the_entry_nothing_lies_in_the_groove():
    """Round-off of the angle must not add a whole turn."""
    for rho in 10.0 ** np.arange(-16, -2):
        free, arc, *_ = pulley_geometry(at((rho, 0.0, 0.5)), row(np.zeros(3), 0.05))
        assert 0.0 <= arc < 0.01
        assert abs(free + arc - 0.5) < 2 * rho + ROUNDING


def _skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
