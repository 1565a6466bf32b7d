"""The law of a cable by its number: at rest, in motion, its energy, and when it is slack.

Here and nowhere else kernels tell cables apart. A further law is a kernel file, a number in
`models`, here a branch in each of the functions that it answers in another way, and a row of
`models.CABLE_MODELS`; a model by a law that is there is a row only. Laws are not called by address
as tension methods are: their sources also run on other scalars, see `simulation_autodiff`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import (
    behaving_energy,
    behaving_motion,
    behaving_response,
)
from cdpr_drake.cables.elastic_law import sagging_energy, straight_energy
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.models import BEHAVING, HANGING
from cdpr_drake.cables.response_kernel import (
    sagging_motion,
    sagging_response,
    straight_motion,
    straight_response,
)
from cdpr_drake.geometry.motion_kernel import Motion

SLACK_WEIGHTS = 1.0
"""A cable is slack whose tension at the platform is at most this many times its own weight.

A cable that hangs loosely from the platform pulls on it with a part of its weight, however long it
is; one across a span that pulls with its weight sags by an eighth of the span."""


@njit(cache=True, inline="always")
def cable_response(
    law: int, X: Motion, cable: Array, l0: float, guess: Array, inner: Array, out: Array
) -> Any:
    """One cable at rest, and how its response changes with the anchor point and l0.

    Args:
        law: `STRAIGHT`, `HANGING` or `BEHAVING`.
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,), by `BEHAVING` (23,).
        l0: Unstrained length [m].
        guess: (H, V_A) of a sagging cable to begin with, H = 0: none; the solution is written
            here, shape (2,) [N].
        inner: Room for `sagging_cable`'s derivatives, shape (6, 3).
        out: Derivatives by (p_WB in W, l0), shape (8, 4), are written here; see `DERIVATIVES`.

    Returns:
        (px, py, pz, t_B, t_A, length, surplus, sag, rx, ry, rz, good): pull along the cable,
        minus the force on the platform, in W [N]; tensions at B and at A [N]; length from A to B
        [m]; what l0 is longer than the straight path [m]; sag [m]; p_PB_W [m]; whether a cable can
        run so. Where not, the numbers are NaN.
    """
    if law == HANGING and cable[9] > 0.0:
        return sagging_response(X[:12], cable, l0, guess, inner, out)
    if law == BEHAVING:
        return behaving_response(X[:12], cable, l0, out)
    return straight_response(X[:12], cable, l0, out)


@njit(cache=True, error_model="numpy")
def all_responses(
    law: int, X: Motion, cables: Array, l0: Array, guesses: Array, states: Array, out: Array
) -> bool:
    """All cables: writes `cable_response`'s first eleven results and derivatives.

    Args:
        law: `STRAIGHT`, `HANGING` or `BEHAVING`.
        X: Pose of the platform.
        cables: `CableSet.packed()`, shape (m, 17).
        l0: Unstrained lengths, shape (m,) [m].
        guesses: See `cable_response`, shape (m, 2).
        states: Results, shape (m, 11).
        out: Derivatives, shape (m, 8, 4).

    Returns:
        Whether all cables can run so.
    """
    good = True
    inner = np.empty((SENSITIVITIES, 3))
    for i in range(cables.shape[0]):
        a, b, c, d, e, f, g, h, x, y, z, one = cable_response(
            law, X, cables[i], l0[i], guesses[i], inner, out[i]
        )
        states[i, 0], states[i, 1], states[i, 2], states[i, 3] = a, b, c, d
        states[i, 4], states[i, 5], states[i, 6], states[i, 7] = e, f, g, h
        states[i, 8], states[i, 9], states[i, 10] = x, y, z
        good = good and one
    return good


@njit(cache=True, inline="always")
def cable_motion(
    law: int, X: Motion, cable: Array, l0: float, l0_dot: float,
    guess: Array, inner: Array, D: Array,
) -> Any:  # fmt: skip
    """One cable in motion: `cable_response` with damping.

    Args:
        law: `STRAIGHT`, `HANGING` or `BEHAVING`.
        X: Motion of the platform, 18 numbers.
        cable: One row of `CableSet.packed()`, shape (17,), by `BEHAVING` (23,).
        l0: Unstrained length [m].
        l0_dot: Its rate [m/s].
        guess: As in `cable_response`; by `BEHAVING` what has crept, and the strain, see
            `behaving_kernel.CREPT`.
        inner: As in `cable_response`.
        D: Room for derivatives, shape (8, 4); written for a catenary only.

    Returns:
        As `cable_response`.
    """
    if law == HANGING and cable[9] > 0.0:
        return sagging_motion(X, cable, l0, l0_dot, guess, inner, D)
    if law == BEHAVING:
        return behaving_motion(X, cable, l0, l0_dot, guess)
    return straight_motion(X, cable, l0, l0_dot)


@njit(cache=True, inline="always")
def cable_energy(law: int, X: Motion, cable: Array, l0: float, solved: Array) -> float:
    """Potential energy of one cable, its weight's from the height of A on [J].

    Args:
        law: `STRAIGHT`, `HANGING` or `BEHAVING`.
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,), by `BEHAVING` (23,).
        l0: Unstrained length [m].
        solved: (H, V_A) of a sagging cable as `cable_response` leaves them, shape (2,) [N].
    """
    if law == HANGING and cable[9] > 0.0:
        return sagging_energy(X[:12], cable, l0, solved)
    if law == BEHAVING:
        return behaving_energy(X[:12], cable, l0)
    return straight_energy(X[:12], cable, l0)


@njit(cache=True, inline="always")
def slack_tension(law: int, weight: float, l0: float) -> float:
    """Tension at the platform up to which a cable is slack [N]; 0 where weight does not count.

    Args:
        law: `STRAIGHT`, `HANGING` or `BEHAVING`.
        weight: Weight per length [N/m].
        l0: Unstrained length [m].
    """
    return SLACK_WEIGHTS * weight * l0 if law == HANGING else 0.0 * l0
