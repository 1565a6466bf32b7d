"""Scenario section `perturbations`: what the controller believes wrongly."""

from typing import Annotated

import numpy as np

from cdpr_drake.models.camera_catalogue import Distortion
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import In, Switch, Text, filled, settings


@settings
class PoseShift:
    """An error of a pose of given size, in a random direction and about a random axis."""

    distance: Annotated[float, In("m", ge=0.0), "Distance from the true position."] = 0.0
    angle_deg: Annotated[float, In("deg", ge=0.0, le=180.0), "Angle from the true rotation."] = 0.0


@settings
class Perturbations:
    """What the controller believes wrongly; the simulated robot stays as its file says, but for
    `slack` and the winches' offsets.

    Explicit and random errors add up. Random directions depend on the scenario's seed.
    """

    believed_robot: Annotated[
        Text | None,
        "Robot by name, or path of a robot file, whose cables and cameras, by torque also"
        " platform and friction, the controller believes in, as cdpr calibrate and "
        "identify write it; null: the robot that is simulated. Errors below come on top.",
    ] = None
    initial_pose: Annotated[
        Pose | None, "Pose of the platform in W that the estimator starts from; null: the true one."
    ] = None
    initial_pose_shift: Annotated[PoseShift, "Random error of that pose."] = filled(PoseShift)
    camera_pose: Annotated[
        Pose | None,
        "Pose, in the true camera frame, of the camera frame that the controller assumes.",
    ] = None
    camera_pose_shift: Annotated[
        PoseShift, "Random error of the camera's pose on the platform."
    ] = filled(PoseShift)
    external_camera: Annotated[
        Pose | None,
        "Pose, in the true frame of the second camera in the world, of the frame that "
        "estimators assume of it.",
    ] = None
    external_camera_shift: Annotated[
        PoseShift, "Random error of that camera's pose in the world."
    ] = filled(PoseShift)
    told_object: Annotated[
        Pose | None,
        "Pose, in the target's true frame, of the frame that estimator.sensor_fusion is "
        "told of it.",
    ] = None
    told_object_shift: Annotated[
        PoseShift, "Random error of the target's pose that it is told."
    ] = filled(PoseShift)
    image_bias: Annotated[
        np.ndarray | None, In("px", 2), "Shift (u, v) of everything that is measured in the image."
    ] = None
    camera_model: Annotated[
        Text | None,
        "Camera by name, or path of a camera file, as whose the images of the servo's "
        "camera are read; null: as which they are.",
    ] = None
    camera_distortion: Annotated[
        Distortion | None,
        "What the lens is believed to do to images, of kind none: nothing; null: what "
        "that camera says.",
    ] = None
    exit_points: Annotated[
        float,
        In("m", ge=0.0),
        "Distance of each assumed exit point from the true one, in a random direction.",
    ] = 0.0
    exit_points_together: Annotated[
        Switch, "Whether all exit points are shifted in the same random direction."
    ] = False
    exit_point_shifts: Annotated[
        np.ndarray | None,
        In("m", None, 3),
        "Shift of each assumed exit point from the true one in W, a row for each cable.",
    ] = None
    anchor_points: Annotated[
        float,
        In("m", ge=0.0),
        "Distance of each assumed anchor point from the true one, in a random direction.",
    ] = 0.0
    anchor_points_together: Annotated[
        Switch, "Whether all anchor points are shifted in the same random direction."
    ] = False
    anchor_point_shifts: Annotated[
        np.ndarray | None,
        In("m", None, 3),
        "Shift of each assumed anchor point from the true one in P, a row for each cable.",
    ] = None
    slack: Annotated[
        np.ndarray | None,
        In("m", None, ge=0.0),
        "Length paid out at the start beyond what holds the platform, for each cable; "
        "this is done to the simulated robot, and nobody knows.",
    ] = None
    winch_offset: Annotated[
        float,
        In("m/s"),
        "Velocity by which every winch pays out more than it is told; this is done to the"
        " simulated robot, and nobody knows.",
    ] = 0.0
    winch_offset_spread: Annotated[
        float,
        In("m/s", ge=0.0),
        "Largest difference of a winch's offset from that, drawn evenly for each winch.",
    ] = 0.0
    slack_at_rest: Annotated[
        Switch,
        "Whether the platform hangs at rest with that slack when the run starts; else it "
        "starts at the initial pose and falls into it.",
    ] = False
