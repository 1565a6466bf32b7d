"""The sampled verdict: the smallest eigenvalue of the criterion over random perturbations."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from cdpr_drake.arrays import Array
from cdpr_drake.perturbation_draws import draw_into, pose_key
from cdpr_drake.servo_interaction import IBVS
from cdpr_drake.stability_kernel import (
    OUTSIDE,
    camera_rows,
    factor,
    interaction_pair,
    left_inverse,
    multiply,
    quaternion_matrix,
)


@njit(cache=True)
def symmetric_part(X: Array, S: Array) -> None:
    """S <- (X + X') / 2."""
    for i in range(X.shape[0]):
        for j in range(X.shape[0]):
            S[i, j] = 0.5 * (X[i, j] + X[j, i])


@njit(cache=True)
def smallest_eigenvalue(S: Array) -> float:
    """Smallest eigenvalue of a symmetric matrix; minus infinity where a number is not finite."""
    for i in range(S.shape[0]):
        for j in range(S.shape[0]):
            if not np.isfinite(S[i, j]):
                return -np.inf
    return np.linalg.eigvalsh(S)[0]


@njit(cache=True, parallel=True)
def sampled_margins(
    poses: Array,
    bits: np.ndarray,
    A: Array,
    B: Array,
    C: Array,
    t: Array,
    scheme: int,
    planar: bool,
    lever: int,
    truth: bool,
    theta_u: Array,
    error: Array,
    p_CO: Array,
    R_CO: Array,
    p_OK: Array,
    radii: Array,
    directions: np.ndarray,
    draws: int,
    seed: int,
    inside: bool,
    first_only: bool,
    margins: Array,
) -> None:
    """margins <- smallest eigenvalue of (Pi + Pi') / 2 over the draws at every pose.

    Minus infinity where a Jacobian is singular. `truth`: the true model is the perturbed one.
    `first_only`: stop at the first draw that is not stable, its eigenvalue is the margin.
    The nominal model counts as a draw.
    """
    m, count = A.shape[0], poses.shape[0]
    features = 2 * p_OK.shape[1] if scheme == IBVS and p_OK.shape[1] > 0 else 6
    moved = radii[4] != 0.0 or radii[5] != 0.0
    for n in prange(count):
        R, d = np.empty((3, 3)), np.zeros(18 + 6 * m)
        J, Jd = np.empty((m, 6)), np.empty((m, 6))
        M, X, Y, S, F = (
            np.empty((6, m)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)),
            np.zeros((6, 6)),
        )  # fmt: skip
        L, Li = np.empty((features, 6)), np.empty((6, features))
        Ld, Lid = np.empty((features, 6)), np.empty((6, features))
        K = np.empty((6, 6))
        quaternion_matrix(poses[n, :4], R)
        p = poses[n, 4:]
        key = pose_key(seed, bits[n])
        camera_rows(R, p, A, B, C, t, d, J)
        good = interaction_pair(
            scheme, planar, lever, d, theta_u[n], error[n], p_CO[n], R_CO[n], p_OK, L, Li
        )
        good = good and left_inverse(J, planar, M)
        margins[n] = 1.0 if good else -np.inf
        if not good:
            continue
        Ld[:], Lid[:] = L, Li
        for number in range(draws):
            draw_into(key, number, radii, directions, planar, inside, m, d)
            camera_rows(R, p, A, B, C, t, d, Jd)
            if moved:
                good = interaction_pair(
                    scheme, planar, lever, d, theta_u[n], error[n], p_CO[n], R_CO[n], p_OK, Ld, Lid
                )
            if truth:
                good = good and left_inverse(Jd, planar, M)
                multiply(M, J, X)
            else:
                multiply(M, Jd, X)
            if not good:
                margins[n] = -np.inf
                break
            if planar:
                for i in range(6):
                    X[i, i] += OUTSIDE[i]
            if scheme == IBVS:
                if moved:
                    if truth:
                        multiply(Li, Ld, K)
                    else:
                        multiply(Lid, L, K)
                    multiply(K, X, Y)
                else:
                    Y[:] = X
            elif truth:
                multiply(Ld, X, K)
                multiply(K, Li, Y)
            else:
                multiply(L, X, K)
                multiply(K, Lid, Y)
            symmetric_part(Y, S)
            if not factor(S, margins[n], F):  # worse than the worst so far
                margins[n] = min(margins[n], smallest_eigenvalue(S))
                if first_only and margins[n] <= 0.0:
                    break
