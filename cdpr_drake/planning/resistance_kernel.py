"""Numba kernels: what a set of wrenches leaves a motion, at points of a path.

Under each corner w_k of the set the cables may pull as they want, with tensions of their own:

    W t_k + w(u, x) + w_k = 0,    lower_k <= t_k <= upper_k,

with w(u, x) the wrench of the motion, u = d2s/dt2 and x = (ds/dt)^2. Such tensions exist where
along every facet normal c of the wrenches that cables can give, with y = W'c,

    y'(T_0 + T_u u + T_x x) + max_k(-c'w_k) <= sum_i max(y_i lower_i, y_i upper_i),

so that a corner costs no variable, and any number of corners one number. A torque bounds a tension
by another line in (u, x): each cable with y_i != 0 then takes either bound, and all choices are
rows. That no cable's own bounds cross is asked of the motion alone.

Source: Bouchard, Gosselin and Moore, On the ability of a cable-driven robot to generate a
prescribed set of wrenches, 2010; that rows y are enough: Rockafellar, The elementary vectors of a
subspace of R^N, 1969.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.planning.limits import INERTIA, LOWER, RATIO, TORQUE, UPPER
from cdpr_drake.planning.margin_kernel import margin
from cdpr_drake.planning.station_kernel import BASIS, BEND, RATE, T_0, T_U, T_X
from cdpr_drake.workspaces.wrench_facets_kernel import facet_normals

BY_U, BY_X, ROOM, SCALE = range(4)
"""Columns of a row: BY_U u + BY_X x <= ROOM [N], and by how much the room shrinks for each half
range by which all limits are moved in [N]."""


@njit(cache=True)
def resistance_rows(
    stations: Array, W: Array, corners: Array, limits: Array, others: Array,
    terms: Array, starts: Array, out: Array,
) -> None:  # fmt: skip
    """Writes what a set of wrenches leaves (u, x) at points of a path.

    Args:
        stations: Rows of `stations_of`, shape (n, 5 + r, m).
        W: Wrench matrices there, in the rows that the platform can move, shape (n, f, m).
        corners: Of the set in these rows, shape (k, f) [N m, N].
        limits: `MotionLimits.packed`.
        others: Cables that each normal's choice leaves, in the order of `itertools.combinations` of
            the f - 1 others, shape (g, m - f + 1).
        terms: Of `wedge_terms(f)`.
        starts: Of `wedge_terms(f)`.
        out: Gets the rows, shape (n, 2 g, 4), or (n, 2 g 2^(m - f + 1), 4) with a limit of torque.
    """
    n, f = W.shape[:2]
    g, left = others.shape
    motors = limits[TORQUE] < np.inf
    ways = 2**left if motors else 1
    half = 0.5 * (limits[UPPER] - limits[LOWER])
    span = limits[TORQUE] / limits[RATIO]
    mass = limits[INERTIA] / limits[RATIO] ** 2
    wedge, chosen = np.empty((f + 1, 20)), np.empty(f, np.int64)
    normals, y = np.empty((g, f)), np.empty(left)
    for i in range(n):
        S = stations[i]
        facet_normals(W[i], terms, starts, wedge, chosen, normals)
        at = 0
        for k in range(g):
            size = 0.0
            for q in range(left):
                y[q] = 0.0
                for row in range(f):
                    y[q] += normals[k, row] * W[i, row, others[k, q]]
                size += abs(y[q])
            for sign in (1.0, -1.0):
                needed = -np.inf
                for c in range(corners.shape[0]):
                    along = 0.0
                    for row in range(f):
                        along -= normals[k, row] * corners[c, row]
                    needed = max(needed, sign * along)
                for way in range(ways):
                    bound = out[i, at]
                    at += 1
                    if size == 0.0:  # these columns determine no facet
                        bound[BY_U], bound[BY_X], bound[ROOM], bound[SCALE] = 0.0, 0.0, np.inf, 1.0
                        continue
                    by_u, by_x, room, scale = 0.0, 0.0, -needed / size, 0.0
                    for q in range(left):
                        j, value = others[k, q], sign * y[q] / size
                        by_u += value * S[T_U, j]
                        by_x += value * S[T_X, j]
                        room -= value * S[T_0, j]
                        if way >> q & 1:  # the bound of the torque
                            by_u -= value * mass * S[RATE, j]
                            by_x -= value * mass * S[BEND, j]
                            room += abs(value) * span
                            scale += abs(value) * span
                        else:
                            room += value * (limits[UPPER] if value > 0.0 else limits[LOWER])
                            scale += abs(value) * half
                    bound[BY_U], bound[BY_X], bound[ROOM], bound[SCALE] = by_u, by_x, room, scale


@njit(cache=True)
def resistance_margins(rows: Array, u: Array, x: Array, margins: Array, worst: Array) -> None:
    """Writes how far a motion is from what a set of wrenches leaves it.

    Args:
        rows: Of `resistance_rows`, shape (n, p, 4).
        u: d2s/dt2, shape (n,) [m/s^2].
        x: (ds/dt)^2, shape (n,) [m^2/s^2].
        margins: Gets the largest d so that tensions under every corner keep d half ranges away from
            their limits, see `margin_kernel.margin`, as far as more than one cable decides it: what
            a cable's own bounds leave each other is that of the motion alone. Negative where limits
            are missed; shape (n,).
        worst: Gets the rows that say so, whole numbers, shape (n,).
    """
    for i in range(rows.shape[0]):
        margins[i], worst[i] = 1.0, 0
        for k in range(rows.shape[1]):
            row = rows[i, k]
            d = (row[ROOM] - row[BY_U] * u[i] - row[BY_X] * x[i]) / row[SCALE]
            if d < margins[i]:
                margins[i], worst[i] = d, k


@njit(cache=True)
def corner_margins(
    stations: Array, responses: Array, u: Array, x: Array, limits: Array,
    margins: Array, where: Array,
) -> None:  # fmt: skip
    """Writes the margin of each corner where it is least along a motion, each by its own program.

    Args:
        stations: Rows of `stations_of`, shape (n, 5 + r, m).
        responses: Tensions that balance each corner, W t + w_k = 0, shape (n, k, m) [N].
        u: d2s/dt2, shape (n,) [m/s^2].
        x: (ds/dt)^2, shape (n,) [m^2/s^2].
        limits: `MotionLimits.packed`.
        margins: Gets the least margin of each corner, shape (k,); NaN: one was not solved.
        where: Gets at which station it is, whole numbers, shape (k,).
    """
    n, count, m = responses.shape
    t, growth = np.empty(m), np.empty(m)
    eta = np.zeros(stations.shape[1] - BASIS)
    margins[:] = np.inf
    where[:] = 0
    for i in range(n):
        S = stations[i]
        for k in range(count):
            for j in range(m):
                t[j] = S[T_0, j] + S[T_U, j] * u[i] + S[T_X, j] * x[i] + responses[i, k, j]
                growth[j] = S[RATE, j] * u[i] + S[BEND, j] * x[i]
            d = margin(t, growth, S[BASIS:], limits, eta)
            if not d >= margins[k]:
                margins[k], where[k] = d, i
