"""The twist of partitioned servoing: the optical axis first, the rest by the image points.

The last two features are alpha and ln sigma, see `partitioned_features_kernel`. From the rates that
are asked of all features,

    w_z = rate(alpha) / L(alpha, w_z),  v_z = rate(ln sigma) / L(ln sigma, v_z),
    V_xy = L_xy^+ (rate - L_z (w_z, v_z)),

with L_xy, L_z the columns of the points' rows, is the law as it was published. Its points want to
go straight to their goals, also while the axis turns them there in circles: what is left between
the two is radial, and up to 2 lambda times the points' distance from the middle at half a turn.
By symmetry it moves nothing there, but any tilt makes it push the other four motions, and with an
object that takes little of the image they follow it fast. So there is a second form: goals that
are turned and scaled by what alpha and sigma have left,

    e'_i = s_i - (sigma / sigma*) R(alpha - alpha*) s*_i,  V_xy = L_xy^+ (-lambda e'),

which move as the axis moves the points, so that its motion needs no compensation.

A field at the edges of the image, if there is one, pushes a point away from the edges by

    F_i = eta rho_0 (rho_0 / rho - 1) (rho_0 / rho)^2 within rho_0 of an edge.

v_z gets what along the axis alone comes nearest to that, by least squares: the camera steps back.
The other four motions are asked for the mean of F on all points: those of a rigid body cannot be
pushed one by one, and what tries to would tilt the camera.

Source: Corke and Hutchinson, A new partitioned approach to image-based visual servo control, 2001:
the partition, alpha, sigma, and a field by 1/2 (1 / rho - 1 / rho_0)^2 as of Khatib's. The gains'
units, how the field is shared between axis and rest, and the second form are chosen here.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import least_squares
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.servoing.servo_law import (
    AXIS_GAIN,
    EDGE_DISTANCE,
    EDGE_GAIN,
    GOAL,
    TURNED,
    X_HIGHEST,
    X_LOWEST,
    Y_HIGHEST,
    Y_LOWEST,
)

ABOUT, ALONG = 2, 5
"""Columns of the rotation about the optical axis and of the translation along it."""

STEEPEST = 2.0
"""Largest rho_0 / rho that counts: a point is pushed by 4 eta rho_0 at most, since what is pushed
past the image's middle in one step is not kept in it."""

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


@shared(VECTOR(VECTOR, VECTOR, VECTOR, MATRIX, VECTOR, types.float64))
@njit(cache=True)
def partitioned_twist(law: Array, s: Array, e: Array, L: Array, rate: Array, gain: float) -> Array:
    """V_C, shape (6,) [rad/s, m/s]; see the module.

    Args:
        law: Numbers of the law, shape (`LAW_SIZE`,).
        s: Features, shape (2 n + 2,): points, alpha and ln sigma against the desired ones.
        e: Their error, the same shape.
        L: Their interaction matrix, shape (2 n + 2, 6).
        rate: What is asked of them, the same shape as s; without share for the axis, and field.
        gain: lambda in it [1/s].
    """
    points = s.shape[0] - 2
    V_C, wanted = np.zeros(6), rate[:points].copy()
    if abs(L[points, ABOUT]) > BLIND:
        V_C[ABOUT] = law[AXIS_GAIN] * rate[points] / L[points, ABOUT]
    if abs(L[points + 1, ALONG]) > BLIND:
        V_C[ALONG] = law[AXIS_GAIN] * rate[points + 1] / L[points + 1, ALONG]
    if law[EDGE_GAIN] > 0.0:  # NaN is not
        along, square, mean = 0.0, 0.0, np.zeros(2)
        for i in range(points):
            lowest, highest = law[X_LOWEST], law[X_HIGHEST]
            if i % 2 == 1:
                lowest, highest = law[Y_LOWEST], law[Y_HIGHEST]
            push = edge_push(law, s[i], lowest, highest)
            mean[i % 2] += 2.0 * push / points
            along += L[i, ALONG] * push
            square += L[i, ALONG] * L[i, ALONG]
        for i in range(points):
            wanted[i] += mean[i % 2]
        if square > BLIND * BLIND:
            V_C[ALONG] += along / square
    if law[GOAL] == TURNED:
        size = math.exp(e[points + 1])
        cosine, sine = size * math.cos(e[points]), size * math.sin(e[points])
        for i in range(0, points, 2):
            x, y = s[i] - e[i], s[i + 1] - e[i + 1]
            wanted[i] += gain * (cosine * x - sine * y - x)
            wanted[i + 1] += gain * (sine * x + cosine * y - y)
    else:
        for i in range(points):
            wanted[i] -= L[i, ABOUT] * V_C[ABOUT] + L[i, ALONG] * V_C[ALONG]
    across = np.empty((points, 4))
    for i in range(points):
        across[i, 0], across[i, 1] = L[i, 0], L[i, 1]
        across[i, 2], across[i, 3] = L[i, 3], L[i, 4]
    found = least_squares(across, wanted, 4)[0]
    V_C[0], V_C[1], V_C[3], V_C[4] = found[0], found[1], found[2], found[3]
    return V_C
