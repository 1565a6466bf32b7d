"""Closed loops of the servo that the criterion is about: kinematics alone, a model always wrong.

From a pose the loop de/dt = -Pi e is followed with unit gain: the servo asks for the camera's twist
v = -L_hat^+ e, turns it into cable velocities by the model that it believes, which is off by the
perturbation all along, and the camera moves as the true cables' least squares have it. The object
rests. The features are those of PBVS, theta u of R_CdC and p_CO, with the exact interaction matrix.

Source: servoing thesis (1.40), (3.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.rotation_kernel import quaternion_of_matrix, rotation_into
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CaseArrays,
    PoseRows,
    moves_object,
    new_work,
    prepare,
)
from cdpr_drake.stability.criterion_kernel import (
    OUTSIDE,
    camera_rows,
    interaction_pair,
    left_inverse,
    multiply,
    rotation_vector_into,
)
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import packed_case

STEP = 0.05
"""Step, times the gain [-]."""

REACHED = 1e-3
"""A loop has converged when the error is this share of what it was."""

AT_GOAL = 1e-9
"""Errors below this are rounding, and a loop that starts so is where it shall be [rad, m]."""

LONGEST_TIME = 60.0
"""Without convergence a loop ends after this time, times the gain [-]."""

CONVERGED, LEFT_BOX, SINGULAR, TIMEOUT = range(4)
"""How a loop ends: at its goal, outside the box, where a matrix is singular, or not at all."""


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """Loops from N poses with k perturbations each.

    Attributes:
        ends: One of the numbers above, shape (N, k).
        falls: -e' de/dt / |e|^2 at the start, shape (N, k) [-]; 1 for a perfect model and where the
            error is zero, minus infinity where a matrix is singular.
        rises: Whether |e| rises somewhere on the way, shape (N, k) bool.
        rise_poses: Where it does so first, rows (qw, qx, qy, qz, x, y, z), shape (N, k, 7) [-, m];
            NaN where it does not.
    """

    ends: np.ndarray
    falls: Array
    rises: np.ndarray
    rise_poses: Array


def closed_loops(
    case: StabilityCase,
    bounds: PerturbationBounds,
    poses: Array,
    perturbations: Array,
    box: tuple[Array, Array],
    threads: int | None = None,
) -> ClosedLoops:
    """Follows the loops from poses under given perturbations.

    Args:
        case: PBVS to an object that rests, with its exact interaction matrix.
        bounds: Bounds that the perturbations are of: whether the object is perturbed.
        poses: Platform poses X_WP to start from, shape (N, 7) [-, m].
        perturbations: As `stability.perturbation_bounds` has them, shape (N, k, 18 + 6 m) [rad, m].
        box: Lower and upper corner of where Po may be, shape (3,) each [m].
        threads: Number of threads; None: all cores.

    Raises:
        StabilityError: Another scheme, target or lever, or as `judge_stability`.
    """
    if case.scheme != "pbvs" or not isinstance(case.target, FixedObject):
        raise StabilityError(
            f"closed loops: found scheme {case.scheme} to {type(case.target).__name__}; accepted: "
            "pbvs to FixedObject"
        )
    if case.lever != "object" or case.perturbed != "estimate":
        raise StabilityError(
            f"closed loops: found lever {case.lever}, perturbed {case.perturbed}; accepted: "
            "object, estimate"
        )
    arrays, rows = packed_case(case, bounds, poses)
    count, k = len(rows.poses), perturbations.shape[1]
    X_WO, X_CdO = case.target.X_WO, case.target.X_CdO
    Q = X_CdO.rotation().matrix() @ X_WO.rotation().matrix().T
    ends, rises = np.empty((count, k), np.int64), np.empty((count, k), np.bool_)
    falls, rise_poses = np.empty((count, k)), np.full((count, k, 7), np.nan)
    over_rows(
        _loops, count, threads, arrays, rows, np.ascontiguousarray(perturbations, float),
        np.ascontiguousarray(Q), np.array(X_WO.translation()), np.array(X_CdO.translation()),
        np.array(box[0], float), np.array(box[1], float), ends, falls, rises, rise_poses,
    )  # fmt: skip
    return ClosedLoops(ends, falls, rises, rise_poses)


@njit(cache=True, error_model="numpy", nogil=True)
def _loops(
    first: int, past: int, case: CaseArrays, rows: PoseRows, perturbations: Array, Q: Array,
    p_WO: Array, p_CdO: Array, lower: Array, upper: Array, ends: np.ndarray, falls: Array,
    rises: np.ndarray, rise_poses: Array,
) -> None:  # fmt: skip
    w = new_work(case)
    R, p, e, v = np.empty((3, 3)), np.empty(3), np.empty(6), np.empty(6)
    for n in range(first, past):
        good = prepare(case, rows, n, w)
        for k in range(perturbations.shape[1]):
            rises[n, k], falls[n, k], ends[n, k] = False, -np.inf, SINGULAR
            if not good:
                continue
            copy_matrix(w.R, R)
            copy_vector(w.p, p)
            size = -1.0
            ends[n, k] = TIMEOUT
            for step in range(round(LONGEST_TIME / STEP)):
                if not _inside(p, lower, upper, case.planar):
                    ends[n, k] = LEFT_BOX
                    break
                rate = _twist(case, R, p, perturbations[n, k], Q, p_WO, p_CdO, e, v)
                square = 0.0
                for i in range(6):
                    square += e[i] * e[i]
                if size < 0.0:
                    size = square
                    falls[n, k] = -rate / square if square > AT_GOAL * AT_GOAL else 1.0
                if square <= max(REACHED * REACHED * size, AT_GOAL * AT_GOAL):
                    ends[n, k] = CONVERGED
                    break
                if not np.isfinite(rate):
                    ends[n, k] = SINGULAR
                    falls[n, k] = -np.inf if step == 0 else falls[n, k]
                    break
                if rate > 0.0 and not rises[n, k]:
                    rises[n, k] = True
                    quaternion_of_matrix(R, rise_poses[n, k])
                    copy_vector(p, rise_poses[n, k, 4:])
                _move(case, R, p, v)


@njit(cache=True, error_model="numpy")
def _inside(p: Array, lower: Array, upper: Array, planar: bool) -> bool:
    inside = True
    for i in range(2 if planar else 3):
        inside = inside and lower[i] <= p[i] <= upper[i]
    return inside


@njit(cache=True, error_model="numpy")
def _twist(
    case: CaseArrays, R: Array, p: Array, d: Array, Q: Array, p_WO: Array, p_CdO: Array, e: Array,
    v: Array,
) -> float:  # fmt: skip
    """e, v <- features' error and the camera's true twist in C, shape (6,); returns e' de/dt.

    NaN where a matrix is singular.
    """
    m = case.A.shape[0]
    J, Jd, M = np.empty((m, 6)), np.empty((m, 6)), np.empty((6, m))
    L, Li, nothing = np.empty((6, 6)), np.empty((6, 6)), np.zeros(18 + 6 * m)
    D, T, R_CO = np.empty((3, 3)), np.empty((3, 3)), np.eye(3)
    theta_u, error, p_CO = np.empty(3), np.empty(3), np.empty(3)
    multiply(R, case.C, D)  # R_WC
    multiply(Q, D, T)  # R_CdC
    rotation_vector_into(T, theta_u)
    for i in range(3):
        p_CO[i] = 0.0
        for j in range(3):
            arm = R[j, 0] * case.t[0] + R[j, 1] * case.t[1] + R[j, 2] * case.t[2]
            p_CO[i] += D[j, i] * (p_WO[j] - p[j] - arm)
    if case.planar:
        theta_u[0], theta_u[1] = 0.0, 0.0
        p_CO[2] = p_CdO[2]
    for i in range(3):
        error[i] = p_CO[i] - p_CdO[i]
        e[i], e[3 + i] = theta_u[i], error[i]
    camera_rows(R, p, case.A, case.B, case.C, case.t, nothing, J)
    camera_rows(R, p, case.A, case.B, case.C, case.t, d, Jd)
    good = left_inverse(J, case.planar, M) and interaction_pair(
        case.scheme, case.planar, case.lever, d, theta_u, error, p_CO, R_CO, case.p_OK, L, Li
    )
    if not good:
        return np.nan
    wanted, speeds = np.empty(6), np.empty(m)
    for i in range(6):
        wanted[i] = 0.0
        for j in range(6):
            wanted[i] -= Li[i, j] * e[j]
    for k in range(m):
        speeds[k] = 0.0
        for j in range(6):
            speeds[k] += Jd[k, j] * wanted[j]
    for i in range(6):
        v[i] = 0.0
        for k in range(m):
            v[i] += M[i, k] * speeds[k]
        if case.planar and OUTSIDE[i] > 0.0:
            v[i] = 0.0
    if moves_object(case):
        interaction_pair(
            case.scheme, case.planar, case.lever, nothing, theta_u, error, p_CO, R_CO, case.p_OK,
            L, Li,
        )  # fmt: skip
    rate = 0.0
    for i in range(6):
        for j in range(6):
            rate += e[i] * L[i, j] * v[j]
    return rate


@njit(cache=True, error_model="numpy")
def _move(case: CaseArrays, R: Array, p: Array, v: Array) -> None:
    """R, p <- the platform after a step with the camera's twist v in C.

    The camera moves along the axes that it has in the middle of the step, so that a step is wrong
    in its third order.
    """
    D, E, F = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    turn, shift = np.empty(3), np.empty(3)
    multiply(R, case.C, D)
    for i in range(3):
        turn[i] = 0.5 * STEP * v[i]
    rotation_into(turn, E)
    multiply(D, E, F)  # R_WC in the middle of the step
    multiply(F, E, D)
    for i in range(3):
        shift[i] = STEP * (F[i, 0] * v[3] + F[i, 1] * v[4] + F[i, 2] * v[5])
        p[i] += shift[i] + R[i, 0] * case.t[0] + R[i, 1] * case.t[1] + R[i, 2] * case.t[2]
    for i in range(3):  # R_WP = R_WC R_CP
        for j in range(3):
            R[i, j] = D[i, 0] * case.C[j, 0] + D[i, 1] * case.C[j, 1] + D[i, 2] * case.C[j, 2]
    for i in range(3):
        p[i] -= R[i, 0] * case.t[0] + R[i, 1] * case.t[1] + R[i, 2] * case.t[2]
