"""The log of a loop: rows in one array that grows, with a name for each range of columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_of

FIRST_ROWS = 512
"""Rows for which there is room at the start."""


class RowOf(NamedTuple):
    """A row of a matrix with many quantities, which is read once for all of them.

    Attributes:
        matrix: Gives the matrix, shape (n, m).
        row: Number of the row.
    """

    matrix: Callable[[], Array]
    row: int


class LoopLog:
    """Rows of vectors and poses; what `RunLog` is for a diagram, for the same log.

    Quantities are read for each row, but those that rest between events by `refresh`, after an
    event.
    """

    def __init__(
        self, read: Mapping[str, Callable[[], Any] | RowOf], resting: Collection[str] = ()
    ) -> None:
        """With what gives each quantity, by its name: a vector, a pose or its matrix (3, 4), or a
        row of a matrix; and the names of those that rest between events."""
        self.columns: dict[str, slice] = {}
        self._poses: set[str] = set()
        shapes: dict[Callable[[], Any], tuple[int, tuple[int, ...]]] = {}
        rests: dict[Callable[[], Any], bool] = {}
        end = 0
        for name, reader in read.items():
            source, row = reader if isinstance(reader, RowOf) else (reader, None)
            value = source()
            if isinstance(value, RigidTransform):
                value = value.GetAsMatrix34()
            if row is None and value.shape == (3, 4):
                self._poses.add(name)
            if source not in shapes:
                shapes[source], rests[source] = (end, value.shape), name in resting
                end += value.size
            first, size = shapes[source][0], value.size
            if row is not None:
                size = value.shape[1]
                first += row * size
            self.columns[name] = slice(first, first + size)
        self._now = np.zeros(end)
        self._moving: list[tuple[Array, Callable[[], Any]]] = []
        self._resting: list[tuple[Array, Callable[[], Any]]] = []
        for source, (first, shape) in shapes.items():
            view = self._now[first : first + math.prod(shape)].reshape(shape)
            (self._resting if rests[source] else self._moving).append((view, source))
        self._times, self._rows, self._count = np.empty(FIRST_ROWS), np.empty((FIRST_ROWS, end)), 0
        self.refresh()

    def refresh(self) -> None:
        """Reads the quantities that rest between events."""
        _write(self._resting)

    def append(self, time: float) -> None:
        """Adds a row of now, at a time [s]."""
        count = self._count
        if count == len(self._times):
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        _write(self._moving)
        self._rows[count] = self._now
        self._times[count] = time
        self._count = count + 1

    def read(self, _: object = None) -> dict[str, Array]:
        """Times "time", shape (n,) [s], and each quantity, shape (n, size)."""
        rows = self._rows[: self._count]
        return {
            "time": self._times[: self._count].copy(),
            **{
                name: pose_rows_of(rows[:, columns])
                if name in self._poses
                else rows[:, columns].copy()
                for name, columns in self.columns.items()
            },
        }

    def rows(self, _: object = None) -> int:
        """Number of rows that are there."""
        return self._count

    def clear(self, _: object = None) -> None:
        """Forgets them; what comes is logged as before."""
        self._count = 0


def _write(sources: list[tuple[Array, Callable[[], Any]]]) -> None:
    for view, source in sources:
        value = source()
        view[:] = value.GetAsMatrix34() if value.__class__ is RigidTransform else value
