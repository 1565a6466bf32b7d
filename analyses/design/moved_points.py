"""Points that move within boxes about where they were, some as images of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array

AXES = {"x": (0,), "y": (1,), "z": (2,), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""Symmetries by name: normals of planes, and axes that half a turn turns round."""


@dataclass(frozen=True)
class Mirror:
    """Point `second` moves as the image of point `first` does, in a plane or by half a turn.

    Attributes:
        axes: Along which displacements change their sign: one, the normal of a plane, or two, half
            a turn about the third.
        first: Number of a point.
        second: Number of another; or of the same, which then does not move along these axes.
    """

    axes: tuple[int, ...]
    first: int
    second: int


class MovedPoints:
    """Displacements of points as functions of few coordinates in [0, 1].

    Every coordinate of every point is free, or tied to that of another with the same sign or the
    opposite one. Where ties contradict each other, the coordinate does not move. Half a box is the
    least among those that are tied.
    """

    def __init__(self, reach: Array, mirrors: Sequence[Mirror] = ()) -> None:
        """For points that move by at most `reach`, shape (3, m), >= 0 [m], either way."""
        self.reach = np.asarray(reach, float)
        m = self.reach.shape[1]
        parent, sign, still = list(range(3 * m)), [1.0] * (3 * m), set[int]()

        def root(k: int) -> tuple[int, float]:
            total = 1.0
            while parent[k] != k:
                total *= sign[k]
                k = parent[k]
            return k, total

        for mirror in mirrors:
            for axis in range(3):
                opposite = -1.0 if axis in mirror.axes else 1.0
                a, s = root(3 * mirror.first + axis)
                b, t = root(3 * mirror.second + axis)
                if a != b:
                    parent[b], sign[b] = a, s * opposite * t
                elif s * opposite != t:
                    still.add(a)
        still = {root(k)[0] for k in still}
        groups: dict[int, list[tuple[int, float]]] = {}
        for k in range(3 * m):
            first, s = root(k)
            groups.setdefault(first, []).append((k, s))
        self._columns: list[Array] = []
        for first, members in groups.items():
            half = min(self.reach[k % 3, k // 3] for k, _ in members)
            if first in still or half <= 0.0:
                continue
            column = np.zeros(3 * m)
            for k, s in members:
                column[k] = s * half
            self._columns.append(column.reshape(m, 3).T)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self._columns)

    def displacements(self, coordinates: Array) -> Array:
        """Displacements, shape (3, m) [m]; those of coordinates of 0.5 are zero."""
        moved = np.zeros_like(self.reach)
        for value, column in zip(coordinates, self._columns, strict=True):
            moved += (2.0 * value - 1.0) * column
        return moved

    def slopes(self, by_points: Array) -> Array:
        """Slopes by the coordinates, shape (n, size), of functions with slopes by the points.

        Args:
            by_points: Shape (n, 3, m) [1/m].
        """
        columns = np.array(self._columns).reshape(-1, *self.reach.shape)
        return np.asarray(2.0 * np.einsum("nam,kam->nk", by_points, columns))
