"""Numba kernels: the balance of a platform, and the largest margin of its tensions, with gradients.

The balance of cables and motion is b = -F - sum_i t_i (r_i x u_i, u_i): the wrench of the cables
less the one that the motion needs, 0 where tensions t give the motion. Its derivative by seeds
(`pose_coordinates_kernel`) is exact, pulleys included.

The margin is the largest s with b = 0 and lower + s <= t <= upper - s. It is a linear program; its
derivative is that of b by the seeds, weighted by the multipliers of b (envelope theorem):

    ds = lambda' db,   from   -G' lambda = mu_low - mu_up,   sum(mu_low + mu_up) = 1,

G the columns (r_i x u_i, u_i). Where the optimum has several sets of multipliers, s has a kink, and
one of its one-sided derivatives is given.

Source: Borgstrom et al., Rapid computation of optimally safe tension distributions for parallel
cable-driven robots, 2009; Rockafellar, Convex Analysis, 1970, for derivatives of optimal values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import DAMPING, POINT_MASS
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line, unit_vector_derivative
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute
from cdpr_drake.numerics.linear_program_kernel import lowest_point
from cdpr_drake.planning.cable_derivatives_kernel import axis, cross, dot
from cdpr_drake.tensions.quadratic_program_kernel import factor, null_space

SHIFT = 1e-7
"""Of a bound, relative to the range of tensions: at a kink bounds are shifted by multiples of this,
so that the multipliers are those of one side of it."""

BALANCED = 1e-9
"""Multipliers that are below zero by more than this are none."""


@njit(cache=True, inline="always")
def _plus(a: Any, b: Any) -> Any:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True, inline="always")
def _minus(a: Any, b: Any) -> Any:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit(cache=True, inline="always")
def _scaled(s: float, a: Any) -> Any:
    return (s * a[0], s * a[1], s * a[2])


@njit(cache=True)
def _inertia(X: Any, dynamics: Array, a: Any) -> Any:
    """R I R' a, I the rotational inertia about Po in P."""
    x = X[0] * a[0] + X[3] * a[1] + X[6] * a[2]
    y = X[1] * a[0] + X[4] * a[1] + X[7] * a[2]
    z = X[2] * a[0] + X[5] * a[1] + X[8] * a[2]
    xx, yy, zz, xy, xz, yz = dynamics[4:10]
    lx, ly, lz = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
    return (
        X[0] * lx + X[1] * ly + X[2] * lz,
        X[3] * lx + X[4] * ly + X[5] * lz,
        X[6] * lx + X[7] * ly + X[8] * lz,
    )


@njit(cache=True)
def needed_wrench(point: Array, dynamics: Array, F: Array, G: Array) -> None:
    """Writes the wrench that a motion needs, shape (6,) [N m, N], and its derivative by the seeds.

    The wrench is that of `task_space.floating_wrench` without gains, or of a point mass.

    Args:
        point: A point of the motion, shape (19,).
        dynamics: `PlatformDynamics.packed`.
        F: Gets the wrench.
        G: Gets its derivative, shape (6, 18).
    """
    X = floating_motion(point)
    mass, gravity, moves = dynamics[0], dynamics[10], dynamics[11:]
    point_mass = dynamics[POINT_MASS] != 0.0
    by_move, by_turn = dynamics[DAMPING], dynamics[DAMPING + 1]
    p = (dynamics[1], dynamics[2], dynamics[3])
    c = (
        X[0] * p[0] + X[1] * p[1] + X[2] * p[2],
        X[3] * p[0] + X[4] * p[1] + X[5] * p[2],
        X[6] * p[0] + X[7] * p[1] + X[8] * p[2],
    )
    w = (point[7], point[8], point[9])
    alpha = (point[13], point[14], point[15])
    lifted = (point[16], point[17], point[18] + gravity)
    wc = cross(w, c)
    f = _scaled(mass, _plus(lifted, _plus(cross(alpha, c), cross(w, wc))))
    f = _plus(f, _scaled(by_move, (point[10], point[11], point[12])))
    Iw, Ia = _inertia(X, dynamics, w), _inertia(X, dynamics, alpha)
    if point_mass:
        f = (moves[3] * f[0], moves[4] * f[1], moves[5] * f[2])
        n = cross(c, f)
    else:
        n = _plus(_plus(Ia, cross(w, Iw)), cross(c, _scaled(mass, lifted)))
        n = _plus(n, _scaled(by_turn, w))
    for i in range(3):
        F[i], F[3 + i] = moves[i] * n[i], moves[3 + i] * f[i]
    zero = (0.0, 0.0, 0.0)
    G[:] = 0.0
    for part in range(5):
        for j in range(3):
            one = axis(j)
            turn = one if part == 0 else zero
            dw = one if part == 1 else zero
            da = one if part == 2 else zero
            dl = one if part == 3 else zero
            dc = cross(turn, c)
            df = _plus(dl, _plus(cross(da, c), cross(alpha, dc)))
            df = _plus(df, cross(dw, wc))
            df = _scaled(mass, _plus(df, cross(w, _plus(cross(dw, c), cross(w, dc)))))
            if part == 4:
                df = _scaled(by_move, one)
            if point_mass:
                df = (moves[3] * df[0], moves[4] * df[1], moves[5] * df[2])
                dn = _plus(cross(dc, f), cross(c, df))
            else:
                dIw = _inertia(X, dynamics, _minus(dw, cross(turn, w)))
                dIw = _plus(dIw, cross(turn, Iw))
                dIa = _inertia(X, dynamics, _minus(da, cross(turn, alpha)))
                dIa = _plus(dIa, cross(turn, Ia))
                dn = _plus(dIa, _plus(cross(dw, Iw), cross(w, dIw)))
                dn = _plus(dn, _scaled(mass, _plus(cross(dc, lifted), cross(c, dl))))
                dn = _plus(dn, _scaled(by_turn, dw))
            seed = j
            if part == 1:
                seed = 6 + j
            elif part == 2:
                seed = 12 + j
            elif part == 3:
                seed = 15 + j
            elif part == 4:
                seed = 9 + j
            for i in range(3):
                G[i, seed], G[3 + i, seed] = moves[i] * dn[i], moves[3 + i] * df[i]


@njit(cache=True, error_model="numpy")
def add_pull(X: Any, cable: Array, tension: float, D: Array, G: Array) -> None:
    """G -= derivative of tension (r x u, u) by the seeds, shape (6, 18); D is work space (3, 3)."""
    _, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    unit_vector_derivative(X, cable, D)
    u, r = (ux, uy, uz), (rx, ry, rz)
    for j in range(6):
        k = j % 3
        one = axis(k)
        dr = cross(one, r)
        dB = dr if j < 3 else one
        du = (dot(D[0], dB), dot(D[1], dB), dot(D[2], dB))
        dm = cross(r, du)
        if j < 3:
            dm = _plus(dm, cross(dr, u))
        for i in range(3):
            G[i, j] -= tension * dm[i]
            G[3 + i, j] -= tension * du[i]


@njit(cache=True, error_model="numpy")
def pulls(X: Any, cables: Array, P: Array) -> None:
    """Writes the columns (r_i x u_i, u_i), shape (6, m)."""
    for i in range(cables.shape[0]):
        _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        P[0, i], P[1, i], P[2, i] = ry * uz - rz * uy, rz * ux - rx * uz, rx * uy - ry * ux
        P[3, i], P[4, i], P[5, i] = ux, uy, uz


@njit(cache=True, error_model="numpy")
def balances(
    points: Array, cables: Array, dynamics: Array, rows: np.ndarray, tensions: Array,
    values: Array, slopes: Array, columns: Array,
) -> None:  # fmt: skip
    """Writes balances and their derivatives.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        dynamics: `PlatformDynamics.packed`.
        rows: Components of a wrench that count, shape (n,), whole numbers.
        tensions: Shape (N, m) [N].
        values: Gets the balances, shape (N, n) [N m, N].
        slopes: Gets their derivatives by the seeds, shape (N, n, 18).
        columns: Gets those by the tensions, shape (N, n, m).
    """
    m = cables.shape[0]
    F, G, P, D = np.empty(6), np.empty((6, 18)), np.empty((6, m)), np.empty((3, 3))
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        needed_wrench(points[k], dynamics, F, G)
        for i in range(6):
            F[i] = -F[i]
            for j in range(18):
                G[i, j] = -G[i, j]
        pulls(X, cables, P)
        for j in range(m):
            add_pull(X, cables[j], tensions[k, j], D, G)
            for i in range(6):
                F[i] -= P[i, j] * tensions[k, j]
        for i in range(rows.shape[0]):
            values[k, i] = F[rows[i]]
            for j in range(18):
                slopes[k, i, j] = G[rows[i], j]
            for j in range(m):
                columns[k, i, j] = -P[rows[i], j]


@njit(cache=True)
def _largest_margin(base: Array, N: Array, lower: Array, upper: Array, x: Array) -> bool:
    """x <- (eta, s) with the largest s, lower + s <= base + N' eta <= upper - s."""
    r, m = N.shape
    cost = np.zeros(r + 1)
    rows, low, high = np.zeros((2 * m, r + 1)), np.empty(2 * m), np.empty(2 * m)
    cost[r] = -1.0
    x[:] = 0.0
    for i in range(m):
        for j in range(r):
            x[j] += N[j, i] * 0.5 * (lower[i] + upper[i])
            rows[i, j] = rows[m + i, j] = N[j, i]
        rows[i, r], rows[m + i, r] = -1.0, 1.0
        low[i], high[i] = lower[i] - base[i], np.inf
        low[m + i], high[m + i] = -np.inf, upper[i] - base[i]
    x[r] = np.inf
    for i in range(m):
        t = base[i]
        for j in range(r):
            t += N[j, i] * x[j]
        x[r] = min(x[r], t - lower[i], upper[i] - t)
    return lowest_point(cost, rows, low, high, x)


@njit(cache=True)
def _bound_forces(
    base: Array, N: Array, lower: Array, upper: Array, x: Array, forces: Array
) -> float:
    """Writes mu_low - mu_up of the r + 1 nearest bounds, shape (m,); returns the least mu."""
    r, m = N.shape
    room = np.empty(2 * m)
    for i in range(m):
        t = base[i]
        for j in range(r):
            t += N[j, i] * x[j]
        room[i], room[m + i] = t - lower[i] - x[r], upper[i] - t - x[r]
    active = np.argsort(room)[: r + 1]
    A, mu, pivots = np.empty((r + 1, r + 1)), np.zeros(r + 1), np.zeros(r + 1)
    for k in range(r + 1):
        i, sign = active[k] % m, 1.0 if active[k] < m else -1.0
        for j in range(r):
            A[j, k] = sign * N[j, i]
        A[r, k] = 1.0
    mu[r] = 1.0
    eliminate(A, r + 1, pivots)
    substitute(A, r + 1, pivots, mu)
    forces[:] = 0.0
    least = np.inf
    for k in range(r + 1):
        sign = 1.0 if active[k] < m else -1.0
        forces[active[k] % m] += sign * mu[k]
        least = min(least, mu[k] if np.isfinite(mu[k]) else -np.inf)
    return least


@njit(cache=True)
def margin_with_multipliers(
    W: Array, F: Array, lower: Array, upper: Array, t: Array, multipliers: Array
) -> float:
    """Largest s with W t = F and lower + s <= t <= upper - s [N]; NaN where W is singular.

    Args:
        W: Columns of wrenches of unit tensions, shape (n, m), n <= m.
        F: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        t: Gets the tensions, shape (m,) [N].
        multipliers: Gets lambda with ds = lambda' d(F - W t), t fixed, shape (n,).
    """
    n, m = W.shape
    r = m - n
    base, N = np.empty(m), np.empty((r, m))
    wanted = np.empty(n)
    for i in range(n):
        wanted[i] = -F[i]
    if not null_space(W, wanted, base, N):
        return np.nan
    x, forces = np.empty(r + 1), np.empty(m)
    if not _largest_margin(base, N, lower, upper, x):
        return np.nan
    s = float(x[r])
    for i in range(m):
        t[i] = base[i]
        for j in range(r):
            t[i] += N[j, i] * x[j]
    if _bound_forces(base, N, lower, upper, x, forces) < -BALANCED:
        # More bounds are touched than are needed: shifted, they are touched one after the other.
        low, high = np.empty(m), np.empty(m)
        for i in range(m):
            by = SHIFT * (upper[i] - lower[i])
            low[i] = lower[i] - by * (1.0 + ((i * 7) % 11) / 11.0)
            high[i] = upper[i] + by * (1.0 + ((i * 5 + 3) % 13) / 13.0)
        _largest_margin(base, N, low, high, x)
        _bound_forces(base, N, low, high, x, forces)
    # W' lambda = forces: the transposed of the factor's triangle, by its normal equations in QR.
    A = np.empty((n, m + 2))
    factor(W, A)
    _solve_transposed(A, forces, multipliers)
    return s


@njit(cache=True)
def _solve_transposed(A: Array, right: Array, out: Array) -> None:
    """out <- lambda with W' lambda = right, from the factors W = L Q' of `factor`."""
    n = A.shape[0]
    m = A.shape[1] - 2
    y = np.empty(m)
    for j in range(m):
        y[j] = right[j]
    for k in range(n):  # Q' right
        d = 0.0
        for j in range(k, m):
            d += A[k, j] * y[j]
        d *= A[k, m + 1]
        for j in range(k, m):
            y[j] -= d * A[k, j]
    for k in range(n - 1, -1, -1):
        value = y[k]
        for i in range(k + 1, n):
            value -= A[i, k] * out[i]
        out[k] = value / A[k, m]


@njit(cache=True, error_model="numpy")
def margins(
    points: Array, cables: Array, dynamics: Array, rows: np.ndarray, lower: Array, upper: Array,
    values: Array, slopes: Array, tensions: Array,
) -> None:  # fmt: skip
    """Writes the margins of the tensions at points, and their derivatives.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        dynamics: `PlatformDynamics.packed`.
        rows: Components of a wrench that count, shape (n,), whole numbers.
        lower: Bounds of the tensions, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        values: Gets the margins, shape (N, 1) [N]; NaN where a cable cannot run or the wrench
            matrix is singular.
        slopes: Gets their derivatives by the seeds, shape (N, 1, 18).
        tensions: Gets the tensions that have them, shape (N, m) [N].
    """
    m, n = cables.shape[0], rows.shape[0]
    F, G, P, D = np.empty(6), np.empty((6, 18)), np.empty((6, m)), np.empty((3, 3))
    W, wanted, multipliers = np.empty((n, m)), np.empty(n), np.empty(n)
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        needed_wrench(points[k], dynamics, F, G)
        pulls(X, cables, P)
        finite = True
        for i in range(n):
            wanted[i] = -F[rows[i]]
            for j in range(m):
                W[i, j] = P[rows[i], j]
                finite = finite and np.isfinite(W[i, j])
        values[k, 0] = np.nan
        slopes[k] = np.nan
        if not finite:
            tensions[k] = np.nan
            continue
        s = margin_with_multipliers(W, wanted, lower, upper, tensions[k], multipliers)
        values[k, 0] = s
        if not np.isfinite(s):
            continue
        for i in range(6):
            for j in range(18):
                G[i, j] = -G[i, j]
        for j in range(m):
            add_pull(X, cables[j], tensions[k, j], D, G)
        for j in range(18):
            slopes[k, 0, j] = 0.0
            for i in range(n):
                slopes[k, 0, j] += multipliers[i] * G[rows[i], j]
