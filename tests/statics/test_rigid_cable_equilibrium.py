import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_type import FREE
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.inextensible_equilibrium import (
    rigid_cables_rest,
    taut_tensions,
    tension_stiffness,
)

STEP = 1e-6


@pytest.mark.parametrize("pulleys", [False, True])
def test_tension_stiffness_against_differences(pulleys):
    cables = load_robot("caroca").cable_set()
    cables = cables if pulleys else cables.without_pulleys()
    X = pose_from_angles([0.3, -0.5, 1.2], [0.1, 0.2, -0.1])
    tensions = np.linspace(0.0, 700.0, 8)
    K = np.empty((6, 6))
    for k, d in enumerate(STEP * np.eye(6)):
        ahead, behind = (
            -cable_paths(
                RigidTransform(
                    rotation_from_vector(s * d[:3]) @ X.rotation(), X.translation() + s * d[3:]
                ),
                cables,
            ).J.T
            @ tensions
            for s in (1.0, -1.0)
        )
        K[:, k] = (behind - ahead) / (2.0 * STEP)
    found = tension_stiffness(X, cables, tensions)
    np.testing.assert_allclose(found, K, atol=1e-7 * np.max(np.abs(K)))


@pytest.mark.parametrize("pulleys", [False, True])
def test_lengths_of_a_pose_lead_back_to_it(pulleys):
    robot = load_robot("acrobot_large")
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    X = pose_from_angles([0.1, -0.1, 0.3], [0.0, 0.05, 0.1])
    platform, fk = rigid_platform(robot), ForwardKinematics(cables)
    l0 = unstrained_lengths(fk.lengths(X), np.zeros(8), cables.stiffness)
    guess = RigidTransform(X.rotation(), X.translation() + np.array([0.01, 0.0, -0.01]))
    found, tensions, free, unbalanced = rigid_cables_rest(cables, platform, l0, guess, 0.1)
    assert pose_error(found, X) < (1e-7, 1e-7)
    assert np.all(tensions >= 0.0)
    assert np.sum(tensions > 0.0) <= 6
    assert len(free) == 6 - np.sum(tensions > 0.0)
    assert unbalanced < 1e-8
    wrench = platform.weight_wrench(found) - cable_paths(found, cables).J.T @ tensions
    np.testing.assert_allclose(wrench, 0.0, atol=1e-8)


def test_cables_that_lack_length_carry_all():
    cables = load_robot("acrobot_large").cable_set()
    X = RigidTransform([0.0, 0.0, 0.3])
    paths = cable_paths(X, cables)
    lacking = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.1])
    weight = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -30.0])
    tensions = taut_tensions(paths, lacking, weight, FREE, np.eye(3))
    assert np.all(tensions[6:] == 0.0)
    assert np.all(tensions >= 0.0)
