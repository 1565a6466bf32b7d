"""Forces of a grip against mechanics, what is in reach, and what hides a tag."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.systems.pick_and_place.grip_kernel import FORCES, grip_forces
from cdpr_drake.systems.pick_and_place.gripper import GripLaw
from cdpr_drake.systems.pick_and_place.tag_cameras import box_hides

LAW = GripLaw(
    p_PT=np.array([0.0, 0.0, -0.08]), p_BF=np.array([0.0, 0.0, 0.01]), reach=3e-3, sideways=5e-3,
    tilt=0.05, stiffness=2e4, damping=30.0, rotational_stiffness=50.0, rotational_damping=0.1,
    strength=40.0,
)  # fmt: skip

ROUNDED = 1e-9
"""Forces of some newtons from differences of positions of a metre in double precision [N, N m]."""


def state(X: RigidTransform, w=(0.0, 0.0, 0.0), v=(0.0, 0.0, 0.0)) -> np.ndarray:
    return np.concatenate([pose_row(X), w, v])


def forces(platform, box, X_PB) -> np.ndarray:
    work = np.zeros(FORCES)
    constants = np.array([
        LAW.stiffness, LAW.damping, LAW.rotational_stiffness, LAW.rotational_damping
    ])  # fmt: skip
    hold = pose_row(X_PB)
    hold.flags.writeable = False  # as Drake gives it: for another kind the kernel compiles again
    grip_forces(platform, box, hold, LAW.p_BF, constants, work)
    return work


def poses(seed: int) -> tuple[RigidTransform, RigidTransform]:
    random = np.random.default_rng(seed)
    X_WP = RigidTransform(RollPitchYaw(random.uniform(-0.5, 0.5, 3)), random.uniform(-1, 1, 3))
    X_PB = RigidTransform(RollPitchYaw(random.uniform(-0.5, 0.5, 3)), np.array([0.0, 0.0, -0.09]))
    return X_WP, X_PB


@pytest.mark.parametrize("seed", range(3))
def test_a_grip_makes_no_momentum(seed):
    random = np.random.default_rng(100 + seed)
    X_WP, X_PB = poses(seed)
    X_WB = (
        X_WP
        @ X_PB
        @ RigidTransform(
            rotation_from_vector(random.uniform(-0.1, 0.1, 3)), random.uniform(-1e-3, 1e-3, 3)
        )
    )
    work = forces(
        state(X_WP, random.normal(size=3), random.normal(size=3)),
        state(X_WB, random.normal(size=3), random.normal(size=3)),
        X_PB,
    )
    np.testing.assert_allclose(work[3:6], -work[9:12], atol=ROUNDED)
    about_W = work[:3] + np.cross(X_WP.translation(), work[3:6])
    about_W += work[6:9] + np.cross(X_WB.translation(), work[9:12])
    np.testing.assert_allclose(about_W, 0.0, atol=1e-7)
    assert work[12] == pytest.approx(X_WP.rotation().matrix()[:, 2] @ work[9:12])
    assert work[13] == pytest.approx(np.linalg.norm(work[9:12]))


def test_a_grip_rests_where_it_closed_and_pulls_back_from_elsewhere():
    X_WP, X_PB = poses(3)
    np.testing.assert_allclose(forces(state(X_WP), state(X_WP @ X_PB), X_PB), 0.0, atol=1e-7)
    shift = np.array([1e-4, -2e-4, 3e-4])
    moved = RigidTransform(shift) @ (X_WP @ X_PB)
    work = forces(state(X_WP), state(moved), X_PB)
    np.testing.assert_allclose(work[9:12], -LAW.stiffness * shift, atol=1e-6)
    turn = np.array([0.02, -0.01, 0.03])
    X_WB = X_WP @ X_PB
    p_WF = X_WB @ LAW.p_BF
    R = rotation_from_vector(turn) @ X_WB.rotation()
    turned = RigidTransform(R, p_WF - R @ LAW.p_BF)  # about the point of the grip
    work = forces(state(X_WP), state(turned), X_PB)
    np.testing.assert_allclose(work[9:12], 0.0, atol=1e-6)
    np.testing.assert_allclose(work[6:9], -LAW.rotational_stiffness * turn, atol=1e-7)


def test_a_grip_does_not_brake_what_moves_as_one_body():
    X_WP, X_PB = poses(4)
    X_WB = X_WP @ X_PB
    w, v = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.2, -0.1])
    v_B = v + np.cross(w, X_WB.translation() - X_WP.translation())
    work = forces(state(X_WP, w, v), state(X_WB, w, v_B), X_PB)
    np.testing.assert_allclose(work, 0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("offset", "angles", "near"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), True),
        ((0.0, 0.0, 2.9e-3), (0.0, 0.0, 0.0), True),
        ((0.0, 0.0, 3.1e-3), (0.0, 0.0, 0.0), False),
        ((4.0e-3, 4.0e-3, 0.0), (0.0, 0.0, 0.0), False),
        ((0.0, 0.0, 0.0), (0.06, 0.0, 0.0), False),
    ],
)
def test_only_a_box_in_reach_is_gripped(offset, angles, near):
    X_WP = RigidTransform([0.1, 0.2, 0.3])
    p_WF = X_WP @ LAW.p_PT - np.array(offset)
    R = RotationMatrix(RollPitchYaw(*angles))
    X_WB = RigidTransform(R, p_WF - R @ LAW.p_BF)
    assert LAW.can_grip(X_WP, X_WB) == near


def test_a_box_hides_what_is_behind_it_and_not_what_lies_on_it():
    size, eye = np.array([0.2, 0.06, 0.02]), np.array([0.0, 0.0, 0.1])
    assert box_hides(size, eye, np.array([0.0, 0.0, -0.1]))
    assert not box_hides(size, eye, np.array([0.0, 0.0, 0.01]))
    assert not box_hides(size, np.array([0.0, 0.075, 0.1]), np.array([0.0, 0.085, -0.01]))
    assert box_hides(size, np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.035, -0.2]))
