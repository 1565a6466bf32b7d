"""Straight cables between fixed exit points and the platform: lengths, Jacobian, wrench matrix."""

from __future__ import annotations

import numpy as np
from numba import njit
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array

ALL_ROWS = (0, 1, 2, 3, 4, 5)
"""Components of a spatial vector (rotation, translation)."""

PLANAR_ROWS = (2, 3, 4)
"""Those that a planar platform can move: rotation about z, translation along x and y."""


def cable_vectors(X_WP: RigidTransform, p_WA: Array, p_PB: Array) -> tuple[Array, Array]:
    """Vectors from exit to anchor points, and the anchor arms, both in W.

    Args:
        X_WP: Pose of the platform P in the world W.
        p_WA: Exit points, shape (3, m) [m].
        p_PB: Anchor points, shape (3, m) [m].

    Returns:
        p_AB_W, shape (3, m) [m], and p_PB_W = R_WP p_PB, shape (3, m) [m].

    Source: servoing thesis (1.3), there expressed in the platform frame.
    """
    p_PB_W = X_WP.rotation().matrix() @ p_PB
    return X_WP.translation()[:, np.newaxis] + p_PB_W - p_WA, p_PB_W


def cable_lengths(X_WP: RigidTransform, p_WA: Array, p_PB: Array) -> Array:
    """Lengths |A_i B_i|, shape (m,) [m]; arguments as in `cable_vectors`.

    Source: servoing thesis (1.2).
    """
    p_AB_W, _ = cable_vectors(X_WP, p_WA, p_PB)
    return np.asarray(np.linalg.norm(p_AB_W, axis=0), float)


def length_jacobian(X_WP: RigidTransform, p_WA: Array, p_PB: Array) -> Array:
    """Maps the platform's spatial velocity to cable length rates, l_dot = J @ V_WP.

    Row i is [(p_PBi_W x u_i)', u_i'] with u_i the unit vector from A_i to B_i. By virtual work,
    tensions t load the platform with F_P_W = -J.T @ t.

    Args:
        X_WP: Pose of the platform P in the world W.
        p_WA: Exit points, shape (3, m) [m].
        p_PB: Anchor points, shape (3, m) [m].

    Returns:
        J, shape (m, 6), columns (w [m/rad], v [-]).

    Source: servoing thesis (1.19), there with columns (v, w) and in the platform frame.
    """
    # As `CableSet` has them, so that it is compiled once.
    exits, anchors = np.asarray(p_WA, float, order="F"), np.asarray(p_PB, float, order="F")
    J: Array = _length_jacobian(
        np.ascontiguousarray(X_WP.rotation().matrix()), X_WP.translation(), exits, anchors
    )
    return J


@njit(cache=True)
def _length_jacobian(R: Array, p: Array, p_WA: Array, p_PB: Array) -> Array:
    m = p_WA.shape[1]
    J = np.empty((m, 6))
    for i in range(m):
        bx, by, bz = p_PB[0, i], p_PB[1, i], p_PB[2, i]
        rx = R[0, 0] * bx + R[0, 1] * by + R[0, 2] * bz
        ry = R[1, 0] * bx + R[1, 1] * by + R[1, 2] * bz
        rz = R[2, 0] * bx + R[2, 1] * by + R[2, 2] * bz
        dx, dy, dz = p[0] + rx - p_WA[0, i], p[1] + ry - p_WA[1, i], p[2] + rz - p_WA[2, i]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        ux, uy, uz = dx / length, dy / length, dz / length
        J[i, 0] = ry * uz - rz * uy
        J[i, 1] = rz * ux - rx * uz
        J[i, 2] = rx * uy - ry * ux
        J[i, 3] = ux
        J[i, 4] = uy
        J[i, 5] = uz
    return J


def wrench_matrix(X_WP: RigidTransform, p_WA: Array, p_PB: Array) -> Array:
    """W = -J', shape (6, m), columns (moment about Po [m], force [-]) of unit tensions, in W.

    Equilibrium under an external wrench w is W t + w = 0. Arguments as in `length_jacobian`.

    Source: servoing thesis (1.24).
    """
    return -length_jacobian(X_WP, p_WA, p_PB).T


def gravity_wrench(
    X_WP: RigidTransform, mass: float, p_PCo: Array, gravity: float | Array = 9.81
) -> Array:
    """Weight of the platform as a wrench about Po in W, shape (6,) [N m, N].

    Args:
        X_WP: Pose of the platform P in the world W.
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        gravity: Acceleration along -z of W, or as a vector in W, shape (3,) [m/s^2].
    """
    f = mass * (np.array([0.0, 0.0, -gravity]) if np.ndim(gravity) == 0 else np.asarray(gravity))
    return np.concatenate([np.cross(X_WP.rotation().matrix() @ p_PCo, f), f])
