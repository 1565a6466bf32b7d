"""Things of a replay that are neither robot nor world: shapes that stand, or go as a log says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Shape
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.spatial import pose_from_row


@dataclass(frozen=True, eq=False)
class ShownThing:
    """A shape fixed to a frame F that stands in W or moves.

    Attributes:
        name: Its name, once in a replay.
        shape: The shape.
        color: Red, green, blue, alpha; textured meshes bring their own.
        X_FG: Pose of the shape in F [m].
        quantity: Name of the poses of F in the log; None: F is W.
    """

    name: str
    shape: Shape
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    X_FG: RigidTransform = field(default_factory=RigidTransform)
    quantity: str | None = None


def show_things(meshcat: Meshcat, things: Sequence[ShownThing]) -> None:
    """Puts shapes into a scene, where their frames are W."""
    for thing in things:
        meshcat.SetObject(f"things/{thing.name}/shape", thing.shape, Rgba(*thing.color))
        meshcat.SetTransform(f"things/{thing.name}/shape", thing.X_FG)


class ThingMover:
    """Moves things to where a log says."""

    def __init__(
        self,
        meshcat: Meshcat,
        things: Sequence[ShownThing],
        log: Mapping[str, Array],
        rows: Sequence[int],
    ) -> None:
        """For the rows of a log that are shown; things that stand stay where they are."""
        self._meshcat = meshcat
        self._poses = {
            thing.name: np.asarray(log[thing.quantity])[list(rows)]
            for thing in things
            if thing.quantity is not None
        }

    def place(self, frame: int, time: float | None) -> None:
        """Moves them to their poses of a frame; time [s] of a recording, None: now."""
        for name, rows in self._poses.items():
            self._meshcat.SetTransform(f"things/{name}", pose_from_row(rows[frame]), time)
