"""The criterion of one perturbed pose in plain NumPy and Drake types, to compare kernels with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector, rotation_vector
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.stability.criterion import ModelAtPose, stability_matrix
from cdpr_drake.stability.stability_case import StabilityCase


def reference_interaction(
    case: StabilityCase, theta_u: Array, error: Array, p_CO: Array, R_CO: Array
) -> Array:
    """L of every scheme, rows as in `servoing.interaction_matrix_kernel`."""
    if case.scheme == "ibvs":
        if case.p_OK is None:
            return np.eye(6)
        rows = []
        for X, Y, Z in (p_CO + (R_CO @ case.p_OK).T).tolist():
            x, y = X / Z, Y / Z
            rows.append([x * y, -(1 + x * x), y, -1 / Z, 0, x / Z])
            rows.append([1 + y * y, -x * y, -x, 0, -1 / Z, y / Z])
        return np.array(rows)
    L = np.zeros((6, 6))
    L_w = theta_u_interaction(theta_u)
    L[:3, :3] = L_w
    if case.scheme == "pbvs":
        L[3:, :3] = cross_matrix(error if case.lever == "error" else p_CO)
        L[3:, 3:] = -np.eye(3)
        return L
    L[3:, 3:] = rotation_from_vector(theta_u).matrix()
    if case.scheme == "2.5d":
        x, y, Z = p_CO[0] / p_CO[2], p_CO[1] / p_CO[2], p_CO[2]
        L[0, :3], L[1, :3] = [x * y, -(1 + x * x), y], [1 + y * y, -x * y, -x]
        L[0, 3:], L[1, 3:] = [-1 / Z, 0, x / Z], [0, -1 / Z, y / Z]
    return L


def reference_pi(case: StabilityCase, pose: Array, d: Array) -> Array:
    """Pi of a pose, shape (7,), and a perturbation, shape (18 + 6 m,), m all cables."""
    cables, m = case.cables, case.cables.count
    X_WP = RigidTransform(Quaternion(pose[:4] / np.linalg.norm(pose[:4])), pose[4:])
    X_WC = X_WP @ case.X_PC
    rows = case.target.rows(X_WC.rotation().matrix()[None], X_WC.translation()[None])
    theta_u, error, p_CO, R_CO = rows.theta_u[0], rows.error[0], rows.p_CO[0], rows.R_CO[0]
    nominal = ModelAtPose(
        X_WP,
        cables,
        case.X_PC,
        reference_interaction(case, theta_u, error, p_CO, R_CO),
    )
    T, E = rotation_from_vector(theta_u), rotation_from_vector(d[12:15])
    turned = rotation_vector(E @ T) if np.any(d[12:15]) else theta_u
    other = ModelAtPose(
        _moved(X_WP, d[0:3], d[3:6]),
        replace(
            cables,
            p_WA=cables.p_WA + d[18 : 18 + 3 * m].reshape(m, 3).T,
            p_PB=cables.p_PB + d[18 + 3 * m :].reshape(m, 3).T,
        ),
        _moved(case.X_PC, d[6:9], d[9:12]),
        reference_interaction(
            case,
            turned,
            error + d[15:18],
            p_CO + d[15:18],
            (T.inverse() @ E.inverse() @ T).matrix() @ R_CO,
        ),
    )
    sides: tuple[Any, Any] = (nominal, other) if case.perturbed == "estimate" else (other, nominal)
    return stability_matrix(*sides, local=case.scheme == "ibvs", taut=case.taut, planar=case.planar)


def _moved(X: RigidTransform, turn: Array, shift: Array) -> RigidTransform:
    R: RotationMatrix = X.rotation() @ rotation_from_vector(turn)
    return RigidTransform(R, X.translation() + shift)
