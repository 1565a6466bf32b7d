"""Ways over cells of poses and time that only go forward in time: safe interval path planning.

A cell of poses is clear in some intervals of time. A state is a cell and one of its intervals, and
the earliest time of arrival in it is all that matters, since one may wait there: so Dijkstra's
algorithm over these states finds the earliest arrival at the goal.

Source: Phillips and Likhachev, SIPP: safe interval path planning for dynamic environments, 2011.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.timed_cells import TimedCells


@dataclass(frozen=True, eq=False)
class CellWay:
    """A way over cells.

    Attributes:
        cells: Cells of poses, shape (n, d).
        times: When each is entered, shape (n,), not falling [s].
        step: Of the raster's time [s].
    """

    cells: np.ndarray
    times: Array
    step: float

    def seeds(self) -> np.ndarray:
        """Cuboids of cells of poses and time: each stay, and each pair that it goes between.

        One and the next share a cell, shape (k, 2, d + 1).
        """
        slices = np.floor(self.times / self.step).astype(np.int64)
        found = []
        for k, (cell, first) in enumerate(zip(self.cells, slices, strict=True)):
            last = slices[min(k + 1, len(slices) - 1)]
            found.append((np.append(cell, first), np.append(cell + 1, last + 1)))
            if k + 1 < len(self.cells):
                both = np.stack([cell, self.cells[k + 1]])
                found.append(
                    (np.append(both.min(axis=0), last), np.append(both.max(axis=0) + 1, last + 1))
                )
        return np.array(found, np.int64)


def earliest_way(
    cells: TimedCells, start: tuple[int, ...], goal: tuple[int, ...], seconds: Array
) -> CellWay | None:
    """The way from a cell at time 0 that is the first to be at another for the rest of the time.

    Args:
        cells: What is clear.
        start: Cell of the start.
        goal: Cell of the goal.
        seconds: Time that the way through a cell takes along each number of a pose, shape (d,).

    Returns:
        None where no way leads there.
    """
    clear, step = cells.clear, cells.step
    steps = clear.shape[-1]
    begins, ends = _runs(clear.reshape(-1, steps))
    shape = clear.shape[:-1]
    places = np.arange(int(np.prod(shape))).reshape(shape)
    first, last = int(places[start]), int(places[goal])
    if ends[first, 0] == 0 or ends[last, steps - 1] != steps:
        return None
    strides = [int(np.prod(shape[a + 1 :])) for a in range(len(shape))]
    wanted = last * steps + int(begins[last, steps - 1])
    state = first * steps
    heap: list[tuple[float, int, int]] = [(0.0, state, -1)]
    before: dict[int, tuple[int, float]] = {}
    while heap:
        now, state, came = heapq.heappop(heap)
        if state in before:
            continue
        before[state] = came, now
        if state == wanted:
            break
        cell, begin = divmod(state, steps)
        until = int(ends[cell, begin])
        index = np.unravel_index(cell, shape)
        for axis, stride in enumerate(strides):
            leave = now + seconds[axis]
            for side in (-1, 1):
                if not 0 <= index[axis] + side < shape[axis]:
                    continue
                near = cell + side * stride
                k = int(leave / step)
                while k < until:
                    if ends[near, k] == 0:  # not clear: go on to where it is
                        k = int(-begins[near, k])
                        continue
                    other = near * steps + int(begins[near, k])
                    if other not in before:
                        heapq.heappush(heap, (max(leave, k * step), other, state))
                    k = int(ends[near, k])
    if wanted not in before:
        return None
    way = [wanted]
    while before[way[-1]][0] >= 0:
        way.append(before[way[-1]][0])
    way.reverse()
    index = np.unravel_index(np.array(way) // steps, shape)
    times = np.array([before[one][1] for one in way])
    assert all(b >= a for a, b in pairwise(times))
    return CellWay(np.array(index, np.int64).T, times, step)


def _runs(clear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each cell and step: where its clear interval begins, and one past its end.

    Where it is not clear the end is 0, and the begin is minus the next step at which it is, or
    minus the number of steps.
    """
    n, steps = clear.shape
    begins, ends = np.zeros((n, steps), np.int32), np.zeros((n, steps), np.int32)
    run = np.zeros(n, np.int32)
    for k in range(steps):
        fresh = clear[:, k] & ~(clear[:, k - 1] if k else np.zeros(n, bool))
        run[fresh] = k
        begins[:, k] = np.where(clear[:, k], run, 0)
    end, ahead = np.full(n, steps, np.int32), np.full(n, steps, np.int32)
    for k in range(steps - 1, -1, -1):
        ends[:, k] = np.where(clear[:, k], end, 0)
        end[~clear[:, k]] = k
        ahead[clear[:, k]] = k
        begins[~clear[:, k], k] = -ahead[~clear[:, k]]
    return begins, ends
