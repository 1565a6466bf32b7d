"""Scenario section `target`: what the camera servos on, of which kind it is and how it moves.

`TARGETS` is the table of the kinds that a scenario can name; a new one is one entry of it.
"""

from collections.abc import Callable, Iterator
from typing import Annotated, Protocol

import numpy as np

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import (
    In,
    OneOf,
    Refusal,
    Scope,
    Switch,
    filled,
    settings,
    values,
)
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack
from cdpr_drake.trajectories.pose_trajectory import MovingPose, SteadyMotion, WaypointMotion
from cdpr_drake.vision.apriltags import TAG_COUNT, TagBundle, TagTarget
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget
from cdpr_drake.vision.target import Target
from cdpr_drake.vision.texture_pictures import TEXTURES
from cdpr_drake.vision.textured_target import TexturedTarget


@settings
class BundledTag:
    """One AprilTag of a bundle."""

    tag_id: Annotated[int, In(ge=0, le=TAG_COUNT - 1), "Identity of the tag."]
    size: Annotated[float, In("m", gt=0.0), "Edge of the black square."]
    pose: Annotated[Pose, "Pose of the tag's frame in the object frame O."]


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


@settings
class Waypoint:
    """Where a moving target is at one time."""

    time: Annotated[float, In("s", gt=0.0), "Time."]
    pose: Annotated[Pose, "Pose of the object frame O in W."]


@settings
class MobileRobotSettings:
    """A robot with two driven wheels that carries the target round on a closed track.

    The track is a rectangle with rounded corners in the plane z = const of the target at time 0,
    which is then in the middle of a long side and moves along its own x axis; the track turns to
    the left. The target is in the middle between the wheels.
    """

    length: Annotated[float, In("m", gt=0.0), "Of the track, along the heading at the start."]
    width: Annotated[float, In("m", gt=0.0), "Of the track, across it."]
    corner_radius: Annotated[float, In("m", gt=0.0), "Of the middle of the track."]
    wheel_base: Annotated[
        float,
        In("m", gt=0.0),
        "Distance of the wheels, of which the faster keeps its speed: the wider, the "
        "slower in the corners.",
    ] = 0.1
    lap_time: Annotated[float, In("s", gt=0.0), "Time of a lap."] = 16.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Corners that are wider than the track."""
        most = 0.5 * min(self.length, self.width)
        if self.corner_radius > most:
            accepted = f"at most {most:g} [m], half the shorter side of the track"
            yield "corner_radius", f"{self.corner_radius:g}", accepted

    def track(self) -> RoundedTrack:
        """The track."""
        return RoundedTrack(self.length, self.width, self.corner_radius)


@settings
class TargetMotion:
    """How the target moves by itself: at constant velocity, through waypoints, or on a robot."""

    velocity: Annotated[np.ndarray, In("m/s", 3), "Velocity in W."] = values(0.0, 0.0, 0.0)
    angular_velocity_deg: Annotated[np.ndarray, In("deg/s", 3), "Angular velocity in W."] = values(
        0.0, 0.0, 0.0
    )
    waypoints: Annotated[
        list[Waypoint],
        "Poses at growing times, straight in between; the first one starts from target.pose.",
    ] = filled(list)
    repeat: Annotated[Switch, "Whether the path through the waypoints begins again at its end."] = (
        False
    )

    mobile_robot: Annotated[
        MobileRobotSettings | None, "A mobile robot that carries it round; null: none."
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Times that do not grow, and several kinds of motion at once."""
        times = [point.time for point in self.waypoints]
        if times != sorted(set(times)):
            yield "waypoints", f"the times {times}", "growing ones"
        kinds = {
            "waypoints": bool(times),
            "a velocity": self.has_velocity(),
            "a mobile_robot": self.mobile_robot is not None,
        }
        several = [words for words, there in kinds.items() if there]
        if len(several) > 1:
            yield "", " and ".join(several), "one of them"

    def moves(self) -> bool:
        """Whether it ever changes, also where the waypoints' times make no sense."""
        return bool(self.waypoints or self.mobile_robot) or self.has_velocity()

    def has_velocity(self) -> bool:
        """Whether a constant velocity is asked for."""
        return bool(np.any(self.velocity) or np.any(self.angular_velocity_deg))


@settings
class TargetSettings:
    """What the camera servos on."""

    kind: Annotated[
        str,
        OneOf(TARGETS),
        "tag: one AprilTag 36h11; tag_bundle: several as one object; dots: four dots on a"
        " square; circles: a ring; textured: a square with a texture, without a tag.",
    ] = "tag"
    carrier: Annotated[
        str, OneOf(("world", "platform")), "What carries it; platform is for cameras in the world."
    ] = "world"
    tag_id: Annotated[int, In(ge=0, le=TAG_COUNT - 1), "Identity of a tag."] = 0
    size: Annotated[
        float,
        In("m", gt=0.0),
        "Edge of a tag's black square, of the dots' or the textured square, diameter of the ring.",
    ]
    texture: Annotated[str, OneOf(TEXTURES), "Texture of a textured square."] = "stones"
    tags: Annotated[list[BundledTag], "The tags of a bundle."] = filled(list)
    pose: Annotated[
        Pose,
        "Pose of the object frame O in its carrier at time 0: x right, y up, z out of the pattern.",
    ]
    motion: Annotated[TargetMotion | None, "How it moves; null: it rests."] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A bundle without tags, or with one twice, and a motion of what the platform carries."""
        ids = [tag.tag_id for tag in self.tags]
        if self.kind == "tag_bundle" and (not ids or len(set(ids)) != len(ids)):
            found = f"the identities {ids}" if ids else "none"
            yield "tags", found, "at least one tag, each identity once"
        if self.motion is not None and self.carrier == "platform":
            found = "a motion of a target that the platform carries"
            yield "motion", found, "null, or target.carrier=world"

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
