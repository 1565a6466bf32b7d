"""The log of a loop: rows in one array that grows, with a name for each range of columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_of

FIRST_ROWS = 512
"""Rows for which there is room at the start."""

_VECTOR, _POSE, _MATRIX = range(3)


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

    What gives a quantity gives another object when it has changed: one that stands there again is
    not read again, and keeps its columns of the row before.
    """

    def __init__(self, read: Mapping[str, Callable[[], Any] | RowOf]) -> None:
        """With what gives each quantity, by its name: a vector, or a pose, read as `pose_row`."""
        self._readers: list[tuple[slice, Callable[[], Any], int]] = []
        self.columns: dict[str, slice] = {}
        self._poses: set[str] = set()
        end, matrices = 0, dict[Callable[[], Array], int]()
        for name, reader in read.items():
            if isinstance(reader, RowOf):
                rows, m = reader.matrix().shape
                if reader.matrix not in matrices:
                    matrices[reader.matrix] = end
                    self._readers.append((slice(end, end + rows * m), reader.matrix, _MATRIX))
                    end += rows * m
                first = matrices[reader.matrix] + reader.row * m
                self.columns[name] = slice(first, first + m)
                continue
            value = reader()
            is_pose = isinstance(value, RigidTransform)
            if is_pose:
                self._poses.add(name)
            columns = slice(end, end + (12 if is_pose else len(value)))
            self.columns[name], end = columns, columns.stop
            self._readers.append((columns, reader, _POSE if is_pose else _VECTOR))
        self._shown: list[Any] = [None] * len(self._readers)
        self._times, self._rows, self._count = np.empty(FIRST_ROWS), np.empty((FIRST_ROWS, end)), 0

    def append(self, time: float) -> None:
        """Adds a row of now, at a time [s]."""
        if self._count == len(self._times):
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        row, shown = self._rows[self._count], self._shown
        if self._count:
            row[:] = self._rows[self._count - 1]
        for k, (columns, reader, kind) in enumerate(self._readers):
            value = reader()
            if value is not shown[k]:
                shown[k] = value
                if kind == _POSE:
                    value = value.GetAsMatrix34()
                row[columns] = value if kind == _VECTOR else value.ravel()
        self._times[self._count] = time
        self._count += 1

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
        self._shown = [None] * len(self._readers)
