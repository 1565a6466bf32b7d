"""How far cables stay from each other, from the platform and from what stands around."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations, product

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS, PARTS, many_clearances
from cdpr_drake.workspaces.convex_clearance_kernel import many_convex_clearances

PART_NAMES = ("cable-cable", "cable-platform", "cable-frame", "cable-obstacle", "platform")
"""Columns of `clearances`; the last is the platform's, from frame and obstacles."""

ONLY_GIVEN = "only given"
"""In the metadata of a field: what was not given, and is empty, is not said of a question."""

SAME_POINT = 1e-9
"""Cables whose exit or anchor points are nearer [m] share it; they always touch there."""


def _no_boxes() -> Array:
    return np.zeros((0, BOX_COLUMNS))


def box_row(middle: Array, size: Array, rotation: Array | None = None) -> Array:
    """A box as the kernels take it, shape (15,).

    Args:
        middle: Its middle, shape (3,) [m].
        size: Its edges, shape (3,) [m].
        rotation: Its axes as columns, shape (3, 3); None: those of the frame it is given in.

    Raises:
        WorkspaceError: A number is not finite, or an edge is negative.
    """
    R = np.eye(3) if rotation is None else np.asarray(rotation, float)
    row = np.concatenate([R.reshape(9), np.asarray(middle, float), 0.5 * np.asarray(size, float)])
    if row.shape != (BOX_COLUMNS,) or not np.all(np.isfinite(row)) or np.any(row[12:] < 0.0):
        raise WorkspaceError("box: accepted: a finite middle and edges of a size >= 0 [m]")
    return row


def beams(lower: Array, upper: Array, thickness: float) -> Array:
    """The twelve beams on the edges of a box, as boxes in W, shape (12, 15).

    Args:
        lower: Lower corner of the box, shape (3,) [m].
        upper: Upper corner, shape (3,) [m].
        thickness: Of the beams, which are centred on the edges [m].
    """
    middle = 0.5 * (np.asarray(lower, float) + upper)
    rows = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for ends in product((lower, upper), repeat=2):
            size, place = np.full(3, thickness), middle.copy()
            size[axis] = upper[axis] - lower[axis] + thickness
            for k, end in zip(others, ends, strict=True):
                place[k] = end[k]
            rows.append(box_row(place, size))
    return np.array(rows)


@dataclass(frozen=True, eq=False)
class Obstacles:
    """What stands in a robot's frame.

    Attributes:
        boxes: In W, shape (o, 15); rows of `box_row`.
        solids: Convex shapes in W.
    """

    boxes: Array = field(default_factory=_no_boxes)
    solids: tuple[ConvexShape, ...] = ()

    def shapes(self) -> tuple[ConvexShape, ...]:
        """All of them as convex shapes in W, boxes first."""
        boxes = [ConvexShape.box(row, f"box {k}") for k, row in enumerate(self.boxes, 1)]
        return (*boxes, *self.solids)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What cables and platform may meet. Cables are straight.

    Attributes:
        cables: The cables, from tangent points where they run over pulleys.
        radius: Radius of the cables, shape (m,) [m].
        bodies: Boxes of the platform, in P, shape (b, 15); rows of `box_row`.
        fixtures: Boxes of the frame, in W, shape (f, 15).
        obstacles: Boxes in W, shape (o, 15).
        exit_free: Length next to an exit point [m] that is not compared with the frame, which
            carries it.
        anchor_free: Length next to an anchor point [m] that is not compared with the platform.
        solids: Convex shapes in W, obstacles beside the boxes.
    """

    cables: CableSet
    radius: Array
    bodies: Array = field(default_factory=_no_boxes)
    fixtures: Array = field(default_factory=_no_boxes)
    obstacles: Array = field(default_factory=_no_boxes)
    exit_free: float = 0.0
    anchor_free: float = 0.0
    solids: tuple[ConvexShape, ...] = field(default=(), metadata={ONLY_GIVEN: True})

    def __post_init__(self) -> None:
        """Checks the lengths.

        Raises:
            WorkspaceError: One is negative or not finite.
        """
        for name in ("exit_free", "anchor_free"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise WorkspaceError(f"{name}: found {value:g}; accepted: >= 0 [m]")

    def platform_shapes(self) -> tuple[ConvexShape, ...]:
        """The platform as convex shapes in P."""
        return tuple(ConvexShape.box(row, "platform") for row in self.bodies)

    def still_shapes(self) -> tuple[ConvexShape, ...]:
        """All that stands in W as convex shapes: frame, boxes, solids."""
        frame = [ConvexShape.box(row, f"frame {k}") for k, row in enumerate(self.fixtures, 1)]
        return (*frame, *Obstacles(self.obstacles, self.solids).shapes())

    def pairs(self) -> np.ndarray:
        """Cables that are compared with each other: all that share no point, shape (p, 2)."""
        A, B = self.cables.p_WA, self.cables.p_PB
        found = [
            (i, j)
            for i, j in combinations(range(self.cables.count), 2)
            if np.linalg.norm(A[:, i] - A[:, j]) > SAME_POINT
            and np.linalg.norm(B[:, i] - B[:, j]) > SAME_POINT
        ]
        return np.array(found, np.int64).reshape(-1, 2)


def clearances(around: Surroundings, positions: Array, rotations: Array) -> Array:
    """Clearances at poses, shape (n, 5) [m], columns `PART_NAMES`.

    Distances of the surfaces of cables, which have a radius, from each other and from boxes, and of
    boxes from each other; cables that go through each other have less than 0, and so has what
    overlaps a convex shape of `solids`. Infinite where there is nothing to meet, NaN where a cable
    cannot run.

    Args:
        around: What there is.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).

    Source: Perreault et al., Geometric determination of the interference-free constant-orientation
    workspace of parallel cable-driven mechanisms, 2010; Gazebo thesis 2.6.2.
    """
    # Copies, hence writable: kernels are compiled anew for arrays that are not.
    p = np.array(positions, float, order="C").reshape(-1, 3)
    R = np.array(rotations, float, order="C").reshape(-1, 3, 3)
    out = np.empty((len(p), PARTS))
    boxes = [
        np.ascontiguousarray(each, float).reshape(-1, BOX_COLUMNS)
        for each in (around.bodies, around.fixtures, around.obstacles)
    ]
    over_rows(
        many_clearances, len(p), None, p, R, around.cables.packed(),
        np.array(around.radius, float), around.pairs(), *boxes,
        np.array([around.exit_free, around.anchor_free]), out,
    )  # fmt: skip
    if around.solids:
        bodies, solids = packed(around.platform_shapes()), packed(around.solids)
        largest = max(2, *np.diff(bodies[1]), 2), max(np.diff(solids[1]))
        over_rows(
            many_convex_clearances, len(p), None, p, R, around.cables.packed(),
            np.array(around.radius, float), *bodies, *solids, convex_work(*largest), out,
        )  # fmt: skip
    return out
