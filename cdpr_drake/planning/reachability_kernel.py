"""Numba kernels: the fastest law of time along a path, by reachability analysis.

Between stations i and i + 1, a way D apart, u = d2s/dt2 is constant, so that x = (ds/dt)^2 goes
from x to x + 2 D u. Both (u, x) at the first and (u, x + 2 D u) at the second station must be
admissible: tensions, torques, cable accelerations within their limits, each with a redundancy of
its own. From the end back, the speeds from which the end can be reached are an interval at every
station, whose ends are linear programs in u, x and the redundancy at both stations. From the start
on, the largest u that stays in these intervals is the fastest law of time on this grid.

The admissible (u, x) are the projection of a polytope along the redundancy. It need not be
computed: programs of six variables for eight cables are solved as they are, from a point that is
feasible. Where the platform cannot rest, the smallest speed of the interval is above zero, and the
motion carries it through.

Source: Pham and Pham, A new approach to time-optimal path parameterization based on reachability
analysis, 2018; the constraint at both stations is its interpolation scheme.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.linear_program_kernel import lowest_point
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.planning.limits import CABLE_ACCELERATION, INERTIA, LOWER, RATIO, TORQUE, UPPER
from cdpr_drake.planning.margin_kernel import ROUNDING
from cdpr_drake.planning.resistance_kernel import BY_U, BY_X, ROOM
from cdpr_drake.planning.station_kernel import BASIS, BEND, RATE, T_0, T_U, T_X

DONE, UNREACHABLE, UNSOLVED = range(3)
"""How a pass ended: well; at a station from which no speed leads on; a program was not solved."""

STANDSTILL = 1e-14
"""Squared speeds below this, relative to the largest of the path, are none."""


@njit(cache=True)
def _kinds(limits: Array) -> int:
    """Rows that each cable has at a station."""
    kinds = 1
    if limits[TORQUE] < np.inf:
        kinds += 1
    if limits[CABLE_ACCELERATION] < np.inf:
        kinds += 1
    return kinds


@njit(cache=True)
def row_count(m: int, limits: Array, more: int) -> int:
    """Rows of the programs of two stations: those of either, then x there, then x here.

    Those of either are the limits of m cables, kind by kind, and `more` bounds of (u, x).
    """
    return 2 * (m * _kinds(limits) + more) + 2


@njit(cache=True)
def _write_station(
    S: Array, bounds: Array, limits: Array, twice: float, first: int, at: int,
    rows: Array, low: Array, high: Array,
) -> int:  # fmt: skip
    """Writes rows of one station into a program; returns where the next begin.

    The variables are (u, x, eta here, eta there). `twice` is 0 here and 2 D there; `first` is the
    column of the station's eta, `at` its first row.
    """
    m, r = S.shape[1], S.shape[0] - BASIS
    mass = limits[INERTIA] / limits[RATIO] ** 2
    span = limits[TORQUE] / limits[RATIO]
    for i in range(m):
        rows[at, 0], rows[at, 1] = S[T_U, i] + twice * S[T_X, i], S[T_X, i]
        for k in range(r):
            rows[at, first + k] = S[BASIS + k, i]
        low[at], high[at] = limits[LOWER] - S[T_0, i], limits[UPPER] - S[T_0, i]
        at += 1
    if limits[TORQUE] < np.inf:
        for i in range(m):
            by_u, by_x = mass * S[RATE, i] - S[T_U, i], mass * S[BEND, i] - S[T_X, i]
            rows[at, 0], rows[at, 1] = by_u + twice * by_x, by_x
            for k in range(r):
                rows[at, first + k] = -S[BASIS + k, i]
            low[at], high[at] = S[T_0, i] - span, S[T_0, i] + span
            at += 1
    if limits[CABLE_ACCELERATION] < np.inf:
        for i in range(m):
            rows[at, 0], rows[at, 1] = S[RATE, i] + twice * S[BEND, i], S[BEND, i]
            low[at], high[at] = -limits[CABLE_ACCELERATION], limits[CABLE_ACCELERATION]
            at += 1
    for k in range(bounds.shape[0]):
        rows[at, 0] = bounds[k, BY_U] + twice * bounds[k, BY_X]
        rows[at, 1] = bounds[k, BY_X]
        low[at], high[at] = -np.inf, bounds[k, ROOM]
        at += 1
    return at


@shared(
    types.void(
        MATRIX, MATRIX, types.float64[:, :, ::1], types.float64, VECTOR, types.float64, VECTOR,
        MATRIX, VECTOR, VECTOR,
    )
)  # fmt: skip
@njit(cache=True)
def write_program(
    here: Array, there: Array, bounds: Array, way: float, limits: Array, fastest: float,
    goal: Array, rows: Array, low: Array, high: Array,
) -> None:  # fmt: skip
    """Writes the constraints between two stations, low <= rows z <= high.

    Args:
        here: Rows of the first station, shape (5 + r, m).
        there: Of the second.
        bounds: Of (u, x) at both, as `resistance_kernel.resistance_rows`, shape (2, p, 4).
        way: D between them [m].
        limits: `MotionLimits.packed`.
        fastest: Largest x here [m^2/s^2].
        goal: Smallest and largest x there, shape (2,) [m^2/s^2].
        rows: Gets the rows of z = (u, x, eta here, eta there), shape (`row_count`, 2 + 2 r).
        low: Shape (`row_count`,).
        high: Shape (`row_count`,).
    """
    r = here.shape[0] - BASIS
    rows[:] = 0.0
    at = _write_station(here, bounds[0], limits, 0.0, as_number(2), as_number(0), rows, low, high)
    at = _write_station(there, bounds[1], limits, 2.0 * way, 2 + r, at, rows, low, high)
    rows[at, 0], rows[at, 1] = 2.0 * way, 1.0
    low[at], high[at] = goal[0], goal[1]
    rows[at + 1, 1] = 1.0
    low[at + 1], high[at + 1] = 0.0, fastest


@shared(types.float64(MATRIX, VECTOR, VECTOR, types.float64, VECTOR, VECTOR))
@njit(cache=True)
def feasible_point(
    rows: Array, low: Array, high: Array, way: float, limits: Array, z: Array
) -> float:
    """Finds a point of a program of `write_program`, or by how much all miss it.

    Args:
        rows: Shape (p, k).
        low: Shape (p,).
        high: Shape (p,).
        way: D between the stations [m].
        limits: `MotionLimits.packed`.
        z: Gets the point that misses its limits least, shape (k,).

    Returns:
        By which share of its range the worst limit is missed, 0 if none is; NaN where the program
        was not solved.
    """
    p, k = rows.shape
    hard = 2  # the last two, on x, which the start below keeps
    wide = np.zeros((2 * p + 1, k + 1))  # the last row keeps what is missed from falling below 0
    least, most = np.full(2 * p + 1, -np.inf), np.full(2 * p + 1, np.inf)
    start, cost = np.zeros(k + 1), np.zeros(k + 1)
    cost[k] = 1.0
    start[0] = low[p - 2] / (2.0 * way)
    worst = 0.0
    for i in range(p):
        value = rows[i, 0] * start[0]
        scale = 0.5 * (high[i] - low[i]) if i < p - hard else 0.0
        if scale == np.inf:  # a bound of one side, of tensions
            scale = 0.5 * (limits[UPPER] - limits[LOWER])
        for j in range(k):
            wide[i, j] = rows[i, j]
            wide[p + i, j] = rows[i, j]
        wide[i, k], wide[p + i, k] = -scale, scale
        most[i], least[p + i] = high[i], low[i]
        if i < p - hard:
            worst = max(worst, (value - high[i]) / scale, (low[i] - value) / scale)
    start[k] = worst
    wide[2 * p, k], least[2 * p] = 1.0, 0.0
    solved = lowest_point(cost, wide, least, most, start)
    for j in range(k):
        z[j] = start[j]
    missed = float(start[k])
    return missed if solved else np.nan


@njit(cache=True)
def backward(
    stations: Array, bounds: Array, ways: Array, fastest: Array, etas: Array, margins: Array,
    limits: Array, speeds: Array, ends: Array,
) -> tuple[int, int]:  # fmt: skip
    """Finds from which speeds the end of the path can be reached at rest.

    Args:
        stations: Rows of `stations_of`, shape (n + 1, 5 + r, m).
        bounds: More bounds of (u, x) there, rows of `resistance_kernel`, shape (n + 1, p, 4).
        ways: Between them, shape (n,) [m].
        fastest: Largest x there, shape (n + 1,) [m^2/s^2].
        etas: Of the platform at rest, shape (n + 1, r) [N].
        margins: Its margins, shape (n + 1,); negative where it cannot rest, or bounds forbid it.
        limits: `MotionLimits.packed`.
        speeds: Gets smallest and largest x, shape (n + 1, 2) [m^2/s^2].
        ends: Gets points of the programs at both, shape (n, 2, 2 + 2 r).

    Returns:
        `DONE` and 0, or what else and at which station.
    """
    n, m = ways.shape[0], stations.shape[2]
    r = stations.shape[1] - BASIS
    p, k = row_count(m, limits, bounds.shape[1]), 2 + 2 * r
    rows, low, high = np.empty((p, k)), np.empty(p), np.empty(p)
    z, cost = np.empty(k), np.zeros(k)
    speeds[n] = 0.0
    for i in range(n - 1, -1, -1):
        write_program(
            stations[i], stations[i + 1], bounds[i : i + 2], ways[i], limits, fastest[i],
            speeds[i + 1], rows, low, high,
        )  # fmt: skip
        if margins[i] >= 0.0 and margins[i + 1] >= 0.0 and speeds[i + 1, 0] == 0.0:
            z[:] = 0.0
            for j in range(r):
                z[2 + j], z[2 + r + j] = etas[i, j], etas[i + 1, j]
        else:
            missed = feasible_point(rows, low, high, ways[i], limits, z)
            if not missed <= ROUNDING:
                return (UNREACHABLE if missed > ROUNDING else UNSOLVED), i
            cost[1] = 1.0
            if not lowest_point(cost, rows, low, high, z):
                return UNSOLVED, i
        speeds[i, 0] = max(z[1], 0.0)
        for j in range(k):
            ends[i, 0, j] = z[j]
        cost[1] = -1.0
        if not lowest_point(cost, rows, low, high, z):
            return UNSOLVED, i
        speeds[i, 1] = max(z[1], speeds[i, 0])
        for j in range(k):
            ends[i, 1, j] = z[j]
    return DONE, 0


@njit(cache=True)
def forward(
    stations: Array, bounds: Array, ways: Array, fastest: Array, speeds: Array, ends: Array,
    limits: Array, x: Array, u: Array,
) -> tuple[int, int]:  # fmt: skip
    """Finds the fastest law of time that stays at speeds from which the end can be reached.

    Args:
        stations: As `backward`.
        bounds: As `backward`.
        ways: As `backward`.
        fastest: As `backward`.
        speeds: What `backward` found.
        ends: What `backward` found.
        limits: `MotionLimits.packed`.
        x: Gets (ds/dt)^2, shape (n + 1,) [m^2/s^2]; its first entry is given.
        u: Gets d2s/dt2, shape (n,) [m/s^2].

    Returns:
        `DONE` and 0, or what else and at which station.
    """
    n, m = ways.shape[0], stations.shape[2]
    r = stations.shape[1] - BASIS
    p, k = row_count(m, limits, bounds.shape[1]), 2 + 2 * r
    rows, low, high = np.empty((p, k)), np.empty(p), np.empty(p)
    fewer, z, cost = np.empty((p, k - 1)), np.empty(k - 1), np.zeros(k - 1)
    cost[0] = -1.0
    largest = speeds[0, 0]
    for i in range(n + 1):
        for j in range(2):
            if speeds[i, j] > largest or speeds[i, j] != speeds[i, j]:  # what is no number stays
                largest = speeds[i, j]
    least = STANDSTILL * largest
    for i in range(n):
        write_program(
            stations[i], stations[i + 1], bounds[i : i + 2], ways[i], limits, fastest[i],
            speeds[i + 1], rows, low, high,
        )  # fmt: skip
        span = speeds[i, 1] - speeds[i, 0]
        share = min(max((x[i] - speeds[i, 0]) / span, 0.0), 1.0) if span > 0.0 else 0.0
        for j in range(p):
            by_x = rows[j, 1] * x[i]
            low[j] -= by_x
            high[j] -= by_x
            fewer[j, 0] = rows[j, 0]
            for c in range(2, k):
                fewer[j, c - 1] = rows[j, c]
        z[0] = (1.0 - share) * ends[i, 0, 0] + share * ends[i, 1, 0]
        for c in range(2, k):
            z[c - 1] = (1.0 - share) * ends[i, 0, c] + share * ends[i, 1, c]
        if not lowest_point(cost, fewer, low, high, z):
            return UNSOLVED, i
        x[i + 1] = min(max(x[i] + 2.0 * ways[i] * z[0], speeds[i + 1, 0]), speeds[i + 1, 1])
        u[i] = (x[i + 1] - x[i]) / (2.0 * ways[i])
        if x[i] + x[i + 1] <= least:
            return UNREACHABLE, i
    return DONE, 0


@njit(cache=True)
def largest_speeds(
    stations: Array, bounds: Array, etas: Array, margins: Array, fastest: Array, limits: Array,
    out: Array,
) -> None:  # fmt: skip
    """Writes the largest x at every station by itself, whatever comes before and after.

    Args:
        stations: As `backward`.
        bounds: As `backward`.
        etas: As `backward`.
        margins: As `backward`; where the platform cannot rest, the answer is NaN.
        fastest: As `backward`.
        limits: `MotionLimits.packed`.
        out: Gets it, shape (n + 1,) [m^2/s^2].
    """
    m, r = stations.shape[2], stations.shape[1] - BASIS
    p, k = m * _kinds(limits) + bounds.shape[1] + 1, 2 + r
    rows, low, high = np.empty((p, k)), np.empty(p), np.empty(p)
    z, cost = np.empty(k), np.zeros(k)
    cost[1] = -1.0
    for i in range(stations.shape[0]):
        rows[:] = 0.0
        at = _write_station(
            stations[i], bounds[i], limits, 0.0, as_number(2), as_number(0), rows, low, high
        )
        rows[at, 1], low[at], high[at] = 1.0, 0.0, fastest[i]
        z[:] = 0.0
        for j in range(r):
            z[2 + j] = etas[i, j]
        good = margins[i] >= 0.0 and lowest_point(cost, rows, low, high, z)
        out[i] = z[1] if good else np.nan
