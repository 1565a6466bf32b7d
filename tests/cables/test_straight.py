"""Kernels of straight cables against a slow NumPy reference, energy, and the law of tensions."""

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.cables.commanded_tension_kernel import cable_motions, tension_force
from cdpr_drake.cables.elastic_law import (
    cable_stiffness_matrix,
    elastic_energy,
    stretched_lengths,
    unstrained_lengths,
)
from cdpr_drake.cables.straight_kernel import cable_pull, floating_force, planar_force
from cdpr_drake.cables.straight_lanes_kernel import floating_lanes_force, put_columns
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_kernel import (
    CABLE_COLUMNS,
    floating_motion,
    pack_cables,
    planar_motion,
)
from cdpr_drake.geometry.poses import rotation_from_angles, rotation_from_vector
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from tests.geometry.geometry_cases import P_PB, P_WA, slopes

ES = 1.0e4  # [N]
ROUNDING = 1e-13  # a few dozen operations on numbers of size one
FORCE = 10 * ES * ROUNDING  # strains are rounded before they meet the stiffness
HEIGHT = 0.4  # of the plane of planar platforms [m]
M = 8
RETARDATION = np.linspace(0.0, 2e-2, M)
CABLES = pack_cables(P_WA, P_PB, np.full(M, ES), RETARDATION)


def reference(R, p, w, v, l0, l0_dot):
    """Wrench (moment about Po, force) in W, tensions, lengths and length rates, cable by cable."""
    wrench, tensions, lengths, rates = np.zeros(6), np.zeros(M), np.zeros(M), np.zeros(M)
    for i in range(M):
        arm = R @ P_PB[:, i]
        along = p + arm - P_WA[:, i]
        lengths[i] = np.linalg.norm(along)
        u = along / lengths[i]
        rates[i] = u @ (v + np.cross(w, arm))
        strain = lengths[i] / l0[i] - 1.0
        strain_rate = rates[i] / l0[i] - lengths[i] * l0_dot[i] / l0[i] ** 2
        if strain > 0.0:
            tensions[i] = max(ES * (strain + RETARDATION[i] * strain_rate), 0.0)
        wrench -= tensions[i] * np.concatenate([np.cross(arm, u), u])
    return wrench, tensions, lengths, rates


def close(actual, expected, atol):
    np.testing.assert_allclose(actual, expected, rtol=ROUNDING, atol=atol)


def random_cables(count, seed):
    random = np.random.default_rng(seed)
    for _ in range(count):
        yield random, random.uniform(0.5, 3.0, M), random.uniform(-1.0, 1.0, M)


def pulls(motion, cables, l0, l0_dot):
    """Tensions and lengths, shape (2, m)."""
    of_each = zip(cables, l0, l0_dot, strict=True)
    return np.array([cable_pull(motion, *one)[:2] for one in of_each]).T


def floating(state, l0, l0_dot, cables=CABLES):
    force = np.full(6, np.nan)
    floating_force(state, l0, l0_dot, cables, 0, force)
    return force, pulls(floating_motion(state), cables, l0, l0_dot)


def planar(state, l0, l0_dot):
    force = np.full(3, np.nan)
    planar_force(state, l0, l0_dot, CABLES, 0, force, HEIGHT)
    return force, pulls(planar_motion(state, HEIGHT), CABLES, l0, l0_dot)


def check_cables(table, tensions, lengths, l0):
    close(table[0], tensions, FORCE)
    close(table[1], lengths, 0.0)
    assert np.all(table[0] >= 0.0)  # cables only pull
    assert np.all(table[0][table[1] < l0] == 0.0)


def test_floating_platform():
    """As the reference; power is what the cables give, and a quaternion's length does not count."""
    for random, l0, l0_dot in random_cables(150, seed=1):
        q, p = random.normal(size=4), random.uniform([-0.5, -0.5, 0.5], [0.5, 0.5, 1.4])
        q /= np.linalg.norm(q)
        V, R = random.uniform(-2.0, 2.0, 6), RotationMatrix(Quaternion(q)).matrix()
        state = np.concatenate([q, p, V])
        motion = np.array(floating_motion(state))
        np.testing.assert_allclose(motion[:9].reshape(3, 3), R, rtol=0, atol=ROUNDING)
        np.testing.assert_array_equal(motion[9:], np.concatenate([p, V]))
        wrench, tensions, lengths, rates = reference(R, p, V[:3], V[3:], l0, l0_dot)
        force, table = floating(state, l0, l0_dot)
        close(force, wrench, M * FORCE)
        check_cables(table, tensions, lengths, l0)
        bound = 2.0 * M * (FORCE + ROUNDING * np.max(tensions))
        assert abs(force @ V + tensions @ rates) <= bound
        state[:4] *= random.uniform(0.1, 10.0)  # integrators leave it a little off
        close(floating(state, l0, l0_dot)[0], force, M * FORCE)
        state[7:] = 0.0
        force, table = floating(state, l0, np.zeros(M))
        W = wrench_matrix(RigidTransform(Quaternion(q), p), P_WA, P_PB)
        close(force, W @ table[0], M * FORCE)


def test_planar_platform():
    """As the reference, in the order x, y, theta, and as a floating one that moves in the plane."""
    for random, l0, l0_dot in random_cables(150, seed=2):
        state = random.uniform(-1.0, 1.0, 6) * [0.5, 0.5, 3.0, 2.0, 2.0, 2.0]
        x, y, theta, vx, vy, turn = state
        R, p = RotationMatrix.MakeZRotation(theta).matrix(), np.array([x, y, HEIGHT])
        w, v = np.array([0.0, 0.0, turn]), np.array([vx, vy, 0.0])
        wrench, tensions, lengths, rates = reference(R, p, w, v, l0, l0_dot)
        force, table = planar(state, l0, l0_dot)
        close(force, wrench[[3, 4, 2]], M * FORCE)
        check_cables(table, tensions, lengths, l0)
        bound = M * 3.0 * (FORCE + ROUNDING * np.max(tensions))
        assert abs(force @ state[3:] + tensions @ rates) <= bound
        q = [np.cos(theta / 2.0), 0.0, 0.0, np.sin(theta / 2.0)]
        close(floating(np.array([*q, *p, *w, *v]), l0, l0_dot)[0][[3, 4, 2]], force, M * FORCE)


def test_forces_are_written_at_their_start_and_the_rest_is_cleared():
    l0, still = np.full(M, 1.2), np.zeros(M)
    state, out = np.array([1.0, 0, 0, 0, 0.1, 0, 1, *np.zeros(6)]), np.full(11, 7.0)
    floating_force(state, l0, still, CABLES, 3, out)
    np.testing.assert_array_equal(out, [0, 0, 0, *floating(state, l0, still)[0], 0, 0])
    state, out = np.array([0.1, 0.0, 0.2, 0.0, 0.0, 0.0]), np.full(6, 7.0)
    planar_force(state, l0, still, CABLES, 2, out, HEIGHT)
    np.testing.assert_array_equal(out, [0, 0, *planar(state, l0, still)[0], 0])


def test_packed_cables_have_one_row_a_cable():
    assert CABLES.shape == (M, CABLE_COLUMNS)
    assert CABLES.flags.c_contiguous
    np.testing.assert_array_equal(CABLES[3], [*P_WA[:, 3], *P_PB[:, 3], ES, RETARDATION[3]])


HANGING = pack_cables([[0.0], [0.0], [2.0]], np.zeros((3, 1)), [ES], [0.1])
AT_ORIGIN = np.array([1.0, *np.zeros(12)])


def test_slack_cables_have_exactly_no_tension_and_leave_the_platform_alone():
    state = np.array([1.0, 0, 0, 0, 0, 0, 1, *np.ones(6)])  # not even damping remains
    lengths = floating(state, np.ones(M), np.zeros(M))[1][1]
    force, table = floating(state, 1.001 * lengths, np.zeros(M))
    np.testing.assert_array_equal(table[0], np.zeros(M))
    np.testing.assert_array_equal(force, np.zeros(6))


@pytest.mark.parametrize(("l0", "upward"), [(2.0, 0.0), (1.9, 1.0)])
def test_a_cable_that_is_just_straight_or_slackens_fast_is_slack(l0, upward):
    state = AT_ORIGIN.copy()
    state[12] = upward  # towards the exit point
    _, table = floating(state, np.array([l0]), np.zeros(1), HANGING)
    np.testing.assert_array_equal(table[:, 0], [0.0, 2.0])


def test_winding_in_while_stretched_adds_damping_tension():
    l0, l0_dot = 1.9, -0.05
    tension, length, *_ = cable_pull(floating_motion(AT_ORIGIN), HANGING[0], l0, l0_dot)
    assert length == 2.0
    strain_rate = -2.0 * l0_dot / l0**2  # of l / l0 - 1 at constant length
    assert tension == pytest.approx(ES * (2.0 / l0 - 1.0 + 0.1 * strain_rate), rel=ROUNDING)


def lanes(rng, m, spoil=None):
    """Forces of random cables, one after the other and eight at once."""
    cables = rng.normal(size=(m, 17))
    cables[:, 6], cables[:, 7] = 1e5 * rng.random(m), rng.choice([0.0, 1e-3, 0.3])
    state, l0, l0_dot = rng.normal(size=13), rng.uniform(0.3, 4.0, m), rng.normal(size=m)
    if spoil:
        places = {"length": l0, "rate": l0_dot, "retardation": cables[:, 7]}
        value = np.nan if spoil in places else np.inf
        places.get(spoil, cables[:, 0])[rng.integers(m)] = value
    columns, one_by_one, together = np.full((8, max(m, 6)), np.nan), np.zeros(6), np.zeros(6)
    put_columns(cables, columns)
    floating_force(state, l0, l0_dot, cables, 0, one_by_one)
    floating_lanes_force(state, l0, l0_dot, columns, together)
    return one_by_one, together


@pytest.mark.parametrize("m", [1, 3, 7, 8, 9, 12, 16, 17])
def test_eight_cables_at_once_have_the_same_bits(m):
    rng, pulled = np.random.default_rng(m), 0
    for _ in range(200):
        one_by_one, together = lanes(rng, m)
        assert one_by_one.tobytes() == together.tobytes()
        pulled += one_by_one.any()
    assert pulled > 50


@pytest.mark.parametrize("spoil", ["length", "rate", "retardation", "exit point"])
def test_what_is_not_a_number_is_none_in_both(spoil):
    rng = np.random.default_rng(0)
    for _ in range(200):
        np.testing.assert_array_equal(*lanes(rng, 8, spoil))


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_commanded_tensions_pull_by_the_jacobian(name, pulleys):
    """Kernels of tension-driven cables: minus the transposed Jacobian, pushing only if told to."""
    robot, random = load_robot(name), np.random.default_rng(5)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    m, height = cables.count, robot.plane_height or 0.0
    rows, nv = ([3, 4, 2], 3) if robot.is_planar() else (list(range(6)), 6)
    for push in (False, True) * 30:
        turn, offset = random.uniform(-0.3, 0.3, (2, 3))
        V = random.uniform(-2.0, 2.0, 6)
        if robot.is_planar():
            X_WP = RigidTransform(RotationMatrix.MakeZRotation(turn[2]), [*offset[:2], height])
            V[[0, 1, 5]] = 0.0
            state = np.array([*offset[:2], turn[2], V[3], V[4], V[2]])
        else:
            p = robot.home.transform().translation() + offset
            X_WP = RigidTransform(rotation_from_vector(turn), p)
            state = np.concatenate([X_WP.rotation().ToQuaternion().wxyz(), p, V])
        tensions, paths = random.uniform(-100.0, 100.0, m), cable_paths(X_WP, cables)
        force, motions = np.full(nv + 2, np.nan), np.empty((2, m))
        tension_force(state, tensions, cables.packed(), height, push, 1, force)
        expected = -paths.J.T @ (tensions if push else np.maximum(tensions, 0.0))
        np.testing.assert_array_equal(force[[0, -1]], np.zeros(2))
        np.testing.assert_allclose(force[1:-1], expected[rows], rtol=0, atol=1e-10)
        cable_motions(state, cables.packed(), height, motions)
        np.testing.assert_allclose(motions, [paths.lengths, paths.J @ V], rtol=0, atol=1e-12)
    tensions[1] = np.nan
    tension_force(state, tensions, cables.packed(), height, False, 1, force)
    assert np.all(np.isnan(force[1:-1]))


# The static law.

SPRINGS = np.array([1.0e4, 2.0e4, 3.0e5, 5.0e4, 1.0e4, 2.0e4, 3.0e5, 5.0e4])  # [N]
X_WP = RigidTransform(rotation_from_angles(np.array([0.1, -0.2, 0.3])), [0.1, -0.2, 0.9])
ELASTIC = pack_cables(P_WA, P_PB, SPRINGS, np.zeros(M))
STEP = 1e-6  # [m]; central differences
ENERGY = 1e-5  # relative; 1e-16 of the energy over the step, plus the curvature


def force_at(X, l0):
    q = X.rotation().ToQuaternion().wxyz()
    return floating(np.concatenate([q, X.translation(), np.zeros(6)]), l0, np.zeros(M), ELASTIC)


@pytest.mark.parametrize("seed", range(10))
def test_the_kernel_finds_the_tensions_that_unstrained_lengths_were_made_for(seed):
    t = np.random.default_rng(seed).uniform(0.0, 500.0, M)
    t[seed % M] = 0.0
    lengths = cable_lengths(X_WP, P_WA, P_PB)
    l0 = unstrained_lengths(lengths, t, SPRINGS)
    assert l0[seed % M] == lengths[seed % M]
    np.testing.assert_allclose(force_at(X_WP, l0)[1][0], t, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(stretched_lengths(l0, t, SPRINGS), lengths)
    np.testing.assert_array_equal(stretched_lengths(l0, -t, SPRINGS), l0)  # none is compressed


@pytest.mark.parametrize("strain", [1e-4, 1e-3, 1e-2])
def test_tension_is_the_slope_of_the_elastic_energy(strain):
    l0 = np.linspace(1.0, 2.0, M)
    lengths = l0 * (1.0 + strain)
    for step, tension in zip(STEP * np.eye(M), SPRINGS * strain, strict=True):
        ahead, back = (elastic_energy(lengths + k * step, l0, SPRINGS) for k in (1, -1))
        scale = max(tension, elastic_energy(lengths, l0, SPRINGS))
        assert abs((ahead - back) / (2.0 * STEP) - tension) <= ENERGY * scale


def test_slack_cables_store_nothing():
    assert elastic_energy(np.array([0.9, 0.5]), np.ones(2), SPRINGS[:2]) == 0.0
    alone = elastic_energy(np.array([1.1]), np.ones(1), SPRINGS[:1])
    assert elastic_energy(np.array([1.1, 0.5]), np.ones(2), SPRINGS[:2]) == alone


def test_the_kernel_pulls_down_the_slope_of_the_elastic_energy():
    """F_P_W . V = -dE/dt for all six motions of the platform."""
    l0 = unstrained_lengths(cable_lengths(X_WP, P_WA, P_PB), np.full(M, 100.0), SPRINGS)
    force = force_at(X_WP, l0)[0]
    slope = slopes(lambda X: elastic_energy(cable_lengths(X, P_WA, P_PB), l0, SPRINGS), X_WP)
    np.testing.assert_allclose(force, -slope, rtol=0, atol=ENERGY * np.max(np.abs(force)))


def test_stiffness_is_minus_the_derivative_of_the_kernels_force():
    """Taut by 1e-4, with little stiffness from turning the tensions: ten times as much."""
    l0 = cable_lengths(X_WP, P_WA, P_PB) / 1.0001
    K = cable_stiffness_matrix(length_jacobian(X_WP, P_WA, P_PB), SPRINGS, l0)
    slope = slopes(lambda X: force_at(X, l0)[0], X_WP)
    np.testing.assert_allclose(K, -slope, rtol=0.0, atol=1e-3 * np.max(np.abs(K)))
    np.testing.assert_allclose(K, K.T, rtol=1e-12)
    assert np.min(np.linalg.eigvalsh(K)) > 0.0


def test_a_single_cable_is_a_spring_along_its_direction():
    J = np.array([[0.0, 0.0, 0.0, 0.0, 0.6, 0.8]])
    K = cable_stiffness_matrix(J, np.array([1e4]), np.array([2.0]))
    np.testing.assert_allclose(K, 5e3 * J.T @ J)
