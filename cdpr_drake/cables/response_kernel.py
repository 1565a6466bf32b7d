"""Numba kernels for one cable by either law: pull, tensions, lengths, sag, and their derivatives.

A straight cable of length l (over its pulley, if it has one) and unstrained length l0 pulls with
t = E S (l / l0 - 1), or not at all; a sagging one as `hanging_kernel` says. Both depend on
where the anchor point is and on l0 only; damping comes on top:

    t_d = T (u' K u  u' v_B + dt/dl0 l0_dot),        K = d(pull)/dp_WB,

with u the direction of the pull. For straight cables this is Kelvin and Voigt's law, servoing
thesis (2.6) with damping; for all it takes energy where the winch stands still.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.cables.catenary_kernel import VERTICAL
from cdpr_drake.cables.hanging_kernel import sagging_cable, solve_catenary
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import pulley_line, unit_vector_derivative
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

DERIVATIVES = 8
"""Rows of a cable's derivatives by (p_WB, l0): pull (3), tension at the platform, tension at the
exit point, length, surplus over the straight path, sag."""

RESPONSE = types.Tuple((*[types.float64] * 11, types.boolean))
POSE, MOTION = (types.UniTuple(types.float64, count) for count in (12, 18))
"""Types of what kernels of a cable give, and of the pose or motion that they take."""


@njit(cache=True, error_model="numpy")
def straight_derivatives(
    u: Any, length: float, l0: float, tension: float, by_length: float, slack: bool,
    longer: float, out: Array,
) -> None:  # fmt: skip
    """Derivatives of a straight cable, shape (`DERIVATIVES`, 4), whose first three rows hold du/dp.

    Args:
        u: Unit vector of the pull.
        length: Of the path [m].
        l0: Unstrained length [m].
        tension: Of the cable [N].
        by_length: Its derivative by the path's length [N/m].
        slack: Whether it is slack.
        longer: Factor by which it is longer than l0 when nothing pulls.
        out: Written.
    """
    for i in range(3):
        for j in range(3):
            out[i, j] = tension * out[i, j] + by_length * u[i] * u[j]
        out[i, 3] = -by_length * length / l0 * u[i]
        out[3, i] = by_length * u[i]
        out[4, i] = out[3, i]
        out[5, i] = u[i]
        out[6, i] = -u[i] if slack else 0.0
        out[7, i] = 0.0
    out[3, 3] = -by_length * length / l0
    out[4, 3] = out[3, 3]
    out[5, 3] = 0.0
    out[6, 3] = longer if slack else 0.0
    out[7, 3] = 0.0


@njit(cache=True, error_model="numpy")
def straight_response(X: Motion, cable: Array, l0: float, out: Array) -> Any:
    """A straight elastic cable; see `dispatch_kernel.cable_response`."""
    length, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    strain = length / l0 - 1.0
    tension = cable[6] * strain if strain > 0.0 else 0.0
    by_length = cable[6] / l0 if strain > 0.0 else 0.0
    unit_vector_derivative(X, cable, out[:3])  # without gaps, as all others give it
    slack = not strain > 0.0
    straight_derivatives((ux, uy, uz), length, l0, tension, by_length, slack, 1.0, out)
    return (
        tension * ux, tension * uy, tension * uz, tension, tension,
        length, max(l0 - length, 0.0), 0.0, rx, ry, rz, ux == ux,
    )  # fmt: skip


@shared(RESPONSE(POSE, VECTOR, types.float64, VECTOR, MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def sagging_response(
    X: Motion, cable: Array, l0: float, guess: Array, inner: Array, out: Array
) -> Any:
    """An elastic cable that sags, swivel axis vertical; see `dispatch_kernel.cable_response`."""
    straight, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    dx = X[9] + rx - cable[0]
    dy = X[10] + ry - cable[1]
    z = X[11] + rz - cable[2]
    rho = np.sqrt(dx * dx + dy * dy)
    ex, ey = (dx / rho, dy / rho) if rho > 0.0 else (1.0, 0.0)
    rho = max(rho, VERTICAL * l0)
    r, ES, w, sigma = cable[8], cable[6], cable[9], cable[12]
    H, V_A, good = solve_catenary(rho, z, r, sigma, l0, ES, w, guess[0], guess[1])
    if not good:
        guess[0] = 0.0
        return (
            np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, rx, ry, rz, False,
        )  # fmt: skip
    guess[0], guess[1] = H, V_A
    H, V_B, t_B, t_A, length, sag = sagging_cable(rho, z, r, sigma, l0, ES, w, H, V_A, inner)
    for k, row in enumerate((2, 3, 4, 5)):
        target = 3 + k if k < 3 else 7
        out[target, 0] = inner[row, 0] * ex
        out[target, 1] = inner[row, 0] * ey
        out[target, 2] = inner[row, 1]
        out[target, 3] = inner[row, 2]
    turn = H / rho
    out[0, 0] = inner[0, 0] * ex * ex + turn * ey * ey
    out[0, 1] = (inner[0, 0] - turn) * ex * ey
    out[1, 0] = out[0, 1]
    out[1, 1] = inner[0, 0] * ey * ey + turn * ex * ex
    out[0, 2], out[1, 2] = inner[0, 1] * ex, inner[0, 1] * ey
    out[2, 0], out[2, 1], out[2, 2] = inner[1, 0] * ex, inner[1, 0] * ey, inner[1, 1]
    out[0, 3], out[1, 3], out[2, 3] = inner[0, 2] * ex, inner[0, 2] * ey, inner[1, 2]
    surplus = l0 > straight
    out[6, 0] = -ux if surplus else 0.0
    out[6, 1] = -uy if surplus else 0.0
    out[6, 2] = -uz if surplus else 0.0
    out[6, 3] = 1.0 if surplus else 0.0
    return (
        H * ex, H * ey, V_B, t_B, t_A, length, max(l0 - straight, 0.0), sag, rx, ry, rz, True,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def damping_tension(
    X: Motion, px: float, py: float, pz: float, t: float, rx: float, ry: float, rz: float,
    D: Array, T: float, l0_dot: float,
) -> float:  # fmt: skip
    """The damping part t_d of a cable's tension [N]; see the module. 0 where t is 0.

    Args:
        X: Motion of the platform, 18 numbers, see `motion_kernel.floating_motion`.
        px: Pull of the cable at rest, with py, pz [N].
        py: See px.
        pz: See px.
        t: Its tension at the platform at rest [N].
        rx: Anchor arm p_PB_W, with ry, rz [m].
        ry: See rx.
        rz: See rx.
        D: Derivatives of a cable at rest, see `DERIVATIVES`, shape (8, 4).
        T: Retardation time [s].
        l0_dot: Rate of the unstrained length [m/s].
    """
    if T == 0.0 or not t > 0.0:
        return 0.0 * t
    ux, uy, uz = px / t, py / t, pz / t
    v = (
        ux * (X[15] + X[13] * rz - X[14] * ry)
        + uy * (X[16] + X[14] * rx - X[12] * rz)
        + uz * (X[17] + X[12] * ry - X[13] * rx)
    )
    stiffness = (
        ux * (D[0, 0] * ux + D[0, 1] * uy + D[0, 2] * uz)
        + uy * (D[1, 0] * ux + D[1, 1] * uy + D[1, 2] * uz)
        + uz * (D[2, 0] * ux + D[2, 1] * uy + D[2, 2] * uz)
    )
    return T * (stiffness * v + D[3, 3] * l0_dot)


@shared(RESPONSE(MOTION, VECTOR, types.float64, types.float64, VECTOR, MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def sagging_motion(
    X: Motion, cable: Array, l0: float, l0_dot: float, guess: Array, inner: Array, D: Array
) -> Any:
    """An elastic cable that sags, with damping; see `dispatch_kernel.cable_motion`."""
    px, py, pz, t, t_A, length, loose, sag, rx, ry, rz, good = sagging_response(
        X[:12], cable, l0, guess, inner, D
    )
    if good:
        damping = damping_tension(X, px, py, pz, t, rx, ry, rz, D, cable[7], l0_dot)
        damping = max(damping, -t)
        share = 1.0 + damping / t
        px, py, pz, t = px * share, py * share, pz * share, t + damping
        t_A = max(t_A + damping, 0.0 * t_A)
    return px, py, pz, t, t_A, length, loose, sag, rx, ry, rz, good


@njit(cache=True, error_model="numpy")
def straight_motion(X: Motion, cable: Array, l0: float, l0_dot: float) -> Any:
    """A straight elastic cable with damping; see `dispatch_kernel.cable_motion`."""
    length, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    per_l0 = 1.0 / l0
    strain = length * per_l0 - 1.0
    t = 0.0 * length
    if strain > 0.0:
        rate = (
            ux * (X[15] + X[13] * rz - X[14] * ry)
            + uy * (X[16] + X[14] * rx - X[12] * rz)
            + uz * (X[17] + X[12] * ry - X[13] * rx)
        )
        t = cable[6] * (strain + cable[7] * (rate - length * l0_dot * per_l0) * per_l0)
        t = max(t, 0.0 * length)
    loose = max(l0 - length, 0.0 * l0)
    return (
        t * ux, t * uy, t * uz, t, t, length, loose, 0.0 * t, rx, ry, rz, ux == ux,
    )  # fmt: skip
