"""Sections of a pick-and-place scenario: workpiece, gripper, places, cover, and how it is done."""

from typing import Annotated

import numpy as np

from cdpr_drake.models.camera_files import camera_names
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Text, filled, settings, values
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED
from cdpr_drake.systems.controllers.perturbation_settings import PoseShift
from cdpr_drake.vision.apriltags import TAG_COUNT, TagTarget

OBJECT_TAG, GOAL_TAG = "object", "goal"
COVERED_IN = {
    "approach": OBJECT_TAG,
    "descend": OBJECT_TAG,
    "carry": GOAL_TAG,
    "lower": GOAL_TAG,
}
"""Phases in which a tag can be hidden, and the tag that the robot needs in each."""


@settings
class PlacedTag:
    """An AprilTag that lies flat on something, face up."""

    tag_id: Annotated[int, In(ge=0, le=TAG_COUNT - 1), "Identity of the tag."]
    size: Annotated[float, In("m", gt=0.0, le=1.0), "Edge of the black square."] = 0.03
    position: Annotated[
        np.ndarray, In("m", 2), "Where its middle is, along x and y of what it is fixed to."
    ] = values(0.0, 0.0)
    angle_deg: Annotated[float, In("deg"), "How it is turned there about z."] = 0.0

    def target(self) -> TagTarget:
        """What a camera looks for."""
        return TagTarget(self.tag_id, self.size)


@settings
class WorkpieceSettings:
    """A box that is picked up. Its frame B lies in its middle, z up, the tag on its upper face."""

    size: Annotated[np.ndarray, In("m", 3, ge=0.005, le=1.0), "Edges along x, y, z of B."]
    mass: Annotated[float, In("kg", ge=0.01, le=100.0), "Mass, evenly spread."] = 0.3
    friction: Annotated[float, In("-", ge=0.0), "Friction coefficient of its surface."] = 0.5
    tag: Annotated[PlacedTag, "Its tag, beside the middle of its upper face."]
    pose: Annotated[Pose, "Pose of B in W at time 0, as the robot expects it."]


@settings
class GoalSettings:
    """Where the box is to be set down, and the tag that marks it."""

    pose: Annotated[Pose, "Pose of B in W when it is set down, as the robot expects it."]
    tag: Annotated[
        PlacedTag, "The tag beside it, as high as the box's lower face; its place is seen from B."
    ]


@settings
class ScatterSettings:
    """How far box and goal truly are from where the robot expects them, by the seed."""

    distance: Annotated[
        float, In("m", ge=0.0, le=0.2), "Radius of the disc in which each is, evenly."
    ] = 0.02
    angle_deg: Annotated[
        float, In("deg", ge=0.0, le=90.0), "Largest turn of each about z, evenly to both sides."
    ] = 8.0


@settings
class GripperSettings:
    """A suction gripper below the platform: it holds what is close enough, by a compliance."""

    tip: Annotated[np.ndarray, In("m", 3), "Its tip, in P."] = values(0.0, 0.0, -0.08)
    reach: Annotated[
        float, In("m", gt=0.0), "Largest distance between tip and upper face, along the tip's axis."
    ] = 0.003
    sideways: Annotated[
        float,
        In("m", gt=0.0),
        "Largest distance of the tip from the middle of the upper face, across.",
    ] = 0.005
    tilt_deg: Annotated[
        float, In("deg", gt=0.0), "Largest angle between the tip's axis and the face's normal."
    ] = 3.0
    stiffness: Annotated[float, In("N/m", gt=0.0), "Of the grip, along every axis."] = 20000.0
    rotational_stiffness: Annotated[float, In("N m", gt=0.0), "Of the grip, about every axis."] = (
        50.0
    )
    damping_ratio: Annotated[
        float, In("-", ge=0.0, le=1.0), "Damping of the grip per critical one, for the box alone."
    ] = 0.2
    strength: Annotated[float, In("N", gt=0.0), "Force beyond which the grip tears off."] = 40.0


@settings
class GoalCameraSettings:
    """The second camera on the platform, which looks past the box at the goal's tag."""

    model: Annotated[str, OneOf(camera_names()), "A camera of the catalogue."] = "ids_kowa"
    pose: Annotated[Pose, "Pose of the camera frame C in P."]


@settings
class BoxCameraSettings:
    """The cameras: which, how they are imitated, and their images."""

    kind: Annotated[
        str,
        OneOf((RENDERED, PROJECTED)),
        "rendered draws images and detects tags in them; projected projects their corners.",
    ] = RENDERED
    mount: Annotated[Text, "Which of the robot's cameras looks at the box."] = "onboard"
    width: Annotated[int, In("px", ge=16, le=8192), "Image width, of both."] = 640
    height: Annotated[int, In("px", ge=16, le=8192), "Image height, of both."] = 480
    pixel_noise: Annotated[
        float,
        In("px", ge=0.0),
        "Standard deviation of a corner's coordinates; projected cameras only.",
    ] = 0.1


@settings
class HandlingErrors:
    """What the robot believes wrongly of itself; all directions are random, by the seed."""

    initial_pose_shift: Annotated[
        PoseShift, "Error of the pose from which dead reckoning starts."
    ] = filled(PoseShift)
    camera_pose_shift: Annotated[PoseShift, "Error of the pose of each camera on the platform."] = (
        filled(PoseShift)
    )
    exit_points: Annotated[
        float, In("m", ge=0.0), "Distance of each assumed exit point from the true one."
    ] = 0.0
    anchor_points: Annotated[
        float, In("m", ge=0.0), "Distance of each assumed anchor point from the true one."
    ] = 0.0


@settings
class CoverSettings:
    """A plate that hides a tag for a while."""

    phase: Annotated[str, OneOf(COVERED_IN), "The phase in which the tag that it needs is hidden."]
    delay: Annotated[float, In("s", ge=0.0), "Time from the beginning of that phase."] = 0.5
    duration: Annotated[float, In("s", gt=0.0), "Time for which the tag is hidden."] = 3.0


@settings
class HandlingSettings:
    """The servo, and when a phase is over."""

    rate: Annotated[
        float, In("Hz", gt=0.0, le=FASTEST), "Control steps, and images, per second."
    ] = 25.0
    lambda_0: Annotated[float, In("1/s", gt=0.0), "Gain at zero error."] = 2.5
    lambda_infinity: Annotated[float, In("1/s", gt=0.0), "Gain at large errors."] = 1.0
    lambda_slope: Annotated[float, In("1/s", ge=0.0), "Slope of the gain at zero error."] = 30.0
    sigma: Annotated[
        float,
        In("1/s", gt=0.0),
        "Rate of the continuous start of each phase; null starts abruptly.",
    ] = 4.0
    smoothing: Annotated[
        float,
        In("-", gt=0.0, le=1.0),
        "Least share of a new sighting in what is believed of a tag's place, after the "
        "mean of the first ones.",
    ] = 0.06
    hover: Annotated[
        float,
        In("m", gt=0.0),
        "Height above the place from which the box is taken, or where it goes.",
    ] = 0.08
    distance: Annotated[float, In("m", gt=0.0), "Distance that counts as reached."] = 0.0005
    angle_deg: Annotated[float, In("deg", gt=0.0), "Angle that counts as reached."] = 0.3
    hold: Annotated[float, In("s", ge=0.0), "Time for which both must hold."] = 0.4
    passing_distance: Annotated[
        float,
        In("m", gt=0.0),
        "Distance that counts as reached on the way, above box and goal and after "
        "release; the angle is as much wider.",
    ] = 0.002
    fresh: Annotated[
        float,
        In("s", gt=0.0),
        "A phase that needs a tag does not end if it was last seen longer ago.",
    ] = 0.25
    blind: Annotated[
        float,
        In("s", gt=0.0),
        "Longest time without the tag that a phase needs, by dead reckoning.",
    ] = 6.0
    pause: Annotated[float, In("s", ge=0.0), "Rest while the gripper closes or opens."] = 0.4
    phase_limit: Annotated[float, In("s", gt=0.0), "Longest time of a phase."] = 25.0
