"""Circles as visual features: centre and moments of their images, ellipses."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

ELLIPSE_SIZE = 5
"""Numbers of an ellipse: centre (x, y) and moments (n20, n11, n02)."""


@njit(cache=True)
def circle_images(R_CO: Array, p_CO: Array, radii: Array) -> Array:
    """Images of circles about O in its plane z = 0, as ellipses, shape (n, 5) [-].

    An ellipse is (x, y, n20, n11, n02) at unit focal length: its centre and the second central
    moments of its area, divided by that area. The centre is not the image of O.

    Args:
        R_CO: Rotation of the object O in the camera frame C, shape (3, 3).
        p_CO: Its position there, shape (3,) [m].
        radii: Radii of the circles, shape (n,) [m].
    """
    ellipses = np.empty((radii.shape[0], ELLIPSE_SIZE))
    for k in range(radii.shape[0]):
        # The dual conic of the image is H diag(1, 1, -1) H' with H = [r x_O, r y_O, p_CO], and
        # that of an ellipse is [[g g' - 4 N, g], [g', 1]] up to scale.
        D = np.empty((3, 3))
        square = radii[k] * radii[k]
        for i in range(3):
            for j in range(3):
                D[i, j] = square * (R_CO[i, 0] * R_CO[j, 0] + R_CO[i, 1] * R_CO[j, 1])
                D[i, j] -= p_CO[i] * p_CO[j]
        D /= D[2, 2]
        x, y = D[0, 2], D[1, 2]
        ellipses[k, 0], ellipses[k, 1] = x, y
        ellipses[k, 2] = (x * x - D[0, 0]) / 4.0
        ellipses[k, 3] = (x * y - D[0, 1]) / 4.0
        ellipses[k, 4] = (y * y - D[1, 1]) / 4.0
    return ellipses


@njit(cache=True)
def plane_of(R_CO: Array, p_CO: Array) -> Array:
    """(A, B, C) of the object's plane z = 0 with 1/Z = A x + B y + C, shape (3,) [1/m].

    Arguments as for `circle_images`. Infinite where the plane passes through the camera.
    """
    normal = R_CO[:, 2]
    return normal / (normal[0] * p_CO[0] + normal[1] * p_CO[1] + normal[2] * p_CO[2])


@njit(cache=True)
def ellipses_interaction(ellipses: Array, plane: Array) -> Array:
    """L with d(x, y, n20, n11, n02, ...)/dt = L @ V_C for circles at rest, shape (5 n, 6).

    V_C = (w, v) is the camera's twist in C [rad/s, m/s]. With f the velocity of image points and G
    its gradient at the centre, the moments N of an ellipse obey dN/dt = G N + N G', since central
    moments of odd order vanish; the centre moves with f and 4 times the part of f that is
    quadratic about it. Exact for any pose of the plane. For concentric circles that are seen
    frontally and centred the rank is 5: the rotation about the optical axis is not seen.

    Args:
        ellipses: As from `circle_images`, shape (n, 5) [-].
        plane: (A, B, C) as from `plane_of`, shape (3,) [1/m].

    Source: derived for ellipses from Chaumette, Image moments: a general and useful set of
    features for visual servoing, 2004; servoing thesis (1.58) is its frontal case.
    """
    A, B, C = plane[0], plane[1], plane[2]
    L = np.empty((ELLIPSE_SIZE * ellipses.shape[0], 6))
    unit = np.zeros(6)
    for k in range(ellipses.shape[0]):
        x, y, n20, n11, n02 = ellipses[k]
        zeta = A * x + B * y + C
        for column in range(6):
            unit[:] = 0.0
            unit[column] = 1.0
            wx, wy, wz, vx, vy, vz = unit
            fx = zeta * (x * vz - vx) + x * y * wx - (1.0 + x * x) * wy + y * wz
            fy = zeta * (y * vz - vy) + (1.0 + y * y) * wx - x * y * wy - x * wz
            along_x, along_y = A * vz - wy, B * vz + wx
            g11 = A * (x * vz - vx) + zeta * vz + y * wx - 2.0 * x * wy
            g12 = B * (x * vz - vx) + x * wx + wz
            g21 = A * (y * vz - vy) - y * wy - wz
            g22 = B * (y * vz - vy) + zeta * vz + 2.0 * y * wx - x * wy
            row = ELLIPSE_SIZE * k
            L[row, column] = fx + 4.0 * (along_x * n20 + along_y * n11)
            L[row + 1, column] = fy + 4.0 * (along_x * n11 + along_y * n02)
            L[row + 2, column] = 2.0 * (g11 * n20 + g12 * n11)
            L[row + 3, column] = g11 * n11 + g12 * n02 + g21 * n20 + g22 * n11
            L[row + 4, column] = 2.0 * (g21 * n11 + g22 * n02)
    return L
