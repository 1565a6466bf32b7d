"""What the estimator of kind sensor_fusion reads, and how far it trusts what.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models.sensor_catalogue import depth_sensor_names
from cdpr_drake.schema.fields import number, optional_section, switch, text


@dataclass(kw_only=True)
class ToldObject:
    """How well the pose of the target is known before anything is seen; standard deviations.

    What is told is target.pose, wrong by perturbations.told_object.
    """

    position: float = number("Of its position.", "m", 0.01, above=0.0)
    rotation_deg: float = number("Of its rotation.", "deg", 1.0, above=0.0)


@dataclass(kw_only=True)
class CalibrationDoubt:
    """That a camera may be worse calibrated than told, and how far off it is then; standard
    deviations."""

    probability: float = number("That it is worse than told.", "-", 0.05, above=0.0, at_most=1.0)
    position: float = number("Of the camera's position then.", "m", 0.02, above=0.0)
    rotation_deg: float = number("Of its rotation then.", "deg", 1.0, above=0.0)


@dataclass(kw_only=True)
class SensorFusionSettings:
    """Sources of kind `sensor_fusion` and how far it trusts them; standard deviations."""

    on_board: bool = switch("Whether it looks at the target by the servo's camera.", True)
    external: bool = switch("Whether it looks at platform_tag by the camera in the world.", True)
    lengths: bool = switch("Whether it reads encoders and tensions.", True)
    imu: bool = switch("Whether it moves on by sensors.imu, and not by what was asked for.", False)
    on_board_depth: str | None = text(
        "Type of a depth camera beside the servo's camera; null: none.",
        None,
        choices=depth_sensor_names(),
    )
    external_depth: str | None = text(
        "Type of a depth camera beside that in the world; null: none.",
        None,
        choices=depth_sensor_names(),
    )
    steer: bool = switch(
        "Whether the servo sees the target where the fused poses put it, so that it goes on while "
        "its camera does not see it; else by the image.",
        True,
    )
    told_object: ToldObject | None = optional_section(
        "What is known of the target's pose beforehand; null: the first image tells."
    )
    start_position: float = number("Of the position at the start.", "m", 0.005, at_least=0.0)
    start_rotation_deg: float = number("Of the rotation at the start.", "deg", 0.5, at_least=0.0)
    velocity: float = number(
        "Of the motion from what was asked for, per root of time.", "m/sqrt(s)", 3e-3, above=0.0
    )
    angular_velocity_deg: float = number("The same of the rotation.", "deg/sqrt(s)", 0.5, above=0.0)
    on_board_position: float = number(
        "Of the servo's camera on the platform.", "m", 0.003, at_least=0.0
    )
    on_board_rotation_deg: float = number("Of its rotation.", "deg", 0.3, at_least=0.0)
    external_position: float = number("Of the camera in the world.", "m", 0.003, at_least=0.0)
    external_rotation_deg: float = number("Of its rotation.", "deg", 0.2, at_least=0.0)
    on_board_doubt: CalibrationDoubt | None = optional_section(
        "What if the servo's camera is further off than these two say; null: it is not."
    )
    external_doubt: CalibrationDoubt | None = optional_section(
        "What if the camera in the world is further off than its two say; null: it is not."
    )
    pixel: float = number("Of a coordinate of a point in either image.", "px", 0.3, above=0.0)
    depth_share: float = number(
        "Of a depth, over what its type says; 1: as it says.", "-", 1.0, above=0.0
    )
    length: float = number("Of a counted length.", "m", 5e-4, above=0.0)
    length_offset: float = number(
        "Of what is wrong with a counted length from the start.", "m", 1e-3, at_least=0.0
    )
    length_drift: float = number(
        "Of what errors of the model add to it per root of time.", "m/sqrt(s)", 5e-4, at_least=0.0
    )
    taut: float = number("Tension below which a cable counts as slack.", "N", 0.5, at_least=0.0)
    asked_velocity: float = number(
        "Of the velocity from what was asked for, with imu.", "m/s", 0.03, above=0.0
    )
    gate: float = number(
        "Probability with which a right reading is rejected.", "-", 1e-3, at_least=0.0, at_most=0.5
    )
    patience: float = number(
        "Time after which a source that was always rejected is believed to be out of calibration.",
        "s",
        1.0,
        above=0.0,
    )
    lost_position: float = number(
        "Of a camera's position once it is believed to be out of calibration, and of a length.",
        "m",
        0.05,
        above=0.0,
    )
    lost_rotation_deg: float = number("Of its rotation then.", "deg", 3.0, above=0.0)
