"""The log of a loop: rows in one array that grows, with a name for each range of columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.spatial import pose_rows_of

FIRST_ROWS = 512
"""Rows for which there is room at the start."""


class LoopLog:
    """Rows of vectors and poses; what `RunLog` is for a diagram, for the same log."""

    def __init__(self, read: Mapping[str, Callable[[], Any]]) -> None:
        """With what gives each quantity, by its name: a vector, or a pose, read as `pose_row`."""
        self._readers: list[tuple[slice, Callable[[], Any]]] = []
        self.columns: dict[str, slice] = {}
        self._poses: set[str] = set()
        end = 0
        for name, reader in read.items():
            value = reader()
            if isinstance(value, RigidTransform):
                reader, value = _matrix_of(reader), np.zeros(12)
                self._poses.add(name)
            columns = slice(end, end + len(value))
            self.columns[name], end = columns, columns.stop
            self._readers.append((columns, reader))
        self._times, self._rows, self._count = np.empty(FIRST_ROWS), np.empty((FIRST_ROWS, end)), 0

    def append(self, time: float) -> None:
        """Adds a row of now, at a time [s]."""
        if self._count == len(self._times):
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        row = self._rows[self._count]
        for columns, reader in self._readers:
            row[columns] = reader()
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


def _matrix_of(reader: Callable[[], RigidTransform]) -> Callable[[], Array]:
    return lambda: reader().GetAsMatrix34().ravel()
