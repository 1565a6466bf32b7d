"""Cases, poses and bounds that tests of stability share, and the criterion in plain NumPy."""

from dataclasses import replace

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.stability.criterion import ModelAtPose, stability_matrix
from cdpr_drake.stability.desired_view import FixedObject, OppositeCorner
from cdpr_drake.stability.stability_case import StabilityCase

ROUNDING = 1e-9
"""Two ways to the same margin, through a pseudo-inverse of condition up to about 1e3."""


def spatial_case(scheme, **changes):
    target = FixedObject(
        RigidTransform([0.1, -0.05, -0.4]),
        RigidTransform(RollPitchYaw(0.2, np.pi - 0.3, 0.4), [0.02, -0.03, 0.5]),
    )
    case = StabilityCase(
        load_robot("acrobot_large").cable_set().without_pulleys(), scheme, target=target,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02]),
        p_OK=np.array([[-0.1, 0.1, 0.1, -0.1], [0.1, 0.1, -0.1, -0.1], [0.0, 0.02, 0.0, 0.01]]),
    )  # fmt: skip
    return replace(case, **changes)


def planar_case():
    return StabilityCase(
        load_robot("planar").cable_set().without_pulleys(), planar=True,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.0, 0.3), [0.02, 0.01, 0.1]),
        target=OppositeCorner(np.full(3, -0.55), np.full(3, 0.55)),
    )  # fmt: skip


CASES = {
    "pbvs": spatial_case("pbvs"),
    "exact": spatial_case("pbvs", lever="object"),
    "line": spatial_case("pbvs-line"),
    "2.5d": spatial_case("2.5d"),
    "ibvs": spatial_case("ibvs"),
    "slack": spatial_case("pbvs", taut=np.arange(8) != 3),
    "planar": planar_case(),
}


def random_poses(count, planar=False, unit=False):
    """Rows of poses, quaternions of any length or of length 1."""
    random = np.random.default_rng(1)
    poses = np.zeros((count, 7))
    poses[:, 0] = 1.0
    poses[:, 1:4] = random.uniform(-0.1, 0.1, (count, 3))
    if planar:
        poses[:, 1:3] = 0.0
    poses[:, 4:] = random.uniform([-0.3, -0.3, 0.1], [0.3, 0.3, 0.7], (count, 3))
    if unit:
        poses[:, :4] /= np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
    return poses


def pose_of(row):
    return RigidTransform(Quaternion(row[:4] / np.linalg.norm(row[:4])), row[4:])


def moved(X, turn, shift):
    return RigidTransform(X.rotation() @ rotation_from_vector(turn), X.translation() + shift)


def moved_points(cables, d):
    """Cables whose points are off by a perturbation, shape (18 + 6 m,)."""
    exits, anchors = d[18:].reshape(2, -1, 3)
    return replace(cables, p_WA=cables.p_WA + exits.T, p_PB=cables.p_PB + anchors.T)


def reference_interaction(case, theta_u, error, p_CO, R_CO):
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
    L[:3, :3] = theta_u_interaction(theta_u)
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


def reference_pi(case, pose, d):
    """Pi of a pose, shape (7,), and a perturbation, shape (18 + 6 m,), m all cables."""
    X_WP = pose_of(pose)
    X_WC = X_WP @ case.X_PC
    rows = case.target.rows(X_WC.rotation().matrix()[None], X_WC.translation()[None])
    theta_u, error, p_CO, R_CO = rows.theta_u[0], rows.error[0], rows.p_CO[0], rows.R_CO[0]
    L = reference_interaction(case, theta_u, error, p_CO, R_CO)
    T, E = rotation_from_vector(theta_u), rotation_from_vector(d[12:15])
    turned = rotation_vector(E @ T) if np.any(d[12:15]) else theta_u
    R_seen = (T.inverse() @ E.inverse() @ T).matrix() @ R_CO
    L_seen = reference_interaction(case, turned, error + d[15:18], p_CO + d[15:18], R_seen)
    nominal = ModelAtPose(X_WP, case.cables, case.X_PC, L)
    other = ModelAtPose(
        moved(X_WP, d[0:3], d[3:6]), moved_points(case.cables, d),
        moved(case.X_PC, d[6:9], d[9:12]), L_seen,
    )  # fmt: skip
    sides = (nominal, other) if case.perturbed == "estimate" else (other, nominal)
    return stability_matrix(*sides, local=case.scheme == "ibvs", taut=case.taut, planar=case.planar)
