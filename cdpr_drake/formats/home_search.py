"""Where a robot hangs farthest from its tension limits: the best of many poses, few of them asked.

At a pose the margin is that of a linear program: the largest s with lower + s <= t <= upper - s and
W t = -w. Any multipliers y of its equations bound it, there and at all other poses: with c = W' y

    s sum |c| <= upper sum max(c, 0) + lower sum min(c, 0) + y' w,

and those of a solved program bound its neighbours closely. So poses are asked in the order of their
bounds, until no bound is left that reaches the best margin found.
"""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

_MISSED = 1e-4
"""Share of the range of tensions by which a bound may miss what the program's rounding gives."""

_UNBALANCED = 1e-5
"""Wrench that no tensions balance, as a share of the load and in N or N m: beyond what a solver
takes for zero, which is 1e-7."""

_RANK = 1e-9
"""Singular values smaller than this share of the largest are zero."""


def farthest_pose(W: Array, w: Array, limits: tuple[float, float]) -> tuple[int, float]:
    """The first pose with the largest margin, and that margin; (0, -1.0) where no pose is held.

    Args:
        W: Wrench matrices of n poses, shape (n, r, m).
        w: Wrench that tensions balance, shape (r,).
        limits: Smallest and largest tension [N].
    """
    margins, bounds = np.full(len(W), -1.0), _balanced(W, w)
    missed = _MISSED * (limits[1] - limits[0])
    k = len(W) // 2 if bounds[len(W) // 2] > 0.0 else int(np.argmax(bounds))
    while bounds[k] >= max(np.max(margins), 0.0) - missed:
        margins[k], y = margin_and_multipliers(W[k], w, limits)
        bounds = np.minimum(bounds, margin_bounds(W, w, limits, y))
        bounds[k] = -np.inf  # it was asked
        k = int(np.argmax(bounds))
    best = int(np.argmax(margins))
    return best, float(margins[best])


def margin_and_multipliers(W: Array, w: Array, limits: tuple[float, float]) -> tuple[float, Array]:
    """Largest distance of balanced tensions to their limits [N], -1.0 without any within them.

    Args:
        W: Wrench matrix, shape (r, m).
        w: Wrench that tensions balance, shape (r,).
        limits: Smallest and largest tension [N].

    Returns:
        The margin, and multipliers of the equations, shape (r,); of the program whose margin may be
        negative where there is no other.
    """
    from scipy.optimize import linprog  # heavy, and needed for files without a home pose only

    m = W.shape[1]
    one = np.ones((m, 1))

    def solved(least: float | None) -> tuple[float, Array]:
        result = linprog(
            np.append(np.zeros(m), -1.0),
            A_ub=np.block([[-np.eye(m), one], [np.eye(m), one]]),
            b_ub=np.concatenate([np.full(m, -limits[0]), np.full(m, limits[1])]),
            A_eq=np.column_stack([W, np.zeros(len(W))]),
            b_eq=-w,
            bounds=[(None, None)] * m + [(least, None)],
            method="highs",
        )
        if result.status != 0:
            return -1.0, np.zeros(len(W))
        return float(result.x[-1]), np.asarray(result.eqlin.marginals, float)

    margin, y = solved(0.0)
    return (margin, y) if margin >= 0.0 else (-1.0, solved(None)[1])


def margin_bounds(W: Array, w: Array, limits: tuple[float, float], y: Array) -> Array:
    """Margins that multipliers allow at all poses [N], shape (n,); inf where they say nothing.

    Args:
        W: Wrench matrices, shape (n, r, m).
        w: Wrench that tensions balance, shape (r,).
        limits: Smallest and largest tension [N].
        y: Multipliers, shape (r,), of either sign.
    """
    c, work = np.einsum("r,nrm->nm", y, W), float(y @ w)
    size = np.sum(np.abs(c), axis=1)
    high, low = np.sum(np.maximum(c, 0.0), axis=1), np.sum(np.minimum(c, 0.0), axis=1)
    one = limits[1] * high + limits[0] * low + work
    other = -limits[1] * low - limits[0] * high - work
    says = size > _RANK * float(np.linalg.norm(y))
    bounds = np.full(len(W), np.inf)
    bounds[says] = np.minimum(one, other)[says] / size[says]
    return bounds


def _balanced(W: Array, w: Array) -> Array:
    """-inf for poses at which no tensions at all balance the load, inf for others, shape (n,)."""
    t = np.linalg.pinv(W, rcond=_RANK) @ -w
    left = np.linalg.norm(np.einsum("nrm,nm->nr", W, t) + w, axis=1)
    return np.where(left > _UNBALANCED * max(float(np.linalg.norm(w)), 1.0), -np.inf, np.inf)
