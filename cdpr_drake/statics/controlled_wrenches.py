"""Which wrenches cables control where they are fewer than the degrees of freedom.

A twist s that changes no length to first order, W' s = 0, does no work against any tensions: the
combination s . F of a wrench's components is zero for all wrenches that the cables give, and the
platform is at rest only where s . w is zero for the wrench w that they have to balance.

Source: Carricato and Merlet, Stability analysis of underconstrained cable-driven parallel robots,
IEEE T-RO 29(1), 2013.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.shortfall import Shortfall, shortfall

RANK_TOLERANCE = 1e-10
"""Singular values of W below this share of the largest are none."""

BALANCED = 1e-9
"""A combination of a wrench's components below this share of the wrench is none."""

_SHOWN = 1e-9
"""Share of the largest component below which one is not said."""


@dataclass(frozen=True, eq=False)
class WrenchControl:
    """What cables can do about a wrench w, W t + w = 0.

    Attributes:
        rank: Of W: how many independent components the cables control.
        free: Twists that change no length, columns, shape (n, n - rank) [rad, m]; of each the
            largest rotation is 1, or where it has none, the largest translation.
        unbalanced: s . w of each of them, what nothing balances, shape (n - rank,), [N m], or [N]
            where it has no rotation.
        balances: Whether they are zero, up to rounding.
        tensions: Tensions that balance w within the bounds, of least 2-norm, shape (m,) [N]; None
            where there are none.
        problem: The part of W t + w = 0 that the cables control, in `rank` combinations of rows.
        combinations: These combinations as columns, shape (n, rank) [N m, N].
    """

    rank: int
    free: Array
    unbalanced: Array
    balances: bool
    tensions: Array | None
    problem: TensionProblem
    combinations: Array

    def shortfall(self) -> Shortfall | None:
        """How far tensions miss what the cables control; None where some balance that part."""
        if exact_tensions(self.problem) is not None:
            return None
        found = shortfall(self.problem)
        return replace(found, missing=self.combinations @ found.missing)


def wrench_control(
    W: Array, wrench: Array, lower: Array, upper: Array, row_scale: Array, *, turns: int = 0
) -> WrenchControl:
    """What cables can do about a wrench, also with fewer of them than degrees of freedom.

    Args:
        W: Wrench matrix, shape (n, m).
        wrench: The wrench to balance, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        row_scale: What makes its components comparable, shape (n,) [m, -].
        turns: How many of them, the first ones, are moments.

    Raises:
        TensionProblemError: The bounds make no sense.
    """
    scaled, load = W / row_scale[:, np.newaxis], wrench / row_scale
    U, singular, _ = np.linalg.svd(scaled)
    rank = int(np.sum(singular > RANK_TOLERANCE * singular[0]))
    kept, off = U[:, :rank], U[:, rank:]
    balances = bool(np.linalg.norm(off.T @ load) <= BALANCED * np.linalg.norm(load))
    problem = TensionProblem(kept.T @ scaled, kept.T @ load, lower, upper)
    tensions = exact_tensions(problem) if balances else None
    free = _legible(off) / row_scale[:, np.newaxis]
    for column in free.T:
        part = column[:turns] if np.any(column[:turns]) else column
        column /= part[np.argmax(np.abs(part))]
    unbalanced = np.asarray(free.T @ wrench, float)
    combinations = kept * row_scale[:, np.newaxis]
    return WrenchControl(rank, free, unbalanced, balances, tensions, problem, combinations)


def _legible(N: Array) -> Array:
    """The same space, each column alone in one row, by elimination with the largest pivot."""
    N = N.copy()
    pivots: list[int] = []
    for k in range(N.shape[1]):
        size = np.max(np.abs(N[:, k:]), axis=1)
        size[pivots] = 0.0
        row = int(np.argmax(size > (1.0 - 1e-9) * np.max(size)))
        best = k + int(np.argmax(np.abs(N[row, k:])))
        N[:, [k, best]] = N[:, [best, k]]
        N[:, k] /= N[row, k]
        for j in range(N.shape[1]):
            if j != k:
                N[:, j] -= N[row, j] * N[:, k]
        pivots.append(row)
    N[np.abs(N) < _SHOWN] = 0.0
    return N


def combination_words(twist: Array, components: tuple[str, ...]) -> str:
    """A combination of a wrench's components in words, as `moment about x + 0.3 m force along y`.

    Args:
        twist: A column of `WrenchControl.free`, shape (n,).
        components: Names of the components, as `MotionType.words` has them.
    """
    parts = []
    for value, name in zip(twist, components, strict=True):
        if value == 0.0:
            continue
        unit = " m" if name.startswith("force") and any(
            twist[k] != 0.0 for k, other in enumerate(components) if other.startswith("moment")
        ) else ""  # fmt: skip
        factor = "" if abs(abs(value) - 1.0) < 1e-9 and not unit else f"{abs(value):.3g}{unit} "
        sign = "-" if value < 0.0 else "+"
        parts.append(f"{sign} {factor}{name}")
    words = " ".join(parts)
    return words.removeprefix("+ ").replace("- ", "-", 1) if words[:1] == "-" else words[2:]
