"""All real solutions of the equations of rest, by following all complex ones to them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.statics.homotopy_kernel import AWAY, FOUND, STUCK
from cdpr_drake.statics.start_systems import (
    KINDS,
    SAME,
    Kind,
    StartSystem,
    follow_all,
    moved_start,
    signatures,
    start_system,
)

CARE = (1.0, 0.3, 0.1, 0.03)
"""Steps of paths, relative; the next where an end raises doubts."""

REAL = 1e-6
"""Imaginary parts below this, relative, are those of a real solution."""

NEARLY_REAL = 1e-3
"""The same of an end at which solutions meet, where paths end less exactly."""

SINGULAR = 1e-12
"""Ratio of pivots below which solutions are taken to meet or to form a family."""


@dataclass
class PathCount:
    """How paths ended, as evidence that none was lost.

    Attributes:
        systems: Systems of equations that were solved along paths.
        paths: Paths that were followed.
        away: Paths that went to infinity: the system has fewer solutions than almost all others.
        singular: Paths that ended where solutions meet, or at a family of solutions.
        lost: Paths that ended nowhere, on the end of another, or at a complex solution whose
            conjugate none found. Without any, all isolated solutions were found.
    """

    systems: int = 0
    paths: int = 0
    away: int = 0
    singular: int = 0
    lost: int = 0
    notes: list[str] = field(default_factory=list)

    def add(self, other: PathCount) -> None:
        """Counts what another counted, too."""
        for name in ("systems", "paths", "away", "singular", "lost"):
            setattr(self, name, getattr(self, name) + getattr(other, name))


DETOURS = 3
"""Other constants to start from where paths were lost: one that nearly meets a singular point or
infinity on its way does not do so on another."""


def real_solutions(name: str, constants: Array) -> tuple[list[tuple[Array, bool]], PathCount]:
    """All isolated real solutions of a system.

    Args:
        name: Of `KINDS`.
        constants: See `rest_equations`; real, about 1, the weight as in `DOWN`, shape (k + 1, 7).

    Returns:
        Solutions p (3), q (4, of length one), lambda (k), each with whether it is singular; how
        paths ended.
    """
    kind, start = KINDS[name], start_system(name)
    solutions, count = _solved_from(kind, start, constants)
    for detour in range(DETOURS):
        if not count.lost:
            break
        other = moved_start(kind, start, detour)
        if len(other.solutions) < kind.count:
            continue
        more, again = _solved_from(kind, other, constants)
        if again.lost < count.lost:
            solutions, count = more, again
    return solutions, count


def _solved_from(
    kind: Kind, start: StartSystem, constants: Array
) -> tuple[list[tuple[Array, bool]], PathCount]:
    target = np.asarray(constants, complex)[None]
    X, care = start.solutions.copy(), np.full(len(start.solutions), CARE[0])
    ends = follow_all(kind, start.constants, target, X, care)
    for level in CARE[1:]:
        doubtful = np.flatnonzero(_doubtful(X, ends, kind))
        if not len(doubtful):
            break
        again = start.solutions[doubtful].copy()
        ends[doubtful] = follow_all(
            kind, start.constants, target, again, np.full(len(doubtful), level)
        )
        X[doubtful] = again
    count = PathCount(systems=1, paths=len(X))
    stuck = ends[:, 0] == STUCK
    met = stuck & (ends[:, 2] > 1.0 - 1e-4)
    singular = met | ((ends[:, 0] == FOUND) & ((ends[:, 2] < SINGULAR) | (ends[:, 1] > 1e-10)))
    count.away = int(np.sum(ends[:, 0] == AWAY))
    count.singular = int(np.sum(singular))
    count.lost = int(np.sum(_doubtful(X, ends, kind) & ~singular))
    solutions = []
    for x, flat in zip(X, singular, strict=True):
        if not np.all(np.isfinite(x)):
            continue
        real = _as_real(x, NEARLY_REAL if flat else REAL)
        if real is not None:
            solutions.append((real, bool(flat)))
    return solutions, count


def _doubtful(X: Array, ends: Array, kind: Kind) -> np.ndarray:
    """Which paths should be followed again, more carefully."""
    good = ends[:, 0] == FOUND
    doubt = ends[:, 0] == STUCK
    index = np.flatnonzero(good)
    if not len(index):
        return doubt
    marks = signatures(X[index], kind)
    size = SAME * (1.0 + np.max(np.abs(marks), axis=1))
    apart = np.max(np.abs(marks[:, None] - marks[None]), axis=2)
    np.fill_diagonal(apart, np.inf)
    twice = np.min(apart, axis=1) < size if len(index) > 1 else np.zeros(1, bool)
    mirrored = np.min(np.max(np.abs(marks[:, None] - marks[None].conj()), axis=2), axis=1) > size
    doubt[index] = (twice | mirrored) & (ends[index, 2] >= SINGULAR)
    if np.any(doubt[index] & mirrored[: len(index)]):
        # One of two solutions that paths exchanged may be on either of their ends.
        near = np.partition(apart, 0, axis=1)[:, 0] if len(index) > 1 else np.zeros(0)
        doubt[index] |= near < 1e3 * size
    return doubt


def _as_real(x: Array, most: float) -> Array | None:
    x = x.copy()
    q = x[3:7]
    largest = q[int(np.argmax(np.abs(q)))]
    x[3:7] = q * (np.conj(largest) / abs(largest))
    x[3:7] /= np.linalg.norm(x[3:7])
    if np.max(np.abs(x.imag)) > most * (1.0 + np.max(np.abs(x))):
        return None
    real = x.real.copy()
    real[3:7] /= np.linalg.norm(real[3:7])
    return real
