import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.rigid_platform import RigidPlatform

STEP = 1e-6

PLATFORM = RigidPlatform(3.0, np.array([0.1, -0.2, 0.3]), np.eye(3), 9.0)
X_WP = pose_from_angles([0.4, 0.5, 0.6], [0.3, -0.2, 0.5])


def test_weight_stiffness_against_differences():
    K = np.empty((6, 6))
    for k, d in enumerate(STEP * np.eye(6)):
        ahead, behind = (
            RigidTransform(
                rotation_from_vector(s * d[:3]) @ X_WP.rotation(), X_WP.translation() + s * d[3:]
            )
            for s in (1.0, -1.0)
        )
        K[:, k] = (PLATFORM.weight_wrench(behind) - PLATFORM.weight_wrench(ahead)) / (2.0 * STEP)
    np.testing.assert_allclose(PLATFORM.weight_stiffness(X_WP), K, atol=1e-8)


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_mass_matrix_is_drakes(name):
    robot = load_robot(name)
    R = np.kron(np.eye(2), X_WP.rotation().matrix())
    expected = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    platform = rigid_platform(robot)
    np.testing.assert_allclose(platform.mass_matrix(X_WP), expected, atol=1e-12)
    assert platform.motion == (LEVEL if name == "planar" else FREE)


def test_packed_weight():
    np.testing.assert_allclose(PLATFORM.packed_weight(), [0.0, 0.0, 27.0, 0.1, -0.2, 0.3])
