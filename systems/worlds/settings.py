"""Scenario section `world`: ground and obstacles round the robot, and whether they touch it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import (
    Direction,
    In,
    Name,
    OneOf,
    Refusal,
    Scope,
    Switch,
    Text,
    filled,
    repeated,
    settings,
    values,
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

Near = Annotated[np.ndarray, In("m", 3, ge=-FARTHEST, le=FARTHEST)]
"""A point that is not too far away."""

SAME_POSE = 1e-9
"""Distance [m] and angle [rad] between poses that count as the same."""

ROOM_BELOW = 0.05
"""Below its frame a platform that may touch something is not lost yet, and plans may end there, so
that it is set down on ground which is level with the frame [m]."""

GROUND = "ground"
"""Name of the ground among the bodies of the world."""

TAKEN = ("world", "platform", "target")
"""Names by which sensors are put on something else."""


@settings
class ObstacleWaypoint:
    """Where a moving obstacle rests on its way."""

    time: Annotated[float, In("s", gt=0.0), "When it gets there."]
    pose: Annotated[Pose, "Pose of the obstacle in W."]


@settings
class ObstacleJoint:
    """A revolute joint to the world that is driven: angle = rate t + amplitude sin(2 pi t / T)."""

    point: Annotated[Near, "A point of its axis in W."]
    axis: Annotated[Direction, "Direction of its axis in W, of any length."]
    rate_deg: Annotated[float, In("deg/s", ge=-100000.0, le=100000.0), "Rate of turning."] = 0.0
    amplitude_deg: Annotated[float, In("deg", ge=0.0, le=10000.0), "Amplitude of swinging."] = 0.0
    period: Annotated[float, In("s", ge=0.001), "Period T of swinging."] = 1.0


@settings
class ObstacleMotion:
    """How an obstacle moves, whatever it meets: steadily, through waypoints, or on a joint."""

    velocity: Annotated[np.ndarray, In("m/s", 3, ge=-1000.0, le=1000.0), "Velocity in W."] = values(
        0.0, 0.0, 0.0
    )
    angular_velocity_deg: Annotated[
        np.ndarray, In("deg/s", 3, ge=-100000.0, le=100000.0), "Angular velocity in W."
    ] = values(0.0, 0.0, 0.0)
    waypoints: Annotated[
        list[ObstacleWaypoint],
        "Poses at growing times, at rest in each, quintic in between; the first way "
        "starts from the obstacle's pose.",
    ] = filled(list)
    repeat: Annotated[Switch, "Whether the way through the waypoints begins again at its end."] = (
        False
    )
    joint: Annotated[ObstacleJoint | None, "A joint that it turns on; null: none."] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Several kinds of motion at once, times that do not grow, and a way that is none."""
        kinds = {
            "waypoints": bool(self.waypoints),
            "a velocity": self.has_velocity(),
            "a joint": self.joint is not None,
        }
        several = [words for words, there in kinds.items() if there]
        if len(several) > 1:
            yield "", " and ".join(several), "one of them"
        times = [point.time for point in self.waypoints]
        if times != sorted(set(times)):
            yield "waypoints", f"the times {times}", "growing ones"
        if self.repeat and not self.waypoints:
            yield "repeat", "true without waypoints", "false"

    def has_velocity(self) -> bool:
        """Whether a constant velocity is asked for."""
        return bool(np.any(self.velocity) or np.any(self.angular_velocity_deg))


@settings
class ObstacleSettings:
    """A body of the world. Its frame lies in the middle of a box, cylinder or sphere."""

    name: Annotated[Name, "Name, once in a world."]
    kind: Annotated[str, OneOf(DIMENSIONS), "Its shape, or what its file is."]
    size: Annotated[
        np.ndarray | None,
        In("m", 3, ge=SMALLEST, le=FARTHEST),
        "Edges of a box along x, y, z of its frame.",
    ] = None
    radius: Annotated[
        float | None, In("m", ge=SMALLEST, le=FARTHEST), "Of a cylinder or sphere."
    ] = None
    length: Annotated[
        float | None, In("m", ge=SMALLEST, le=FARTHEST), "Of a cylinder, along z of its frame."
    ] = None
    file: Annotated[
        Text | None,
        "A mesh (.obj, .gltf) or an SDFormat or URDF model, from this file or the working"
        " folder; a mesh is solid where its convex hull is, joints of a model keep their "
        "angles.",
    ] = None
    scale: Annotated[float, In("m", ge=1e-06, le=1000.0), "Metres per unit of a mesh."] = 1.0
    pose: Annotated[Pose, "Pose in W at time 0."]
    color: Annotated[
        np.ndarray,
        In("-", 3, ge=0.0, le=1.0),
        "Red, green, blue; files that have colours keep theirs.",
    ] = values(0.72, 0.55, 0.38)
    friction: Annotated[float, In("-", ge=0.0), "Friction coefficient of its surface."] = 0.5
    motion: Annotated[ObstacleMotion | None, "How it moves; null: it rests."] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Dimensions of another kind, none of its own, and places that are too far away."""
        for name in ("size", "radius", "length", "file"):
            is_there, is_needed = getattr(self, name) is not None, name in DIMENSIONS[self.kind]
            if is_there and not is_needed:
                yield name, f"one of a {self.kind}", "null"
            elif is_needed and not is_there:
                yield name, "null", f"a value, for kind {self.kind}"
        motion = self.motion or ObstacleMotion()
        places = {"pose": self.pose}
        places |= {
            f"motion.waypoints[{k}].pose": one.pose for k, one in enumerate(motion.waypoints)
        }
        for name, pose in places.items():
            if np.any(np.abs(pose.position) > FARTHEST):
                accepted = f"within {FARTHEST:g} m of the origin along every axis"
                yield f"{name}.position", pose.position.tolist(), accepted
        yield from way_back_refusals(self.pose.transform(), motion)

    def path(self) -> BodyMotion:
        """Its pose over time."""
        return body_motion(self.pose.transform(), self.motion or ObstacleMotion())


def way_back_refusals(start: RigidTransform, motion: ObstacleMotion) -> Iterator[Refusal]:
    """A way that shall begin again at its end and does not end where the body starts."""
    if motion.repeat and motion.waypoints:
        ends = motion.waypoints[-1].pose.transform()
        if max(pose_error(ends, start)) > SAME_POSE:
            found = "true, but the last waypoint is not the obstacle's pose"
            yield "motion.repeat", found, "false, or a way that ends where it begins"


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


@settings
class GroundSettings:
    """Level ground under the frame and half its width around it."""

    height: Annotated[float, In("m", ge=-FARTHEST, le=FARTHEST), "Its z in W."] = 0.0
    friction: Annotated[float, In("-", ge=0.0), "Friction coefficient of its surface."] = 0.5
    color: Annotated[
        np.ndarray | None,
        In("-", 3, ge=0.0, le=1.0),
        "Red, green, blue; null: grey. What is to be seen of it lies 1 mm lower, so that "
        "a target on the ground hides it.",
    ] = None


@settings
class ContactSettings:
    """Compliant contact of the platform with ground and obstacles; cables touch nothing."""

    model: Annotated[
        str,
        OneOf(CONTACT_MODELS),
        "point: at the corners of the platform, and where a face of it is met; "
        "hydroelastic: over the area of contact, which also holds a platform that none of"
        " its corners holds.",
    ] = POINT
    penetration: Annotated[
        float,
        In("m", ge=1e-06, le=0.01),
        "How deep the platform's weight presses its four lower corners into what they "
        "stand on; the stiffness of contact follows from it and the platform's mass.",
    ] = 0.0001
    dissipation: Annotated[
        float | None,
        In("s/m", ge=0.0),
        "Hunt and Crossley's d, force = stiffness x depth x (1 + d x speed); null: "
        "critical damping of the platform's vibration on its four corners.",
    ] = None
    friction: Annotated[
        float,
        In("-", ge=0.0),
        "Friction coefficient of the platform's surface; of two surfaces 2 a b / (a + b) counts.",
    ] = 0.5
    slip_speed: Annotated[
        float,
        In("m/s", ge=1e-06),
        "Below this speed of slipping friction is less than its full value, so that what "
        "sticks creeps by less; a smaller one needs smaller steps.",
    ] = 0.005


def found_file(file: str, folder: Path) -> str:
    """A file's absolute path: in a folder, if it is there, else in that of work."""
    beside = folder / file
    return str((beside if input_there(beside) else Path(file)).absolute())


@settings
class WorldSettings:
    """What stands and moves round the robot."""

    ground: Annotated[GroundSettings | None, "The ground; null: none."] = None
    obstacles: Annotated[list[ObstacleSettings], "Bodies of the world."] = filled(list)
    contact: Annotated[
        ContactSettings | None,
        "Contact of the platform with them, {} for its defaults; null: it passes through.",
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Names that come twice, or are those of something else."""
        taken = [*TAKEN, *([] if self.ground is None else [GROUND])]
        names = [obstacle.name for obstacle in self.obstacles]
        yield from repeated(names, "obstacles[{}].name")
        for k, name in enumerate(names):
            if name in taken:
                yield f"obstacles[{k}].name", name, f"not one of {', '.join(taken)}"

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
