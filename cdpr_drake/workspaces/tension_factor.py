"""Dexterity and tension factor: how evenly cables hold a platform."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.numerics.linear_program_kernel import lowest_point
from cdpr_drake.tensions.quadratic_program_kernel import null_space
from cdpr_drake.workspaces.demanded_wrenches import weight_wrenches
from cdpr_drake.workspaces.static_feasibility import StaticCase, wrench_matrices
from cdpr_drake.workspaces.stiffness import held_tensions
from cdpr_drake.workspaces.wrench_capacity import scaled_matrices

REGULAR = 1e-3
"""A pose counts as singular where the dexterity is smaller."""


def dexterities(case: StaticCase, positions: Array, rotations: Array) -> Array:
    """Inverse condition numbers of W, moments divided by `case.arm`, shape (n,), 0 to 1.

    0 where W is singular or a cable cannot run. Arguments as `tension_factors`.
    """
    W = scaled_matrices(case, positions, rotations)
    out = np.zeros(len(W))
    good = np.all(np.isfinite(W), axis=(1, 2))
    values = np.linalg.svd(W[good], compute_uv=False)
    out[good] = values[:, -1] / values[:, 0]
    return out


def tension_factors(case: StaticCase, positions: Array, rotations: Array) -> Array:
    """Largest ratio of the smallest to the largest tension that holds the platform, (n,), 0 to 1.

    NaN where it cannot be held.

    Args:
        case: Platform, load and tension bounds.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).

    Raises:
        TensionProblemError: The tension bounds make no sense.

    Source: Pham et al., Workspace analysis of fully restrained cable-driven manipulators, 2009,
    here with the load, as a linear program in y = t / max t and 1 / max t.
    """
    p = np.asarray(positions, float).reshape(-1, 3)
    R = np.asarray(rotations, float).reshape(-1, 3, 3)
    tensions, held = held_tensions(case, p, R)
    rows = list(case.rows)
    W = np.ascontiguousarray(wrench_matrices(p, R, case.cables)[:, rows])
    loads = np.ascontiguousarray(weight_wrenches(case, R)[:, rows])
    out = np.full(len(p), np.nan)
    over_rows(_many_factors, len(p), None, W, loads, *case.bounds(), tensions, held, out)
    return out


@njit(cache=True, nogil=True)
def _many_factors(
    first: int, past: int, W: Array, loads: Array, lower: Array, upper: Array, tensions: Array,
    held: np.ndarray, out: Array,
) -> None:  # fmt: skip
    """Unknowns (eta, z, s): y = z t_0 + N' eta, lower z <= y <= upper z, s <= y <= 1; max s."""
    _, n, m = W.shape
    r = m - n
    base, N = np.empty(m), np.empty((r, m))
    rows, low, high = np.zeros((4 * m + 1, r + 2)), np.empty(4 * m + 1), np.empty(4 * m + 1)
    x, cost = np.empty(r + 2), np.zeros(r + 2)
    cost[r + 1] = -1.0
    for pose in range(first, past):
        if not held[pose] or not null_space(W[pose], loads[pose], base, N):
            continue
        t = tensions[pose]
        largest = np.max(t)
        z = 1.0 / (largest if largest > 0.0 else np.max(upper))
        rows[:] = 0.0
        low[:], high[:] = 0.0, np.inf
        for i in range(m):
            for k in range(4):
                for j in range(r):
                    rows[k * m + i, j] = N[j, i]
                rows[k * m + i, r] = base[i]
            low[i], high[i] = -np.inf, 1.0
            rows[m + i, r + 1] = -1.0
            rows[2 * m + i, r] -= lower[i]
            rows[3 * m + i, r] -= upper[i]
            low[3 * m + i], high[3 * m + i] = -np.inf, 0.0
        rows[4 * m, r] = 1.0
        for j in range(r):
            x[j] = 0.0
            for i in range(m):
                x[j] += N[j, i] * t[i] * z
        x[r], x[r + 1] = z, max(np.min(t), 0.0) * z
        if lowest_point(cost, rows, low, high, x):
            out[pose] = min(max(x[r + 1], 0.0), 1.0)
