"""Numba kernels: boxes on a raster, and cuboids of cells that are as large as they can be.

A raster is a block of cells along up to six numbers of a pose, flat in C order. Counts of cells in
a cuboid come from a table of sums (an integral image) in any number of dimensions.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True)
def add_shares(low: np.ndarray, high: np.ndarray, width: np.ndarray, shape: np.ndarray,
               shares: Array) -> None:  # fmt: skip
    """Adds to every cell the share of it that boxes fill.

    Boxes and cells are on one lattice of powers of two, so sums of shares are exact.

    Args:
        low: Lower ends of the boxes in units of the lattice, shape (k, d).
        high: Upper ends.
        width: Units of a cell, shape (d,).
        shape: Cells along each number, shape (d,).
        shares: Gets the shares, flat.
    """
    d = shape.shape[0]
    first, last, at = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d, np.int64)
    for i in range(low.shape[0]):
        for a in range(d):
            first[a] = low[i, a] // width[a]
            last[a] = min((high[i, a] - 1) // width[a], shape[a] - 1)
            at[a] = first[a]
        while True:
            share, place = 1.0, 0
            for a in range(d):
                begin = max(low[i, a], at[a] * width[a])
                end = min(high[i, a], (at[a] + 1) * width[a])
                share *= (end - begin) / width[a]
                place = place * shape[a] + at[a]
            shares[place] += share
            a = d - 1
            while a >= 0:
                at[a] += 1
                if at[a] <= last[a]:
                    break
                at[a] = first[a]
                a -= 1
            if a < 0:
                break


@njit(cache=True)
def count_cells(table: np.ndarray, strides: np.ndarray, low: np.ndarray, high: np.ndarray) -> int:
    """Cells of a cuboid, from a table of sums with a zero plane before each number.

    Args:
        table: Sums of all cells before a place along every number, flat.
        strides: Of the table, shape (d,).
        low: First cell, shape (d,).
        high: One beyond the last cell.
    """
    d, found = low.shape[0], 0
    for corner in range(1 << d):
        place, sign = 0, 1
        for a in range(d):
            if corner >> a & 1:
                place += high[a] * strides[a]
            else:
                place += low[a] * strides[a]
                sign = -sign
        found += sign * table[place]
    return found


@njit(cache=True)
def _grow(
    table: np.ndarray, strides: np.ndarray, shape: np.ndarray, axis: int, side: int,
    low: np.ndarray, high: np.ndarray,
) -> bool:  # fmt: skip
    """Grows a cuboid by one layer of cells if all of the layer are good."""
    if side == 0:
        if low[axis] == 0:
            return False
        kept = high[axis]
        low[axis] -= 1
        high[axis] = low[axis] + 1
    else:
        if high[axis] == shape[axis]:
            return False
        kept = low[axis]
        low[axis] = high[axis]
        high[axis] += 1
    volume = 1
    for a in range(low.shape[0]):
        volume *= high[a] - low[a]
    whole = count_cells(table, strides, low, high) == volume
    if side == 0:
        high[axis] = kept
        if not whole:
            low[axis] += 1
    else:
        low[axis] = kept
        if not whole:
            high[axis] -= 1
    return whole


@njit(cache=True)
def grow_cuboids(
    table: np.ndarray, strides: np.ndarray, shape: np.ndarray, seeds: np.ndarray,
    grown: np.ndarray,
) -> None:  # fmt: skip
    """Grows every seed in d + 1 ways into cuboids of good cells that no layer can be added to.

    Way 0 adds a layer on each side in turn; way 1 + k grows along number k as far as it can first,
    then along those that follow it.

    Args:
        table: Of the good cells, as `count_cells` takes it.
        strides: Of the table.
        shape: Cells along each number, shape (d,).
        seeds: First cells and one beyond the last, all good, shape (n, 2, d).
        grown: Gets the cuboids, shape (n, d + 1, 2, d).
    """
    d = shape.shape[0]
    for i in range(seeds.shape[0]):
        for way in range(d + 1):
            low, high = grown[i, way, 0], grown[i, way, 1]
            low[:] = seeds[i, 0]
            high[:] = seeds[i, 1]
            if way > 0:
                for k in range(d):
                    axis = (way - 1 + k) % d
                    for side in range(2):
                        while _grow(table, strides, shape, axis, side, low, high):
                            pass
            moved = True
            while moved:
                moved = False
                for axis in range(d):
                    for side in range(2):
                        moved |= _grow(table, strides, shape, axis, side, low, high)


@njit(cache=True)
def best_cuboid(table: np.ndarray, strides: np.ndarray, cuboids: np.ndarray,
                gains: np.ndarray) -> int:  # fmt: skip
    """The cuboid with most cells of a table, the first of several; gains that are too low stay.

    Counts only fall from call to call, so a cuboid whose last count is below the best is not
    counted again (lazy greedy cover; Minoux, 1978).

    Args:
        table: Of the cells that are counted.
        strides: Of the table.
        cuboids: Shape (n, 2, d).
        gains: Last counts, updated, shape (n,).
    """
    best, most = -1, 0
    for i in range(cuboids.shape[0]):
        if gains[i] > most:
            gains[i] = count_cells(table, strides, cuboids[i, 0], cuboids[i, 1])
            if gains[i] > most:
                best, most = i, gains[i]
    return best


@njit(cache=True)
def overlapping_pairs(lower: Array, upper: Array, least: int) -> np.ndarray:
    """Pairs i < j of boxes that share a box with at least so many numbers of width above zero.

    Args:
        lower: Shape (k, d).
        upper: Shape (k, d).
        least: Numbers along which the shared box must be wide; along others it may be flat.

    Returns:
        Shape (p, 2), in the order of i, then j.
    """
    k, d = lower.shape
    found = np.empty((k * (k - 1) // 2, 2), np.int64)
    count = 0
    for i in range(k):
        for j in range(i + 1, k):
            wide, meet = 0, True
            for a in range(d):
                size = min(upper[i, a], upper[j, a]) - max(lower[i, a], lower[j, a])
                if size < 0.0:
                    meet = False
                    break
                if size > 0.0:
                    wide += 1
            if meet and wide >= least:
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]
