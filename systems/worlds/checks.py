"""What cannot be in a section `world`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.errors import Problems, ScenarioError, WorldError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.settings import (
    DIMENSIONS,
    FARTHEST,
    GROUND,
    TAKEN,
    ObstacleMotion,
    ObstacleSettings,
    WorldSettings,
)
from cdpr_drake.systems.worlds.world import make_world

_ALL_DIMENSIONS = ("size", "radius", "length", "file")

SAME_POSE = 1e-9
"""Distance [m] and angle [rad] between poses that count as the same."""


def check_world(
    settings: WorldSettings | None,
    robot: Robot,
    X_WP: RigidTransform,
    path: Path,
    *,
    compiled: bool,
    stop: bool,
) -> None:
    """Refuses a world that cannot be.

    Args:
        settings: The section, whose files have been found; None: there is none.
        robot: The robot.
        X_WP: Where its platform starts [m].
        path: The file that messages name.
        compiled: Whether the compiled engine is asked for.
        stop: Whether the first touch shall end the run.

    Raises:
        ScenarioError: Names the file and the key; a line for each problem.
    """
    problems = Problems(ScenarioError)
    if settings is None:
        if stop:
            problems.add(f"{path}: stop.contact: found true without a world; accepted: false")
        problems.raise_any()
        return
    if settings.contact is not None and compiled:
        problems.add(
            f"{path}: integration.engine: found compiled, which knows no contact, with "
            "world.contact; accepted: plant or automatic, or world.contact null"
        )
    problems.add(*(f"{path}: {words}" for words in world_problems(settings, robot, X_WP)))
    problems.raise_any()


def world_problems(settings: WorldSettings, robot: Robot, X_WP: RigidTransform) -> Iterator[str]:
    """What is wrong with a world round a robot, a line each that begins with the key.

    Args:
        settings: The section, whose files have been found.
        robot: The robot.
        X_WP: Where its platform starts [m].
    """
    found = False
    for problem in _obstacle_problems(settings):
        found = True
        yield problem
    if found:
        return
    try:
        world = make_world(settings, robot)
    except WorldError as problem:
        yield str(problem)
        return
    if settings.contact is None:
        return
    gaps = WorldClearances(robot, world, robot.cable_set().without_pulleys()).platform(X_WP, 0.0)
    for name, gap in zip(world.names(), gaps, strict=True):
        if gap < -settings.contact.penetration:
            yield (
                f"world: the platform starts {-1e3 * gap:.3g} mm deep in {name}; accepted with "
                f"world.contact: at most world.contact.penetration, "
                f"{1e3 * settings.contact.penetration:g} mm"
            )


def _obstacle_problems(settings: WorldSettings) -> Iterator[str]:
    names: list[str] = [] if settings.ground is None else [GROUND]
    for k, obstacle in enumerate(settings.obstacles):
        key = f"world.obstacles[{k}]"
        if obstacle.name in names:
            yield f"{key}.name: found {obstacle.name} twice; accepted: each name once"
        if obstacle.name in TAKEN:
            yield f"{key}.name: found {obstacle.name}; accepted: not one of {', '.join(TAKEN)}"
        names.append(obstacle.name)
        yield from _dimension_problems(obstacle, key)
        yield from _place_problems(obstacle, key)
        if obstacle.motion is not None:
            start = obstacle.pose.transform()
            yield from motion_problems(start, obstacle.motion, f"{key}.motion")


def _dimension_problems(obstacle: ObstacleSettings, key: str) -> Iterator[str]:
    needed = DIMENSIONS[obstacle.kind]
    for name in _ALL_DIMENSIONS:
        there = getattr(obstacle, name) is not None
        if there and name not in needed:
            yield f"{key}.{name}: found one of a {obstacle.kind}; accepted: null"
        elif not there and name in needed:
            yield f"{key}.{name}: found null; accepted for kind {obstacle.kind}: a value"


def _place_problems(obstacle: ObstacleSettings, key: str) -> Iterator[str]:
    places = {"pose.position": obstacle.pose.position}
    motion = obstacle.motion or ObstacleMotion()
    for k, point in enumerate(motion.waypoints):
        places[f"motion.waypoints[{k}].pose.position"] = point.pose.position
    if motion.joint is not None:
        places["motion.joint.point"] = motion.joint.point
    for name, place in places.items():
        if np.any(np.abs(place) > FARTHEST):
            yield (
                f"{key}.{name}: found {place.tolist()}; accepted: within {FARTHEST:g} m of the "
                "origin along every axis"
            )


def motion_problems(start: RigidTransform, motion: ObstacleMotion, key: str) -> Iterator[str]:
    """What is wrong with the motion of an obstacle from its pose at time 0, a sentence each."""
    kinds = {
        "waypoints": bool(motion.waypoints),
        "a velocity": motion.has_velocity(),
        "a joint": motion.joint is not None,
    }
    asked = [words for words, there in kinds.items() if there]
    if len(asked) > 1:
        yield f"{key}: found {' and '.join(asked)}; accepted: one of them"
    times = [point.time for point in motion.waypoints]
    if times != sorted(set(times)):
        yield f"{key}.waypoints: found the times {times}; accepted: growing ones"
    if motion.repeat:
        if not motion.waypoints:
            yield f"{key}.repeat: found true without waypoints; accepted: false"
        else:
            ends = motion.waypoints[-1].pose.transform()
            if max(pose_error(ends, start)) > SAME_POSE:
                yield (
                    f"{key}.repeat: found true, but the last waypoint is not the obstacle's pose; "
                    "accepted: false, or a way that ends where it begins"
                )
    if motion.joint is not None and not np.any(motion.joint.axis):
        yield f"{key}.joint.axis: found zeros; accepted: a direction"
