"""Convex shapes that move: where they are at a time, and what they sweep in an interval of time.

A body turns about an axis and moves along a line at once, both by the same share of its way. Then a
point of it at a distance r from the axis is off the straight line between two of its places by r
angle^2 / 8 at most, angle that of the turn between: the bound of linear interpolation, |f''| / 8 by
the square of the step. So the hull of a shape at some poses of its way, widened by that, holds all
that it sweeps. Without turns nothing is widened, and where the way between two poses is straight
the hull is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_shapes import ConvexShape


@dataclass(frozen=True)
class PoseSpan:
    """Poses of a body that stand for all those in an interval of time.

    Attributes:
        poses: X_WB, one at least; between two in a row it moves and turns by the same share.
        bend: How far points are off the hull of their places at these poses, at most, over their
            distance from the axis.
        arm: Distance of the axis from Bo at most [m].
    """

    poses: tuple[RigidTransform, ...]
    bend: float = 0.0
    arm: float = 0.0


class SpannedMotion(Protocol):
    """A pose over time of which intervals can be bounded."""

    def at(self, time: float) -> RigidTransform:
        """X_WB at a time [s]."""

    def span(self, first: float, last: float) -> PoseSpan:
        """Poses round which all those from a first to a last time [s] lie."""

    def settled(self) -> float:
        """From when on it rests for ever [s]; infinite: never."""


class MovingObstacle(Protocol):
    """Something of convex shapes that moves, whatever it meets."""

    @property
    def name(self) -> str:
        """How messages call it."""

    def at(self, time: float) -> tuple[ConvexShape, ...]:
        """Its shapes in W at a time [s]."""

    def swept(self, first: float, last: float) -> tuple[ConvexShape, ...]:
        """Shapes in W that hold all that it is at from a first to a last time [s]."""

    def settled(self) -> float:
        """From when on it rests for ever [s]; infinite: never."""

    def shown(self, times: Array) -> Sequence[tuple[ConvexShape, Sequence[RigidTransform]]]:
        """Shapes to show, in frames of their own, and the poses X_WB of these at times [s]."""


@dataclass(frozen=True, eq=False)
class MovingShape:
    """A convex shape on a moving body.

    Attributes:
        shape: In the frame of the body.
        motion: X_WB over time.
        name: How messages call it.
    """

    shape: ConvexShape
    motion: SpannedMotion
    name: str = ""

    def at(self, time: float) -> tuple[ConvexShape, ...]:
        """As `MovingObstacle` has it."""
        return (self.shape.moved(self.motion.at(time)),)

    def swept(self, first: float, last: float) -> tuple[ConvexShape, ...]:
        """As `MovingObstacle` has it."""
        return (swept_shape(self.shape, self.motion.span(first, last)),)

    def settled(self) -> float:
        """As `MovingObstacle` has it."""
        return self.motion.settled()

    def shown(self, times: Array) -> Sequence[tuple[ConvexShape, Sequence[RigidTransform]]]:
        """As `MovingObstacle` has it."""
        return [(self.shape, [self.motion.at(float(time)) for time in times])]


def swept_shape(shape: ConvexShape, span: PoseSpan) -> ConvexShape:
    """What a shape, in the frame of a body, sweeps at most, in W."""
    far = float(np.max(np.linalg.norm(shape.points, axis=1))) + span.arm
    places = np.concatenate([(X @ shape.points.T).T for X in span.poses])
    return ConvexShape(np.unique(places, axis=0), shape.radius + span.bend * far, shape.name)


def swept_by(
    things: Sequence[MovingObstacle], first: float, last: float
) -> tuple[ConvexShape, ...]:
    """What all of them sweep, in W."""
    return tuple(shape for thing in things for shape in thing.swept(first, last))


def shapes_at(things: Sequence[MovingObstacle], time: float) -> tuple[ConvexShape, ...]:
    """What all of them are at, in W."""
    return tuple(shape for thing in things for shape in thing.at(time))
