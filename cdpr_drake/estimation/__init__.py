"""The platform's pose from images, from cable lengths, or from both; and what sensors make of it.

Errors of a pose are twists in the body frame, X_true = X exp(e), ordered (rotation, translation).

`sensor_filter` fuses many sensors, with gates: `sensor_models` says what each reads of a belief,
`source_gates` takes readings in or leaves them out, `calibration_doubt` weighs whether cameras are
where they are told to be. `pose_filter` fuses one camera with
lengths, and finds errors of the robot's points.

Source: servoing thesis 2.1 and 2.3; for the invariant filter, Barrau and Bonnabel, 2017.
"""

from cdpr_drake.estimation.calibration_doubt import (
    Answer,
    Calibration,
    Judged,
    answers,
    judged,
    learnt_shares,
    mixed,
)
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
from cdpr_drake.estimation.sensor_filter import (
    COUNTED,
    EXTERNAL,
    ON_BOARD,
    FusedBelief,
    Increments,
    Prior,
    correct,
    drift_lengths,
    know_object,
    move,
    move_inertially,
    remember_pose,
    start_fusion,
)
from cdpr_drake.estimation.sensor_models import (
    Look,
    image_innovation,
    length_innovation,
    motion_between,
    object_of_image,
    sight_external,
    sight_on_board,
    sigmas_of,
    velocity_innovation,
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
from cdpr_drake.estimation.source_gates import (
    ACCEPTED,
    NOTHING,
    REJECTED,
    USED,
    Gates,
    take_depths,
    take_image,
    take_lengths,
)

__all__ = [
    "ACCEPTED", "COUNTED", "EXTERNAL", "LENGTHS", "NOTHING", "ON_BOARD", "REJECTED", "USED",
    "Answer", "Calibration", "FusedBelief", "Gates", "Increments", "Judged", "Look", "PoseBelief",
    "PoseBias", "Prior", "answers", "correct", "drift_lengths", "encoder_readings", "error_size",
    "image_covariance", "image_innovation", "judged", "know_object", "learnt_shares",
    "length_innovation", "mixed", "motion_between", "move", "move_inertially", "moved_pose",
    "object_from_pose", "object_of_image", "pose_from_images", "pose_from_object", "predict",
    "random_direction", "random_rotation", "remember_pose", "sample_noise", "sensor_random",
    "sight_external", "sight_on_board", "sigmas_of", "start_belief", "start_fusion", "take_depths",
    "take_image", "take_lengths", "tension_readings", "update_image", "update_known_object",
    "update_lengths", "velocity_innovation",
]  # fmt: skip
