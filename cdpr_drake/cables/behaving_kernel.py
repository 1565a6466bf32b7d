"""Numba kernels for one straight cable that stiffens, is warm, creeps, and rubs in its groove.

With f the factor of heat, e = l / (f l0) - 1 and z what has crept of it, see `cable_behaviour`,

    t = E S (exp(g E S e) - 1) / (g E S) + E1 S (e - z) + T dt/de de/dt,   dz/dt = (e - z) / tau,

dt/de without creep, and the drum holds t exp(-mu theta tanh(l0_dot / v)), where v is the speed at
which a cable slides in its groove for good. At rest for long, z = e and nothing slides: then the
cable is that of the first term. One that is slack carries nothing, and its springs come back by
themselves: e is then E1 z / (E + E1), where both of them are in balance.

Source: Feyrer, Wire Ropes, 2015, 1.4 and 3.1; Flugge, Viscoelasticity, 1975, chapter 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.cables.response_kernel import MOTION, POSE, RESPONSE, straight_derivatives
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import (
    CABLE_SET_COLUMNS,
    PULLEY_RADIUS,
    pulley_geometry,
    pulley_line,
    unit_vector_derivative,
)
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

STIFFENING, LONGER, FRICTION, SLIDING, CREEP, CREEP_TIME = (
    CABLE_SET_COLUMNS + k for k in range(6)
)  # fmt: skip
"""Columns of `CableSet.packed()` behind those of elastic cables: g [1/N], f [-], mu [-], v [m/s],
E1 over E [-], tau [s]."""

CREPT, STRAIN = range(2)
"""What stands where catenaries keep their solution: z, which is read, and e, which is written."""


@njit(cache=True)
def put_crept(crept: Array, guesses: Array) -> None:
    """Puts z of all cables, shape (m,), where `behaving_motion` reads it, shape (m, 2)."""
    for i in range(crept.shape[0]):
        guesses[i, CREPT] = crept[i]


@njit(cache=True)
def creep_rates(guesses: Array, cables: Array, out: Array) -> None:
    """Writes dz/dt of all cables, shape (m,) [1/s], from what `behaving_motion` left."""
    for i in range(out.shape[0]):
        out[i] = (guesses[i, STRAIN] - guesses[i, CREPT]) / cables[i, CREEP_TIME]


@njit(cache=True, error_model="numpy", inline="always")
def _stretched(strain: float, ES: float, g: float) -> Any:
    """Tension of the first term and its derivative by the strain [N], of a taut cable."""
    if g > 0.0:
        half = 0.5 * g * ES * strain
        grown = np.exp(half)
        # exp(x) - 1 without loss at small x, of functions that AutoDiff has, too.
        return 2.0 * grown * np.sinh(half) / g, ES * grown * grown
    return ES * strain, ES + 0.0 * strain


@shared(RESPONSE(POSE, VECTOR, types.float64, MATRIX))
@njit(cache=True, error_model="numpy")
def behaving_response(X: Motion, cable: Array, l0: float, out: Array) -> Any:
    """Such a cable that has been at rest for long; see `dispatch_kernel.cable_response`."""
    length, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    natural = cable[LONGER] * l0
    strain = length / natural - 1.0
    tension, by_length = 0.0, 0.0
    if strain > 0.0:
        tension, slope = _stretched(strain, cable[6], cable[STIFFENING])
        by_length = slope / natural
    unit_vector_derivative(X, cable, out[:3])
    slack = not strain > 0.0
    straight_derivatives((ux, uy, uz), length, l0, tension, by_length, slack, cable[LONGER], out)
    return (
        tension * ux, tension * uy, tension * uz, tension, tension,
        length, max(natural - length, 0.0), 0.0, rx, ry, rz, ux == ux,
    )  # fmt: skip


@shared(RESPONSE(MOTION, VECTOR, types.float64, types.float64, VECTOR))
@njit(cache=True, error_model="numpy")
def behaving_motion(X: Motion, cable: Array, l0: float, l0_dot: float, inner: Array) -> Any:
    """Such a cable in motion; see `dispatch_kernel.cable_motion`.

    Args:
        X: As there.
        cable: As there, shape (23,).
        l0: As there.
        l0_dot: As there.
        inner: `CREPT`, read, and `STRAIN`, written, shape (2,).
    """
    length, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    natural = cable[LONGER] * l0
    strain = length / natural - 1.0
    soft, ES, z = cable[CREEP], cable[6], inner[CREPT]
    t, slope = _stretched(max(strain, 0.0 * strain), ES, cable[STIFFENING])
    if soft > 0.0:
        t = t + soft * ES * (strain - z)
    if strain > 0.0 and t > 0.0:
        rate = (
            ux * (X[15] + X[13] * rz - X[14] * ry)
            + uy * (X[16] + X[14] * rx - X[12] * rz)
            + uz * (X[17] + X[12] * ry - X[13] * rx)
        )
        t = t + slope * cable[7] * (rate - length * l0_dot / l0) / natural
        t = max(t, 0.0 * length)
        inner[STRAIN] = strain
    else:
        t = 0.0 * length
        inner[STRAIN] = soft / (1.0 + soft) * z
    drum = t
    if cable[FRICTION] > 0.0 and cable[PULLEY_RADIUS] > 0.0:
        _, arc, _, _, _, _, _, _, _, _, _ = pulley_geometry(X[:12], cable)
        theta = arc / cable[PULLEY_RADIUS]
        drum = t * np.exp(-cable[FRICTION] * theta * np.tanh(l0_dot / cable[SLIDING]))
    loose = max(natural - length, 0.0 * l0)
    return (
        t * ux, t * uy, t * uz, t, drum, length, loose, 0.0 * t, rx, ry, rz, ux == ux,
    )  # fmt: skip


@shared(types.float64(POSE, VECTOR, types.float64))
@njit(cache=True, error_model="numpy")
def behaving_energy(X: Motion, cable: Array, l0: float) -> float:
    """Energy of such a cable at rest for long [J]; see `dispatch_kernel.cable_energy`."""
    length, _, _, _, _, _, _ = pulley_line(X, cable)
    natural, ES, g = cable[LONGER] * l0, cable[6], cable[STIFFENING]
    strain = max(length / natural - 1.0, 0.0)
    if g * ES == 0.0:
        return 0.5 * ES * strain * strain * natural
    x = g * ES * strain
    # exp(x) - 1 - x, by its series where it would be lost in rounding.
    rest = 0.5 * x * x * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0))))
    if x > 0.01:
        rest = np.expm1(x) - x
    return rest / (g * g * ES) * natural
