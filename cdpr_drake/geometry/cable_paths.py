"""How the cables of a set run at a pose: over their pulleys, or straight from their exit points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import pulley_geometry
from cdpr_drake.geometry.straight_cables import length_jacobian

SHORTEST = 1e-12
"""A cable shorter than this is none: rounding alone makes such lengths [m]."""


@dataclass(frozen=True, eq=False)
class CablePaths:
    """Where m cables run; without pulleys the tangent points are the exit points.

    Attributes:
        lengths: From A along the grooves and straight to B, shape (m,) [m].
        free: Of the free part, from the tangent point A' to B, or to the tangent point of a pulley
            at the platform, shape (m,) [m].
        arcs: Along the grooves of both ends together, shape (m,) [m].
        p_WT: Tangent points A', shape (3, m) [m].
        u_W: Unit vectors from A' to B, shape (3, m).
        J: Maps the platform's spatial velocity to length rates, l_dot = J @ V_WP; shape (m, 6),
            columns (w [m/rad], v [-]) in W. Tensions t load the platform with F_P_W = -J.T @ t.

    Source: servoing thesis (1.5), (1.15) to (1.17), (1.20).
    """

    lengths: Array
    free: Array
    arcs: Array
    p_WT: Array
    u_W: Array
    J: Array


def motion_of(X_WP: RigidTransform) -> Motion:
    """A pose as the kernels of cables take it: rotation row by row, position; 12 numbers."""
    return (*X_WP.rotation().matrix().ravel().tolist(), *X_WP.translation().tolist())


def cable_paths(X_WP: RigidTransform, cables: CableSet) -> CablePaths:
    """Lengths, tangent points, unit vectors and Jacobian of all cables.

    Args:
        X_WP: Pose of the platform P in the world W.
        cables: The cables.

    Raises:
        CableGeometryError: An anchor point lies in the groove of its pulley or on its swivel axis.
    """
    motion, rows = motion_of(X_WP), cables.packed()
    geometries = [pulley_geometry(motion, row) for row in rows]
    table = np.array(geometries).T
    if not all(_can_run(geometry) for geometry in geometries):
        raise CableGeometryError(impossible_cable(X_WP, cables))
    u, arm = table[5:8], table[8:11]
    J = np.vstack([np.cross(arm.T, u.T).T, u]).T
    return CablePaths(table[0] + table[1], table[0], table[1], table[2:5], u, J)


def cable_jacobian(X_WP: RigidTransform, cables: CableSet) -> Array:
    """J with l_dot = J @ V_WP, shape (m, 6), columns (w [m/rad], v [-]), over pulleys if there are.

    Tensions t load the platform with F_P_W = -J.T @ t; W = -J.T is the wrench matrix.

    Raises:
        CableGeometryError: An anchor point lies in the groove of its pulley, on its swivel axis, or
            on the exit point.
    """
    if cables.has_pulleys():
        return cable_paths(X_WP, cables).J
    try:
        return length_jacobian(X_WP, cables.p_WA, cables.p_PB)
    except ZeroDivisionError:
        raise CableGeometryError(impossible_cable(X_WP, cables)) from None


def impossible_cable(X_WP: RigidTransform, cables: CableSet) -> str:
    """One line about the first cable that cannot run at this pose, for an error message.

    Where all can run straight, it is a sagging cable without a catenary.
    """
    motion, rows = motion_of(X_WP), cables.packed()
    bad = [i for i, row in enumerate(rows) if not _can_run(pulley_geometry(motion, row))]
    if not bad:
        return (
            "no catenary is found for one of the cables; accepted: anchor points farther from the "
            "swivel axes than the pulleys' diameters, or shorter cables"
        )
    i = bad[0]
    if cables.anchor_pulley_radius[i] > 0.0:
        return (
            f"cable {i + 1}: no line touches its pulleys of radius {cables.pulley_radius[i]:g} m "
            f"at {_words(cables.p_WA[:, i])} m and {cables.anchor_pulley_radius[i]:g} m at the "
            f"platform, {_words(X_WP.multiply(cables.p_PB[:, i]))} m; accepted: a pose where "
            "neither end lies in the groove or on the swivel axis of the other"
        )
    A, B, r = cables.p_WA[:, i], X_WP.multiply(cables.p_PB[:, i]), cables.pulley_radius[i]
    if cables.arm[i] > 0.0:
        return (
            f"cable {i + 1}: its anchor point {_words(B)} m lies within the length "
            f"{cables.arm[i]:g} m of its arm at {_words(A)} m; accepted: a pose farther from the "
            "swivel axis"
        )
    where = "in the groove or on the swivel axis of its pulley" if r > 0.0 else "on its exit point"
    return (
        f"cable {i + 1}: its anchor point {_words(B)} m lies {where} of radius {r:g} m at "
        f"{_words(A)} m; accepted: a pose where the cable can leave along a tangent"
        if r > 0.0
        else f"cable {i + 1}: its anchor point {_words(B)} m lies {where}; accepted: points apart"
    )


def _can_run(geometry: tuple[float, ...]) -> bool:
    """Whether a cable has a direction; one as short as rounding has none, whatever it computes."""
    return bool(np.all(np.isfinite(geometry)) and geometry[0] + geometry[1] > SHORTEST)


def _words(values: Array) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
