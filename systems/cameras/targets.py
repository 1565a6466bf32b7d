"""Scenario section `target`: what the camera servos on, of which kind it is and how it moves.

`TARGETS` is the table of the kinds that a scenario can name; a new one is one entry of it.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import (
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack
from cdpr_drake.trajectories.pose_trajectory import MovingPose, SteadyMotion, WaypointMotion
from cdpr_drake.vision.apriltags import TAG_COUNT, TagBundle, TagTarget
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget
from cdpr_drake.vision.target import Target
from cdpr_drake.vision.texture_pictures import TEXTURES
from cdpr_drake.vision.textured_target import TexturedTarget


@dataclass(kw_only=True)
class BundledTag:
    """One AprilTag of a bundle."""

    tag_id: int = whole("Identity of the tag.", at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag's frame in the object frame O.", Pose)


class TargetPattern(Protocol):
    """What the kinds of targets are made from; `TargetSettings` is one."""

    kind: str
    tag_id: int
    size: float
    tags: list[BundledTag]
    texture: str


def _bundle(settings: TargetPattern) -> Target:
    tags = settings.tags
    poses = [tag.pose.transform() for tag in tags]
    return TagBundle([tag.tag_id for tag in tags], [tag.size for tag in tags], poses)


TARGETS: dict[str, Callable[[TargetPattern], Target]] = {
    "tag": lambda settings: TagTarget(settings.tag_id, settings.size),
    "tag_bundle": _bundle,
    "dots": lambda settings: DotTarget(settings.size),
    "circles": lambda settings: CircleTarget(settings.size),
    "textured": lambda settings: TexturedTarget(settings.texture, settings.size),
}
"""Makes a target from the section `target` of a scenario, by its kind."""


@dataclass(kw_only=True)
class Waypoint:
    """Where a moving target is at one time."""

    time: float = number("Time.", "s", above=0.0)
    pose: Pose = section("Pose of the object frame O in W.", Pose)


@dataclass(kw_only=True)
class MobileRobotSettings:
    """A robot with two driven wheels that carries the target round on a closed track.

    The track is a rectangle with rounded corners in the plane z = const of the target at time 0,
    which is then in the middle of a long side and moves along its own x axis; the track turns to
    the left. The target is in the middle between the wheels.
    """

    length: float = number("Of the track, along the heading at the start.", "m", above=0.0)
    width: float = number("Of the track, across it.", "m", above=0.0)
    corner_radius: float = number("Of the middle of the track.", "m", above=0.0)
    wheel_base: float = number(
        "Distance of the wheels, of which the faster keeps its speed: the wider, the slower in the "
        "corners.",
        "m",
        0.1,
        above=0.0,
    )
    lap_time: float = number("Time of a lap.", "s", 16.0, above=0.0)

    def track(self) -> RoundedTrack:
        """The track."""
        return RoundedTrack(self.length, self.width, self.corner_radius)


@dataclass(kw_only=True)
class TargetMotion:
    """How the target moves by itself: at constant velocity, through waypoints, or on a robot."""

    velocity: np.ndarray = array("Velocity in W.", "m/s", (3,), (0.0, 0.0, 0.0))
    angular_velocity_deg: np.ndarray = array(
        "Angular velocity in W.", "deg/s", (3,), (0.0, 0.0, 0.0)
    )
    waypoints: list[Waypoint] = sections(
        "Poses at growing times, straight in between; the first one starts from target.pose.",
        required=False,
    )
    repeat: bool = switch("Whether the path through the waypoints begins again at its end.", False)

    mobile_robot: MobileRobotSettings | None = optional_section(
        "A mobile robot that carries it round; null: none."
    )

    def moves(self) -> bool:
        """Whether it ever changes, also where the waypoints' times make no sense."""
        return bool(self.waypoints or self.mobile_robot) or self.has_velocity()

    def has_velocity(self) -> bool:
        """Whether a constant velocity is asked for."""
        return bool(np.any(self.velocity) or np.any(self.angular_velocity_deg))


@dataclass(kw_only=True)
class TargetSettings:
    """What the camera servos on."""

    kind: str = text(
        "tag: one AprilTag 36h11; tag_bundle: several as one object; dots: four dots on a square; "
        "circles: a ring; textured: a square with a texture, without a tag.",
        "tag",
        choices=TARGETS,
    )
    carrier: str = text(
        "What carries it; platform is for cameras in the world.",
        "world",
        choices=("world", "platform"),
    )
    tag_id: int = whole("Identity of a tag.", 0, at_least=0, at_most=TAG_COUNT - 1)
    size: float = number(
        "Edge of a tag's black square, of the dots' or the textured square, diameter of the ring.",
        "m",
        above=0.0,
    )
    texture: str = text("Texture of a textured square.", "stones", choices=TEXTURES)
    tags: list[BundledTag] = sections("The tags of a bundle.", required=False)
    pose: Pose = section(
        "Pose of the object frame O in its carrier at time 0: x right, y up, z out of the pattern.",
        Pose,
    )
    motion: TargetMotion | None = optional_section("How it moves; null: it rests.")

    def target(self) -> Target:
        """The target itself."""
        return TARGETS[self.kind](self)

    def path(self) -> MovingPose:
        """Its pose over time, in its carrier."""
        start = self.pose.transform()
        motion = self.motion or TargetMotion()
        carrier = motion.mobile_robot
        if carrier is not None:
            return MobileRobotMotion(
                start, carrier.track(), wheel_base=carrier.wheel_base, lap_time=carrier.lap_time
            )
        if motion.waypoints:
            times = [0.0, *(point.time for point in motion.waypoints)]
            poses = [start, *(point.pose.transform() for point in motion.waypoints)]
            return WaypointMotion(times, poses, motion.repeat)
        return SteadyMotion(start, motion.velocity, np.radians(motion.angular_velocity_deg))
