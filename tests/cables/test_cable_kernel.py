"""The kernels against a slow NumPy reference, energy, and the refusal to push."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.cables.straight_kernel import (
    cable_pull,
    floating_cables,
    floating_force,
    planar_cables,
    planar_force,
)
from cdpr_drake.geometry.motion_kernel import CABLE_COLUMNS, floating_motion, pack_cables
from cdpr_drake.geometry.straight_cables import wrench_matrix

STIFFNESS = 1.0e4  # [N]
ROUNDING = 1e-13  # a few dozen operations on numbers of size one
FORCE_TOLERANCE = STIFFNESS * ROUNDING  # strains are rounded before they meet the stiffness
HEIGHT = 0.4  # of the plane of planar platforms [m]

P_WA = np.array([(x, y, z) for x in (-1.0, 1.1) for y in (-0.9, 1.0) for z in (0.0, 1.9)]).T
P_PB = np.array([(x, y, z) for x in (0.1, -0.11) for y in (-0.1, 0.12) for z in (0.08, 0.0)]).T
M = P_WA.shape[1]
RETARDATION = np.linspace(0.0, 2e-2, M)
CABLES = pack_cables(P_WA, P_PB, np.full(M, STIFFNESS), RETARDATION)

share = st.floats(-1.0, 1.0)
quaternions = (
    st.tuples(share, share, share, share)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
positions = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.5, 1.4)).map(np.array)
velocities = st.tuples(*[st.floats(-2.0, 2.0)] * 6).map(np.array)
unstrained = st.lists(st.floats(0.5, 3.0), min_size=M, max_size=M).map(np.array)
unwinding = st.lists(st.floats(-1.0, 1.0), min_size=M, max_size=M).map(np.array)
planar_states = st.tuples(*[share] * 6).map(lambda v: np.array(v) * [0.5, 0.5, 3.0, 2.0, 2.0, 2.0])


def reference(R, p, w, v, l0, l0_dot):
    """Wrench (moment about Po, force) in W, tensions, lengths and length rates, cable by cable."""
    wrench, tensions, lengths, rates = np.zeros(6), [], [], []
    for i in range(M):
        arm = R @ P_PB[:, i]
        along = p + arm - P_WA[:, i]
        length = np.linalg.norm(along)
        u = along / length
        rate = u @ (v + np.cross(w, arm))
        strain = length / l0[i] - 1.0
        strain_rate = rate / l0[i] - length * l0_dot[i] / l0[i] ** 2
        tension = STIFFNESS * (strain + RETARDATION[i] * strain_rate) if strain > 0.0 else 0.0
        tension = max(tension, 0.0)
        wrench -= tension * np.concatenate([np.cross(arm, u), u])
        tensions.append(tension)
        lengths.append(length)
        rates.append(rate)
    return wrench, np.array(tensions), np.array(lengths), np.array(rates)


def floating_reference(q, p, V, l0, l0_dot):
    R = RotationMatrix(Quaternion(q)).matrix()
    return reference(R, p, V[:3], V[3:], l0, l0_dot)


def planar_reference(state, l0, l0_dot):
    R = RotationMatrix.MakeZRotation(state[2]).matrix()
    p = np.array([state[0], state[1], HEIGHT])
    w, v = np.array([0.0, 0.0, state[5]]), np.array([state[3], state[4], 0.0])
    return reference(R, p, w, v, l0, l0_dot)


def force(state, l0, l0_dot):
    out = np.empty(6)
    floating_force(state, l0, l0_dot, CABLES, 0, out)
    return out


def cable_states(state, l0, l0_dot):
    out = np.empty((3, M))
    floating_cables(state, l0, l0_dot, CABLES, out)
    return out


def at_rest(q, p):
    return np.concatenate([q, p, np.zeros(6)])


def test_packed_cables_have_one_row_a_cable():
    assert CABLES.shape == (M, CABLE_COLUMNS)
    assert CABLES.flags.c_contiguous
    np.testing.assert_array_equal(CABLES[3, :3], P_WA[:, 3])
    np.testing.assert_array_equal(CABLES[3, 3:6], P_PB[:, 3])
    np.testing.assert_array_equal(CABLES[3, 6:], [STIFFNESS, RETARDATION[3]])


@given(quaternions, positions, velocities)
def test_floating_motion_is_drakes_rotation(q, p, V):
    motion = np.array(floating_motion(np.concatenate([q, p, V])))
    R = RotationMatrix(Quaternion(q)).matrix()
    np.testing.assert_allclose(motion[:9].reshape(3, 3), R, atol=ROUNDING)
    np.testing.assert_array_equal(motion[9:], np.concatenate([p, V]))


@given(quaternions, positions, velocities, unstrained, unwinding)
def test_floating_force_is_that_of_the_reference(q, p, V, l0, l0_dot):
    wrench, *_ = floating_reference(q, p, V, l0, l0_dot)
    out = force(np.concatenate([q, p, V]), l0, l0_dot)
    np.testing.assert_allclose(out, wrench, rtol=ROUNDING, atol=10 * M * FORCE_TOLERANCE)


@given(quaternions, positions, velocities, unstrained, unwinding)
def test_floating_cables_are_those_of_the_reference(q, p, V, l0, l0_dot):
    _, tensions, lengths, _ = floating_reference(q, p, V, l0, l0_dot)
    out = cable_states(np.concatenate([q, p, V]), l0, l0_dot)
    np.testing.assert_allclose(out[0], tensions, rtol=ROUNDING, atol=10 * FORCE_TOLERANCE)
    np.testing.assert_allclose(out[1], lengths, rtol=ROUNDING)
    np.testing.assert_array_equal(out[2], out[0] == 0.0)


@given(planar_states, unstrained, unwinding)
def test_planar_kernels_are_those_of_the_reference(state, l0, l0_dot):
    wrench, tensions, lengths, _ = planar_reference(state, l0, l0_dot)
    out, cables = np.empty(3), np.empty((3, M))
    planar_force(state, l0, l0_dot, CABLES, 0, out, HEIGHT)
    planar_cables(state, l0, l0_dot, CABLES, cables, HEIGHT)
    expected = [wrench[3], wrench[4], wrench[2]]  # the order of the planar joint: x, y, theta
    np.testing.assert_allclose(out, expected, rtol=ROUNDING, atol=10 * M * FORCE_TOLERANCE)
    np.testing.assert_allclose(cables[0], tensions, rtol=ROUNDING, atol=10 * FORCE_TOLERANCE)
    np.testing.assert_allclose(cables[1], lengths, rtol=ROUNDING)
    np.testing.assert_array_equal(cables[2], cables[0] == 0.0)


@given(planar_states, unstrained, unwinding)
def test_a_planar_platform_feels_what_a_floating_one_feels(state, l0, l0_dot):
    x, y, theta, vx, vy, w = state
    q = [np.cos(theta / 2.0), 0.0, 0.0, np.sin(theta / 2.0)]
    floating = force(np.array([*q, x, y, HEIGHT, 0.0, 0.0, w, vx, vy, 0.0]), l0, l0_dot)
    out = np.empty(3)
    planar_force(state, l0, l0_dot, CABLES, 0, out, HEIGHT)
    expected = floating[[3, 4, 2]]
    np.testing.assert_allclose(out, expected, rtol=ROUNDING, atol=10 * M * FORCE_TOLERANCE)


@given(quaternions, positions, velocities, unstrained, unwinding)
def test_cables_only_pull(q, p, V, l0, l0_dot):
    tensions, lengths, slack = cable_states(np.concatenate([q, p, V]), l0, l0_dot)
    assert np.all(tensions >= 0.0)
    assert np.all(tensions[lengths < l0] == 0.0)
    np.testing.assert_array_equal(slack, np.where(tensions == 0.0, 1.0, 0.0))


def test_slack_cables_have_exactly_no_tension_and_leave_the_platform_alone():
    state = at_rest([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    state[7:] = 1.0  # not even damping remains
    _, lengths, _ = cable_states(state, np.ones(M), np.zeros(M))
    tensions, _, slack = cable_states(state, 1.001 * lengths, np.zeros(M))
    np.testing.assert_array_equal(tensions, np.zeros(M))
    np.testing.assert_array_equal(slack, np.ones(M))
    np.testing.assert_array_equal(force(state, 1.001 * lengths, np.zeros(M)), np.zeros(6))


def test_a_cable_that_is_just_straight_counts_as_slack():
    cable = pack_cables([[0.0], [0.0], [2.0]], [[0.0], [0.0], [0.0]], [STIFFNESS], [0.1])
    out = np.empty((3, 1))
    state = at_rest([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    floating_cables(state, np.array([2.0]), np.array([0.0]), cable, out)
    np.testing.assert_array_equal(out[:, 0], [0.0, 2.0, 1.0])


def test_a_stretched_cable_that_slackens_fast_does_not_push():
    cable = pack_cables([[0.0], [0.0], [2.0]], [[0.0], [0.0], [0.0]], [STIFFNESS], [0.1])
    state = at_rest([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    state[12] = 1.0  # towards the exit point
    out = np.empty((3, 1))
    floating_cables(state, np.array([1.9]), np.array([0.0]), cable, out)
    np.testing.assert_array_equal(out[:, 0], [0.0, 2.0, 1.0])


def test_winding_in_while_stretched_adds_damping_tension():
    cable = pack_cables([[0.0], [0.0], [2.0]], [[0.0], [0.0], [0.0]], [STIFFNESS], [0.1])
    motion = floating_motion(at_rest([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]))
    l0, l0_dot = 1.9, -0.05
    tension, length, *_ = cable_pull(motion, cable[0], l0, l0_dot)
    strain_rate = -2.0 * l0_dot / l0**2  # of l / l0 - 1 at constant length
    assert length == 2.0
    expected = STIFFNESS * (2.0 / l0 - 1.0 + 0.1 * strain_rate)
    assert tension == pytest.approx(expected, rel=ROUNDING)


def test_floating_force_writes_at_its_start_and_clears_the_rest():
    state, l0 = at_rest([1.0, 0.0, 0.0, 0.0], [0.1, 0.0, 1.0]), np.full(M, 1.2)
    out = np.full(11, 7.0)
    floating_force(state, l0, np.zeros(M), CABLES, 3, out)
    np.testing.assert_array_equal(out[3:9], force(state, l0, np.zeros(M)))
    np.testing.assert_array_equal(out[[0, 1, 2, 9, 10]], 0.0)


def test_planar_force_writes_at_its_start_and_clears_the_rest():
    state, l0 = np.array([0.1, 0.0, 0.2, 0.0, 0.0, 0.0]), np.full(M, 1.2)
    alone, out = np.empty(3), np.full(6, 7.0)
    planar_force(state, l0, np.zeros(M), CABLES, 0, alone, HEIGHT)
    planar_force(state, l0, np.zeros(M), CABLES, 2, out, HEIGHT)
    np.testing.assert_array_equal(out[2:5], alone)
    np.testing.assert_array_equal(out[[0, 1, 5]], 0.0)


@given(quaternions, positions, velocities, unstrained, unwinding)
def test_the_platform_gains_the_power_that_the_cables_give(q, p, V, l0, l0_dot):
    """Generalized force times velocity is -sum(t dl/dt), with rates from the reference."""
    state = np.concatenate([q, p, V])
    *_, rates = floating_reference(q, p, V, l0, l0_dot)
    tensions = cable_states(state, l0, l0_dot)[0]
    bound = M * np.max(np.abs(V)) * (10 * FORCE_TOLERANCE + ROUNDING * np.max(tensions))
    assert abs(force(state, l0, l0_dot) @ V + tensions @ rates) <= bound


@given(planar_states, unstrained, unwinding)
def test_the_planar_platform_gains_the_power_that_the_cables_give(state, l0, l0_dot):
    *_, rates = planar_reference(state, l0, l0_dot)
    out, cables = np.empty(3), np.empty((3, M))
    planar_force(state, l0, l0_dot, CABLES, 0, out, HEIGHT)
    planar_cables(state, l0, l0_dot, CABLES, cables, HEIGHT)
    bound = M * np.max(np.abs(state)) * (10 * FORCE_TOLERANCE + ROUNDING * np.max(cables[0]))
    assert abs(out @ state[3:] + cables[0] @ rates) <= bound


@given(quaternions, positions, velocities, unstrained, st.floats(0.1, 10.0))
def test_the_length_of_the_quaternion_does_not_matter(q, p, V, l0, length):
    """Integrators leave quaternions a little off unit length."""
    unit = force(np.concatenate([q, p, V]), l0, np.zeros(M))
    other = force(np.concatenate([length * q, p, V]), l0, np.zeros(M))
    np.testing.assert_allclose(other, unit, rtol=ROUNDING, atol=10 * M * FORCE_TOLERANCE)


@given(quaternions, positions, unstrained)
def test_the_force_at_rest_is_the_wrench_of_the_tensions(q, p, l0):
    state = at_rest(q, p)
    W = wrench_matrix(RigidTransform(Quaternion(q), p), P_WA, P_PB)
    expected = W @ cable_states(state, l0, np.zeros(M))[0]
    out = force(state, l0, np.zeros(M))
    np.testing.assert_allclose(out, expected, rtol=ROUNDING, atol=10 * M * FORCE_TOLERANCE)
