"""Scenario section `world`: ground and obstacles round the robot, and whether they touch it.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import (
    array,
    file_name,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
)
from cdpr_drake.schema.input_files import input_there
from cdpr_drake.systems.worlds.motions import BodyMotion, JointedBody, PathBody, SteadyBody
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

BOX, CYLINDER, SPHERE, MESH, SDFORMAT = "box", "cylinder", "sphere", "mesh", "sdformat"

DIMENSIONS: dict[str, tuple[str, ...]] = {
    BOX: ("size",),
    CYLINDER: ("radius", "length"),
    SPHERE: ("radius",),
    MESH: ("file",),
    SDFORMAT: ("file",),
}
"""Kinds of obstacles, and the keys that say how large each is."""

POINT, HYDROELASTIC = "point", "hydroelastic"
CONTACT_MODELS = (POINT, HYDROELASTIC)

SMALLEST, FARTHEST = 1e-4, 1e3
"""Sizes of obstacles, and how far from the origin of W they may be [m]: beyond, distances of shapes
are not good to a micrometre any more."""

ROOM_BELOW = 0.05
"""Below its frame a platform that may touch something is not lost yet, and plans may end there, so
that it is set down on ground which is level with the frame [m]."""

GROUND = "ground"
"""Name of the ground among the bodies of the world."""

TAKEN = ("world", "platform", "target", "pan_tilt")
"""Names by which sensors are put on something else."""


@dataclass(kw_only=True)
class ObstacleWaypoint:
    """Where a moving obstacle rests on its way."""

    time: float = number("When it gets there.", "s", above=0.0)
    pose: Pose = section("Pose of the obstacle in W.", Pose)


@dataclass(kw_only=True)
class ObstacleJoint:
    """A revolute joint to the world that is driven: angle = rate t + amplitude sin(2 pi t / T)."""

    point: np.ndarray = array("A point of its axis in W.", "m", (3,))
    axis: np.ndarray = array("Direction of its axis in W, of any length.", "-", (3,))
    rate_deg: float = number("Rate of turning.", "deg/s", 0.0, at_least=-1e5, at_most=1e5)
    amplitude_deg: float = number("Amplitude of swinging.", "deg", 0.0, at_least=0.0, at_most=1e4)
    period: float = number("Period T of swinging.", "s", 1.0, at_least=1e-3)


@dataclass(kw_only=True)
class ObstacleMotion:
    """How an obstacle moves, whatever it meets: steadily, through waypoints, or on a joint."""

    velocity: np.ndarray = array(
        "Velocity in W.", "m/s", (3,), (0.0, 0.0, 0.0), at_least=-1e3, at_most=1e3
    )
    angular_velocity_deg: np.ndarray = array(
        "Angular velocity in W.", "deg/s", (3,), (0.0, 0.0, 0.0), at_least=-1e5, at_most=1e5
    )
    waypoints: list[ObstacleWaypoint] = sections(
        "Poses at growing times, at rest in each, quintic in between; the first way starts from "
        "the obstacle's pose.",
        required=False,
    )
    repeat: bool = switch("Whether the way through the waypoints begins again at its end.", False)
    joint: ObstacleJoint | None = optional_section("A joint that it turns on; null: none.")

    def has_velocity(self) -> bool:
        """Whether a constant velocity is asked for."""
        return bool(np.any(self.velocity) or np.any(self.angular_velocity_deg))


@dataclass(kw_only=True)
class ObstacleSettings:
    """A body of the world. Its frame lies in the middle of a box, cylinder or sphere."""

    name: str = file_name("Name, once in a world.")
    kind: str = text("Its shape, or what its file is.", choices=DIMENSIONS)
    size: np.ndarray | None = array(
        "Edges of a box along x, y, z of its frame.", "m", (3,), None,
        at_least=SMALLEST, at_most=FARTHEST,
    )  # fmt: skip
    radius: float | None = number(
        "Of a cylinder or sphere.", "m", None, at_least=SMALLEST, at_most=FARTHEST
    )
    length: float | None = number(
        "Of a cylinder, along z of its frame.", "m", None, at_least=SMALLEST, at_most=FARTHEST
    )
    file: str | None = text(
        "A mesh (.obj, .gltf) or an SDFormat or URDF model, from this file or the working folder; "
        "a mesh is solid where its convex hull is, joints of a model keep their angles.",
        None,
    )
    scale: float = number("Metres per unit of a mesh.", "m", 1.0, at_least=1e-6, at_most=1e3)
    pose: Pose = section("Pose in W at time 0.", Pose)
    color: np.ndarray = array(
        "Red, green, blue; files that have colours keep theirs.",
        "-",
        (3,),
        (0.72, 0.55, 0.38),
        at_least=0.0,
        at_most=1.0,
    )
    friction: float = number("Friction coefficient of its surface.", "-", 0.5, at_least=0.0)
    motion: ObstacleMotion | None = optional_section("How it moves; null: it rests.")

    def path(self) -> BodyMotion:
        """Its pose over time."""
        return body_motion(self.pose.transform(), self.motion or ObstacleMotion())


def body_motion(start: RigidTransform, motion: ObstacleMotion) -> BodyMotion:
    """The pose over time of a body that is at `start` at time 0."""
    if motion.joint is not None:
        return _jointed(start, motion.joint)
    if motion.waypoints:
        times = np.array([0.0, *(point.time for point in motion.waypoints)])
        poses = (start, *(point.pose.transform() for point in motion.waypoints))
        return PathBody(PoseTrajectory(poses, tuple(np.diff(times))), motion.repeat)
    return SteadyBody(start, motion.velocity, np.radians(motion.angular_velocity_deg))


def _jointed(start: RigidTransform, joint: ObstacleJoint) -> JointedBody:
    return JointedBody(
        start, joint.point, joint.axis, rate=float(np.radians(joint.rate_deg)),
        amplitude=float(np.radians(joint.amplitude_deg)), period=joint.period,
    )  # fmt: skip


@dataclass(kw_only=True)
class GroundSettings:
    """Level ground under the frame and half its width around it."""

    height: float = number("Its z in W.", "m", 0.0, at_least=-FARTHEST, at_most=FARTHEST)
    friction: float = number("Friction coefficient of its surface.", "-", 0.5, at_least=0.0)
    color: np.ndarray | None = array(
        "Red, green, blue; null: grey. What is to be seen of it lies 1 mm lower, so that a target "
        "on the ground hides it.",
        "-",
        (3,),
        None,
        at_least=0.0,
        at_most=1.0,
    )


@dataclass(kw_only=True)
class ContactSettings:
    """Compliant contact of the platform with ground and obstacles; cables touch nothing."""

    model: str = text(
        "point: at the corners of the platform, and where a face of it is met; hydroelastic: over "
        "the area of contact, which also holds a platform that none of its corners holds.",
        POINT,
        choices=CONTACT_MODELS,
    )
    penetration: float = number(
        "How deep the platform's weight presses its four lower corners into what they stand on; "
        "the stiffness of contact follows from it and the platform's mass.",
        "m",
        1e-4,
        at_least=1e-6,
        at_most=1e-2,
    )
    dissipation: float | None = number(
        "Hunt and Crossley's d, force = stiffness x depth x (1 + d x speed); null: critical "
        "damping of the platform's vibration on its four corners.",
        "s/m",
        None,
        at_least=0.0,
    )
    friction: float = number(
        "Friction coefficient of the platform's surface; of two surfaces 2 a b / (a + b) counts.",
        "-",
        0.5,
        at_least=0.0,
    )
    slip_speed: float = number(
        "Below this speed of slipping friction is less than its full value, so that what sticks "
        "creeps by less; a smaller one needs smaller steps.",
        "m/s",
        5e-3,
        at_least=1e-6,
    )


def found_file(file: str, folder: Path) -> str:
    """A file's absolute path: in a folder, if it is there, else in that of work."""
    beside = folder / file
    return str((beside if input_there(beside) else Path(file)).absolute())


@dataclass(kw_only=True)
class WorldSettings:
    """What stands and moves round the robot."""

    ground: GroundSettings | None = optional_section("The ground; null: none.")
    obstacles: list[ObstacleSettings] = sections("Bodies of the world.", required=False)
    contact: ContactSettings | None = optional_section(
        "Contact of the platform with them, {} for its defaults; null: it passes through."
    )

    def moving(self) -> list[str]:
        """Names of the obstacles that move."""
        return [body.name for body in self.obstacles if body.motion is not None]

    def room_below(self) -> float:
        """How far below its frame the platform may be [m]: with contact, where the ground at the
        frame's lower side gives way."""
        return 0.0 if self.contact is None else ROOM_BELOW

    def friction(self) -> float:
        """Largest friction coefficient of ground and obstacles."""
        surfaces: list[GroundSettings | ObstacleSettings] = [*self.obstacles]
        if self.ground is not None:
            surfaces.append(self.ground)
        return max((surface.friction for surface in surfaces), default=0.0)

    def find_files(self, folder: Path) -> None:
        """Makes the obstacles' files absolute, see `found_file`."""
        for obstacle in self.obstacles:
            if obstacle.file is not None:
                obstacle.file = found_file(obstacle.file, folder)
