"""Energy, gradient and Hessian of a hanging platform against differences of each other."""

import numpy as np
import pytest

from cdpr_drake.cables.dispatch_kernel import STRAIGHT
from cdpr_drake.cables.models import cable_derivatives, cable_state
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.rotation_kernel import turn_pose
from cdpr_drake.statics.equilibrium_kernel import RESTS, STUCK, energy_at, settle
from cdpr_drake.statics.rigid_platform import RigidPlatform

STEP = 1e-5
DIFFERENCE = 1e-6
"""Central differences with STEP, relative: its square times third derivatives, and rounding."""

P_WA = np.array([(x, y, z) for x in (-1.6, 1.7) for y in (-2.9, 3.0) for z in (0.1, 3.2)]).T
P_PB = np.array([(x, y, z) for x in (0.2, -0.21) for y in (-0.1, 0.12) for z in (0.23, 0.0)]).T
PLATFORM = RigidPlatform(5.0, np.array([0.02, -0.03, 0.1]), np.eye(3))
X_WP = pose_from_angles([0.2, -0.3, 1.4], [0.2, -0.1, 0.3])
STATE = np.concatenate([X_WP.rotation().ToQuaternion().wxyz(), X_WP.translation(), np.zeros(6)])


def cables_with(radius):
    return CableSet.make(P_WA, P_PB, 1e4, pulley_radius=radius, linear_weight=1.5)


def lengths_of(cables, X):
    state = cable_state(cables, "elastic", X, np.full(8, 9.0))
    return state.lengths * np.where(np.arange(8) % 3 == 0, 1.01, 0.99)  # some slack, some taut


def at(state, cables, l0, sags, motion=FREE):
    g, H = np.empty(6), np.empty((6, 6))
    energy, pull, good = energy_at(
        int(sags), floating_motion(state)[:12], cables.packed(), l0, 1.0, PLATFORM.packed_weight(),
        motion.packed(), np.zeros((8, 2)), g, H,
    )  # fmt: skip
    assert good
    return energy, pull, g, H


def moved(direction):
    state = STATE.copy()
    turn_pose(state, *(STEP * direction[:3]))
    state[4:7] += STEP * direction[3:]
    return state


@pytest.mark.parametrize("radius", [0.0, 0.075])
@pytest.mark.parametrize("sags", [False, True])
def test_gradient_and_hessian(sags, radius):
    cables = cables_with(radius)
    l0 = lengths_of(cables, X_WP)
    _, pull, g, H = at(STATE, cables, l0, sags)
    slopes, curves = np.empty(6), np.empty((6, 6))
    for k, direction in enumerate(np.eye(6)):
        ahead = at(moved(direction), cables, l0, sags)
        behind = at(moved(-direction), cables, l0, sags)
        slopes[k] = (ahead[0] - behind[0]) / (2.0 * STEP)
        curves[:, k] = (ahead[2] - behind[2]) / (2.0 * STEP)
    np.testing.assert_allclose(g, slopes, atol=DIFFERENCE * np.max(np.abs(g)))
    expected = 0.5 * (curves + curves.T)
    np.testing.assert_allclose(H, expected, atol=DIFFERENCE * np.max(np.abs(H)))
    model = "catenary" if sags else "elastic"
    state = cable_state(cables, model, X_WP, l0)
    wrench = state.wrench + PLATFORM.weight_wrench(X_WP)
    np.testing.assert_allclose(g, -wrench, atol=1e-9 * pull)
    assert pull == pytest.approx(np.sum(state.tensions))
    K = PLATFORM.weight_stiffness(X_WP)
    K = K - cable_derivatives(cables, model, X_WP, l0).wrench_by_pose
    np.testing.assert_allclose(H, 0.5 * (K + K.T), atol=1e-9 * np.max(np.abs(H)))


def test_a_planar_platform_has_three_motions():
    cables = cables_with(0.0)
    l0 = lengths_of(cables, X_WP)
    _, _, g, H = at(STATE, cables, l0, False)
    _, _, planar_g, planar_H = at(STATE, cables, l0, False, LEVEL)
    moving = [2, 3, 4]
    np.testing.assert_array_equal(planar_g[moving], g[moving])
    np.testing.assert_array_equal(planar_H[np.ix_(moving, moving)], H[np.ix_(moving, moving)])
    np.testing.assert_array_equal(planar_g[[0, 1, 5]], 0.0)


def test_the_energy_never_grows_on_the_way_to_rest():
    cables = cables_with(0.0)
    l0 = lengths_of(cables, X_WP)
    state = STATE.copy()
    before = at(state, cables, l0, False)[0]
    code, steps, unbalanced = settle(
        state, STRAIGHT, cables.packed(), l0, 1.0, PLATFORM.packed_weight(), FREE.packed(),
        0.2, np.zeros((8, 2)),
    )  # fmt: skip
    after, pull, _, H = at(state, cables, l0, False)
    assert code == RESTS
    assert after < before
    assert steps < 200
    assert unbalanced <= 1e-8 * (pull + 50.0)
    assert np.all(np.linalg.eigvalsh(H) > 0.0)


def test_a_cable_that_cannot_run_is_no_rest():
    cables = CableSet.make(P_WA, P_PB, 1e4, pulley_radius=0.3)
    state = STATE.copy()
    arm = X_WP.rotation().matrix() @ P_PB[:, 0]
    state[4:7] = P_WA[:, 0] - arm + np.array([0.3, 0.0, 0.0])  # in the groove's circle
    code, _, _ = settle(
        state, STRAIGHT, cables.packed(), np.full(8, 3.0), 1.0, PLATFORM.packed_weight(),
        FREE.packed(), 0.2, np.zeros((8, 2)),
    )  # fmt: skip
    assert code == STUCK
