"""Sets of wrenches and obstacles as users write them."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies
from cdpr_drake.errors import (
    CableGeometryError,
    CdprError,
    DataFileError,
    TrajectoryError,
    WrenchSetError,
)
from cdpr_drake.geometry.convex_shapes import ConvexShape, mesh_vertices
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import In, Scope, Switch, Text, filled, settings, values
from cdpr_drake.schema.typed_yaml import load_typed
from cdpr_drake.systems.worlds.settings import ObstacleMotion, body_motion, way_back_refusals
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE
from cdpr_drake.trajectories.sampled_motion import read_motion, sampled_motion
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS
from cdpr_drake.workspaces.cable_interference import Obstacles, box_row
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.moving_robots import MovingRobot, PlannedMotion
from cdpr_drake.workspaces.moving_shapes import MovingObstacle, MovingShape

MOTION = "How it moves, as a body of a scenario's world does; null: it rests."
"""Documentation of the section of obstacles that move."""


@settings
class WrenchSetFile:
    """Wrenches about Po in W: every sum of one of the polytope, the box and the ellipsoid."""

    vertices: Annotated[
        np.ndarray, In("N m, N", None, 6), "Vertices of a polytope, moments then forces."
    ] = values(*np.zeros((1, 6)))
    box: Annotated[np.ndarray, In("N m, N", 6, ge=0.0), "Half widths of a box."] = values(
        *np.zeros(6)
    )
    ellipsoid: Annotated[np.ndarray, In("N m, N", 6, ge=0.0), "Semi-axes of an ellipsoid."] = (
        values(*np.zeros(6))
    )


@settings
class ObstacleBox:
    """A box that stands in the robot's frame."""

    pose: Annotated[Pose, "Pose of its middle in W."]
    size: Annotated[np.ndarray, In("m", 3, gt=0.0), "Its edges."]
    motion: Annotated[ObstacleMotion | None, MOTION] = None


@settings
class ObstacleSphere:
    """A ball that stands in the robot's frame."""

    position: Annotated[np.ndarray, In("m", 3), "Its middle in W."]
    radius: Annotated[float, In("m", gt=0.0), "Its radius."]
    motion: Annotated[ObstacleMotion | None, MOTION] = None


@settings
class ObstacleCapsule:
    """What is within a radius of a line in the robot's frame."""

    start: Annotated[np.ndarray, In("m", 3), "One end of the line in W."]
    end: Annotated[np.ndarray, In("m", 3), "The other."]
    radius: Annotated[float, In("m", gt=0.0), "The radius."]
    motion: Annotated[
        ObstacleMotion | None, MOTION + " Its frame is in the middle of the line, along W."
    ] = None


@settings
class ObstacleMesh:
    """The convex hull of a mesh that stands in the robot's frame."""

    file: Annotated[Text, "Mesh in metres, beside this file: .obj; .stl and .ply with trimesh."]
    pose: Annotated[Pose, "Pose of the mesh in W."]
    scale: Annotated[float, In("-", gt=0.0), "What its coordinates are multiplied by."] = 1.0
    motion: Annotated[ObstacleMotion | None, MOTION] = None


@settings
class OtherRobot:
    """Another robot in the same room, which moves as was planned for it, or rests."""

    robot: Annotated[Text, "Its name, or its file, beside this one or in the working folder."]
    pose: Annotated[Pose, "Pose of its W in this robot's W."]
    plan: Annotated[
        Text | None,
        "Folder that cdpr plan wrote for it, or a table as its motion.csv, beside this "
        "file; null: it rests at home.",
    ] = None
    later: Annotated[float, In("s", ge=0.0), "How much later than its plan says it starts."] = 0.0
    beams: Annotated[Switch, "Whether the beams of its frame stand there, too."] = True


@settings
class ObstacleFile:
    """What cables and platform may not touch."""

    boxes: Annotated[list[ObstacleBox], "Boxes."] = filled(list)
    spheres: Annotated[list[ObstacleSphere], "Balls."] = filled(list)
    capsules: Annotated[list[ObstacleCapsule], "Capsules."] = filled(list)
    meshes: Annotated[list[ObstacleMesh], "Convex hulls of meshes."] = filled(list)
    robots: Annotated[list[OtherRobot], "Other robots, with their plans."] = filled(list)


def load_wrench_set(path: Path) -> SpatialSet:
    """Reads a set of wrenches; keys as `WrenchSetFile`.

    Raises:
        DataFileError: The file cannot be read, or a value is not accepted.
        WrenchSetError: The set has nothing but zero, or is empty.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of a set of wrenches")
    content = load_typed(WrenchSetFile, path)
    try:
        wrenches = SpatialSet(content.vertices, content.box, content.ellipsoid)
    except WrenchSetError as problem:
        raise WrenchSetError(f"{path}: {problem}") from problem
    if wrenches.is_zero():
        raise WrenchSetError(
            f"{path}: found no wrench but zero; accepted: vertices, a box or an ellipsoid; "
            "static is the kind for the weight alone"
        )
    return wrenches


def load_obstacles(path: Path) -> Obstacles:
    """Reads boxes, balls, capsules and convex hulls of meshes that rest; keys as `ObstacleFile`.

    Raises:
        DataFileError: The file or a mesh cannot be read, a value is not accepted, or an obstacle
            moves.
    """
    resting, moving = load_all_obstacles(path)
    if moving:
        raise DataFileError(
            f"{path}: {moving[0].name}: found an obstacle that moves; accepted: those that rest; "
            "ones that move with cdpr plan --proven"
        )
    return resting


def load_all_obstacles(path: Path) -> tuple[Obstacles, tuple[MovingObstacle, ...]]:
    """Reads obstacles that rest, and those that move; keys as `ObstacleFile`.

    Raises:
        DataFileError: The file or a mesh cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of obstacles")
    content = load_typed(ObstacleFile, path, scope=lambda content: Scope(content, path))
    if not any((content.boxes, content.spheres, content.capsules, content.meshes, content.robots)):
        raise DataFileError(
            f"{path}: found no obstacle; accepted: some of boxes, spheres, capsules, meshes, robots"
        )
    boxes: list[np.ndarray] = []
    solids: list[ConvexShape] = []
    moving: list[MovingObstacle] = []

    def add(key: str, shape: ConvexShape, X_WS: RigidTransform, motion: Any) -> None:
        """A shape in its frame S, which rests or moves."""
        if motion is None:
            solids.append(shape.moved(X_WS))
            return
        for inner, found, accepted in way_back_refusals(X_WS, motion):
            raise DataFileError(f"{path}: {key}.{inner}: found {found}; accepted: {accepted}")
        moving.append(MovingShape(shape, body_motion(X_WS, motion), key))

    for k, box in enumerate(content.boxes):
        X_WS = box.pose.transform()
        if box.motion is None:
            boxes.append(box_row(X_WS.translation(), box.size, X_WS.rotation().matrix()))
        else:
            shape = ConvexShape.box_at(np.zeros(3), box.size, name=f"box {k + 1}")
            add(f"boxes[{k}]", shape, X_WS, box.motion)
    for k, ball in enumerate(content.spheres):
        shape = ConvexShape.sphere(np.zeros(3), ball.radius, f"sphere {k + 1}")
        add(f"spheres[{k}]", shape, RigidTransform(ball.position), ball.motion)
    for k, line in enumerate(content.capsules):
        name, half = f"capsule {k + 1}", 0.5 * (line.end - line.start)
        if line.motion is None:  # its ends stay as they are, to the last digit
            solids.append(ConvexShape.capsule(line.start, line.end, line.radius, name))
        else:
            shape = ConvexShape.capsule(-half, half, line.radius, name)
            add(f"capsules[{k}]", shape, RigidTransform(line.start + half), line.motion)
    for k, mesh in enumerate(content.meshes):
        try:
            vertices = mesh.scale * mesh_vertices(path.parent / mesh.file)
            shape = ConvexShape.mesh(vertices, name=mesh.file)
        except CableGeometryError as problem:
            raise DataFileError(f"{path}: meshes[{k}].file: {problem}") from problem
        add(f"meshes[{k}]", shape, mesh.pose.transform(), mesh.motion)
    moving += [_robot(path, f"robots[{k}]", other) for k, other in enumerate(content.robots)]
    resting = Obstacles(np.array(boxes, float).reshape(-1, BOX_COLUMNS), tuple(solids))
    return resting, tuple(moving)


def _robot(path: Path, key: str, other: OtherRobot) -> MovingRobot:
    """Another robot, which moves as its plan says, or rests at home."""
    beside = path.parent / other.robot
    try:
        robot = load_robot(str(beside) if beside.exists() else other.robot)
    except CdprError as problem:
        raise DataFileError(f"{path}: {key}.robot: {problem}") from problem
    if other.plan is None:
        row = np.zeros((2, MOTION_SIZE))
        row[:, :7] = pose_row(robot.home.transform())
        motion = sampled_motion(np.array([0.0, 1e-3]), row)
    else:
        table = path.parent / other.plan
        try:
            motion = read_motion(table / "motion.csv" if table.is_dir() else table, other.later)
        except TrajectoryError as problem:
            raise DataFileError(f"{path}: {key}.plan: {problem}") from problem
    planned = PlannedMotion(motion, other.pose.transform())
    return MovingRobot(
        interference_bodies(robot, pulleys=True), planned, f"{key} {robot.name}", other.beams
    )
