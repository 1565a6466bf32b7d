"""The platform's pose from images, from cable lengths, or from both; and what sensors make of it.

Errors of a pose are twists in the body frame, X_true = X exp(e), ordered (rotation, translation).

Source: servoing thesis 2.1 and 2.3; for the invariant filter, Barrau and Bonnabel, 2017.
"""

from cdpr_drake.estimation.from_images import object_from_pose, pose_from_images, pose_from_object
from cdpr_drake.estimation.pose_filter import (
    LENGTHS,
    PoseBelief,
    error_size,
    image_covariance,
    predict,
    start_belief,
    update_image,
    update_known_object,
    update_lengths,
)
from cdpr_drake.estimation.sensor_noise import (
    PoseBias,
    encoder_readings,
    moved_pose,
    random_direction,
    random_rotation,
    sample_noise,
    sensor_random,
    tension_readings,
)

__all__ = [
    "LENGTHS", "PoseBelief", "PoseBias", "encoder_readings", "error_size", "image_covariance",
    "moved_pose", "object_from_pose", "pose_from_images", "pose_from_object", "predict",
    "random_direction", "random_rotation", "sample_noise", "sensor_random", "start_belief",
    "tension_readings", "update_image", "update_known_object", "update_lengths",
]  # fmt: skip
