"""The stability criterion as numba kernels on packed arrays.

With J the map from camera twists in C to cable length rates, J = A Ad, the criterion is
Pi = K_l J^+ J_hat K_r, where K_l = L and K_r = L_hat^+, or K_l = L_hat^+ L and K_r = I for IBVS.
A planar robot is embedded: what it cannot move is the identity in J^+ J_hat and in L.

Source: servoing thesis (3.1), (3.8), (3.26); `criterion` is the plain form.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.rotation_kernel import rotation_into
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.servoing.interaction_matrix_kernel import (
    camera_pose_into,
    hybrid_into,
    object_pose_into,
    point_into,
    theta_u_into,
)
from cdpr_drake.stability.stability_case import IBVS, PBVS, PBVS_LINE

OUTSIDE = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
"""One where a planar robot cannot move, in a spatial vector (rotation, translation)."""

RANK_TOLERANCE = 1e-10
"""A Jacobian counts as singular when a pivot of J'J falls below this times its diagonal."""


@njit(cache=True, error_model="numpy")
def turn_after(R: Array, vector: Array, out: Array) -> None:
    """out <- R exp([vector]x)."""
    E = np.empty((3, 3))
    rotation_into(vector, E)
    for i in range(3):
        for j in range(3):
            out[i, j] = R[i, 0] * E[0, j] + R[i, 1] * E[1, j] + R[i, 2] * E[2, j]


@shared(types.void(MATRIX, VECTOR, *[MATRIX] * 3, VECTOR, VECTOR, MATRIX))
@njit(cache=True, error_model="numpy")
def camera_rows(
    R: Array, p: Array, A: Array, B: Array, C: Array, t: Array, d: Array, J: Array
) -> None:
    """J <- A Ad of a perturbed model, shape (m, 6), columns (w, v) of the camera's twist in C.

    Args:
        R: R_WP, shape (3, 3).
        p: p_WP, shape (3,) [m].
        A: p_WA transposed, shape (m, 3) [m].
        B: p_PB transposed, shape (m, 3) [m].
        C: R_PC, shape (3, 3).
        t: p_PC, shape (3,) [m].
        d: Perturbation, shape (18 + 6 m,).
        J: Output.
    """
    m = A.shape[0]
    Rd, Cd, D = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    turn_after(R, d[0:3], Rd)
    turn_after(C, d[6:9], Cd)
    for i in range(3):  # R_WC
        for j in range(3):
            D[i, j] = Rd[i, 0] * Cd[0, j] + Rd[i, 1] * Cd[1, j] + Rd[i, 2] * Cd[2, j]
    px, py, pz = p[0] + d[3], p[1] + d[4], p[2] + d[5]
    tx, ty, tz = t[0] + d[9], t[1] + d[10], t[2] + d[11]
    for i in range(m):
        a, b = 18 + 3 * i, 18 + 3 * (m + i)
        bx, by, bz = B[i, 0] + d[b], B[i, 1] + d[b + 1], B[i, 2] + d[b + 2]
        qx = px + Rd[0, 0] * bx + Rd[0, 1] * by + Rd[0, 2] * bz - A[i, 0] - d[a]
        qy = py + Rd[1, 0] * bx + Rd[1, 1] * by + Rd[1, 2] * bz - A[i, 1] - d[a + 1]
        qz = pz + Rd[2, 0] * bx + Rd[2, 1] * by + Rd[2, 2] * bz - A[i, 2] - d[a + 2]
        f = 1.0 / np.sqrt(qx * qx + qy * qy + qz * qz)
        ux = f * (D[0, 0] * qx + D[1, 0] * qy + D[2, 0] * qz)
        uy = f * (D[0, 1] * qx + D[1, 1] * qy + D[2, 1] * qz)
        uz = f * (D[0, 2] * qx + D[1, 2] * qy + D[2, 2] * qz)
        bx, by, bz = bx - tx, by - ty, bz - tz
        cx = Cd[0, 0] * bx + Cd[1, 0] * by + Cd[2, 0] * bz
        cy = Cd[0, 1] * bx + Cd[1, 1] * by + Cd[2, 1] * bz
        cz = Cd[0, 2] * bx + Cd[1, 2] * by + Cd[2, 2] * bz
        J[i, 0], J[i, 1], J[i, 2] = cy * uz - cz * uy, cz * ux - cx * uz, cx * uy - cy * ux
        J[i, 3], J[i, 4], J[i, 5] = ux, uy, uz


@shared(types.boolean(MATRIX, types.boolean, MATRIX))
@njit(cache=True, error_model="numpy")
def left_inverse(J: Array, planar: bool, M: Array) -> bool:
    """M <- J^+ = (J'J)^-1 J', shape (6, m); False where J has not full column rank.

    Of a planar robot the columns that it cannot move count as the identity: those rows of M are 0.
    """
    m, n = J.shape
    S, F = np.empty((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            x = 0.0
            for k in range(m):
                x += J[k, i] * J[k, j]
            S[i, j] = x
        if planar:
            S[i, i] += OUTSIDE[i]
    for j in range(n):  # Cholesky with a check of the rank
        x = S[j, j]
        for k in range(j):
            x -= F[j, k] * F[j, k]
        if not x > RANK_TOLERANCE * S[j, j]:
            return False
        F[j, j] = np.sqrt(x)
        for i in range(j + 1, n):
            y = S[i, j]
            for k in range(j):
                y -= F[i, k] * F[j, k]
            F[i, j] = y / F[j, j]
    for k in range(m):
        for i in range(n):
            x = J[k, i]
            for j in range(i):
                x -= F[i, j] * M[j, k]
            M[i, k] = x / F[i, i]
        for i in range(n - 1, -1, -1):
            x = M[i, k]
            for j in range(i + 1, n):
                x -= F[j, i] * M[j, k]
            M[i, k] = x / F[i, i]
    return True


@njit(cache=True, error_model="numpy", inline="always")
def rotation_vector_into(R: Array, out: Array) -> None:
    """out <- theta u of R, theta in [0, pi].

    Not `rotation_vector_of_matrix`, which allocates, and whose last digits control keeps.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    big = 0  # the largest component of the quaternion
    if trace < R[0, 0] or trace < R[1, 1] or trace < R[2, 2]:
        big = 1
        if R[1, 1] > R[0, 0]:
            big = 2
        if R[2, 2] > max(R[0, 0], R[1, 1]):
            big = 3
    if big == 0:
        w = 1.0 + trace
        x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    elif big == 1:
        w, x = R[2, 1] - R[1, 2], 1.0 + R[0, 0] - R[1, 1] - R[2, 2]
        y, z = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif big == 2:
        w, x = R[0, 2] - R[2, 0], R[0, 1] + R[1, 0]
        y, z = 1.0 + R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]
    else:
        w, x = R[1, 0] - R[0, 1], R[0, 2] + R[2, 0]
        y, z = R[1, 2] + R[2, 1], 1.0 + R[2, 2] - R[0, 0] - R[1, 1]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = np.sqrt(x * x + y * y + z * z)
    f = 2.0 * np.arctan2(norm, w) / norm if norm > 1e-300 else 0.0
    out[0], out[1], out[2] = f * x, f * y, f * z


@shared(types.void(VECTOR, VECTOR, MATRIX, VECTOR, MATRIX))
@njit(cache=True, error_model="numpy")
def _turn_object(d: Array, theta_u: Array, R_CO: Array, seen: Array, R: Array) -> None:
    """seen, R <- theta u of R_CdC, shape (3,), and R_CO, of an object that d turns.

    Of its own, as most questions know the object.
    """
    E, T, Q = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    rotation_into(d[12:15], E)
    rotation_into(theta_u, T)
    for i in range(3):
        for j in range(3):
            Q[i, j] = E[i, 0] * T[0, j] + E[i, 1] * T[1, j] + E[i, 2] * T[2, j]
    rotation_vector_into(Q, seen)
    for i in range(3):  # R_CdC = R_CdO R_OC, so R_CO becomes R_CO turned back by T' E' T
        for j in range(3):
            T[i, j] = R_CO[i, j]
    rotation_into(theta_u, Q)
    turn = np.empty(3)
    for i in range(3):  # -T' d
        turn[i] = -(Q[0, i] * d[12] + Q[1, i] * d[13] + Q[2, i] * d[14])
    rotation_into(turn, E)
    for i in range(3):
        for j in range(3):
            R[i, j] = E[i, 0] * T[0, j] + E[i, 1] * T[1, j] + E[i, 2] * T[2, j]


@njit(cache=True, error_model="numpy", inline="always")
def object_state(
    d: Array, theta_u: Array, error: Array, p_CO: Array, R_CO: Array, s: Array, R: Array
) -> None:
    """s, R <- the perturbed (theta u, error, p_CO), shape (3, 3), and R_CO, shape (3, 3)."""
    for j in range(3):
        s[0, j] = theta_u[j]
        s[1, j] = error[j] + d[15 + j]
        s[2, j] = p_CO[j] + d[15 + j]
    copy_matrix(R_CO, R)
    if d[12] != 0.0 or d[13] != 0.0 or d[14] != 0.0:
        _turn_object(d, theta_u, R_CO, s[0], R)


@njit(cache=True, error_model="numpy")
def interaction_into(scheme: int, s: Array, R_CO: Array, p_OK: Array, L: Array) -> None:
    """L <- the interaction matrix, shape (6, 6), or (2 k, 6) for k points of IBVS.

    Args:
        scheme: Code of the scheme.
        s: theta u of R_CdC [rad], lever of PBVS, p_CO [m], shape (3, 3).
        R_CO: Orientation of the object, shape (3, 3); for IBVS.
        p_OK: Points of the object, shape (3, k) [m]; for IBVS.
        L: Output.
    """
    if scheme == IBVS:
        for k in range(p_OK.shape[1]):
            X, Y, Z = s[2, 0], s[2, 1], s[2, 2]
            for j in range(3):
                X += R_CO[0, j] * p_OK[j, k]
                Y += R_CO[1, j] * p_OK[j, k]
                Z += R_CO[2, j] * p_OK[j, k]
            point_into(X / Z, Y / Z, Z, L, 2 * k)
        return
    if scheme == PBVS:
        object_pose_into(s[0], s[1], L)
        return
    R = np.empty((3, 3))
    rotation_into(s[0], R)
    if scheme == PBVS_LINE:
        camera_pose_into(s[0], R, L)
    else:
        hybrid_into(s[0], R, s[2, 0] / s[2, 2], s[2, 1] / s[2, 2], s[2, 2], L)


@shared(types.boolean(MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def _invert_hybrid(L: Array, Li: Array) -> bool:
    """The upper blocks of Li, whose lower right one is R', for the L of 2 1/2 D."""
    a, b, c = L[0, 0], L[0, 1], L[0, 2]
    e, f, g = L[1, 0], L[1, 1], L[1, 2]
    h, k, o = L[2, 0], L[2, 1], L[2, 2]
    determinant = a * (f * o - g * k) - b * (e * o - g * h) + c * (e * k - f * h)
    if not abs(determinant) > 1e-9:
        return False
    q = 1.0 / determinant
    Li[0, 0], Li[0, 1], Li[0, 2] = q * (f * o - g * k), q * (c * k - b * o), q * (b * g - c * f)
    Li[1, 0], Li[1, 1], Li[1, 2] = q * (g * h - e * o), q * (a * o - c * h), q * (c * e - a * g)
    Li[2, 0], Li[2, 1], Li[2, 2] = q * (e * k - f * h), q * (b * h - a * k), q * (a * f - b * e)
    U = np.empty((3, 3))  # the upper right block of L times R'
    for i in range(3):
        for j in range(3):
            U[i, j] = L[i, 3] * L[3 + j, 3] + L[i, 4] * L[3 + j, 4] + L[i, 5] * L[3 + j, 5]
    for i in range(3):
        for j in range(3):
            Li[i, 3 + j] = -(Li[i, 0] * U[0, j] + Li[i, 1] * U[1, j] + Li[i, 2] * U[2, j])
    return True


@njit(cache=True, error_model="numpy", inline="always")
def inverse_interaction_into(scheme: int, s: Array, L: Array, Li: Array) -> bool:
    """Li <- L^+, shape (6, f); False where L is singular. Closed forms where there are any.

    Args:
        scheme: Code of the scheme.
        s: Perturbed (theta u, lever, p_CO), shape (3, 3).
        L: Interaction matrix.
        Li: Output.
    """
    if scheme == IBVS:
        return left_inverse(L, False, Li)
    Li[:] = 0.0
    if scheme == PBVS:
        theta_u_into(s[0], Li, -1.0)
        x, y, z = s[1, 0], s[1, 1], s[1, 2]
        for j in range(3):
            Li[3, j] = y * Li[2, j] - z * Li[1, j]
            Li[4, j] = z * Li[0, j] - x * Li[2, j]
            Li[5, j] = x * Li[1, j] - y * Li[0, j]
            Li[3 + j, 3 + j] = -1.0
        return True
    for i in range(3):
        for j in range(3):
            Li[3 + i, 3 + j] = L[3 + j, 3 + i]
    if scheme == PBVS_LINE:
        theta_u_into(s[0], Li, -1.0)
        return True
    return _invert_hybrid(L, Li)


@njit(cache=True, error_model="numpy")
def embed_planar(L: Array) -> None:
    """Makes L the identity where a planar robot cannot move."""
    for i in range(6):
        for j in range(6):
            if OUTSIDE[i] + OUTSIDE[j] > 0.0:
                L[i, j] = 1.0 if i == j else 0.0


@shared(types.boolean(types.int64, types.boolean, types.int64, *[VECTOR] * 4, *[MATRIX] * 4))
@njit(cache=True, error_model="numpy")
def interaction_pair(
    scheme: int,
    planar: bool,
    lever: int,
    d: Array,
    theta_u: Array,
    error: Array,
    p_CO: Array,
    R_CO: Array,
    p_OK: Array,
    L: Array,
    Li: Array,
) -> bool:
    """L, Li <- the interaction matrix of a perturbed object and its inverse.

    IBVS without points gets the identity for both, which is right as long as nothing perturbs the
    object. False where L is singular.
    """
    if scheme == IBVS and p_OK.shape[1] == 0:
        L[:] = 0.0
        Li[:] = 0.0
        for i in range(6):
            L[i, i], Li[i, i] = 1.0, 1.0
        return True
    s, R = np.empty((3, 3)), np.empty((3, 3))
    object_state(d, theta_u, error, p_CO, R_CO, s, R)
    if scheme == PBVS and lever == 1:
        copy_vector(s[2], s[1])
    interaction_into(scheme, s, R, p_OK, L)
    good = inverse_interaction_into(scheme, s, L, Li)
    if planar:
        embed_planar(L)
        embed_planar(Li)
    return good


@njit(cache=True, error_model="numpy")
def multiply(X: Array, Y: Array, out: Array) -> None:
    """out <- X Y."""
    for i in range(X.shape[0]):
        for j in range(Y.shape[1]):
            x = 0.0
            for k in range(X.shape[1]):
                x += X[i, k] * Y[k, j]
            out[i, j] = x
