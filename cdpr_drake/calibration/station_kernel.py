"""Numba kernel for all cables at all poses of a calibration: lengths, directions, derivatives."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_vector_of_matrix
from cdpr_drake.geometry.pulley_kernel import LINEAR_WEIGHT, PULLEY_RADIUS, tangent

SWIVEL = LINEAR_WEIGHT + 1
"""Column of a packed cable at which its swivel axis begins."""

LENGTH, RADIUS_SLOPE, SWIVEL_ANGLE = 0, 1, 2
"""Columns of the numbers of a cable: length [m], its slope over the groove's radius [-], and the
angle of the cable's plane about the swivel axis [rad]."""

U, ARM, BEND, ACROSS = 0, 3, 6, 9
"""Where vectors of a cable begin: unit vector u, anchor arm R p_PB [m], du/dr [1/m], and how the
swivel angle grows as B moves [rad/m]."""


@njit(cache=True, error_model="numpy")
def cable_terms(
    R: Array, p: Array, cables: Array, numbers: Array, vectors: Array, hessians: Array
) -> None:
    """Writes what residuals of a calibration need of each cable at each pose.

    A cable of radius 0 leaves its exit point straight; the slope over the radius holds there, too.
    Along the swivel axis it has no swivel angle, and no slope of one.
    With alpha where the cable leaves the groove, the slope of the length is pi - alpha - sin alpha,
    and alpha falls by (1 + cos alpha) / L: the groove grows about A, not about its centre.

    Args:
        R: Rotations of the platform, shape (k, 3, 3).
        p: Its positions, shape (k, 3) [m].
        cables: `CableSet.packed()`, shape (m, 17).
        numbers: Written, shape (k, m, 3): `LENGTH`, `RADIUS_SLOPE`, `SWIVEL_ANGLE`.
        vectors: Written, shape (k, m, 12): from `U`, `ARM`, `BEND`, `ACROSS`.
        hessians: Written, du/dp_WB, shape (k, m, 3, 3) [1/m].
    """
    d, e, n, side = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(R.shape[0]):
        for i in range(cables.shape[0]):
            h, square = 0.0, 0.0
            for a in range(3):
                arm = 0.0
                for b in range(3):
                    arm += R[k, a, b] * cables[i, 3 + b]
                vectors[k, i, ARM + a] = arm
                d[a] = p[k, a] + arm - cables[i, a]
                n[a] = cables[i, SWIVEL + a]
                h += d[a] * n[a]
            for a in range(3):
                e[a] = d[a] - h * n[a]
                square += e[a] * e[a]
            rho, r = np.sqrt(square), cables[i, PULLEY_RADIUS]
            upright = rho == 0.0 and r == 0.0
            if upright:
                _any_across(n, e)
            else:
                for a in range(3):
                    e[a] /= rho
            side[0] = n[1] * e[2] - n[2] * e[1]
            side[1] = n[2] * e[0] - n[0] * e[2]
            side[2] = n[0] * e[1] - n[1] * e[0]
            L, sine, cosine = tangent(rho, h, r)
            if upright and h != 0.0:
                L, sine, cosine = abs(h), 0.0, -np.sign(h)
            alpha = np.arctan2(sine, cosine)
            numbers[k, i, LENGTH] = L + max(r, 0.0) * (np.pi - alpha)
            numbers[k, i, RADIUS_SLOPE] = np.pi - alpha - sine
            numbers[k, i, SWIVEL_ANGLE] = swivel_angle(e, n)
            turn = -(1.0 + cosine) / L
            bent = 1.0 / L if upright else sine / rho
            for a in range(3):
                normal = cosine * e[a] + sine * n[a]
                vectors[k, i, U + a] = sine * e[a] - cosine * n[a]
                vectors[k, i, BEND + a] = normal * turn
                vectors[k, i, ACROSS + a] = 0.0 if upright else side[a] / rho
                for b in range(3):
                    other = cosine * e[b] + sine * n[b]
                    hessians[k, i, a, b] = normal * other / L + bent * side[a] * side[b]


@njit(cache=True, error_model="numpy")
def rotation_vectors(R: Array, vectors: Array) -> None:
    """Writes the rotation vectors of rotations, shape (k, 3, 3), shape (k, 3) [rad]."""
    for k in range(len(R)):
        vectors[k] = rotation_vector_of_matrix(R[k])


@njit(cache=True, error_model="numpy")
def _any_across(n: Array, e: Array) -> None:
    """Writes a unit vector e across n, both shape (3,)."""
    first = 1 if abs(n[0]) > 0.9 else 0
    size = np.sqrt(1.0 - n[first] * n[first])
    for a in range(3):
        e[a] = ((1.0 if a == first else 0.0) - n[first] * n[a]) / size


@njit(cache=True, error_model="numpy")
def swivel_angle(e: Array, n: Array) -> float:
    """Angle of a direction e about the axis n, in the right-hand sense [rad].

    From x of W, as it is seen along n; from z of W where n is nearly along x.
    """
    first = 2 if abs(n[0]) > 0.9 else 0
    x = np.zeros(3)
    x[first] = 1.0
    along = n[first]
    for a in range(3):
        x[a] -= along * n[a]
    y0 = n[1] * x[2] - n[2] * x[1]
    y1 = n[2] * x[0] - n[0] * x[2]
    y2 = n[0] * x[1] - n[1] * x[0]
    return float(
        np.arctan2(e[0] * y0 + e[1] * y1 + e[2] * y2, e[0] * x[0] + e[1] * x[1] + e[2] * x[2])
    )
