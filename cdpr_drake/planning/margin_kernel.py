"""Numba kernels: how far from their limits tensions and torques can be kept."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_program_kernel import lowest_point
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.planning.limits import (
    CABLE_ACCELERATION,
    CABLE_SPEED,
    INERTIA,
    LOWER,
    RATIO,
    SPEED,
    TORQUE,
    UPPER,
)
from cdpr_drake.planning.station_kernel import BASIS, BEND, RATE, T_0, T_U, T_X

ROUNDING = 1e-9
"""Limits that are missed by less, relative to their ranges, are kept."""

TENSION_USE, SPEED_USE, ACCELERATION_USE, PATH_SPEED_USE = range(4)
"""Columns of `uses_of`: tensions and torques together, cable speeds, cable accelerations, speed
of Po."""


@shared(types.float64(VECTOR, VECTOR, MATRIX, VECTOR, VECTOR))
@njit(cache=True)
def margin(tensions: Array, accelerations: Array, basis: Array, limits: Array, eta: Array) -> float:
    """Largest d so that some tensions keep d half ranges away from all their limits.

    Tensions t = tensions + basis' eta shall keep lower + d h <= t <= upper - d h with h half of the
    range, and the motors' torques |tau| <= (1 - d) torque.

    Args:
        tensions: At eta = 0, shape (m,) [N].
        accelerations: d2l/dt2 of the cables, shape (m,) [m/s^2].
        basis: Null space of the wrench matrix, row by row, shape (r, m).
        limits: `MotionLimits.packed`.
        eta: Gets the best, shape (r,) [N].

    Returns:
        d, at most 1; negative where limits are missed; NaN where the program was not solved.
    """
    r, m = basis.shape
    motors = limits[TORQUE] < np.inf
    half = 0.5 * (limits[UPPER] - limits[LOWER])
    span = limits[TORQUE] / limits[RATIO]
    mass = limits[INERTIA] / limits[RATIO] ** 2
    p = (4 if motors else 2) * m + 1
    rows, low, high = np.zeros((p, r + 1)), np.full(p, -np.inf), np.full(p, np.inf)
    z, cost = np.zeros(r + 1), np.zeros(r + 1)
    cost[r] = -1.0
    worst = 1.0
    for i in range(m):
        for k in range(r):
            rows[i, k] = basis[k, i]
            rows[m + i, k] = basis[k, i]
        rows[i, r], rows[m + i, r] = half, -half
        high[i], low[m + i] = limits[UPPER] - tensions[i], limits[LOWER] - tensions[i]
        worst = min(worst, high[i] / half, -low[m + i] / half)
        if motors:
            # tau / rho = mass d2l/dt2 - t
            a, b = 2 * m + i, 3 * m + i
            for k in range(r):
                rows[a, k] = basis[k, i]
                rows[b, k] = basis[k, i]
            rows[a, r], rows[b, r] = span, -span
            high[a] = span + mass * accelerations[i] - tensions[i]
            low[b] = -span + mass * accelerations[i] - tensions[i]
            worst = min(worst, high[a] / span, -low[b] / span)
    rows[p - 1, r], high[p - 1] = 1.0, 1.0
    z[r] = worst
    if not lowest_point(cost, rows, low, high, z):
        return np.nan
    for k in range(r):
        eta[k] = z[k]
    best = float(z[r])
    return best


@njit(cache=True)
def rest_margins(stations: Array, limits: Array, etas: Array, margins: Array) -> None:
    """Writes the margin of the platform at rest at every station, and the eta that has it.

    Args:
        stations: Rows of `stations_of`, shape (n, 5 + r, m).
        limits: `MotionLimits.packed`.
        etas: Gets eta, shape (n, r) [N].
        margins: Gets the margins, shape (n,).
    """
    still = np.zeros(stations.shape[2])
    for i in range(stations.shape[0]):
        margins[i] = margin(stations[i, T_0], still, stations[i, BASIS:], limits, etas[i])


@njit(cache=True)
def uses_of(
    stations: Array, reach: Array, u: Array, x: Array, limits: Array,
    uses: Array, tensions: Array, rates: Array,
) -> None:  # fmt: skip
    """Writes which share of its limits a motion uses at stations; 1: one is reached, above: missed.

    Args:
        stations: Rows of `stations_of`, shape (n, 5 + r, m).
        reach: |p'| there, shape (n,).
        u: d2s/dt2, shape (n,) [m/s^2].
        x: (ds/dt)^2, shape (n,) [m^2/s^2].
        limits: `MotionLimits.packed`.
        uses: Gets the shares, shape (n, 4), see `TENSION_USE`; of tensions with the redundancy used
            as well as it can be.
        tensions: Gets the tensions that use it so, shape (n, m) [N].
        rates: Gets speeds and accelerations of the cables, shape (n, 2, m) [m/s, m/s^2].
    """
    n, m = stations.shape[0], stations.shape[2]
    r = stations.shape[1] - BASIS
    eta = np.zeros(r)
    for i in range(n):
        S = stations[i]
        speed = np.sqrt(x[i])
        uses[i, SPEED_USE], uses[i, ACCELERATION_USE] = 0.0, 0.0
        for j in range(m):
            tensions[i, j] = S[T_0, j] + S[T_U, j] * u[i] + S[T_X, j] * x[i]
            rates[i, 0, j] = S[RATE, j] * speed
            rates[i, 1, j] = S[RATE, j] * u[i] + S[BEND, j] * x[i]
            uses[i, SPEED_USE] = max(uses[i, SPEED_USE], abs(rates[i, 0, j]) / limits[CABLE_SPEED])
            uses[i, ACCELERATION_USE] = max(
                uses[i, ACCELERATION_USE], abs(rates[i, 1, j]) / limits[CABLE_ACCELERATION]
            )
        uses[i, PATH_SPEED_USE] = reach[i] * speed / limits[SPEED]
        uses[i, TENSION_USE] = 1.0 - margin(tensions[i], rates[i, 1], S[BASIS:], limits, eta)
        for k in range(r):
            for j in range(m):
                tensions[i, j] += S[BASIS + k, j] * eta[k]
