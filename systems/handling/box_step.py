"""The integration step that follows a box on its corners, in a grip."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.tree import SpatialInertia

from cdpr_drake.numerics import largest_stable_step
from cdpr_drake.spatial import cross_matrix
from cdpr_drake.systems.handling.gripper import GripLaw
from cdpr_drake.systems.handling.workpiece import contact_dissipation, contact_stiffness
from cdpr_drake.systems.scenarios import WorkpieceSettings

PRESSED = 2.0
"""Force with which a box may be pressed onto what it stands on, beside its weight [N]."""

STEEPEST = 1.875
"""Largest slope of Drake's friction coefficient over speed, times slip speed over coefficient."""


def box_step(
    settings: WorkpieceSettings, law: GripLaw, gravity: float, slip_speed: float, integrator: str
) -> float:
    """The largest stable step of an explicit method for a box that is held and stands [s].

    Args:
        settings: The box.
        law: The grip, whose platform counts as fixed.
        gravity: Acceleration of free fall [m/s^2].
        slip_speed: That of contact [m/s].
        integrator: One of `numerics.explicit_integrators()`.
    """
    M = SpatialInertia.SolidBoxWithMass(
        settings.mass, *(float(edge) for edge in settings.size)
    ).CopyToFullMatrix6()
    k = contact_stiffness(settings, gravity)
    normal = (settings.mass * gravity + PRESSED) / 4.0
    slipping = STEEPEST * settings.friction * normal / slip_speed
    upright = contact_dissipation(gravity) * normal
    J = np.hstack([-cross_matrix(law.p_BF), np.eye(3)])
    turning = np.zeros((6, 6))
    turning[:3, :3] = np.eye(3)
    K = law.stiffness * J.T @ J + law.rotational_stiffness * turning
    D = law.damping * J.T @ J + law.rotational_damping * turning
    for x, y in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        corner = 0.5 * settings.size * np.array([x, y, -1.0])
        J = np.hstack([-cross_matrix(corner), np.eye(3)])
        K += J.T @ np.diag([0.0, 0.0, k]) @ J
        D += J.T @ np.diag([slipping, slipping, upright]) @ J
    A = np.block([
        [np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]
    ])  # fmt: skip
    return largest_stable_step(np.linalg.eigvals(A), integrator)
