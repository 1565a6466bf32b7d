"""Cells of a raster of poses: wholly proven inside kinds of workspaces, proven outside, or open.

Boxes come from one box of poses that is cut in halves, so they fit a raster of powers of two
exactly. A cell is inside where boxes in which all kinds are proven fill it, also many small ones.
It is excluded where boxes fill it that are proven outside some kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, NUMBERS, OUTSIDE
from cdpr_drake.proofs.box_judges import CertifyTask
from cdpr_drake.proofs.box_refinement import refine
from cdpr_drake.proofs.certified_boxes import CertifiedBoxes, PoseBox, certify
from cdpr_drake.proofs.cuboid_cover_kernel import add_shares

LATTICE = 30
"""A box of poses is 2^LATTICE units of the lattice wide along each number: finer than its boxes."""

CELLS = 2**18
"""Usual number of cells of a raster."""

FEWEST_CELLS, MOST_CELLS = 2**6, 2**24


@dataclass(frozen=True, eq=False)
class ProvenCells:
    """What is proven of the cells of a raster.

    Attributes:
        box: The poses.
        axes: Numbers of a pose that vary, of x, y, z, phi, theta, psi, shape (d,).
        inside: Whether a cell is proven inside all kinds, one dimension a number of `axes`.
        excluded: Whether it is proven outside one kind.
        boxes: The boxes that fill them.
    """

    box: PoseBox
    axes: np.ndarray
    inside: np.ndarray
    excluded: np.ndarray
    boxes: CertifiedBoxes

    @property
    def lower(self) -> Array:
        """Of the box, the numbers that vary, shape (d,) [m, rad]."""
        return np.asarray(self.box.lower[self.axes], float)

    @property
    def width(self) -> Array:
        """Of a cell, shape (d,) [m, rad]."""
        return np.asarray(
            (self.box.upper - self.box.lower)[self.axes] / np.array(self.inside.shape), float
        )

    @property
    def share(self) -> float:
        """Of the box, in cells that are proven inside."""
        return float(np.mean(self.inside))

    def edges(self, cells: np.ndarray) -> Array:
        """Places of borders between cells, shape (n, d), by their numbers, in one way always."""
        return np.asarray(self.lower + self.width * cells, float)

    def cells_at(self, pose: Array) -> np.ndarray:
        """Cells that a pose lies in, shape (k, d): several on a border, none outside the box.

        Args:
            pose: Position and angles, shape (6,) [m, rad].
        """
        pose = np.asarray(pose, float)
        fixed = np.setdiff1d(np.arange(NUMBERS), self.axes)
        if np.any(np.abs(pose - self.box.lower)[fixed] > SAME_NUMBER):
            return np.zeros((0, len(self.axes)), np.int64)
        shape = np.array(self.inside.shape)
        guess = np.floor((pose[self.axes] - self.lower) / self.width).astype(np.int64)
        sides = []
        for a, place in enumerate(guess):
            near = np.arange(place - 1, place + 2)
            near = near[(near >= 0) & (near < shape[a])]
            low, high = (self.lower[a] + self.width[a] * (near + k) for k in (0, 1))
            value = pose[self.axes[a]]
            sides.append(near[(low <= value) & (value <= high)])
        return np.array(np.meshgrid(*sides, indexing="ij"), np.int64).reshape(len(self.axes), -1).T


SAME_NUMBER = 1e-9
"""How far a number of a pose that does not vary may be from that of the box [m, rad]."""


def prove_cells(
    tasks: Sequence[CertifyTask],
    box: PoseBox,
    most_boxes: int,
    arm: float,
    cells: int = CELLS,
    on_progress: Callable[[int, float], None] | None = None,
) -> ProvenCells:
    """Proves boxes of all tasks in one search, and puts them on a raster.

    Args:
        tasks: What is to be proven; all must hold.
        box: The poses.
        most_boxes: Boxes that are judged, at most.
        arm: Length by which a turn counts as a way, for the shape of cells [m].
        cells: Cells of the raster, at most; a power of two is used.
        on_progress: Called with the boxes judged and the share still open.

    Raises:
        WorkspaceError: There is no task, or a number is not accepted.
    """
    if not tasks:
        raise WorkspaceError("proven sets: found no kind; accepted: at least one")
    if not FEWEST_CELLS <= cells <= MOST_CELLS:
        raise WorkspaceError(f"cells: found {cells}; accepted: {FEWEST_CELLS} to {MOST_CELLS}")
    axes, shape = raster_shape(box, arm, cells)
    found = certify(tasks, box, most_boxes, on_progress=on_progress)
    return on_raster(found, box, axes, shape)


def on_raster(
    found: CertifiedBoxes, box: PoseBox, axes: np.ndarray, shape: tuple[int, ...]
) -> ProvenCells:
    """Cells of that shape, as boxes of the whole fill them."""
    inside, excluded = (
        whole_cells(found, verdict, box, axes, shape) for verdict in (INSIDE, OUTSIDE)
    )
    return ProvenCells(box, axes, inside, excluded, found)


def prove_more(
    cells: ProvenCells, tasks: Sequence[CertifyTask], where: np.ndarray, boxes_a_cell: int
) -> ProvenCells:
    """Goes on cutting the open boxes of some cells, the largest first.

    Args:
        cells: What is proven by now.
        tasks: What is to be proven.
        where: The cells, shape (n, d).
        boxes_a_cell: Boxes that are judged, at most, for each of them; cells that need fewer leave
            theirs to the others.

    Returns:
        The same raster; cells that stay open are not told apart from those never looked at.
    """
    mask = np.zeros(cells.inside.shape, bool)
    mask[tuple(where.T)] = True
    found = refine(cells.boxes, tasks, CellRegion(cells, mask), boxes_a_cell * len(where))
    return on_raster(found, cells.box, cells.axes, cells.inside.shape)


@dataclass(frozen=True, eq=False)
class CellRegion:
    """The poses of some cells of a raster.

    Attributes:
        cells: The raster.
        mask: Which cells, of its shape.
    """

    cells: ProvenCells
    mask: np.ndarray

    def meets(self, poses: Array, halves: Array) -> np.ndarray:
        """Which boxes that fit the raster have more than a border in common with it, shape (k,)."""
        axes, lower, width = self.cells.axes, self.cells.lower, self.cells.width
        shape = np.array(self.mask.shape)
        first = (poses - halves)[:, axes] - lower
        last = (poses + halves)[:, axes] - lower
        # Ends on a border are off it by roundings, far less than the finest box.
        low = np.floor(first / width + SAME_NUMBER).astype(np.int64)
        high = np.ceil(last / width - SAME_NUMBER).astype(np.int64)
        low, high = np.clip(low, 0, shape - 1), np.clip(high, 1, shape)
        sums = np.pad(self.mask.astype(np.int64), [(1, 0)] * len(axes))
        for axis in range(len(axes)):
            sums = np.cumsum(sums, axis=axis)
        count = np.zeros(len(poses), np.int64)
        for corner in product((0, 1), repeat=len(axes)):
            at = np.where(np.array(corner, bool), high, low)
            count += (-1) ** (len(axes) - sum(corner)) * sums[tuple(at.T)]
        return np.asarray(count > 0)


def raster_shape(box: PoseBox, arm: float, cells: int) -> tuple[np.ndarray, tuple[int, ...]]:
    """Numbers that vary, and cells along each: powers of two, about as wide as each other."""
    sizes = box.upper - box.lower
    axes = np.flatnonzero(sizes > 0.0)
    widths = np.where(axes < 3, 1.0, arm) * sizes[axes]
    bits = np.zeros(len(axes), int)
    while np.sum(bits) < int(np.log2(cells)):
        widest = int(np.argmax(widths))
        bits[widest] += 1
        widths[widest] *= 0.5
    return axes, tuple(int(n) for n in 2**bits)


def whole_cells(
    found: CertifiedBoxes, verdict: int, box: PoseBox, axes: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Cells that boxes of a verdict fill, of that shape."""
    chosen = found.verdicts == verdict
    unit = (box.upper - box.lower)[axes] / 2.0**LATTICE
    poses, halves = found.poses[chosen][:, axes], found.halves[chosen][:, axes]
    low = np.rint((poses - halves - box.lower[axes]) / unit).astype(np.int64)
    high = np.rint((poses + halves - box.lower[axes]) / unit).astype(np.int64)
    shares = np.zeros(int(np.prod(shape)))
    width = 2**LATTICE // np.array(shape, np.int64)
    add_shares(low, high, width, np.array(shape, np.int64), shares)
    return np.asarray(shares == 1.0).reshape(shape)
