"""Scenario section `perturbations`: what the controller believes wrongly.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.models.camera_catalogue import Distortion
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import array, number, optional_section, section, switch, text


@dataclass(kw_only=True)
class PoseShift:
    """An error of a pose of given size, in a random direction and about a random axis."""

    distance: float = number("Distance from the true position.", "m", 0.0, at_least=0.0)
    angle_deg: float = number(
        "Angle from the true rotation.", "deg", 0.0, at_least=0.0, at_most=180.0
    )


@dataclass(kw_only=True)
class Perturbations:
    """What the controller believes wrongly; the simulated robot stays as its file says, but for
    `slack` and the winches' offsets.

    Explicit and random errors add up. Random directions depend on the scenario's seed.
    """

    believed_robot: str | None = text(
        "Robot by name, or path of a robot file, whose cables and cameras, by torque also platform "
        "and friction, the controller believes in, as cdpr calibrate and identify write it; null: "
        "the robot that is simulated. Errors below come on top.",
        None,
    )
    initial_pose: Pose | None = optional_section(
        "Pose of the platform in W that the estimator starts from; null: the true one."
    )
    initial_pose_shift: PoseShift = section("Random error of that pose.", PoseShift, required=False)
    camera_pose: Pose | None = optional_section(
        "Pose, in the true camera frame, of the camera frame that the controller assumes."
    )
    camera_pose_shift: PoseShift = section(
        "Random error of the camera's pose on the platform.", PoseShift, required=False
    )
    external_camera: Pose | None = optional_section(
        "Pose, in the true frame of the second camera in the world, of the frame that estimators "
        "assume of it."
    )
    external_camera_shift: PoseShift = section(
        "Random error of that camera's pose in the world.", PoseShift, required=False
    )
    told_object: Pose | None = optional_section(
        "Pose, in the target's true frame, of the frame that estimator.sensor_fusion is told of it."
    )
    told_object_shift: PoseShift = section(
        "Random error of the target's pose that it is told.", PoseShift, required=False
    )
    image_bias: np.ndarray | None = array(
        "Shift (u, v) of everything that is measured in the image.", "px", (2,), None
    )
    camera_model: str | None = text(
        "Camera by name, or path of a camera file, as whose the images of the servo's camera are "
        "read; null: as which they are.",
        None,
    )
    camera_distortion: Distortion | None = optional_section(
        "What the lens is believed to do to images, of kind none: nothing; null: what that camera "
        "says."
    )
    exit_points: float = number(
        "Distance of each assumed exit point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )
    exit_points_together: bool = switch(
        "Whether all exit points are shifted in the same random direction.", False
    )
    exit_point_shifts: np.ndarray | None = array(
        "Shift of each assumed exit point from the true one in W, a row for each cable.",
        "m",
        (None, 3),
        None,
    )
    anchor_points: float = number(
        "Distance of each assumed anchor point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )
    anchor_points_together: bool = switch(
        "Whether all anchor points are shifted in the same random direction.", False
    )
    anchor_point_shifts: np.ndarray | None = array(
        "Shift of each assumed anchor point from the true one in P, a row for each cable.",
        "m",
        (None, 3),
        None,
    )
    slack: np.ndarray | None = array(
        "Length paid out at the start beyond what holds the platform, for each cable; this is "
        "done to the simulated robot, and nobody knows.",
        "m",
        (None,),
        None,
        at_least=0.0,
    )
    winch_offset: float = number(
        "Velocity by which every winch pays out more than it is told; this is done to the "
        "simulated robot, and nobody knows.",
        "m/s",
        0.0,
    )
    winch_offset_spread: float = number(
        "Largest difference of a winch's offset from that, drawn evenly for each winch.",
        "m/s",
        0.0,
        at_least=0.0,
    )
    slack_at_rest: bool = switch(
        "Whether the platform hangs at rest with that slack when the run starts; else it starts at "
        "the initial pose and falls into it.",
        False,
    )
