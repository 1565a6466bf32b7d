"""Cables over pulleys at the platform, and at both ends: lengths, lines, derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.optimize import minimize, root

from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths, motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.geometry.pulley_kernel import pulley_geometry, pulley_line, unit_vector_derivative
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning, free_line, line_by_pose

RATE = 1e-8
"""Central differences over 1e-5 of lengths of metres that bend over centimetres."""

EXACT = 1e-12
"""What rounding leaves of lengths of metres."""

LEAST = 1e-9
"""Of a least length with a slope of 1e-7 [m] and less."""

unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.2)
place = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
radius = st.floats(0.005, 0.15)


def made(A, B, axis, anchor_axis, r, s):
    column = [np.array([[x] for x in v], float) for v in (A, B, axis, anchor_axis)]
    n, k = (v / np.linalg.norm(v) for v in column[2:])
    return CableSet.make(
        column[0], column[1], 1e5, pulley_radius=r, swivel_axis=n
    ).over_platform_pulleys(s, k)


@st.composite
def cables(draw, r=radius, s=radius):
    """A cable and a pose at which it runs well away from both swivel axes."""
    far = np.array(draw(place))
    cable = made(draw(place), 0.3 * np.array(draw(place)), draw(unit), draw(unit), draw(r), draw(s))
    X = RigidTransform(RollPitchYaw(draw(place)), far)
    line = free_line(motion_of(X), cable.packed()[0])
    sine_A, sine_B, rho_A, rho_B = line[7], line[9], line[11], line[12]
    assume(np.isfinite(line[0]) and line[0] > 0.3)
    assume(cable.pulley_radius[0] == 0.0 or (sine_A > 0.1 and rho_A > 0.05))
    assume(sine_B > 0.1 and rho_B > 0.05)
    return cable, X


def length_at(cable, X):
    return pulley_line(motion_of(X), cable.packed()[0])[0]


def turned(X, V, h):
    return RigidTransform(
        rotation_from_vector(h * V[:3]) @ X.rotation(), X.translation() + h * V[3:]
    )


@given(cables(r=st.one_of(st.just(0.0), radius)))
def test_the_jacobian_is_the_derivative_of_the_length(case):
    cable, X = case
    J, h = cable_jacobian(X, cable)[0], 1e-5
    for V in np.eye(6):
        slope = length_at(cable, turned(X, V, h)) - length_at(cable, turned(X, V, -h))
        assert slope / (2.0 * h) == pytest.approx(J @ V, abs=RATE)


@given(cables())
def test_ends_may_be_swapped(case):
    cable, X = case
    swapped = CableSet.make(
        cable.p_PB, cable.p_WA, 1e5, pulley_radius=cable.anchor_pulley_radius,
        swivel_axis=cable.anchor_swivel_axis,
    ).over_platform_pulleys(cable.pulley_radius, cable.swivel_axis)  # fmt: skip
    here, there = cable_paths(X, cable), cable_paths(X.inverse(), swapped)
    np.testing.assert_allclose(there.lengths, here.lengths, rtol=EXACT)
    np.testing.assert_allclose(there.arcs, here.arcs, atol=EXACT)
    R = X.rotation().matrix()
    np.testing.assert_allclose(R @ there.u_W, -here.u_W, atol=1e-11)


@given(cables(r=st.just(0.0)))
def test_one_at_the_platform_is_one_at_the_frame_seen_from_the_other_side(case):
    cable, X = case
    frame = CableSet.make(
        cable.p_PB, cable.p_WA, 1e5, pulley_radius=cable.anchor_pulley_radius,
        swivel_axis=cable.anchor_swivel_axis,
    )  # fmt: skip
    here, there = cable_paths(X, cable), cable_paths(X.inverse(), frame)
    np.testing.assert_allclose(there.lengths, here.lengths, rtol=EXACT)
    np.testing.assert_allclose(X.rotation().matrix() @ there.u_W, -here.u_W, atol=EXACT)
    tangent = X.multiply(there.p_WT[:, 0])
    np.testing.assert_allclose((here.p_WT + here.free * here.u_W)[:, 0], tangent, atol=EXACT)


@given(cables(r=st.one_of(st.just(0.0), radius), s=st.just(1e-14)))
def test_a_small_pulley_at_the_platform_is_none(case):
    cable, X = case
    without = CableSet.make(
        cable.p_WA, cable.p_PB, 1e5, pulley_radius=cable.pulley_radius,
        swivel_axis=cable.swivel_axis,
    )  # fmt: skip
    there = cable_paths(X, without)
    assume(there.free[0] > 0.3)
    here = cable_paths(X, cable)
    np.testing.assert_allclose(here.lengths, there.lengths, atol=EXACT)
    np.testing.assert_allclose(here.J, there.J, atol=EXACT)
    D, same = np.empty((3, 3)), np.empty((3, 3))
    unit_vector_derivative(motion_of(X), cable.packed()[0], D)
    unit_vector_derivative(motion_of(X), without.packed()[0], same)
    np.testing.assert_allclose(D, same, atol=1e-10)


@settings(max_examples=25)
@given(cables())
def test_no_shorter_way_goes_round_both_wheels(case):
    """Least length over both swivels; wherever these stand, the cable leaves each groove where the
    wheel's tangent plane holds the other tangent point.
    """
    cable, X = case
    free, arc_A, arc_B, _, _, eA, eB, *_ = free_line(motion_of(X), cable.packed()[0])
    wheels = [
        wheel(cable.p_WA[:, 0], cable.swivel_axis[:, 0], np.array(eA), cable.pulley_radius[0]),
        wheel(
            X.multiply(cable.p_PB[:, 0]), X.rotation().matrix() @ cable.anchor_swivel_axis[:, 0],
            np.array(eB), cable.anchor_pulley_radius[0],
        ),
    ]  # fmt: skip
    r, s = cable.pulley_radius[0], cable.anchor_pulley_radius[0]

    def ends(swivels, arcs):
        return [one(swivel, arc) for one, swivel, arc in zip(wheels, swivels, arcs, strict=True)]

    def outside(arcs, swivels):
        (P, out), (Q, beyond) = ends(swivels, arcs)
        return [(Q - P) @ out / r, (P - Q) @ beyond / s]

    def length(swivels):
        arcs = root(outside, [arc_A, arc_B], args=(swivels,), tol=1e-13).x
        (P, _), (Q, _) = ends(swivels, arcs)
        return np.linalg.norm(Q - P) + np.sum(arcs)

    np.testing.assert_allclose(outside([arc_A, arc_B], [0.0, 0.0]), 0.0, atol=1e-9)
    best = minimize(length, [0.05, -0.08], method="BFGS", options={"gtol": 1e-7})
    assert best.fun == pytest.approx(free + arc_A + arc_B, abs=LEAST)


def wheel(foot, n, e, r):
    """Point of a swivelled wheel at an arc from where the cable enters, and the way out there."""
    y = np.cross(n, e)

    def point(swivel, arc):
        forward, alpha = np.cos(swivel) * e + np.sin(swivel) * y, np.pi - arc / r
        out = np.cos(alpha) * forward + np.sin(alpha) * n
        return foot + r * (forward + out), out

    return point


@given(cables(r=st.one_of(st.just(0.0), radius)))
def test_the_line_turns_as_differences_say(case):
    cable, X = case
    row, found, h = cable.packed()[0], np.empty((6, 6)), 1e-6
    line_by_pose(motion_of(X), row, found)

    def line(V, step):
        _, ux, uy, uz, *arm = pulley_line(motion_of(turned(X, V, step)), row)
        return np.concatenate([np.cross(arm, [ux, uy, uz]), [ux, uy, uz]])

    for k, V in enumerate(np.eye(6)):
        slope = (line(V, h) - line(V, -h)) / (2.0 * h)
        np.testing.assert_allclose(found[:, k], slope, atol=2e-6)
    # Moment by translation and force by turn are the same second derivative of the length.
    np.testing.assert_allclose(found[3:, :3], found[:3, 3:].T, atol=1e-8)
    np.testing.assert_allclose(found[3:, 3:], found[3:, 3:].T, atol=1e-8)


def test_without_a_pulley_at_the_platform_nothing_is_added():
    cable = made((0, 0, 2), (0.1, 0.2, 0), (0, 0, 1), (0, 0, 1), 0.05, 0.0)
    K = np.zeros((6, 6))
    add_platform_turning(motion_of(RigidTransform([0.5, 0.4, 0.3])), cable.packed()[0], 10.0, K)
    assert not K.any()


def test_two_wheels_in_a_plane_are_an_open_and_a_crossed_belt():
    """Both axes along z, in one plane: textbook tangents of two circles."""
    r, s, X = 0.1, 0.1, RigidTransform([3.0, 0.0, 0.0])
    # From below on the left, and from below on the right: over the top of both, level.
    cable = made((0, 0, 0), (0, 0, 0), (0, 0, 1), (0, 0, 1), r, s)
    path = cable_paths(X, cable)
    np.testing.assert_allclose(path.u_W[:, 0], [1.0, 0.0, 0.0], atol=EXACT)
    assert path.lengths[0] == pytest.approx(3.0 - r - s + np.pi / 2 * (r + s), abs=EXACT)
    # From below on the left, from above on the right: the line crosses between the centres.
    crossed = cable_paths(X, made((0, 0, 0), (0, 0, 0), (0, 0, 1), (0, 0, -1), r, s))
    apart = 3.0 - r - s
    free = np.sqrt(apart**2 - (r + s) ** 2)
    assert crossed.free[0] == pytest.approx(free, abs=EXACT)
    angle = np.arcsin((r + s) / apart)
    assert crossed.arcs[0] == pytest.approx((r + s) * (np.pi / 2 + angle), abs=EXACT)


def test_ends_in_each_others_groove_are_refused_by_the_cable():
    cable = made((0, 0, 0), (0, 0, 0), (0, 0, 1), (0, 0, 1), 0.3, 0.3)
    with pytest.raises(CableGeometryError, match=r"cable 1: no line touches its pulleys of radius"):
        cable_paths(RigidTransform([0.2, 0.0, 0.05]), cable)


def test_a_line_is_found_wherever_pulleys_are_apart():
    random, missed = np.random.default_rng(7), 0
    for _ in range(3000):
        A, p, n, k = random.normal(size=(4, 3))
        r, s = random.uniform(0.005, 0.15, 2)
        X = RigidTransform(RollPitchYaw(random.uniform(-3, 3, 3)), p)
        if np.linalg.norm(A - p) < 0.8:
            continue
        free, *_ = pulley_geometry(motion_of(X), made(A, (0, 0, 0), n, k, r, s).packed()[0])
        missed += not np.isfinite(free)
    assert missed <= 6  # next to a swivel axis, where a wheel has no direction
