"""Numba kernels for straight elastic cables, eight at once: the law of `straight_kernel` in lanes.

The order of operations is that of `straight_kernel._platform_force`, and so are all bits. What runs
millions of times a second is worth a second form: eight cables take a third of the time.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import CABLE_COLUMNS, Motion, floating_motion
from cdpr_drake.numerics.lanes import (
    COUNT,
    lane_of,
    less_sums,
    load_lanes,
    no_lanes,
    positive_where,
    root_of,
)


@njit(cache=True)
def put_columns(cables: Array, columns: Array) -> None:
    """columns[:8, :m] <- what `lanes_force` reads of packed cables, shape (m, 8) or more."""
    for i in range(cables.shape[0]):
        for k in range(CABLE_COLUMNS):
            columns[k, i] = cables[i, k]


@njit(cache=True, error_model="numpy", forceinline=True)
def lanes_force(X: Motion, l0: Array, l0_dot: Array, columns: Array) -> Any:
    """Moment about Po and force in W [N m, N] of all cables, in the first six lanes.

    Args:
        X: Motion of the platform from `floating_motion`.
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        columns: As `put_columns` wrote them, shape (8, m) or more.
    """
    m, sums = l0.shape[0], no_lanes()
    for i in range(0, m, COUNT):
        bx, by, bz = load_lanes(columns[3], i), load_lanes(columns[4], i), load_lanes(columns[5], i)
        rx = X[0] * bx + X[1] * by + X[2] * bz
        ry = X[3] * bx + X[4] * by + X[5] * bz
        rz = X[6] * bx + X[7] * by + X[8] * bz
        dx = X[9] + rx - load_lanes(columns[0], i)
        dy = X[10] + ry - load_lanes(columns[1], i)
        dz = X[11] + rz - load_lanes(columns[2], i)
        length = root_of(dx * dx + dy * dy + dz * dz)
        per_length = 1.0 / length
        ux, uy, uz = dx * per_length, dy * per_length, dz * per_length
        per_l0 = 1.0 / load_lanes(l0, i)
        strain = length * per_l0 - 1.0
        length_dot = (
            ux * (X[15] + X[13] * rz - X[14] * ry)
            + uy * (X[16] + X[14] * rx - X[12] * rz)
            + uz * (X[17] + X[12] * ry - X[13] * rx)
        )
        strain_rate = (length_dot - length * load_lanes(l0_dot, i) * per_l0) * per_l0
        pull = load_lanes(columns[6], i) * (strain + load_lanes(columns[7], i) * strain_rate)
        t = positive_where(strain, pull)
        terms = (
            t * (ry * uz - rz * uy), t * (rz * ux - rx * uz), t * (rx * uy - ry * ux),
            t * ux, t * uy, t * uz,
        )  # fmt: skip
        sums = less_sums(sums, terms, m - i)
    return sums


@njit(cache=True, error_model="numpy")
def floating_lanes_force(
    state: Array, l0: Array, l0_dot: Array, columns: Array, out: Array
) -> None:
    """Writes what `straight_kernel.floating_force` does to `out[:6]`, to the same bits.

    Args:
        state: Begins with the state of the platform, shape (13,).
        l0: See `lanes_force`.
        l0_dot: See `lanes_force`.
        columns: See `lanes_force`.
        out: Moment about Po and force in W [N m, N].
    """
    sums = lanes_force(floating_motion(state), l0, l0_dot, columns)
    for k in range(6):
        out[k] = lane_of(sums, k)
