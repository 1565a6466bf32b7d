"""Scenario section `target`: what the camera servos on.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.models import Pose
from cdpr_drake.schema import (
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from cdpr_drake.systems.cameras.targets import TARGETS, BundledTag
from cdpr_drake.trajectories import MovingPose, SteadyMotion, WaypointMotion
from cdpr_drake.vision import TAG_COUNT, Target


@dataclass(kw_only=True)
class Waypoint:
    """Where a moving target is at one time."""

    time: float = number("Time.", "s", above=0.0)
    pose: Pose = section("Pose of the object frame O in W.", Pose)


@dataclass(kw_only=True)
class TargetMotion:
    """How the target moves by itself: at constant velocity, or through waypoints."""

    velocity: np.ndarray = array("Velocity in W.", "m/s", (3,), (0.0, 0.0, 0.0))
    angular_velocity_deg: np.ndarray = array(
        "Angular velocity in W.", "deg/s", (3,), (0.0, 0.0, 0.0)
    )
    waypoints: list[Waypoint] = sections(
        "Poses at growing times, straight in between; the first one starts from target.pose.",
        required=False,
    )
    repeat: bool = switch("Whether the path through the waypoints begins again at its end.", False)

    def moves(self) -> bool:
        """Whether it ever changes, also where the waypoints' times make no sense."""
        return bool(self.waypoints or np.any(self.velocity) or np.any(self.angular_velocity_deg))


@dataclass(kw_only=True)
class TargetSettings:
    """What the camera servos on."""

    kind: str = text(
        "tag: one AprilTag 36h11; tag_bundle: several as one object; dots: four dots on a square; "
        "circles: a ring.",
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
        "Edge of a tag's black square or of the dots' square, diameter of the ring.",
        "m",
        above=0.0,
    )
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
        if motion.waypoints:
            times = [0.0, *(point.time for point in motion.waypoints)]
            poses = [start, *(point.pose.transform() for point in motion.waypoints)]
            return WaypointMotion(times, poses, motion.repeat)
        return SteadyMotion(start, motion.velocity, np.radians(motion.angular_velocity_deg))
