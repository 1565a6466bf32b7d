"""Sections of a pick-and-place scenario: workpiece, gripper, places, cover, and how it is done.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.models.camera_files import camera_names
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import FASTEST, array, number, section, text, whole
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


@dataclass(kw_only=True)
class PlacedTag:
    """An AprilTag that lies flat on something, face up."""

    tag_id: int = whole("Identity of the tag.", at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", 0.03, above=0.0, at_most=1.0)
    position: np.ndarray = array(
        "Where its middle is, along x and y of what it is fixed to.", "m", (2,), (0.0, 0.0)
    )
    angle_deg: float = number("How it is turned there about z.", "deg", 0.0)

    def target(self) -> TagTarget:
        """What a camera looks for."""
        return TagTarget(self.tag_id, self.size)


@dataclass(kw_only=True)
class WorkpieceSettings:
    """A box that is picked up. Its frame B lies in its middle, z up, the tag on its upper face."""

    size: np.ndarray = array("Edges along x, y, z of B.", "m", (3,), at_least=5e-3, at_most=1.0)
    mass: float = number("Mass, evenly spread.", "kg", 0.3, at_least=0.01, at_most=100.0)
    friction: float = number("Friction coefficient of its surface.", "-", 0.5, at_least=0.0)
    tag: PlacedTag = section("Its tag, beside the middle of its upper face.", PlacedTag)
    pose: Pose = section("Pose of B in W at time 0, as the robot expects it.", Pose)


@dataclass(kw_only=True)
class GoalSettings:
    """Where the box is to be set down, and the tag that marks it."""

    pose: Pose = section("Pose of B in W when it is set down, as the robot expects it.", Pose)
    tag: PlacedTag = section(
        "The tag beside it, as high as the box's lower face; its place is seen from B.", PlacedTag
    )


@dataclass(kw_only=True)
class ScatterSettings:
    """How far box and goal truly are from where the robot expects them, by the seed."""

    distance: float = number(
        "Radius of the disc in which each is, evenly.", "m", 0.02, at_least=0.0, at_most=0.2
    )
    angle_deg: float = number(
        "Largest turn of each about z, evenly to both sides.", "deg", 8.0, at_least=0.0,
        at_most=90.0,
    )  # fmt: skip


@dataclass(kw_only=True)
class GripperSettings:
    """A suction gripper below the platform: it holds what is close enough, by a compliance."""

    tip: np.ndarray = array("Its tip, in P.", "m", (3,), (0.0, 0.0, -0.08))
    reach: float = number(
        "Largest distance between tip and upper face, along the tip's axis.", "m", 3e-3, above=0.0
    )
    sideways: float = number(
        "Largest distance of the tip from the middle of the upper face, across.", "m", 5e-3,
        above=0.0,
    )  # fmt: skip
    tilt_deg: float = number(
        "Largest angle between the tip's axis and the face's normal.", "deg", 3.0, above=0.0
    )
    stiffness: float = number("Of the grip, along every axis.", "N/m", 2e4, above=0.0)
    rotational_stiffness: float = number("Of the grip, about every axis.", "N m", 50.0, above=0.0)
    damping_ratio: float = number(
        "Damping of the grip per critical one, for the box alone.", "-", 0.2, at_least=0.0,
        at_most=1.0,
    )  # fmt: skip
    strength: float = number("Force beyond which the grip tears off.", "N", 40.0, above=0.0)


@dataclass(kw_only=True)
class GoalCameraSettings:
    """The second camera on the platform, which looks past the box at the goal's tag."""

    model: str = text("A camera of the catalogue.", "ids_kowa", choices=camera_names())
    pose: Pose = section("Pose of the camera frame C in P.", Pose)


@dataclass(kw_only=True)
class BoxCameraSettings:
    """The cameras: which, how they are imitated, and their images."""

    kind: str = text(
        "rendered draws images and detects tags in them; projected projects their corners.",
        RENDERED,
        choices=(RENDERED, PROJECTED),
    )
    mount: str = text("Which of the robot's cameras looks at the box.", "onboard")
    width: int = whole("Image width, of both.", 640, "px", at_least=16, at_most=8192)
    height: int = whole("Image height, of both.", 480, "px", at_least=16, at_most=8192)
    pixel_noise: float = number(
        "Standard deviation of a corner's coordinates; projected cameras only.", "px", 0.1,
        at_least=0.0,
    )  # fmt: skip


@dataclass(kw_only=True)
class HandlingErrors:
    """What the robot believes wrongly of itself; all directions are random, by the seed."""

    initial_pose_shift: PoseShift = section(
        "Error of the pose from which dead reckoning starts.", PoseShift, required=False
    )
    camera_pose_shift: PoseShift = section(
        "Error of the pose of each camera on the platform.", PoseShift, required=False
    )
    exit_points: float = number(
        "Distance of each assumed exit point from the true one.", "m", 0.0, at_least=0.0
    )
    anchor_points: float = number(
        "Distance of each assumed anchor point from the true one.", "m", 0.0, at_least=0.0
    )


@dataclass(kw_only=True)
class CoverSettings:
    """A plate that hides a tag for a while."""

    phase: str = text("The phase in which the tag that it needs is hidden.", choices=COVERED_IN)
    delay: float = number("Time from the beginning of that phase.", "s", 0.5, at_least=0.0)
    duration: float = number("Time for which the tag is hidden.", "s", 3.0, above=0.0)


@dataclass(kw_only=True)
class HandlingSettings:
    """The servo, and when a phase is over."""

    rate: float = number(
        "Control steps, and images, per second.", "Hz", 25.0, above=0.0, at_most=FASTEST
    )
    lambda_0: float = number("Gain at zero error.", "1/s", 2.5, above=0.0)
    lambda_infinity: float = number("Gain at large errors.", "1/s", 1.0, above=0.0)
    lambda_slope: float = number("Slope of the gain at zero error.", "1/s", 30.0, at_least=0.0)
    sigma: float | None = number(
        "Rate of the continuous start of each phase; null starts abruptly.", "1/s", 4.0, above=0.0
    )
    smoothing: float = number(
        "Least share of a new sighting in what is believed of a tag's place, after the mean of the "
        "first ones.",
        "-",
        0.06,
        above=0.0,
        at_most=1.0,
    )  # fmt: skip
    hover: float = number(
        "Height above the place from which the box is taken, or where it goes.", "m", 0.08,
        above=0.0,
    )  # fmt: skip
    distance: float = number("Distance that counts as reached.", "m", 5e-4, above=0.0)
    angle_deg: float = number("Angle that counts as reached.", "deg", 0.3, above=0.0)
    hold: float = number("Time for which both must hold.", "s", 0.4, at_least=0.0)
    passing_distance: float = number(
        "Distance that counts as reached on the way, above box and goal and after release; the "
        "angle is as much wider.",
        "m",
        2e-3,
        above=0.0,
    )  # fmt: skip
    fresh: float = number(
        "A phase that needs a tag does not end if it was last seen longer ago.", "s", 0.25,
        above=0.0,
    )  # fmt: skip
    blind: float = number(
        "Longest time without the tag that a phase needs, by dead reckoning.", "s", 6.0, above=0.0
    )
    pause: float = number("Rest while the gripper closes or opens.", "s", 0.4, at_least=0.0)
    phase_limit: float = number("Longest time of a phase.", "s", 25.0, above=0.0)
