"""Few overlapping cuboids that cover most of the good cells of a raster, and stay connected."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cdpr_drake.errors import WorkspaceError
from cdpr_drake.proofs.cuboid_cover_kernel import best_cuboid, grow_cuboids, overlapping_pairs

FIRST_SEEDS, MORE_SEEDS = 1024, 64
"""Cells that cuboids grow from at the beginning, and again after every cuboid that was taken."""

MOST_SETS = 400
"""Cuboids, at most, before those that keep what is connected together."""


@dataclass(frozen=True, eq=False)
class SumTable:
    """Sums of cells before every place, with which the cells of a cuboid are counted.

    Attributes:
        flat: The sums, flat.
        strides: Shape (d,).
    """

    flat: np.ndarray
    strides: np.ndarray

    @staticmethod
    def of(cells: np.ndarray) -> SumTable:
        """The table of an array of bool."""
        table = np.zeros([n + 1 for n in cells.shape], np.int64)
        inner = table[tuple(slice(1, None) for _ in cells.shape)]
        inner[...] = cells
        for axis in range(cells.ndim):
            np.cumsum(inner, axis=axis, out=inner)
        return SumTable(table.ravel(), np.array(table.strides, np.int64) // table.itemsize)


def cover_cells(
    good: np.ndarray, share: float, must: np.ndarray, most: int = MOST_SETS
) -> np.ndarray:
    """Covers good cells by cuboids of good cells that no layer can be added to.

    Greedy: of the cuboids that grew from many cells, the one that covers most of what is left. Then
    cells that must be covered are, and what is connected by faces of cells, and has cuboids in it,
    is connected by cuboids that share cells: cuboids along the shortest way between them are added.
    Parts of the good cells that are not connected with the rest and too small for the share may
    have no cuboid at all.

    Args:
        good: Of the raster, d-dimensional, bool.
        share: Share of the good cells to be covered, above 0, at most 1.
        must: Cells that are covered in any case, good ones, shape (n, d).
        most: Cuboids before the connecting ones, at most.

    Returns:
        First cell and one beyond the last of each, shape (k, 2, d), in the order in which they
        were taken; the same for the same cells.

    Raises:
        WorkspaceError: No cell is good, one that must be covered is not, or the share is not
            accepted.
    """
    if not 0.0 < share <= 1.0:
        raise WorkspaceError(f"cover: found {share:g}; accepted: above 0, at most 1")
    if not np.any(good):
        raise WorkspaceError("proven sets: found no cell that is proven; accepted: at least one")
    must = np.asarray(must, np.int64).reshape(-1, good.ndim)
    if not np.all(good[tuple(must.T)]):
        raise WorkspaceError("must: found a cell that is not proven; accepted: proven ones")
    cover = _Cover(good)
    cover.take_best(share, most)
    for cell in must:
        if not cover.covered[tuple(cell)]:
            cover.take_from(cell, cell)
    cover.connect()
    return np.array(cover.taken)


def cover_with(good: np.ndarray, share: float, seeds: np.ndarray, most: int) -> np.ndarray:
    """Covers a share of good cells by the cuboids that cover most, and cuboids round seeds.

    Args:
        good: Of the raster, d-dimensional, bool.
        share: Share of the good cells to be covered, above 0, at most 1.
        seeds: Cuboids of good cells, each of which lies in one of those that are taken, (n, 2, d).
        most: Cuboids beside those of the seeds, at most.

    Returns:
        As `cover_cells`.

    Raises:
        WorkspaceError: A seed has a cell that is not good, or the share is not accepted.
    """
    if not 0.0 < share <= 1.0:
        raise WorkspaceError(f"cover: found {share:g}; accepted: above 0, at most 1")
    cover = _Cover(good)
    cover.take_best(share, most)
    for seed in np.asarray(seeds, np.int64).reshape(-1, 2, good.ndim):
        if not np.all(good[tuple(slice(a, b) for a, b in seed.T)]):
            raise WorkspaceError("seeds: found a cell that is not proven; accepted: proven ones")
        cover.take_round(seed)
    return np.array(cover.taken)


class _Cover:
    """Cuboids that were taken, and what they cover."""

    def __init__(self, good: np.ndarray) -> None:
        self.good, self.shape = good, np.array(good.shape, np.int64)
        self.table = SumTable.of(good)
        self.covered = np.zeros(good.shape, bool)
        self.taken: list[np.ndarray] = []

    def grown(self, seeds: np.ndarray) -> np.ndarray:
        """All cuboids that grow from seeds, shape (n, 2, d): shape (k, 2, d), without repeats."""
        d = self.good.ndim
        found = np.empty((len(seeds), d + 1, 2, d), np.int64)
        grow_cuboids(self.table.flat, self.table.strides, self.shape, seeds, found)
        return np.unique(found.reshape(-1, 2 * d), axis=0).reshape(-1, 2, d)

    def seeds(self, count: int) -> np.ndarray:
        """Cells that are good and not covered, evenly among them, as cuboids."""
        left = np.flatnonzero(self.good & ~self.covered)
        chosen = left[np.unique(np.linspace(0, len(left) - 1, min(count, len(left))).astype(int))]
        cells = np.array(np.unravel_index(chosen, self.good.shape), np.int64).T
        return np.ascontiguousarray(np.stack([cells, cells + 1], axis=1))

    def take(self, cuboid: np.ndarray) -> None:
        """Takes a cuboid, shape (2, d)."""
        self.taken.append(cuboid)
        self.covered[tuple(slice(a, b) for a, b in zip(*cuboid.tolist(), strict=True))] = True

    def take_best(self, share: float, most: int) -> None:
        """Takes the best cuboids until a share is covered, or so many are taken."""
        wanted = share * np.count_nonzero(self.good)
        pool = self.grown(self.seeds(FIRST_SEEDS))
        gains = np.full(len(pool), np.iinfo(np.int64).max)
        while np.count_nonzero(self.covered) < wanted and len(self.taken) < most:
            left = SumTable.of(self.good & ~self.covered)
            best = best_cuboid(left.flat, left.strides, pool, gains)
            if best < 0:  # all that grew is taken: cells that had no seed are left
                fresh = self.grown(self.seeds(FIRST_SEEDS))
                pool, gains = fresh, np.full(len(fresh), np.iinfo(np.int64).max)
                continue
            self.take(pool[best])
            fresh = self.grown(self.seeds(MORE_SEEDS))
            pool = np.concatenate([pool, fresh])
            gains = np.concatenate([gains, np.full(len(fresh), np.iinfo(np.int64).max)])

    def take_from(self, first: np.ndarray, second: np.ndarray) -> None:
        """Takes the cuboid round two neighbours, or a cell, that covers most of what is not."""
        self._take_grown(np.stack([np.minimum(first, second), np.maximum(first, second) + 1]))

    def take_round(self, seed: np.ndarray) -> None:
        """Takes the cuboid round a seed that covers most of what is not, if none holds the seed."""
        held = np.array(self.taken).reshape(-1, 2, self.good.ndim)
        if not np.any(np.all((held[:, 0] <= seed[0]) & (held[:, 1] >= seed[1]), axis=1)):
            self._take_grown(seed)

    def _take_grown(self, seed: np.ndarray) -> None:
        found = self.grown(seed[np.newaxis])
        left = SumTable.of(self.good & ~self.covered)
        gains = np.full(len(found), np.iinfo(np.int64).max)
        best = best_cuboid(left.flat, left.strides, found, gains)
        self.take(found[max(best, 0)])

    def connect(self) -> None:
        """Connects by shared cells what faces of cells connect."""
        parts, _ = ndimage.label(self.good)
        while True:
            boxes = np.array(self.taken)
            groups = set_groups(boxes)
            part = parts[tuple(boxes[:, 0].T)]
            lone = [
                k
                for k in range(groups.max() + 1)
                if np.any(part[groups != k] == part[groups == k][0])
            ]
            if not lone:
                return
            smallest = min(lone, key=lambda k: (np.count_nonzero(groups == k), k))
            way = self._way(boxes, groups == smallest, parts)
            for first, second in pairwise(way):
                self.take_round(
                    np.stack([np.minimum(first, second), np.maximum(first, second) + 1])
                )

    def _way(self, boxes: np.ndarray, own: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """The shortest way over faces of cells from some cuboids to the others of their part."""
        start, goal = np.zeros(self.good.shape, bool), np.zeros(self.good.shape, bool)
        part = parts[tuple(boxes[own][0, 0])]
        for box, mine in zip(boxes, own, strict=True):
            place = tuple(slice(a, b) for a, b in zip(*box.tolist(), strict=True))
            (start if mine else goal)[place] = True
        goal &= parts == part
        steps = np.full(self.good.shape, -1, np.int64)
        front, reached, number = start, start.copy(), 0
        steps[start] = 0
        while not np.any(front & goal):
            number += 1
            front = ndimage.binary_dilation(front) & self.good & ~reached
            reached |= front
            steps[front] = number
        cell = np.argwhere(front & goal)[0]
        way = [cell]
        while steps[tuple(cell)] > 0:
            cell = next(
                near
                for axis in range(self.good.ndim)
                for by in (-1, 1)
                for near in [cell + by * np.eye(self.good.ndim, dtype=np.int64)[axis]]
                if 0 <= near[axis] < self.shape[axis]
                and steps[tuple(near)] == steps[tuple(cell)] - 1
            )
            way.append(cell)
        return np.array(way[::-1])


def set_groups(boxes: np.ndarray) -> np.ndarray:
    """To which connected group each cuboid belongs, shape (k,): those connect that share cells."""
    lower, upper = (np.ascontiguousarray(boxes[:, k], float) for k in (0, 1))
    pairs = overlapping_pairs(lower, upper, boxes.shape[2])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(boxes),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1])
