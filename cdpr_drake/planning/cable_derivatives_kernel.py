"""Numba kernels: how a cable's line, its tangent point and its length bend with the anchor point.

With the plane of a pulley as in `pulley_kernel`, e away from the swivel axis n, y = n x e, and
c = cos(alpha) e + sin(alpha) n, where u = sin(alpha) e - cos(alpha) n leaves A', a move dB of the
anchor point gives

    dalpha = c' dB / L,    de = y (y' dB) / rho,    dL = u' dB + r dalpha,    drho = e' dB,

from which all of this follows; a radius of 0 is a cable from a point. Of an arm, whose end A' is a
away from the axis, dA' = a de and dL = u' dB. All of it is exact.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion, cable_line
from cdpr_drake.geometry.pulley_kernel import (
    PULLEY_RADIUS,
    SWIVEL_AXIS,
    pulley_plane,
    tangent,
)


@njit(cache=True, inline="always")
def dot(a: Any, b: Any) -> Any:
    """a' b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, inline="always")
def cross(a: Any, b: Any) -> Any:
    """The vector product of a and b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, inline="always")
def axis(k: int) -> Any:
    """The unit vector along axis k."""
    return (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)


@njit(cache=True, error_model="numpy")
def exit_derivative(X: Motion, cable: Array, out: Array) -> None:
    """Writes dp_WA'/dp_WB, how the tangent point moves with the anchor point, shape (3, 3) [-].

    Args:
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()` without a pulley at the platform, shape (17,).
        out: Where it is written.
    """
    r = cable[PULLEY_RADIUS]
    if r == 0.0:
        out[:] = 0.0
        return
    rho, h, ex, ey, ez, _, _, _ = pulley_plane(X, cable)
    L, sine, cosine = tangent(rho, h, r)
    e = (ex, ey, ez)
    n = (cable[SWIVEL_AXIS], cable[SWIVEL_AXIS + 1], cable[SWIVEL_AXIS + 2])
    y = cross(n, e)
    for i in range(3):
        back = -sine * e[i] + cosine * n[i]
        for j in range(3):
            if r < 0.0:
                out[i, j] = -r / rho * y[i] * y[j]
                continue
            c = cosine * e[j] + sine * n[j]
            out[i, j] = r * (back * c / L + (1.0 + cosine) / rho * y[i] * y[j])


@njit(cache=True, error_model="numpy")
def bend_gradient(X: Motion, cable: Array, v: Any, out: Array) -> float:
    """v' D v with D = du/dp_WB, and its derivative by p_WB with v fixed, shape (3,).

    Args:
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()` without a pulley at the platform, shape (17,).
        v: A vector in W, three numbers.
        out: Gets the derivative.

    Returns:
        v' D v, by m^-1.
    """
    r = cable[PULLEY_RADIUS]
    if r == 0.0:
        length, ux, uy, uz, _, _, _ = cable_line(X, cable)
        u = (ux, uy, uz)
        along = dot(u, v)
        value = (dot(v, v) - along * along) / length
        for k in range(3):
            # du/dB_k times v, and dlength/dB_k
            turning = (v[k] - along * u[k]) / length
            out[k] = (-2.0 * along * turning - value * u[k]) / length
        return value
    rho, h, ex, ey, ez, _, _, _ = pulley_plane(X, cable)
    L, sine, cosine = tangent(rho, h, r)
    e = (ex, ey, ez)
    n = (cable[SWIVEL_AXIS], cable[SWIVEL_AXIS + 1], cable[SWIVEL_AXIS + 2])
    y = cross(n, e)
    ev, nv, yv = dot(e, v), dot(n, v), dot(y, v)
    cv, uv = cosine * ev + sine * nv, sine * ev - cosine * nv
    value = cv * cv / L + sine / rho * yv * yv
    for k in range(3):
        dalpha = (cosine * e[k] + sine * n[k]) / L
        dL = sine * e[k] - cosine * n[k] + max(r, 0.0) * dalpha
        side = y[k] / rho
        dcv = -uv * dalpha + cosine * yv * side
        dyv = -ev * side
        out[k] = (
            (2.0 * dcv - cv * dL / L) * cv / L
            + (cosine * dalpha - sine * e[k] / rho) * yv * yv / rho
            + 2.0 * sine / rho * yv * dyv
        )
    return value
