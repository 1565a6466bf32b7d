"""What the estimator of kind sensor_fusion reads, and how far it trusts what."""

from typing import Annotated

from cdpr_drake.models.sensor_catalogue import depth_sensor_names
from cdpr_drake.schema.declarations import In, OneOf, Switch, settings


@settings
class ToldObject:
    """How well the pose of the target is known before anything is seen; standard deviations.

    What is told is target.pose, wrong by perturbations.told_object.
    """

    position: Annotated[float, In("m", gt=0.0), "Of its position."] = 0.01
    rotation_deg: Annotated[float, In("deg", gt=0.0), "Of its rotation."] = 1.0


@settings
class CalibrationDoubt:
    """That a camera may be worse calibrated than told, and how far off it is then; standard
    deviations."""

    probability: Annotated[float, In("-", gt=0.0, le=1.0), "That it is worse than told."] = 0.05
    position: Annotated[float, In("m", gt=0.0), "Of the camera's position then."] = 0.02
    rotation_deg: Annotated[float, In("deg", gt=0.0), "Of its rotation then."] = 1.0


@settings
class SensorFusionSettings:
    """Sources of kind `sensor_fusion` and how far it trusts them; standard deviations."""

    on_board: Annotated[Switch, "Whether it looks at the target by the servo's camera."] = True
    external: Annotated[Switch, "Whether it looks at platform_tag by the camera in the world."] = (
        True
    )
    lengths: Annotated[Switch, "Whether it reads encoders and tensions."] = True
    imu: Annotated[Switch, "Whether it moves on by sensors.imu, and not by what was asked for."] = (
        False
    )
    on_board_depth: Annotated[
        str | None,
        OneOf(depth_sensor_names()),
        "Type of a depth camera beside the servo's camera; null: none.",
    ] = None
    external_depth: Annotated[
        str | None,
        OneOf(depth_sensor_names()),
        "Type of a depth camera beside that in the world; null: none.",
    ] = None
    steer: Annotated[
        Switch,
        "Whether the servo sees the target where the fused poses put it, so that it goes "
        "on while its camera does not see it; else by the image.",
    ] = True
    told_object: Annotated[
        ToldObject | None,
        "What is known of the target's pose beforehand; null: the first image tells.",
    ] = None
    start_position: Annotated[float, In("m", ge=0.0), "Of the position at the start."] = 0.005
    start_rotation_deg: Annotated[float, In("deg", ge=0.0), "Of the rotation at the start."] = 0.5
    velocity: Annotated[
        float, In("m/sqrt(s)", gt=0.0), "Of the motion from what was asked for, per root of time."
    ] = 0.003
    angular_velocity_deg: Annotated[
        float, In("deg/sqrt(s)", gt=0.0), "The same of the rotation."
    ] = 0.5
    on_board_position: Annotated[
        float, In("m", ge=0.0), "Of the servo's camera on the platform."
    ] = 0.003
    on_board_rotation_deg: Annotated[float, In("deg", ge=0.0), "Of its rotation."] = 0.3
    external_position: Annotated[float, In("m", ge=0.0), "Of the camera in the world."] = 0.003
    external_rotation_deg: Annotated[float, In("deg", ge=0.0), "Of its rotation."] = 0.2
    on_board_doubt: Annotated[
        CalibrationDoubt | None,
        "What if the servo's camera is further off than these two say; null: it is not.",
    ] = None
    external_doubt: Annotated[
        CalibrationDoubt | None,
        "What if the camera in the world is further off than its two say; null: it is not.",
    ] = None
    pixel: Annotated[float, In("px", gt=0.0), "Of a coordinate of a point in either image."] = 0.3
    depth_share: Annotated[
        float, In("-", gt=0.0), "Of a depth, over what its type says; 1: as it says."
    ] = 1.0
    length: Annotated[float, In("m", gt=0.0), "Of a counted length."] = 0.0005
    length_offset: Annotated[
        float, In("m", ge=0.0), "Of what is wrong with a counted length from the start."
    ] = 0.001
    length_drift: Annotated[
        float, In("m/sqrt(s)", ge=0.0), "Of what errors of the model add to it per root of time."
    ] = 0.0005
    taut: Annotated[float, In("N", ge=0.0), "Tension below which a cable counts as slack."] = 0.5
    asked_velocity: Annotated[
        float, In("m/s", gt=0.0), "Of the velocity from what was asked for, with imu."
    ] = 0.03
    gate: Annotated[
        float, In("-", ge=0.0, le=0.5), "Probability with which a right reading is rejected."
    ] = 0.001
    patience: Annotated[
        float,
        In("s", gt=0.0),
        "Time after which a source that was always rejected is believed to be out of calibration.",
    ] = 1.0
    lost_position: Annotated[
        float,
        In("m", gt=0.0),
        "Of a camera's position once it is believed to be out of calibration, and of a length.",
    ] = 0.05
    lost_rotation_deg: Annotated[float, In("deg", gt=0.0), "Of its rotation then."] = 3.0
