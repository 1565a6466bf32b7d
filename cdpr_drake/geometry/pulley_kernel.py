"""Numba kernels for one cable over a swivelling pulley: length, tangent point, unit vector.

The pulley turns about a swivel axis n through A, which is where the cable enters its groove: the
cable arrives at A along n, follows the groove of radius r in the plane of n and the anchor point
B, and leaves it at the tangent point A' for B. With rho the distance of B from the swivel axis and
h its height over A along n, the centre lies at (r, 0) in the plane's coordinates (rho, h), and

    L = sqrt(rho^2 + h^2 - 2 r rho)          the free part from A' to B,
    alpha = atan2(L (rho - r) + r h, r (rho - r) - L h)   where A' lies on the groove,
    length = L + r (pi - alpha)              from A to B, along the groove and then straight.

The length changes with B as if the cable left a fixed A': its rate is u' v_B with u the unit vector
of the free part, which is what makes (1.20) the Jacobian. A radius of 0 is a cable from a point,
computed by `motion_kernel.cable_line`.

An arm in the place of a pulley swivels about n as well, across it, and has no groove: the cable
begins at its end, a away from A, so that with mx = rho - a

    L = sqrt(mx^2 + h^2) = length,    u = (mx e + h n) / L.

Its rate is u' v_B, too. Kernels take it as a radius of -a.

Where B lies in the groove's circle or, for r > 0, on the swivel axis, no cable runs, and all
numbers but the arm are NaN; `straight_cables` and the systems make an error of that.

Source: servoing thesis 1.3.1, (1.5) to (1.17), (1.9) with the sign of its angle corrected.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion, cable_line
from cdpr_drake.geometry.two_pulleys_kernel import (
    line_by_pose,
    two_pulleys_geometry,
    two_pulleys_line,
)

PULLEY_RADIUS, LINEAR_WEIGHT, SWIVEL_AXIS = 8, 9, 10
"""Columns of `CableSet.packed()` behind the eight of `motion_kernel.pack_cables`: radius of the
groove, or minus the length of an arm [m], weight per unstrained length [N/m], swivel axis n in W
(3). Behind them those of `two_pulleys_kernel`."""

CABLE_SET_COLUMNS = 17
"""Columns of `CableSet.packed()`."""


@njit(cache=True, error_model="numpy")
def pulley_plane(X: Motion, cable: Array) -> Any:
    """B as the pulley sees it: rho, h [m], unit vector from the axis to B (3), arm in W (3) [m].

    Args:
        X: Pose of the platform as `motion_kernel.floating_motion` gives it: at least the rotation
            (row by row) and the position.
        cable: One row of `CableSet.packed()`, shape (17,).
    """
    bx, by, bz = cable[3], cable[4], cable[5]
    rx = X[0] * bx + X[1] * by + X[2] * bz
    ry = X[3] * bx + X[4] * by + X[5] * bz
    rz = X[6] * bx + X[7] * by + X[8] * bz
    dx = X[9] + rx - cable[0]
    dy = X[10] + ry - cable[1]
    dz = X[11] + rz - cable[2]
    nx, ny, nz = cable[10], cable[11], cable[12]
    h = dx * nx + dy * ny + dz * nz
    ex, ey, ez = dx - h * nx, dy - h * ny, dz - h * nz
    rho = np.sqrt(ex * ex + ey * ey + ez * ez)
    if rho > 0.0:
        ex, ey, ez = ex / rho, ey / rho, ez / rho
    return rho, h, ex, ey, ez, rx, ry, rz


@njit(cache=True, error_model="numpy")
def tangent(rho: float, h: float, r: float) -> Any:
    """Free length L [m] and sine, cosine of alpha; NaN where no cable runs. For r != 0.

    Of an arm, r < 0, sine and cosine are those with which u = sine e - cosine n.
    """
    if r < 0.0:
        across = rho + r
        if not across > 0.0:
            return np.nan, np.nan, np.nan
        far = np.sqrt(across * across + h * h)
        return far, across / far, -h / far
    square = rho * rho + h * h - 2.0 * r * rho
    if not (square > 0.0 and rho > 0.0):
        return np.nan, np.nan, np.nan
    L = np.sqrt(square)
    mx = rho - r
    per_square = 1.0 / (mx * mx + h * h)
    sine = (L * mx + r * h) * per_square
    if h >= 0.0 and sine < 0.0:  # round-off; alpha would jump from pi to -pi
        sine = 0.0
    return L, sine, (r * mx - L * h) * per_square


@njit(cache=True, error_model="numpy", inline="always")
def pulley_line(X: Motion, cable: Array) -> Any:
    """Length from A to B [m], unit vector of the free part, arm in W: as `cable_line` gives them.

    Args:
        X: Pose of the platform, see `pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,).

    Returns:
        (length, ux, uy, uz, rx, ry, rz): the length along grooves and free part, the unit vector
        from A' to B in W, and p_PB_W. With a pulley at the platform B is its tangent point B'.
    """
    pose = X[:12]  # a motion is a longer tuple, for which all of this would be compiled again
    if cable[13] > 0.0:
        return two_pulleys_line(pose, cable)
    r = cable[8]
    if r == 0.0:
        return cable_line(pose, cable)
    rho, h, ex, ey, ez, rx, ry, rz = pulley_plane(pose, cable)
    L, sine, cosine = tangent(rho, h, r)
    length = L
    if r > 0.0:
        length = L + r * (np.pi - np.arctan2(sine, cosine))
    nx, ny, nz = cable[10], cable[11], cable[12]
    return (
        length,
        sine * ex - cosine * nx, sine * ey - cosine * ny, sine * ez - cosine * nz,
        rx, ry, rz,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def pulley_geometry(X: Motion, cable: Array) -> Any:
    """All of the geometry of one cable.

    Args:
        X: Pose of the platform, see `pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,).

    Returns:
        (free, arc, tx, ty, tz, ux, uy, uz, rx, ry, rz): length of the free part and length along
        the grooves [m], tangent point p_WA' [m], unit vector from A' to B in W, p_PB_W [m]. With a
        pulley at the platform B is its tangent point B'.
    """
    if cable[13] > 0.0:
        return two_pulleys_geometry(X[:12], cable)
    r = cable[8]
    if r == 0.0:
        length, ux, uy, uz, rx, ry, rz = cable_line(X, cable)
        return length, 0.0, cable[0], cable[1], cable[2], ux, uy, uz, rx, ry, rz
    rho, h, ex, ey, ez, rx, ry, rz = pulley_plane(X, cable)
    L, sine, cosine = tangent(rho, h, r)
    nx, ny, nz = cable[10], cable[11], cable[12]
    out, up, arc = r * (1.0 + cosine), r * sine, r * (np.pi - np.arctan2(sine, cosine))
    if r < 0.0:
        out, up, arc = -r, 0.0, 0.0
    return (
        L, arc,
        cable[0] + out * ex + up * nx, cable[1] + out * ey + up * ny, cable[2] + out * ez + up * nz,
        sine * ex - cosine * nx, sine * ey - cosine * ny, sine * ez - cosine * nz,
        rx, ry, rz,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def unit_vector_derivative(X: Motion, cable: Array, out: Array) -> None:
    """Writes du/dp_WB, how the unit vector of the free part turns as B moves, shape (3, 3) [1/m].

    Symmetric, and the Hessian of the length with respect to p_WB, the platform not turning.

    Args:
        X: Pose of the platform, see `pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,).
        out: Where it is written; columns behind the third stay as they are.
    """
    if cable[13] > 0.0:
        T = np.empty((6, 6))
        line_by_pose(X[:12], cable, T)
        for i in range(3):  # a slice would take numba three seconds to compile
            for j in range(3):
                out[i, j] = T[3 + i, 3 + j]
        return
    r = cable[8]
    if r == 0.0:
        length, ux, uy, uz, _, _, _ = cable_line(X, cable)
        u = (ux, uy, uz)
        for i in range(3):
            for j in range(3):
                out[i, j] = ((1.0 if i == j else 0.0) - u[i] * u[j]) / length
        return
    rho, h, ex, ey, ez, _, _, _ = pulley_plane(X, cable)
    L, sine, cosine = tangent(rho, h, r)
    nx, ny, nz = cable[10], cable[11], cable[12]
    # Within the plane u turns about A' over the length L, out of it about the swivel axis.
    c = (cosine * ex + sine * nx, cosine * ey + sine * ny, cosine * ez + sine * nz)
    y = (ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex)
    for i in range(3):
        for j in range(3):
            out[i, j] = c[i] * c[j] / L + sine / rho * y[i] * y[j]


@njit(cache=True, error_model="numpy")
def pulley_lengths(X: Motion, cables: Array, out: Array) -> None:
    """Writes the lengths from A to B of all cables, shape (m,) [m].

    Args:
        X: Pose of the platform, see `pulley_plane`.
        cables: `CableSet.packed()`, shape (m, 17).
        out: Where they are written.
    """
    for i in range(cables.shape[0]):
        out[i] = pulley_line(X, cables[i])[0]


@njit(cache=True, error_model="numpy")
def pulley_jacobian(X: Motion, cables: Array, lengths: Array, J: Array) -> None:
    """Writes lengths, shape (m,) [m], and J, shape (m, 6), with l_dot = J @ V_WP.

    Columns (w [m/rad], v [-]) in W; arguments as for `pulley_lengths`.

    Source: servoing thesis (1.20), there with columns (v, w) and in the platform frame.
    """
    for i in range(cables.shape[0]):
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        lengths[i] = length
        J[i, 0] = ry * uz - rz * uy
        J[i, 1] = rz * ux - rx * uz
        J[i, 2] = rx * uy - ry * ux
        J[i, 3] = ux
        J[i, 4] = uy
        J[i, 5] = uz
