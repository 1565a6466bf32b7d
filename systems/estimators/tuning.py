"""What estimators are told about a known tag, and how far fusion trusts what."""

from typing import Annotated

from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import FASTEST, In, Switch, Text, settings
from cdpr_drake.vision.apriltags import TAG_COUNT, TagTarget


@settings
class KnownTagSettings:
    """An AprilTag 36h11 in the scene whose pose in W is known."""

    tag_id: Annotated[int, In(ge=0, le=TAG_COUNT - 1), "Identity of the tag."]
    size: Annotated[float, In("m", gt=0.0), "Edge of the black square."]
    pose: Annotated[Pose, "Pose of the tag frame K in W."]
    period: Annotated[
        float,
        In("s", gt=0.0),
        "Time between two new beginnings of the estimate at the tag; the first one comes "
        "a period after the start.",
    ] = 10.0

    def target(self) -> TagTarget:
        """The tag, as cameras see it."""
        return TagTarget(self.tag_id, self.size)


@settings
class PlatformTagSettings:
    """An AprilTag 36h11 on the platform, and the camera in the world that looks at it."""

    mount: Annotated[Text, "Which of the robot's camera mountings in the world."] = "overview"
    tag_id: Annotated[int, In(ge=0, le=TAG_COUNT - 1), "Identity of the tag."]
    size: Annotated[float, In("m", gt=0.0), "Edge of the black square."]
    pose: Annotated[Pose, "Pose of the tag frame Q on the platform."]
    pixel_noise: Annotated[
        float,
        In("px", ge=0.0),
        "Standard deviation of a corner's coordinates; the image is projected, also where"
        " that of the servo's camera is rendered.",
    ] = 0.1
    rate: Annotated[
        float | None,
        In("Hz", gt=0.0, le=FASTEST),
        "Images per second; null: that of the servo's camera.",
    ] = None
    latency_frames: Annotated[
        int | None,
        In("frames", ge=0, le=1000),
        "Delay from image to estimator; null: that of the servo's camera.",
    ] = None
    fault: Annotated[CameraFault | None, "When this camera fails; null: never."] = None

    def target(self) -> TagTarget:
        """The tag, as cameras see it."""
        return TagTarget(self.tag_id, self.size)


@settings
class FusionSettings:
    """How far the filter of kind `fusion` trusts what; standard deviations."""

    start_position: Annotated[float, In("m", ge=0.0), "Of the position at the start."] = 0.002
    start_rotation_deg: Annotated[float, In("deg", ge=0.0), "Of the rotation at the start."] = 0.2
    velocity: Annotated[
        float, In("m/sqrt(s)", gt=0.0), "Of the motion from what was asked for, per root of time."
    ] = 0.002
    angular_velocity_deg: Annotated[
        float, In("deg/sqrt(s)", gt=0.0), "The same of the rotation."
    ] = 0.3
    camera_position: Annotated[
        float, In("m", ge=0.0), "Of the camera's position on the platform."
    ] = 0.005
    camera_rotation_deg: Annotated[float, In("deg", ge=0.0), "Of its rotation."] = 1.5
    points: Annotated[float, In("m", ge=0.0), "Of the exit and anchor points."] = 0.003
    pixel: Annotated[float, In("px", gt=0.0), "Of a coordinate of a point in the image."] = 0.5
    length: Annotated[float, In("m", gt=0.0), "Of a counted length."] = 0.0005
    length_drift: Annotated[
        float,
        In("m/sqrt(s)", ge=0.0),
        "Of what errors of the model add to a counted length per root of time.",
    ] = 0.0001
    start_slack: Annotated[
        float, In("m", ge=0.0), "Of the length beyond need of cables that are slack at the start."
    ] = 0.02
    taut: Annotated[float, In("N", ge=0.0), "Tension below which a cable counts as slack."] = 0.5
    pulleys: Annotated[Switch, "Whether the lengths are modelled with pulleys."] = False
