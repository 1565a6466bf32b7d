"""The bodies of a world: what they are made of, and where they are when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box, Cylinder, Shape, Sphere
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorldError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.scene import FLOOR_COLOR
from cdpr_drake.systems.worlds.model_files import Part, mesh_parts, model_parts
from cdpr_drake.systems.worlds.motions import BodyMotion, SteadyBody
from cdpr_drake.systems.worlds.settings import (
    BOX,
    CYLINDER,
    GROUND,
    MESH,
    SDFORMAT,
    GroundSettings,
    ObstacleSettings,
    WorldSettings,
)

GROUND_THICKNESS = 1.0
"""Of the box that is the ground [m]; what falls through it in one step would be very fast."""

VISIBLE_DEPTH = 1e-3
"""The visible ground lies this far below its height [m], so that a target on it hides it."""


@dataclass(frozen=True, eq=False)
class WorldBody:
    """A body with a name that moves as it wants to, whatever it meets.

    Attributes:
        name: Its name.
        parts: What it is made of.
        motion: Its pose X_WB over time.
        friction: Friction coefficient of its surface.
    """

    name: str
    parts: tuple[Part, ...]
    motion: BodyMotion
    friction: float

    def solids(self) -> list[Part]:
        """The parts that one can touch."""
        return [part for part in self.parts if part.solid]


@dataclass(frozen=True, eq=False)
class World:
    """What is round a robot.

    Attributes:
        bodies: The ground, if there is any, and the obstacles in the order of their file.
        ground: Height of the ground [m]; None: there is none.
    """

    bodies: tuple[WorldBody, ...]
    ground: float | None

    def names(self) -> list[str]:
        """Names of the bodies."""
        return [body.name for body in self.bodies]

    def body(self, name: str) -> WorldBody:
        """The body of that name.

        Raises:
            WorldError: There is none.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise WorldError(f"world: found no body {name!r}; known: {', '.join(self.names())}")


def make_world(settings: WorldSettings, robot: Robot) -> World:
    """The world that settings describe.

    Args:
        settings: The section `world`, whose files have been found.
        robot: The robot, on whose frame depends how far the ground reaches.

    Raises:
        WorldError: A file cannot be read, or has no shapes; names the key.
    """
    bodies = [] if settings.ground is None else [_ground(settings.ground, robot)]
    bodies += [
        _obstacle(obstacle, f"world.obstacles[{k}]")
        for k, obstacle in enumerate(settings.obstacles)
    ]
    return World(tuple(bodies), None if settings.ground is None else settings.ground.height)


def _ground(settings: GroundSettings, robot: Robot) -> WorldBody:
    lower, upper = robot.frame.lower, robot.frame.upper
    middle, size = 0.5 * (lower + upper)[:2], 2.0 * (upper - lower)[:2]
    shape = Box(float(size[0]), float(size[1]), GROUND_THICKNESS)

    def placed(top: float) -> RigidTransform:
        return RigidTransform([*middle, top - 0.5 * GROUND_THICKNESS])

    solid = Part(shape, placed(settings.height), None, shown=False, solid=True)
    color = FLOOR_COLOR if settings.color is None else _rgba(settings.color)
    seen = Part(shape, placed(settings.height - VISIBLE_DEPTH), color, solid=False)
    at_rest = SteadyBody(RigidTransform(), np.zeros(3), np.zeros(3))
    return WorldBody(GROUND, (solid, seen), at_rest, settings.friction)


def _obstacle(settings: ObstacleSettings, key: str) -> WorldBody:
    color = _rgba(settings.color)
    try:
        if settings.kind == MESH:
            parts = mesh_parts(str(settings.file), settings.scale, color)
        elif settings.kind == SDFORMAT:
            parts = model_parts(str(settings.file), color)
        else:
            parts = (Part(_shape(settings), RigidTransform(), color),)
    except WorldError as problem:
        raise WorldError(f"{key}.file: {problem}") from problem
    return WorldBody(settings.name, parts, settings.path(), settings.friction)


def _shape(settings: ObstacleSettings) -> Shape:
    if settings.kind == BOX:
        assert settings.size is not None
        return Box(*(float(edge) for edge in settings.size))
    assert settings.radius is not None
    if settings.kind == CYLINDER:
        assert settings.length is not None
        return Cylinder(settings.radius, settings.length)
    return Sphere(settings.radius)


def _rgba(color: Array) -> Array:
    return np.append(np.asarray(color, float), 1.0)
