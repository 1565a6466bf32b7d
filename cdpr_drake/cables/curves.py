"""The curves of cables in space, for pictures: over the groove, then straight or hanging."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.catenary_kernel import VERTICAL, free_part
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES, sagging_cable, solve_catenary
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet

GROOVE_POINTS = 5
"""Points of the part of a cable that lies in the groove of its pulley."""

WEIGHTLESS_SHARE = 1e-6
"""Weight of a weightless cable that hangs, as a share of its axial stiffness: next to no stretch,
and without stretch the weight does not matter for the shape."""


def cable_curves(
    cables: CableSet,
    model: str,
    X_WP: RigidTransform,
    l0: Array,
    points: int = 13,
    least_sag: float = 0.0,
) -> list[Array]:
    """Points along every cable at rest, from its exit point A to its anchor point B.

    A taut cable without weight is straight. A slack one has no shape of its own; it is shown as
    its length hangs, like one with weight. The groove of each pulley adds `GROOVE_POINTS` - 1.

    Args:
        cables: The cables.
        model: A name of `models.CABLE_MODELS`.
        X_WP: Pose of the platform.
        l0: Unstrained lengths from A to B, shape (m,) [m].
        points: Of the free part of a curved cable; a straight one has its ends only.
        least_sag: A cable that sags less is drawn straight [m].

    Returns:
        One array for each cable, shape (3, n) [m].

    Raises:
        CableGeometryError: An anchor point lies in the groove of its pulley or on its swivel axis.

    Source: Irvine, Cable Structures, 1981, 1.3, for what hangs; servoing thesis 1.3.1 for pulleys.
    """
    paths = cable_paths(X_WP, cables)
    curves = []
    for i in range(cables.count):
        A, T = cables.p_WA[:, i], paths.p_WT[:, i]
        B = T + paths.free[i] * paths.u_W[:, i]
        curve = None
        if CABLE_MODELS[model].sags and cables.linear_weight[i] > 0.0:
            curve = _hanging(cables, i, A, B, l0[i], radius=cables.pulley_radius[i], points=points)
        elif l0[i] > paths.lengths[i]:
            curve = _hanging(cables, i, T, B, l0[i] - paths.arcs[i], radius=0.0, points=points)
        if curve is None:
            curve = np.column_stack([T, B])
        elif _sag(curve) < least_sag:
            curve = curve[:, [0, -1]]
        if cables.arm[i] > 0.0:
            curve = np.column_stack([A, curve])
        if cables.pulley_radius[i] > 0.0:
            axis, r = cables.swivel_axis[:, i], cables.pulley_radius[i]
            curve = np.hstack([_groove(A, curve[:, 0], axis, r), curve])
        if cables.anchor_pulley_radius[i] > 0.0:
            anchor = X_WP.multiply(cables.p_PB[:, i])
            axis = X_WP.rotation().matrix() @ cables.anchor_swivel_axis[:, i]
            groove = _groove(anchor, B, axis, cables.anchor_pulley_radius[i])
            curve = np.hstack([curve, groove[:, ::-1]])
        curves.append(curve)
    return curves


def _hanging(
    cables: CableSet, i: int, A: Array, B: Array, l0: float, *, radius: float, points: int
) -> Array | None:
    """The free part of a cable from A or its pulley to B, shape (3, n) [m]; None: not found."""
    rise = B - A
    rho = float(np.hypot(rise[0], rise[1]))
    out = np.array([rise[0] / rho, rise[1] / rho, 0.0]) if rho > 0.0 else np.array([1.0, 0.0, 0.0])
    ES, sigma = float(cables.stiffness[i]), float(np.sign(cables.swivel_axis[2, i]))
    w = float(cables.linear_weight[i]) or WEIGHTLESS_SHARE * ES / l0
    shape = max(rho, VERTICAL * l0), float(rise[2]), float(radius), sigma, float(l0), ES, w
    H, V_A, good = solve_catenary(*shape, 0.0, 0.0)
    if not good:
        return None
    V_B = V_A + w * l0  # all of it hangs; in a groove the weight of a part does not count
    if radius > 0.0:
        V_B = sagging_cable(*shape, H, V_A, np.empty((SENSITIVITIES, 3)))[1]
    start = A
    if radius > 0.0:
        tension = np.hypot(H, V_A)
        start = A + radius * (1.0 - sigma * V_A / tension) * out
        start = start + np.array([0.0, 0.0, sigma * radius * H / tension])
    along = np.linspace(0.0, (V_B - V_A) / w, points)
    flat = np.array([free_part(H, V_A, s, ES, w)[:2] for s in along])
    curve: Array = start[:, np.newaxis] + np.outer(out, flat[:, 0])
    curve[2] += flat[:, 1]
    return curve


def _sag(curve: Array) -> float:
    """Largest distance of points from the chord of the first and the last [m]."""
    chord = curve[:, -1] - curve[:, 0]
    away = np.cross((curve - curve[:, :1]).T, chord / np.linalg.norm(chord))
    return float(np.max(np.linalg.norm(away, axis=1)))


def _groove(A: Array, T: Array, n: Array, r: float) -> Array:
    """Points of a groove from its entry A to just before the tangent point T, shape (3, n) [m].

    Args:
        A: Where the cable enters it.
        T: Where it leaves it.
        n: Swivel axis through A, unit vector.
        r: Radius [m].
    """
    rise = float((T - A) @ n)
    out = T - A - rise * n
    length = float(np.linalg.norm(out))
    if length == 0.0:
        return A[:, np.newaxis]
    e = out / length
    angle = np.arctan2(rise, length - r)  # of T, seen from the centre; A lies at pi
    at = np.linspace(np.pi, angle, GROOVE_POINTS)[:-1]
    return A[:, np.newaxis] + np.outer(e, r * (1.0 + np.cos(at))) + np.outer(n, r * np.sin(at))
