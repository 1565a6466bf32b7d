"""The criterion at one pose as a function of the perturbation, on packed arrays and work space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.rotation_kernel import quaternion_into
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.stability.criterion_kernel import (
    OUTSIDE,
    camera_rows,
    interaction_pair,
    left_inverse,
    multiply,
)
from cdpr_drake.stability.stability_case import IBVS


class CaseArrays(NamedTuple):
    """A case and its bounds as the kernels take them.

    Attributes:
        A: Exit points in W, shape (m, 3) [m].
        B: Anchor points in P, shape (m, 3) [m].
        C: R_PC, shape (3, 3).
        t: p_PC, shape (3,) [m].
        scheme: Code of the scheme.
        planar: Whether the robot is planar.
        lever: Code of the lever.
        truth: Whether the true model is the perturbed one.
        p_OK: Points of the object, shape (3, k) [m].
        radii: Bounds, shape (8,).
        directions: Codes of the directions, shape (2,).
    """

    A: Array
    B: Array
    C: Array
    t: Array
    scheme: int
    planar: bool
    lever: int
    truth: bool
    p_OK: Array
    radii: Array
    directions: np.ndarray


class PoseRows(NamedTuple):
    """Poses and what the servo sees there.

    Attributes:
        poses: Quaternions (w, x, y, z) and positions, shape (N, 7) [m].
        bits: The same as whole numbers, for hashing.
        theta_u: Rotation vectors of R_CdC, shape (N, 3) [rad].
        error: e_t, shape (N, 3) [m].
        p_CO: Positions of the object, shape (N, 3) [m].
        R_CO: Its orientations, shape (N, 3, 3).
    """

    poses: Array
    bits: np.ndarray
    theta_u: Array
    error: Array
    p_CO: Array
    R_CO: Array


class Work(NamedTuple):
    """Work space of one pose; f rows of the interaction matrix, m cables.

    Attributes:
        R: R_WP, shape (3, 3).
        p: p_WP, shape (3,) [m].
        J: Nominal camera Jacobian, shape (m, 6).
        M: Its left inverse, shape (6, m).
        L: Nominal interaction matrix, shape (f, 6).
        Li: Its left inverse, shape (6, f).
        LM: L M, or M for IBVS, shape (6, m).
        Jd, Md, Ld, Lid: The same of the perturbed model.
        X: J^+ J_hat, shape (6, 6).
        Y, K: Products, shape (6, 6).
        S: (Pi + Pi') / 2, shape (6, 6).
        F: A Cholesky factor, shape (6, 6).
    """

    R: Array
    p: Array
    J: Array
    M: Array
    L: Array
    Li: Array
    LM: Array
    Jd: Array
    Md: Array
    Ld: Array
    Lid: Array
    X: Array
    Y: Array
    K: Array
    S: Array
    F: Array


_SCALARS = (types.int64, types.boolean, types.int64, types.boolean)
CASE_TYPE = types.NamedTuple(
    (*[MATRIX] * 3, VECTOR, *_SCALARS, MATRIX, VECTOR, types.int64[::1]),
    CaseArrays,
)
ROWS_TYPE = types.NamedTuple(
    (MATRIX, types.uint64[:, ::1], *[MATRIX] * 3, types.float64[:, :, ::1]), PoseRows
)
WORK_TYPE = types.NamedTuple((MATRIX, VECTOR, *[MATRIX] * 14), Work)
"""The three as numba has them, for kernels that are called by their slot."""


@njit(cache=True, error_model="numpy", inline="always")
def moves_object(case: CaseArrays) -> bool:
    """Whether the object is perturbed."""
    return case.radii[4] != 0.0 or case.radii[5] != 0.0


@njit(cache=True, error_model="numpy", inline="always")
def new_work(case: CaseArrays) -> Work:
    """Work space for one pose at a time."""
    m = case.A.shape[0]
    f = 2 * case.p_OK.shape[1] if case.scheme == IBVS and case.p_OK.shape[1] > 0 else 6
    return Work(
        np.empty((3, 3)), np.empty(3),
        np.empty((m, 6)), np.empty((6, m)), np.empty((f, 6)), np.empty((6, f)), np.empty((6, m)),
        np.empty((m, 6)), np.empty((6, m)), np.empty((f, 6)), np.empty((6, f)),
        np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.zeros((6, 6)),
    )  # fmt: skip


@shared(types.boolean(CASE_TYPE, ROWS_TYPE, types.int64, WORK_TYPE))
@njit(cache=True, error_model="numpy")
def prepare(case: CaseArrays, rows: PoseRows, n: int, w: Work) -> bool:
    """Fills what pose n has in common for all perturbations; False where a matrix is singular."""
    q = rows.poses[n]
    s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    quaternion_into(q[0], q[1], q[2], q[3], s, w.R)
    copy_vector(rows.poses[n, 4:], w.p)
    d = np.zeros(18 + 6 * case.A.shape[0])
    camera_rows(w.R, w.p, case.A, case.B, case.C, case.t, d, w.J)
    if not left_inverse(w.J, case.planar, w.M):
        return False
    if not interaction_pair(
        case.scheme, case.planar, case.lever, d, rows.theta_u[n], rows.error[n], rows.p_CO[n],
        rows.R_CO[n], case.p_OK, w.L, w.Li,
    ):  # fmt: skip
        return False
    copy_matrix(w.L, w.Ld)
    copy_matrix(w.Li, w.Lid)
    if case.scheme == IBVS:
        copy_matrix(w.M, w.LM)
    else:
        multiply(w.L, w.M, w.LM)
    return True


@shared(types.boolean(CASE_TYPE, ROWS_TYPE, types.int64, WORK_TYPE, VECTOR))
@njit(cache=True, error_model="numpy")
def evaluate(case: CaseArrays, rows: PoseRows, n: int, w: Work, d: Array) -> bool:
    """w.S <- (Pi + Pi') / 2 for the perturbation d; False where a matrix is singular."""
    camera_rows(w.R, w.p, case.A, case.B, case.C, case.t, d, w.Jd)
    moved = moves_object(case)
    if moved and not interaction_pair(
        case.scheme, case.planar, case.lever, d, rows.theta_u[n], rows.error[n], rows.p_CO[n],
        rows.R_CO[n], case.p_OK, w.Ld, w.Lid,
    ):  # fmt: skip
        return False
    if case.truth:
        if not left_inverse(w.Jd, case.planar, w.Md):
            return False
        multiply(w.Md, w.J, w.X)
    else:
        multiply(w.M, w.Jd, w.X)
    if case.planar:
        for i in range(6):
            w.X[i, i] += OUTSIDE[i]
    if case.scheme != IBVS:
        if case.truth:
            multiply(w.Ld, w.X, w.K)
            multiply(w.K, w.Li, w.Y)
        else:
            multiply(w.L, w.X, w.K)
            multiply(w.K, w.Lid, w.Y)
    elif moved:
        if case.truth:
            multiply(w.Li, w.Ld, w.K)
        else:
            multiply(w.Lid, w.L, w.K)
        multiply(w.K, w.X, w.Y)
    else:
        copy_matrix(w.X, w.Y)
    for i in range(6):
        for j in range(6):
            w.S[i, j] = 0.5 * (w.Y[i, j] + w.Y[j, i])
    return True
