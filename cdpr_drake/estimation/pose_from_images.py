"""The platform's pose from images of an object that does not move."""

from __future__ import annotations

from pydrake.math import RigidTransform


def pose_from_object(
    X_WO: RigidTransform, X_PC: RigidTransform, X_CO: RigidTransform
) -> RigidTransform:
    """X_WP [m] from an object whose pose in W is known and that the camera on the platform sees.

    Args:
        X_WO: Pose of the object O in the world W.
        X_PC: Camera C on the platform P.
        X_CO: Measured pose of the object in the camera.

    Source: servoing thesis (2.2), solved for the platform; with X_WO from the first image (2.5).
    """
    return X_WO @ X_CO.inverse() @ X_PC.inverse()


def object_from_pose(
    X_WP: RigidTransform, X_PC: RigidTransform, X_CO: RigidTransform
) -> RigidTransform:
    """X_WO [m] of an object that a platform at X_WP sees at X_CO. Source: servoing thesis (2.2)."""
    return X_WP @ X_PC @ X_CO


def pose_from_images(
    X_WP_before: RigidTransform,
    X_PC: RigidTransform,
    X_CO_before: RigidTransform,
    X_CO: RigidTransform,
) -> RigidTransform:
    """X_WP [m] from two images of an object at rest and the pose at the first of them.

    Repeated from image to image this gives what the first and the last image alone give: what it
    keeps, X_WP X_PC X_CO, is the object's pose, so errors of the images between cancel.

    Args:
        X_WP_before: Pose of the platform at the first image.
        X_PC: Camera C on the platform P.
        X_CO_before: Object in the camera at the first image.
        X_CO: Object in the camera at the second image.

    Source: servoing thesis (2.4).
    """
    return pose_from_object(object_from_pose(X_WP_before, X_PC, X_CO_before), X_PC, X_CO)
