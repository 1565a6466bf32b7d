"""A camera on two joints: its law by finite differences, its steady view, what encoders hide."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.servoing.turned_view import (
    centre_jacobian,
    centring_rates,
    encoder_turn,
    pointing_angles,
    spiral,
    steady_view,
)
from cdpr_drake.systems.sensors.pan_tilt import head_pose

STEP, DIFFERENCES = 1e-6, 1e-8
"""Central differences of a smooth function: error of the order of STEP^2 and round-off / STEP."""

POINT = np.array([0.3, -0.2, 1.4])


def image(angles):
    p = head_pose(RigidTransform(), np.zeros(3), angles).inverse() @ POINT
    return p[:2] / p[2]


@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.4, -0.3), (-0.7, 0.6)])
def test_jacobian_of_the_middle_by_finite_differences(angles):
    angles = np.array(angles)
    J = centre_jacobian(image(angles), angles[1])
    for k in range(2):
        step = STEP * np.eye(2)[k]
        slope = (image(angles + step) - image(angles - step)) / (2.0 * STEP)
        np.testing.assert_allclose(J[:, k], slope, atol=DIFFERENCES)


def test_the_law_takes_the_middle_there_exponentially():
    """As exp(-gain t), but for the damping, of 1e-6 of the rates."""
    angles, gain, period = np.array([0.3, 0.1]), 2.0, 1e-4
    start = np.linalg.norm(image(angles))
    for _ in range(10_000):
        angles = angles + period * centring_rates(image(angles), angles[1], gain)
    assert np.linalg.norm(image(angles)) == pytest.approx(start * np.exp(-2.0), rel=1e-3)


def test_along_the_axis_of_pan_rates_stay_finite():
    assert np.all(np.isfinite(centring_rates(np.zeros(2), np.pi / 2, 4.0)))
    assert np.max(np.abs(centring_rates(np.array([1e-3, 0.0]), np.pi / 2, 4.0))) < 10.0


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.02, -0.01, 0.05)])
def test_steady_view_is_what_a_camera_at_rest_sees(arm):
    """Whatever the joints are at, and with an arm by the depths of the pose."""
    arm = np.array(arm)
    p_OK = np.array([[-0.03, 0.03, 0.03, -0.03], [-0.03, -0.03, 0.03, 0.03], np.zeros(4)])
    X_C0O = pose_from_angles(np.array([0.3, -0.2, 0.5]), np.array([2.9, 0.1, 0.4]))
    X_BM = RigidTransform(-arm)  # C0 is B then
    X_C0C = head_pose(X_BM, arm, np.array([0.5, 0.35]))
    X_CO = X_C0C.inverse() @ X_C0O
    p_CK = X_CO @ p_OK
    seen = steady_view(X_C0C, X_CO, p_CK[:2] / p_CK[2], p_OK)
    assert seen is not None
    p_C0K = X_C0O @ p_OK
    np.testing.assert_allclose(seen[1], p_C0K[:2] / p_C0K[2], atol=1e-12)
    assert seen[0].IsNearlyEqualTo(X_C0O, 1e-12)


def test_no_steady_view_of_what_is_beside_or_behind():
    for x, z in ((0.3, -0.2), (0.3, 0.001)):
        X_C0O = RigidTransform([x, 0.0, z])
        X_C0C = RigidTransform(RotationMatrix.MakeYRotation(1.6))
        X_CO = X_C0C.inverse() @ X_C0O
        marks = (X_CO.translation()[:2] / X_CO.translation()[2])[:, np.newaxis]
        assert steady_view(X_C0C, X_CO, marks, np.zeros((3, 1))) is None


def test_errors_of_encoders_turn_the_camera_by_no_more():
    """At any angles; of both errors in full it is met."""
    random = np.random.default_rng(3)
    bound = encoder_turn(0.05, 0.08)
    turns = []
    for _ in range(500):
        at = random.uniform(-1.5, 1.5, 2)
        wrong = at + random.choice([-1.0, 1.0], 2) * [0.05, 0.08]
        R, R_wrong = (head_pose(RigidTransform(), np.zeros(3), q).rotation() for q in (at, wrong))
        turns.append((R.inverse() @ R_wrong).ToAngleAxis().angle())
    np.testing.assert_allclose(turns, bound, rtol=1e-9)
    assert encoder_turn(0.05, 0.0) == pytest.approx(0.05)


def test_pointing_angles_look_at_a_point():
    for point in (POINT, np.array([-0.4, 0.7, 0.3]), np.array([0.2, 0.1, -0.5])):
        p = head_pose(RigidTransform(), np.zeros(3), pointing_angles(point)).inverse() @ point
        np.testing.assert_allclose(p, [0.0, 0.0, np.linalg.norm(point)], atol=1e-12)


def test_the_search_leaves_nothing_out():
    """Every point within its reach is nearer than half a pitch to the spiral."""
    pitch, reach = 0.3, 1.0
    way = np.array([spiral(t, pitch, 1.0, reach) for t in np.arange(0.0, 10.4, 0.01)])
    assert np.max(np.linalg.norm(way, axis=1)) <= reach
    random = np.random.default_rng(1)
    for point in random.uniform(-0.55, 0.55, (200, 2)):
        assert np.min(np.linalg.norm(way - point, axis=1)) < 0.5 * pitch + 0.02
