"""Stiffness of a platform on its cables as a numba kernel: all of its parts at once."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import all_responses
from cdpr_drake.cables.models import STRAIGHT
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.geometry.cable_paths import SHORTEST
from cdpr_drake.geometry.pulley_kernel import pulley_line, unit_vector_derivative
from cdpr_drake.geometry.two_pulleys_kernel import add_platform_turning
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

TOTAL, CABLES, WEIGHT, ELASTIC, TENSION = range(5)
"""Rows of what `stiffness_into` writes."""

DONE, BAD_LENGTH, NO_CABLE = range(3)
"""What it returns: an unstrained length that is not finite or not above 0; a cable cannot run."""


@shared(types.void(VECTOR, VECTOR, MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def _add_turning(r: Array, f: Array, D: Array, K: Array) -> None:
    """Adds the stiffness of a pull f at arm r that changes by D with the anchor point.

    With S = [r]x, F = [f]x: K += [[(F - S D) S, S D], [-D S, D]].
    """
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            # (S X)[i] is r[a] X[b] - r[b] X[a], and (X S)[:, j] is X[:, c] r[d] - X[:, d] r[c].
            K[i, j] -= r[a] * (D[b, c] * r[d] - D[b, d] * r[c])
            K[i, j] += r[b] * (D[a, c] * r[d] - D[a, d] * r[c])
            K[i, j] += f[j] * r[i]
            K[i, 3 + j] += r[a] * D[b, j] - r[b] * D[a, j]
            K[3 + i, j] -= D[i, c] * r[d] - D[i, d] * r[c]
            K[3 + i, 3 + j] += D[i, j]
        K[i, i] -= f[0] * r[0] + f[1] * r[1] + f[2] * r[2]


@njit(cache=True, error_model="numpy")
def stiffness_into(
    law: int, X_WP: Array, cables: Array, l0: Array, platform: Array, K: Array
) -> int:
    """Writes the stiffness of a platform and its parts, see `stiffness.PlatformStiffness`.

    Args:
        law: Number of the cables' law, see `CableModel`.
        X_WP: Pose of the platform as a homogeneous matrix, shape (4, 4).
        cables: `CableSet.packed()`, shape (m, 17).
        l0: Unstrained lengths, shape (m,) [m].
        platform: Force in W that bears the weight (3) [N], centre of mass in P (3) [m].
        K: Gets the parts, shape (5, 6, 6); `ELASTIC` and `TENSION` are of straight cables only.

    Returns:
        `DONE`, or `BAD_LENGTH` or `NO_CABLE`; then K is worthless.
    """
    m = cables.shape[0]
    for i in range(m):
        if not (l0[i] > 0.0 and l0[i] < np.inf):
            return BAD_LENGTH
    X = (
        X_WP[0, 0], X_WP[0, 1], X_WP[0, 2], X_WP[1, 0], X_WP[1, 1], X_WP[1, 2],
        X_WP[2, 0], X_WP[2, 1], X_WP[2, 2], X_WP[0, 3], X_WP[1, 3], X_WP[2, 3],
    )  # fmt: skip
    states, D = np.empty((m, 11)), np.zeros((m, DERIVATIVES, 4))
    if not all_responses(law, X, cables, l0, np.zeros((m, 2)), states, D):
        return NO_CABLE
    K[:] = 0.0
    turned = np.empty((3, 3))
    j = np.empty(6)
    for i in range(m):
        r, f, t = states[i, 8:11], states[i, 0:3], states[i, 3]
        _add_turning(r, f, D[i], K[CABLES])
        add_platform_turning(X, cables[i], t, K[CABLES])
        if law != STRAIGHT:
            continue
        length, ux, uy, uz, _, _, _ = pulley_line(X, cables[i])
        if not length > SHORTEST:
            return NO_CABLE
        unit_vector_derivative(X, cables[i], turned)
        for a in range(3):
            for b in range(3):
                turned[a, b] *= t
        _add_turning(r, f, turned, K[TENSION])
        add_platform_turning(X, cables[i], t, K[TENSION])
        if t > 0.0:
            j[0], j[1], j[2] = r[1] * uz - r[2] * uy, r[2] * ux - r[0] * uz, r[0] * uy - r[1] * ux
            j[3], j[4], j[5] = ux, uy, uz
            k = cables[i, 6] / l0[i]
            for a in range(6):
                for b in range(6):
                    K[ELASTIC, a, b] += j[a] * k * j[b]
    # The arm of the weight turns with the platform.
    cx = X[0] * platform[3] + X[1] * platform[4] + X[2] * platform[5]
    cy = X[3] * platform[3] + X[4] * platform[4] + X[5] * platform[5]
    cz = X[6] * platform[3] + X[7] * platform[4] + X[8] * platform[5]
    arm, weight = (cx, cy, cz), K[WEIGHT]
    along = platform[0] * cx + platform[1] * cy + platform[2] * cz
    for a in range(3):
        for b in range(3):
            weight[a, b] = arm[a] * platform[b] - (along if a == b else 0.0)
    for a in range(6):
        for b in range(6):
            K[TOTAL, a, b] = K[CABLES, a, b] + weight[a, b]
    return DONE
