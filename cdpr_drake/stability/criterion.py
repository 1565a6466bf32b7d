"""The stability criterion Pi of visual servoing of a cable robot, in plain NumPy.

The servo converges where Pi + Pi' is positive definite. This is the reference that the kernels are
tested against, and the form to read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import adjoint
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS


@dataclass(frozen=True, eq=False)
class ModelAtPose:
    """One side of the criterion: what is true, or what the controller believes.

    Attributes:
        X_WP: Pose of the platform.
        cables: The cables; over pulleys where they have any.
        X_PC: Pose of the camera on the platform.
        L: Interaction matrix, shape (f, 6), columns (w, v).
    """

    X_WP: RigidTransform
    cables: CableSet
    X_PC: RigidTransform
    L: Array

    def camera_jacobian(self, taut: np.ndarray | None = None) -> Array:
        """A Ad: cable length rates of camera twists in C, shape (m, 6).

        Raises:
            CableGeometryError: A cable cannot run.

        Source: (1.19), (1.20), (1.37).
        """
        J = cable_jacobian(self.X_WP, self.cables)
        if taut is not None:
            J = J[taut]
        return np.asarray(J @ adjoint(RigidTransform(self.X_WP.rotation())) @ adjoint(self.X_PC))


def stability_matrix(
    truth: ModelAtPose,
    estimate: ModelAtPose,
    local: bool = False,
    taut: np.ndarray | None = None,
    planar: bool = False,
) -> Array:
    """Pi of the closed loop de/dt = -lambda Pi e, the identity for a perfect model.

    Pi = L Ad^-1 A^+ A_hat Ad_hat L_hat^+, or with `local`, which is for IBVS with more features
    than degrees of freedom, L_hat^+ L Ad^-1 A^+ A_hat Ad_hat, which proves local stability only.
    This is the thesis' stability analysis III; with the same platform and cables on both sides it
    is analysis II, with the same camera as well analysis I.

    Args:
        truth: What is true.
        estimate: What the controller believes.
        local: Whether to take the local form.
        taut: Cables that count, shape (m,) bool; None: all.
        planar: Whether to keep rotation about z and translation along x, y only.

    Returns:
        Shape (6, 6), or (3, 3) for a planar robot, ordered (rotation, translation).

    Source: servoing thesis (3.1), (3.26), (3.8); slack cables: 5.3.1.
    """
    A, A_hat = truth.camera_jacobian(taut), estimate.camera_jacobian(taut)
    L, L_hat = truth.L, estimate.L
    if planar:
        rows = list(PLANAR_ROWS)
        A, A_hat = A[:, rows], A_hat[:, rows]
        L, L_hat = L[np.ix_(rows, rows)], L_hat[np.ix_(rows, rows)]
    middle = np.linalg.pinv(A) @ A_hat
    if local:
        return np.asarray(np.linalg.pinv(L_hat) @ L @ middle)
    return np.asarray(L @ middle @ np.linalg.pinv(L_hat))


def stability_margin(Pi: Array) -> float:
    """Smallest eigenvalue of (Pi + Pi') / 2 [-]; stable where it is positive."""
    return float(np.linalg.eigvalsh((Pi + Pi.T) / 2.0)[0])
