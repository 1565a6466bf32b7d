"""Things of a replay that are neither robot nor world: shapes that stand, or go as a log says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Shape
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.palette import Look, rgb
from cdpr_drake.systems.worlds.settings import WorldSettings
from cdpr_drake.vision.pinhole import Pinhole


@dataclass(frozen=True, eq=False)
class ShownThing:
    """A shape fixed to a frame F that stands in W or moves.

    Attributes:
        name: Its name, once in a replay.
        shape: The shape.
        color: Red, green, blue, alpha; textured meshes bring their own.
        X_FG: Pose of the shape in F [m].
        quantity: Name of the poses of F in the log; None: F is W.
        while_positive: Name of a number in the log, shape (n, 1), with which it is there and
            without which it is not; None: it always is.
    """

    name: str
    shape: Shape
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    X_FG: RigidTransform = field(default_factory=RigidTransform)
    quantity: str | None = None
    while_positive: str | None = None


@dataclass(frozen=True, eq=False)
class ShownView:
    """What a camera sees, as a pyramid, on a frame F that stands in W or moves.

    Attributes:
        name: Its name, once in a replay.
        words: What the page calls it.
        pinhole: The camera.
        look: Its colour.
        X_FG: Pose of the camera frame in F [m].
        quantity: Name of the poses of F in the log; None: F is W.
    """

    name: str
    words: str
    pinhole: Pinhole
    look: Look
    X_FG: RigidTransform = field(default_factory=RigidTransform)
    quantity: str | None = None
    while_positive: ClassVar[str | None] = None  # it always is there


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is around a robot in a replay.

    Attributes:
        world: Section of a scenario; None: nothing.
        things: What else is shown, and moves as the log says.
    """

    world: WorldSettings | None = None
    things: tuple[ShownThing | ShownView, ...] = ()


ALONE = Surroundings()
"""A robot without anything around it."""


def show_things(
    meshcat: Meshcat, things: Sequence[ShownThing | ShownView], depth: float
) -> list[tuple[str, Look]]:
    """Puts things into a scene, where their frames are W; views are drawn to a depth [m].

    Returns:
        What a legend has to say of them: words, and the look that they mean.
    """
    legend = []
    for thing in things:
        path = f"things/{thing.name}/shape"
        if isinstance(thing, ShownView):
            starts, ends = frustum(thing.pinhole, depth)
            meshcat.SetLineSegments(path, starts, ends, 2.0, Rgba(*rgb(thing.look.color)))
            legend.append((thing.words, thing.look))
        else:
            meshcat.SetObject(path, thing.shape, Rgba(*thing.color))
        meshcat.SetTransform(path, thing.X_FG)
        if thing.while_positive is not None:
            meshcat.SetProperty(f"things/{thing.name}", "visible", False)
    return legend


class ThingMover:
    """Moves things to where a log says; things that stand stay where they are."""

    def __init__(
        self, meshcat: Meshcat, things: Sequence[ShownThing | ShownView],
        log: Mapping[str, Array], rows: Sequence[int],
    ) -> None:  # fmt: skip
        """Takes the rows of a log that are shown."""
        self._meshcat = meshcat
        self._poses = {
            thing.name: np.asarray(log[thing.quantity])[list(rows)]
            for thing in things
            if thing.quantity is not None
        }
        self._there = {
            thing.name: np.asarray(log[thing.while_positive])[list(rows), 0] > 0.0
            for thing in things
            if thing.while_positive is not None
        }

    def place(self, frame: int, time: float | None) -> None:
        """Moves them to their poses of a frame; time [s] of a recording, None: now."""
        for name, rows in self._poses.items():
            self._meshcat.SetTransform(f"things/{name}", pose_from_row(rows[frame]), time)
        for name, there in self._there.items():
            if frame == 0 or there[frame] != there[frame - 1]:
                self._meshcat.SetProperty(f"things/{name}", "visible", bool(there[frame]), time)


def frustum(pinhole: Pinhole, depth: float) -> tuple[Array, Array]:
    """Starts and ends of the edges of what a camera sees, in C, shape (3, 9) each [m].

    Four edges from the focal point to the corners of the image at a depth [m], the rim of the
    image there, and a short line on its upper side, which tells what is up in the image.
    """
    u = np.array([-0.5, pinhole.width - 0.5, pinhole.width - 0.5, -0.5])
    v = np.array([-0.5, -0.5, pinhole.height - 0.5, pinhole.height - 0.5])
    corners = depth * np.array(
        [(u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, np.ones(4)]
    )
    up = (corners[:, 0] + corners[:, 1]) / 2.0
    above = up + 0.3 * (corners[:, 0] - corners[:, 3]) / 2.0
    starts = np.column_stack([np.zeros((3, 4)), corners, up])
    ends = np.column_stack([corners, np.roll(corners, -1, axis=1), above])
    return starts, ends
