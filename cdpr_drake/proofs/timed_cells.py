"""Cells of poses and time in which cables and platform are proven clear of what moves.

A raster of poses gets time as one more number. A cuboid of its cells is clear if the robot, at all
its poses, is clear of all that is swept in its interval of time; else it is cut in two, down to
single cells, across time where what moves is more in the way than the poses, else across a pose.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.proofs.box_collision_kernel import judge_cables, judge_collisions
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OPEN, OUTSIDE
from cdpr_drake.proofs.cuboid_cover import SumTable
from cdpr_drake.proofs.cuboid_cover_kernel import count_cells
from cdpr_drake.proofs.proven_cells import ProvenCells
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_shapes import MovingObstacle, shapes_at, swept_by

BORDER = 1e-11
"""Poses so far beside a cell count as in it, as its border is a rounded number; what is judged is
wider than a cell by twice as much [m, rad]."""


@dataclass(frozen=True, eq=False)
class PoseRaster:
    """Proven cells of poses, as many as are wanted.

    Attributes:
        lower: First number of each that varies, shape (d,) [m, rad].
        width: Of a cell, shape (d,).
        axes: Numbers of a pose that vary, shape (d,).
        fixed: A pose with the numbers that do not, shape (6,).
        inside: Which cells are proven, one dimension a number of `axes`.
    """

    lower: Array
    width: Array
    axes: np.ndarray
    fixed: Array
    inside: np.ndarray

    @staticmethod
    def of(cells: ProvenCells, most: int) -> PoseRaster:
        """Those of another raster, some of which are joined where there are more than `most`."""
        inside, width = cells.inside, cells.width.copy()
        while inside.size > most:
            axis = int(np.argmin(np.where(np.array(inside.shape) > 1, width, np.inf)))
            pairs = np.moveaxis(inside, axis, 0)
            inside = np.moveaxis(pairs[0::2] & pairs[1::2], 0, axis)
            width[axis] *= 2.0
        return PoseRaster(cells.lower, width, cells.axes, cells.box.lower, inside)


@dataclass(frozen=True, eq=False)
class TimedCells:
    """What is proven of the cells of a raster of poses and time.

    Attributes:
        raster: Of the poses.
        step: Of time, from 0 on [s].
        clear: Which cells are proven, the last dimension time.
        judged: Cuboids that were judged.
    """

    raster: PoseRaster
    step: float
    clear: np.ndarray
    judged: int

    @property
    def horizon(self) -> float:
        """Until when it goes [s]."""
        return self.step * self.clear.shape[-1]

    def cell_at(self, pose: Array) -> tuple[int, ...] | None:
        """The cell of a pose, shape (6,) [m, rad], that is clear for most time; None: none is."""
        raster = self.raster
        place = (np.asarray(pose, float)[raster.axes] - raster.lower) / raster.width
        best: tuple[int, ...] | None = None
        for corner in np.ndindex(*(2,) * len(place)):
            cell = np.where(corner, np.ceil(place) - 1, np.floor(place)).astype(int)
            if np.any((cell < 0) | (cell >= raster.inside.shape)):
                continue
            found = tuple(int(k) for k in cell)
            if best is None or self.clear[found].sum() > self.clear[best].sum():
                best = found
        return best if best is not None and np.any(self.clear[best]) else None


def clear_cells(
    raster: PoseRaster,
    around: Surroundings,
    things: Sequence[MovingObstacle],
    clearance: float,
    horizon: float,
    steps: int,
    *,
    on_progress: Callable[[int, float], None] | None = None,
) -> TimedCells:
    """Proves cells of poses and time.

    Args:
        raster: Poses of which all else is proven.
        around: The robot's cables and platform; what rests is not looked at.
        things: What moves.
        clearance: How far cables and platform must be from it [m].
        horizon: Until when [s].
        steps: Of time.
        on_progress: Called with the cuboids judged and the share of all cells still to be judged.
    """
    inside, d = raster.inside, len(raster.axes)
    step = horizon / steps
    clear = np.zeros((*inside.shape, steps), bool)
    table = SumTable.of(inside)
    swept: dict[tuple[int, int], tuple[tuple[ConvexShape, ...], float]] = {}
    boxes = np.array([[[0] * (d + 1), [*inside.shape, steps]]], np.int64)
    judged, open_cells = 0, float(clear.size)
    while len(boxes):
        boxes = boxes[_any_inside(table, boxes[:, :, :d])]
        poses, halves = _pose_boxes(raster, boxes)
        verdicts, stretch = np.empty(len(boxes), np.int64), np.zeros((len(boxes), d + 1))
        spans, group = np.unique(boxes[:, :, d], axis=0, return_inverse=True)
        for number, (first, last) in enumerate(spans.tolist()):
            if (first, last) not in swept:
                swept[first, last] = _swept(things, first * step, last * step)
            shapes, moved = swept[first, last]
            mine = np.flatnonzero(group.ravel() == number)
            found, wide = _judge(around, shapes, clearance, poses[mine], halves[mine])
            verdicts[mine], stretch[mine, :d] = found, wide[:, raster.axes]
            stretch[mine, d] = moved
        judged += len(boxes)
        for low, high in boxes[verdicts == INSIDE].tolist():
            clear[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
        # Where all poses meet what is swept, a shorter interval alone can help.
        stretch[verdicts == OUTSIDE, :d] = -1.0
        boxes = _cut(boxes[verdicts != INSIDE], stretch[verdicts != INSIDE])
        open_cells = float(np.sum(np.prod(boxes[:, 1] - boxes[:, 0], axis=1)))
        if on_progress is not None:
            on_progress(judged, open_cells / clear.size)
    clear &= inside[..., np.newaxis]
    return TimedCells(raster, step, clear, judged)


def _any_inside(table: SumTable, boxes: np.ndarray) -> np.ndarray:
    """Which cuboids have a proven cell."""
    return np.array(
        [count_cells(table.flat, table.strides, low, high) > 0 for low, high in boxes], bool
    )


def _pose_boxes(raster: PoseRaster, boxes: np.ndarray) -> tuple[Array, Array]:
    """Middles and half widths of the poses of cuboids, shape (k, 6) each."""
    d = len(raster.axes)
    poses = np.repeat(raster.fixed[np.newaxis], len(boxes), axis=0)
    halves = np.zeros((len(boxes), NUMBERS))
    low = raster.lower + raster.width * boxes[:, 0, :d]
    high = raster.lower + raster.width * boxes[:, 1, :d]
    poses[:, raster.axes], halves[:, raster.axes] = 0.5 * (low + high), 0.5 * (high - low)
    halves[:, raster.axes] += 2.0 * BORDER
    return poses, halves


def _swept(
    things: Sequence[MovingObstacle], first: float, last: float
) -> tuple[tuple[ConvexShape, ...], float]:
    """What is swept in an interval, and by how much it is wider than what sweeps, at most [m]."""
    shapes, middle = swept_by(things, first, last), shapes_at(things, 0.5 * (first + last))
    wider = [
        np.max(np.ptp(a.points, axis=0) - np.ptp(b.points, axis=0)) + 2.0 * (a.radius - b.radius)
        for a, b in zip(shapes, middle, strict=True)
    ]
    return shapes, 0.5 * float(max(wider, default=0.0))


def _judge(
    around: Surroundings, shapes: Sequence[ConvexShape], clearance: float, poses: Array,
    halves: Array,
) -> tuple[np.ndarray, Array]:  # fmt: skip
    """Verdicts on boxes of poses among shapes, and how much each half width is in the way."""
    bodies, solids = packed(around.platform_shapes()), packed(shapes)
    largest = max([*np.diff(bodies[1]), 1]), max(np.diff(solids[1]))
    verdicts, stretch = np.empty(len(poses), np.int64), np.empty((len(poses), NUMBERS))
    over_rows(
        judge_collisions, len(poses), None, poses, halves, *bodies, *solids, clearance,
        convex_work(8 * largest[0], largest[1]), verdicts, stretch,
    )  # fmt: skip
    rest = np.flatnonzero(verdicts != OUTSIDE)
    found, wide = np.empty(len(rest), np.int64), np.empty((len(rest), NUMBERS))
    over_rows(
        judge_cables, len(rest), None, poses[rest], halves[rest], around.cables.packed(),
        np.array(around.radius, float), *solids, np.array([clearance, 0.0, 0.0]),
        convex_work(9, largest[1]), found, wide,
    )  # fmt: skip
    other = (found == OUTSIDE) | ((found == OPEN) & (verdicts[rest] == INSIDE))
    verdicts[rest[other]], stretch[rest[other]] = found[other], wide[other]
    return verdicts, stretch


def _cut(boxes: np.ndarray, stretch: Array) -> np.ndarray:
    """Each cuboid in two across what is most in the way; those that cannot be cut go."""
    sizes = boxes[:, 1] - boxes[:, 0]
    wanted = np.where((sizes > 1) & (stretch >= 0.0), stretch, -1.0)
    axes = np.argmax(wanted, axis=1)
    index = np.arange(len(boxes))
    kept = wanted[index, axes] >= 0.0
    boxes, axes = boxes[kept], axes[kept]
    index = np.arange(len(boxes))
    middle = boxes[index, 0, axes] + (boxes[index, 1, axes] - boxes[index, 0, axes]) // 2
    low, high = boxes.copy(), boxes.copy()
    low[index, 1, axes], high[index, 0, axes] = middle, middle
    return np.concatenate([low, high])
