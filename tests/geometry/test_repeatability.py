"""Accuracy and repeatability against values computed by hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.pose_accuracy import mean_pose, repeatability

ROUND_OFF = 1e-12  # poses of order one


def test_a_square_about_a_point_beside_the_desired_one():
    centre = np.array([0.3, 0.0, 0.4])
    corners = [np.array([1.0, 0, 0]), [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]]
    found = repeatability(
        [RigidTransform(centre + 0.01 * np.array(c)) for c in corners], RigidTransform()
    )
    assert found.count == 4
    assert found.accuracy == pytest.approx(0.5, abs=ROUND_OFF)
    assert found.repeatability == pytest.approx(0.01, abs=ROUND_OFF)
    assert found.iso_9283 == pytest.approx(0.01, abs=ROUND_OFF)  # all equally far: no deviation
    assert found.rotation_accuracy == found.rotation_repeatability == 0.0


def test_iso_9283_adds_three_standard_deviations():
    poses = [RigidTransform([x, 0.0, 0.0]) for x in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    distances = np.array([2.0, 1.0, 0.0, 1.0, 2.0])
    found = repeatability(poses, RigidTransform())
    deviation = np.sqrt(np.sum((distances - 1.2) ** 2) / 4.0)
    assert found.iso_9283 == pytest.approx(1.2 + 3.0 * deviation, abs=ROUND_OFF)
    assert found.repeatability == pytest.approx(2.0, abs=ROUND_OFF)


def test_rotations_about_one_axis():
    angles = np.radians([10.0, 14.0, 18.0])
    poses = [RigidTransform(RotationMatrix.MakeZRotation(a), [0.0, 0.0, 0.0]) for a in angles]
    found = repeatability(poses, RigidTransform())
    assert found.rotation_accuracy == pytest.approx(np.radians(14.0), abs=ROUND_OFF)
    assert found.rotation_repeatability == pytest.approx(np.radians(4.0), abs=ROUND_OFF)


def test_one_pose_repeats_itself():
    X = RigidTransform(RotationMatrix.MakeXRotation(0.3), [1.0, 2.0, 3.0])
    found = repeatability([X], X)
    assert found.accuracy == found.repeatability == 0.0
    assert found.iso_9283 is None
    assert found.rotation_accuracy < ROUND_OFF


def test_the_mean_of_opposite_turns_is_no_turn():
    poses = [RigidTransform(RotationMatrix.MakeYRotation(a), [0.0, 0.0, 0.0]) for a in (0.4, -0.4)]
    assert mean_pose(poses).IsNearlyIdentity(ROUND_OFF)


def test_no_poses_are_refused():
    with pytest.raises(CdprError, match="at least one pose"):
        repeatability([], RigidTransform())
