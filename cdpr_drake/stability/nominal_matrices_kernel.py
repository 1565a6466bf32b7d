"""The nominal matrices of the criterion at many poses, for bounds that are written with arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix
from cdpr_drake.stability.certified_kernel import rounding_error
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, PoseRows, new_work, prepare
from cdpr_drake.stability.stability_case import IBVS


class NominalMatrices(NamedTuple):
    """Of N poses and k rows of a twist, 6 or a planar robot's 3; NaN where one is singular.

    Attributes:
        R: R_WP, shape (N, 3, 3).
        J: Camera Jacobian, shape (N, m, k).
        M: Its left inverse, shape (N, k, m).
        K_l: L, or 1 for IBVS, shape (N, k, k).
        K_r: L^-1, or 1 for IBVS, shape (N, k, k).
        loss: What rounding does to the criterion, by `certified_kernel.rounding_error`, shape (N,).
        rows: Which rows of a twist (w, v) these k are.
    """

    R: Array
    J: Array
    M: Array
    K_l: Array
    K_r: Array
    loss: Array
    rows: list[int]

    def picked(self, which: np.ndarray) -> NominalMatrices:
        """Those of some of the poses."""
        R, J, M, K_l, K_r, loss = (
            x[which] for x in (self.R, self.J, self.M, self.K_l, self.K_r, self.loss)
        )
        return NominalMatrices(R, J, M, K_l, K_r, loss, self.rows)


def nominal_matrices(case: CaseArrays, rows: PoseRows) -> NominalMatrices:
    """Matrices of poses of a case whose object is seen as it is."""
    count, m = len(rows.poses), len(case.A)
    R, J, M = np.empty((count, 3, 3)), np.empty((count, m, 6)), np.empty((count, 6, m))
    L, Li, loss = np.empty((count, 6, 6)), np.empty((count, 6, 6)), np.empty(count)
    _fill(case, rows, R, J, M, L, Li, loss)
    kept = list(PLANAR_ROWS) if case.planar else list(range(6))
    both = np.ix_(range(count), kept, kept)
    return NominalMatrices(R, J[:, :, kept], M[:, kept], L[both], Li[both], loss, kept)


@njit(cache=True, error_model="numpy")
def _fill(
    case: CaseArrays, rows: PoseRows, R: Array, J: Array, M: Array, L: Array, Li: Array, loss: Array
) -> None:
    w = new_work(case)
    for n in range(R.shape[0]):
        if not prepare(case, rows, n, w):
            for X in (R, J, M, L, Li):
                X[n] = np.nan
            loss[n] = np.nan
            continue
        copy_matrix(w.R, R[n])
        copy_matrix(w.J, J[n])
        copy_matrix(w.M, M[n])
        loss[n] = rounding_error(case, w)
        if case.scheme == IBVS:  # L^+ L
            for i in range(6):
                for j in range(6):
                    L[n, i, j] = 1.0 if i == j else 0.0
            copy_matrix(L[n], Li[n])
        else:
            copy_matrix(w.L, L[n])
            copy_matrix(w.Li, Li[n])
