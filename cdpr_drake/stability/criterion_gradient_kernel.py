"""Gradient of v' Pi v over the perturbation, for a fixed v, and the perturbation that it asks for.

With w = (J^+)' K_l' v and z = K_r v, v' Pi v is the sum over the cables of w_i (J_hat z)_i, and
(J_hat z)_i = u_i . n_i: the unit vector of the cable times the velocity n_i = z_v + z_w x b_i of
the anchor point, b_i seen from the camera. Each perturbation moves the vector q_i from exit to
anchor point, turns u_i into the camera's frame, or moves b_i. A perturbed pseudo-inverse adds
d(J^+) = -J^+ dJ J^+ + (J'J)^-1 dJ' (I - J J^+), two more sums of the same kind.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CASE_TYPE,
    ROWS_TYPE,
    WORK_TYPE,
    CaseArrays,
    PoseRows,
    Work,
    moves_object,
)
from cdpr_drake.stability.criterion_kernel import interaction_pair, turn_after
from cdpr_drake.stability.perturbation_samples_kernel import COMMON, CORNERS, SINGLE
from cdpr_drake.stability.stability_case import IBVS

DIFFERENCE_STEP = 1e-6
"""Step of the central differences of the interaction matrix over the object's pose [m, rad]."""


@njit(cache=True, error_model="numpy")
def _cross_add(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, f: float, g: Array, at: int
) -> None:
    """g[at : at + 3] += f a x b."""
    g[at] += f * (ay * bz - az * by)
    g[at + 1] += f * (az * bx - ax * bz)
    g[at + 2] += f * (ax * by - ay * bx)


@njit(cache=True, error_model="numpy")
def _turned_back(phi: Array, g: Array, at: int) -> None:
    """g[at : at + 3] <- J_r(phi)' g, from body turns after exp(phi) to changes of phi."""
    x, y, z = phi[0], phi[1], phi[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if theta < 1e-4:
        a, b = 0.5, 1.0 / 6.0
    else:
        a, b = (1.0 - np.cos(theta)) / square, (theta - np.sin(theta)) / (square * theta)
    gx, gy, gz = g[at], g[at + 1], g[at + 2]
    cx, cy, cz = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
    g[at] = gx + a * cx + b * (y * cz - z * cy)
    g[at + 1] = gy + a * cy + b * (z * cx - x * cz)
    g[at + 2] = gz + a * cz + b * (x * cy - y * cx)


@shared(types.void(*[MATRIX] * 3, VECTOR, MATRIX, *[VECTOR] * 5))
@njit(cache=True, error_model="numpy")
def add_camera_gradient(
    A: Array,
    B: Array,
    C: Array,
    t: Array,
    R: Array,
    p: Array,
    d: Array,
    weights: Array,
    z: Array,
    g: Array,
) -> None:
    """g += gradient of sum_i weights_i (J z)_i over d, body turns for the two rotations.

    Arguments as `CaseArrays` and `Work` have them: tuples of so many arrays cost more to compile.
    """
    m = A.shape[0]
    turn, place = as_number(0), as_number(9)  # of the platform, and of the camera on it
    Rd, Cd = np.empty((3, 3)), np.empty((3, 3))
    turn_after(R, d[0:3], Rd)
    turn_after(C, d[6:9], Cd)
    tx, ty, tz = t[0] + d[9], t[1] + d[10], t[2] + d[11]
    for i in range(m):
        a, b = 18 + 3 * i, 18 + 3 * (m + i)
        bx, by, bz = B[i, 0] + d[b], B[i, 1] + d[b + 1], B[i, 2] + d[b + 2]  # in P
        Qx = p[0] + d[3] + Rd[0, 0] * bx + Rd[0, 1] * by + Rd[0, 2] * bz - A[i, 0] - d[a]
        Qy = p[1] + d[4] + Rd[1, 0] * bx + Rd[1, 1] * by + Rd[1, 2] * bz - A[i, 1] - d[a + 1]
        Qz = p[2] + d[5] + Rd[2, 0] * bx + Rd[2, 1] * by + Rd[2, 2] * bz - A[i, 2] - d[a + 2]
        qx = Rd[0, 0] * Qx + Rd[1, 0] * Qy + Rd[2, 0] * Qz  # in P
        qy = Rd[0, 1] * Qx + Rd[1, 1] * Qy + Rd[2, 1] * Qz
        qz = Rd[0, 2] * Qx + Rd[1, 2] * Qy + Rd[2, 2] * Qz
        f = 1.0 / np.sqrt(qx * qx + qy * qy + qz * qz)
        ux, uy, uz = f * qx, f * qy, f * qz
        # In P: the turn z_w and the anchor's velocity n.
        ox = Cd[0, 0] * z[0] + Cd[0, 1] * z[1] + Cd[0, 2] * z[2]
        oy = Cd[1, 0] * z[0] + Cd[1, 1] * z[1] + Cd[1, 2] * z[2]
        oz = Cd[2, 0] * z[0] + Cd[2, 1] * z[1] + Cd[2, 2] * z[2]
        rx, ry, rz = bx - tx, by - ty, bz - tz
        nx = Cd[0, 0] * z[3] + Cd[0, 1] * z[4] + Cd[0, 2] * z[5] + oy * rz - oz * ry
        ny = Cd[1, 0] * z[3] + Cd[1, 1] * z[4] + Cd[1, 2] * z[5] + oz * rx - ox * rz
        nz = Cd[2, 0] * z[3] + Cd[2, 1] * z[4] + Cd[2, 2] * z[5] + ox * ry - oy * rx
        s = weights[i]
        un = ux * nx + uy * ny + uz * nz
        hx, hy, hz = s * f * (nx - un * ux), s * f * (ny - un * uy), s * f * (nz - un * uz)
        Hx = Rd[0, 0] * hx + Rd[0, 1] * hy + Rd[0, 2] * hz  # in W
        Hy = Rd[1, 0] * hx + Rd[1, 1] * hy + Rd[1, 2] * hz
        Hz = Rd[2, 0] * hx + Rd[2, 1] * hy + Rd[2, 2] * hz
        g[3] += Hx
        g[4] += Hy
        g[5] += Hz
        g[a] -= Hx
        g[a + 1] -= Hy
        g[a + 2] -= Hz
        g[b] += hx
        g[b + 1] += hy
        g[b + 2] += hz
        _cross_add(ux, uy, uz, ox, oy, oz, s, g, b)
        _cross_add(ux, uy, uz, ox, oy, oz, -s, g, place)
        _cross_add(bx, by, bz, hx, hy, hz, 1.0, g, turn)
        _cross_add(ux, uy, uz, nx, ny, nz, -s, g, turn)
        # A body turn of the camera, in C: first in P, then turned.
        kx, ky, kz = uy * oz - uz * oy, uz * ox - ux * oz, ux * oy - uy * ox
        vx = -s * (uy * nz - uz * ny + ry * kz - rz * ky)
        vy = -s * (uz * nx - ux * nz + rz * kx - rx * kz)
        vz = -s * (ux * ny - uy * nx + rx * ky - ry * kx)
        g[6] += Cd[0, 0] * vx + Cd[1, 0] * vy + Cd[2, 0] * vz
        g[7] += Cd[0, 1] * vx + Cd[1, 1] * vy + Cd[2, 1] * vz
        g[8] += Cd[0, 2] * vx + Cd[1, 2] * vy + Cd[2, 2] * vz


@njit(cache=True, error_model="numpy")
def _times(X: Array, v: Array) -> Array:
    out = np.zeros(X.shape[0])
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            out[i] += X[i, j] * v[j]
    return out


@njit(cache=True, error_model="numpy")
def _transposed_times(X: Array, v: Array) -> Array:
    out = np.zeros(X.shape[1])
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            out[j] += X[i, j] * v[i]
    return out


@shared(types.void(CASE_TYPE, ROWS_TYPE, types.int64, *[VECTOR] * 4))
@njit(cache=True, error_model="numpy")
def _add_object_gradient(
    case: CaseArrays,
    rows: PoseRows,
    n: int,
    d: Array,
    left: Array,
    right: Array,
    g: Array,
) -> None:
    """g += gradient of left' L(d) right over the object's pose, by central differences of L."""
    shape = (len(left), 6)
    low, high, other = np.empty(shape), np.empty(shape), np.empty((6, len(left)))
    at = d.copy()
    for k in range(12, 18):
        if case.radii[k // 3] == 0.0:
            continue
        for sign in (-1.0, 1.0):
            at[k] = d[k] + sign * DIFFERENCE_STEP
            interaction_pair(
                case.scheme, case.planar, case.lever, at, rows.theta_u[n], rows.error[n],
                rows.p_CO[n], rows.R_CO[n], case.p_OK, low if sign < 0.0 else high, other,
            )  # fmt: skip
        at[k] = d[k]
        for i in range(shape[0]):
            for j in range(6):
                g[k] += left[i] * (high[i, j] - low[i, j]) / (2.0 * DIFFERENCE_STEP) * right[j]


@shared(
    types.void(
        *[MATRIX] * 3, VECTOR, MATRIX, VECTOR, *[MATRIX] * 3, types.boolean, *[VECTOR] * 3
    )
)  # fmt: skip
@njit(cache=True, error_model="numpy")
def gradient_known_object(
    A: Array, B: Array, C: Array, t: Array, R: Array, p: Array, L: Array, Li: Array, M: Array,
    local: bool, d: Array, v: Array, g: Array,
) -> None:  # fmt: skip
    """As `gradient` where the estimate is perturbed and the object known: what most questions need.

    Arguments as `CaseArrays` and `Work` have them; `local` says whether the scheme is IBVS.
    """
    g[:] = 0.0
    if local:
        left, z = v.copy(), v.copy()
    else:
        left, z = _transposed_times(L, v), _times(Li, v)
    add_camera_gradient(A, B, C, t, R, p, d, _transposed_times(M, left), z, g)
    _turned_back(d[0:3], g, as_number(0))
    _turned_back(d[6:9], g, as_number(6))


@shared(types.void(CASE_TYPE, ROWS_TYPE, types.int64, WORK_TYPE, *[VECTOR] * 3))
@njit(cache=True, error_model="numpy")
def gradient(
    case: CaseArrays, rows: PoseRows, n: int, w: Work, d: Array, v: Array, g: Array
) -> None:
    """g <- gradient of v' Pi v over d, shape (18 + 6 m,).

    `evaluate` has just seen d; where `evaluate_quick` is used instead, it need not have, since
    what the perturbation changes is not read then.
    """
    moved = moves_object(case)
    A, B, C, t, R, p = case.A, case.B, case.C, case.t, w.R, w.p
    if not (moved or case.truth):
        local = case.scheme == IBVS
        gradient_known_object(A, B, C, t, R, p, w.L, w.Lid, w.M, local, d, v, g)
        return
    g[:] = 0.0
    L_true, L_hat_inverse = (w.Ld, w.Li) if case.truth else (w.L, w.Lid)
    J_true_inverse = w.Md if case.truth else w.M
    J_hat = w.J if case.truth else w.Jd
    if case.scheme == IBVS:
        left, z = v.copy(), v.copy()
        if moved:
            left = _transposed_times(L_true, _transposed_times(L_hat_inverse, v))
    else:
        left, z = _transposed_times(L_true, v), _times(L_hat_inverse, v)
    weights = _transposed_times(J_true_inverse, left)
    if case.truth:
        y = _times(J_hat, z)
        x = _times(J_true_inverse, y)
        add_camera_gradient(A, B, C, t, R, p, d, -weights, x, g)
        # (J'J)^-1 left = J^+ (J^+)' left
        rest = y - _times(w.Jd, x)
        add_camera_gradient(A, B, C, t, R, p, d, rest, _times(J_true_inverse, weights), g)
    else:
        add_camera_gradient(A, B, C, t, R, p, d, weights, z, g)
    _turned_back(d[0:3], g, as_number(0))
    _turned_back(d[6:9], g, as_number(6))
    if not moved:
        return
    if case.scheme != IBVS:
        if case.truth:
            _add_object_gradient(case, rows, n, d, v, _times(w.X, z), g)
        else:
            back = _transposed_times(L_hat_inverse, _transposed_times(w.X, left))
            _add_object_gradient(case, rows, n, d, -back, z, g)
        return
    x = _times(w.X, v)
    if case.truth:
        _add_object_gradient(case, rows, n, d, _transposed_times(w.Li, v), x, g)
    else:
        y = _times(w.L, x)
        u = _transposed_times(w.Lid, v)
        fit = _times(w.Lid, y)
        _add_object_gradient(case, rows, n, d, -u, fit, g)
        _add_object_gradient(case, rows, n, d, y - _times(w.Ld, fit), _times(w.Lid, u), g)


@njit(cache=True, error_model="numpy")
def _ball_step(g: Array, at: int, radius: float, planar: bool, turn: bool, out: Array) -> None:
    gx, gy, gz = g[at], g[at + 1], g[at + 2]
    if planar and turn:
        gx, gy = 0.0, 0.0
    elif planar:
        gz = 0.0
    norm = np.sqrt(gx * gx + gy * gy + gz * gz)
    if norm > 0.0:
        f = -radius / norm
        out[at], out[at + 1], out[at + 2] = f * gx, f * gy, f * gz
    else:
        out[at], out[at + 1], out[at + 2] = 0.0, 0.0, 0.0


@shared(types.void(types.int64, types.boolean, VECTOR, types.int64[::1], VECTOR, VECTOR))
@njit(cache=True, error_model="numpy")
def steepest_into(
    m: int, planar: bool, radii: Array, directions: np.ndarray, g: Array, out: Array
) -> None:
    """out <- the perturbation of m cables within the bounds with the smallest g' d."""
    for block in range(6):
        _ball_step(g, 3 * block, radii[block], planar, block % 2 == 0, out)
    total = np.empty(3)
    shift = m < 0  # no turn; a False written out would compile `_ball_step` once more
    for part in range(2):
        at, radius = 18 + 3 * m * part, radii[6 + part]
        if directions[part] == COMMON:
            total[:] = 0.0
            for i in range(m):
                for j in range(3):
                    total[j] += g[at + 3 * i + j]
            _ball_step(total, as_number(0), radius, planar, shift, total)
            for i in range(m):
                for j in range(3):
                    out[at + 3 * i + j] = total[j]
        elif directions[part] == CORNERS:
            for i in range(3 * m):
                flat = planar and i % 3 == 2
                out[at + i] = 0.0 if flat else -radius * np.sign(g[at + i])
        else:
            for i in range(m):
                _ball_step(g, at + 3 * i, radius, planar, shift, out)
            if directions[part] == SINGLE:
                _keep_steepest(g, at, m, out)


@njit(cache=True, error_model="numpy")
def _keep_steepest(g: Array, at: int, m: int, out: Array) -> None:
    """Sets all shifts of points to zero, but the one with the smallest g' d."""
    best, least = 0, np.inf
    for i in range(m):
        value = 0.0
        for k in range(at + 3 * i, at + 3 * i + 3):
            value += g[k] * out[k]
        if value < least:
            best, least = i, value
    for i in range(m):
        if i != best:
            for k in range(at + 3 * i, at + 3 * i + 3):
                out[k] = 0.0
