"""The twist of partitioned servoing: the optical axis first, the rest by the image points.

The last two features are alpha and ln sigma, see `features.partition_kernel`. From the rates that
are asked of all features,

    w_z = rate(alpha) / L(alpha, w_z),  v_z = rate(ln sigma) / L(ln sigma, v_z),
    V_xy = L_xy^+ (rate - L_z (w_z, v_z)),

with L_xy, L_z the columns of the points' rows. A field at the edges of the image, if there is one,
adds to the points' rates a velocity away from the edges,

    F = eta rho_0 (rho_0 / rho - 1) (rho_0 / rho)^2 within rho_0 of an edge,

and to v_z what along the axis alone comes nearest to it, by least squares.

Source: Corke and Hutchinson, A new partitioned approach to image-based visual servo control, 2001:
the partition, alpha, sigma, and a field by 1/2 (1 / rho - 1 / rho_0)^2 as of Khatib's. The gains'
units and how the field is shared between axis and rest are chosen here.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics import least_squares
from cdpr_drake.servoing.law_numbers import (
    AXIS_GAIN,
    EDGE_DISTANCE,
    EDGE_GAIN,
    X_HIGHEST,
    X_LOWEST,
    Y_HIGHEST,
    Y_LOWEST,
)

ABOUT, ALONG = 2, 5
"""Columns of the rotation about the optical axis and of the translation along it."""

STEEPEST = 10.0
"""Largest rho_0 / rho that counts, so that a point on the edge has a finite velocity."""

BLIND = 1e-9
"""A feature that changes less than this with the motion it controls does not control it."""


@njit(cache=True)
def edge_push(law: Array, value: float, lowest: float, highest: float) -> float:
    """Velocity F [1/s] of one coordinate away from the edges of the image, see the module."""
    push, distance = 0.0, law[EDGE_DISTANCE]
    for room, sign in ((value - lowest, 1.0), (highest - value, -1.0)):
        if room < distance:
            steep = min(distance / max(room, distance / STEEPEST), STEEPEST)
            push += sign * law[EDGE_GAIN] * distance * (steep - 1.0) * steep * steep
    return push


@njit(cache=True)
def partitioned_twist(law: Array, s: Array, L: Array, rate: Array) -> Array:
    """V_C, shape (6,) [rad/s, m/s]; see the module.

    Args:
        law: Numbers of the law, shape (`LAW_SIZE`,).
        s: Features, shape (2 n + 2,): points, alpha and ln sigma against the desired ones.
        L: Their interaction matrix, shape (2 n + 2, 6).
        rate: What is asked of them, the same shape as s; without share for the axis, and field.
    """
    points = s.shape[0] - 2
    V_C, wanted = np.zeros(6), rate[:points].copy()
    if abs(L[points, ABOUT]) > BLIND:
        V_C[ABOUT] = law[AXIS_GAIN] * rate[points] / L[points, ABOUT]
    if abs(L[points + 1, ALONG]) > BLIND:
        V_C[ALONG] = law[AXIS_GAIN] * rate[points + 1] / L[points + 1, ALONG]
    if law[EDGE_GAIN] > 0.0:  # NaN is not
        along, square = 0.0, 0.0
        for i in range(points):
            lowest, highest = law[X_LOWEST], law[X_HIGHEST]
            if i % 2 == 1:
                lowest, highest = law[Y_LOWEST], law[Y_HIGHEST]
            push = edge_push(law, s[i], lowest, highest)
            wanted[i] += push
            along += L[i, ALONG] * push
            square += L[i, ALONG] * L[i, ALONG]
        if square > BLIND * BLIND:
            V_C[ALONG] += along / square
    across = np.empty((points, 4))
    for i in range(points):
        wanted[i] -= L[i, ABOUT] * V_C[ABOUT] + L[i, ALONG] * V_C[ALONG]
        across[i, 0], across[i, 1] = L[i, 0], L[i, 1]
        across[i, 2], across[i, 3] = L[i, 3], L[i, 4]
    found = least_squares(across, wanted, 4)[0]
    V_C[0], V_C[1], V_C[3], V_C[4] = found[0], found[1], found[2], found[3]
    return V_C
