"""What estimators are told about a known tag, and how far fusion trusts what.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import FASTEST, number, optional_section, section, switch, text, whole
from cdpr_drake.vision.apriltags import TAG_COUNT, TagTarget


@dataclass(kw_only=True)
class KnownTagSettings:
    """An AprilTag 36h11 in the scene whose pose in W is known."""

    tag_id: int = whole("Identity of the tag.", at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag frame K in W.", Pose)
    period: float = number(
        "Time between two new beginnings of the estimate at the tag; the first one comes a period "
        "after the start.",
        "s",
        10.0,
        above=0.0,
    )

    def target(self) -> TagTarget:
        """The tag, as cameras see it."""
        return TagTarget(self.tag_id, self.size)


@dataclass(kw_only=True)
class PlatformTagSettings:
    """An AprilTag 36h11 on the platform, and the camera in the world that looks at it."""

    mount: str = text("Which of the robot's camera mountings in the world.", "overview")
    tag_id: int = whole("Identity of the tag.", at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag frame Q on the platform.", Pose)
    pixel_noise: float = number(
        "Standard deviation of a corner's coordinates; the image is projected, also where that of "
        "the servo's camera is rendered.",
        "px",
        0.1,
        at_least=0.0,
    )
    rate: float | None = number(
        "Images per second; null: that of the servo's camera.",
        "Hz",
        None,
        above=0.0,
        at_most=FASTEST,
    )
    latency_frames: int | None = whole(
        "Delay from image to estimator; null: that of the servo's camera.",
        None,
        "frames",
        at_least=0,
        at_most=1000,
    )
    fault: CameraFault | None = optional_section("When this camera fails; null: never.")

    def target(self) -> TagTarget:
        """The tag, as cameras see it."""
        return TagTarget(self.tag_id, self.size)


@dataclass(kw_only=True)
class FusionSettings:
    """How far the filter of kind `fusion` trusts what; standard deviations."""

    start_position: float = number("Of the position at the start.", "m", 0.002, at_least=0.0)
    start_rotation_deg: float = number("Of the rotation at the start.", "deg", 0.2, at_least=0.0)
    velocity: float = number(
        "Of the motion from what was asked for, per root of time.", "m/sqrt(s)", 2e-3, above=0.0
    )
    angular_velocity_deg: float = number("The same of the rotation.", "deg/sqrt(s)", 0.3, above=0.0)
    camera_position: float = number(
        "Of the camera's position on the platform.", "m", 0.005, at_least=0.0
    )
    camera_rotation_deg: float = number("Of its rotation.", "deg", 1.5, at_least=0.0)
    points: float = number("Of the exit and anchor points.", "m", 0.003, at_least=0.0)
    pixel: float = number("Of a coordinate of a point in the image.", "px", 0.5, above=0.0)
    length: float = number("Of a counted length.", "m", 5e-4, above=0.0)
    length_drift: float = number(
        "Of what errors of the model add to a counted length per root of time.",
        "m/sqrt(s)",
        1e-4,
        at_least=0.0,
    )
    start_slack: float = number(
        "Of the length beyond need of cables that are slack at the start.", "m", 0.02, at_least=0.0
    )
    taut: float = number("Tension below which a cable counts as slack.", "N", 0.5, at_least=0.0)
    pulleys: bool = switch("Whether the lengths are modelled with pulleys.", False)
