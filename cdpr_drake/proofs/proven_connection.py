"""Proofs where they are needed: open cells at some poses, and on the way between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_judges import CertifyTask
from cdpr_drake.proofs.proven_cells import ProvenCells, prove_more

ROUNDS = 12
"""Ways between two poses whose open cells are cut, one after the other, at most."""

BOXES_A_CELL = 2000
"""Boxes that are judged for an open cell on a way, at most, on average of those of the way."""

PROVEN_STEP = 1e-3
"""What a step through a proven cell costs, where one through an open cell costs 1."""


def inside_cell(cells: ProvenCells, pose: Array) -> np.ndarray | None:
    """The first proven cell that a pose lies in, shape (d,); None: in none."""
    near = cells.cells_at(pose)
    near = near[cells.inside[tuple(near.T)]]
    return near[0] if len(near) else None


def connected(cells: ProvenCells, first: Array, second: Array) -> bool:
    """Whether proven cells lead from one pose to another, over faces of cells."""
    ends = [inside_cell(cells, pose) for pose in (first, second)]
    parts, _ = ndimage.label(cells.inside)
    numbers = [0 if end is None else int(parts[tuple(end)]) for end in ends]
    return numbers[0] == numbers[1] > 0


def separated(cells: ProvenCells, first: Array, second: Array) -> bool:
    """Whether cells that are proven outside part two poses, so that no path joins them in the box.

    A path may go from cell to cell over faces, edges and corners; so all neighbours count, and only
    cells that are proven outside one kind in all their poses are in its way. The poses are those of
    the box: with other angles, or beyond its borders, there may be a way.

    Args:
        cells: What is proven by now.
        first: Position and angles, shape (6,) [m, rad].
        second: Likewise.
    """
    free = ~cells.excluded
    parts, _ = ndimage.label(free, np.ones((3,) * free.ndim, bool))
    near = [{int(parts[tuple(at)]) for at in cells.cells_at(p)} - {0} for p in (first, second)]
    return not near[0] & near[1]


def connect_poses(
    cells: ProvenCells,
    tasks: Sequence[CertifyTask],
    poses: Sequence[Array],
    boxes_a_cell: int = BOXES_A_CELL,
    on_cut: Callable[[int], None] | None = None,
) -> tuple[ProvenCells, int]:
    """Cuts open cells at poses, then those on ways from each pose to the next.

    A way has as few open cells as can be; where one of them stays open, or is proven outside, the
    next way goes round it.

    Args:
        cells: What is proven by now.
        tasks: What is to be proven.
        poses: Position and angles, shape (6,) each [m, rad].
        boxes_a_cell: As of `prove_more`.
        on_cut: Called with the number of cells that were cut by then.

    Returns:
        The same raster, and how many cells were cut further; 0: nothing was needed.
    """
    cut, tried = 0, np.zeros(cells.inside.shape, bool)

    def prove(where: np.ndarray) -> None:
        nonlocal cells, cut
        cells = prove_more(cells, tasks, where, boxes_a_cell)
        tried[tuple(where.T)] = True
        cut += len(where)
        if on_cut is not None:
            on_cut(cut)

    for pose in poses:
        near = cells.cells_at(pose)
        if inside_cell(cells, pose) is None:
            near = near[~cells.excluded[tuple(near.T)]]
            if len(near):
                prove(near)
    for first, second in pairwise(poses):
        ends = [inside_cell(cells, pose) for pose in (first, second)]
        if ends[0] is None or ends[1] is None:
            continue
        for _ in range(ROUNDS):
            if connected(cells, first, second):
                break
            way = _way(cells, tried, ends[0], ends[1])
            if way is None:
                break
            prove(way)
    return cells, cut


def _way(
    cells: ProvenCells, tried: np.ndarray, first: np.ndarray, second: np.ndarray
) -> np.ndarray | None:
    """Open cells of the way with the fewest of them, shape (n, d); None where none leads there."""
    free = cells.inside | ~(cells.excluded | tried)
    shape, number = free.shape, np.arange(free.size).reshape(free.shape)
    cost = np.where(cells.inside, PROVEN_STEP, 1.0).ravel()
    rows, columns = [], []
    for axis in range(free.ndim):
        low = tuple(slice(0, -1) if a == axis else slice(None) for a in range(free.ndim))
        high = tuple(slice(1, None) if a == axis else slice(None) for a in range(free.ndim))
        both = free[low] & free[high]
        rows += [number[low][both], number[high][both]]
        columns += [number[high][both], number[low][both]]
    i, j = np.concatenate(rows), np.concatenate(columns)
    graph = csr_array((cost[j], (i, j)), shape=(free.size, free.size))
    start = int(np.ravel_multi_index(tuple(first), shape))
    goal = int(np.ravel_multi_index(tuple(second), shape))
    _, before = dijkstra(graph, indices=start, return_predecessors=True)
    if before[goal] < 0:
        return None
    way = [goal]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    found = np.array(np.unravel_index(way, shape), np.int64).T
    return found[~cells.inside[tuple(found.T)]]
