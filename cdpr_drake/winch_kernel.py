"""The winches of `cdpr_drake.winch_law` as a numba kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.drum import TURN
from cdpr_drake.winch_law import POSITION, SPEED_MARGIN, TORQUE, WinchLaw

WINCH_CONSTANTS = 18
"""Numbers of a packed winch; see `pack_winch`."""


def pack_winch(law: WinchLaw) -> Array:
    """A kind of winch as one array for the kernels of this module, shape (18,).

    In order: radius, gear ratio, turns per layer (0: one layer), layer height, wound length and
    drum's angle at home; inertia, rated speed, rated torque; F_c, F_s, F_v, w_s, T; brake torque;
    Kp, Ki, K.
    """
    drum, friction = law.drum, law.friction
    turns = drum.layer_turns if drum.has_layers() else 0.0
    return np.array([
        drum.radius, drum.gear_ratio, turns, drum.layer_height, drum.wound, drum.start_angle(),
        law.inertia, law.rated_speed, law.rated_torque,
        friction.coulomb, friction.static, friction.viscous, friction.stribeck_speed,
        friction.settling_time,
        law.brake_torque,
        *law.gains(), law.position_bandwidth,
    ])  # fmt: skip


@njit(cache=True)
def drum_state(q: float, c: Array) -> Any:
    """Paid out length [m] and length per motor angle [m/rad] at a motor angle [rad]."""
    phi = c[5] - q / c[1]
    if c[2] == 0.0:
        return c[4] - c[0] * phi, c[0] / c[1]
    whole = c[2] * TURN
    layer = max(np.floor(phi / whole), 0.0)
    flat = (c[2] - 1.0) * TURN
    beyond = phi - layer * whole - flat
    climb = max(beyond, 0.0)
    radius = c[0] + c[3] * layer
    a = 0.5 * c[3] * whole
    below = layer * (a * layer + whole * c[0] - a + 0.5 * c[3] * TURN)
    wound = below + radius * (flat + beyond) + c[3] * climb * climb / (2.0 * TURN)
    return c[4] - wound, (radius + c[3] * climb / TURN) / c[1]


@njit(cache=True)
def _one_winch(
    q: float,
    w: float,
    z: float,
    tension: float,
    command: float,
    brake: float,
    home: float,
    mode: int,
    c: Array,
) -> Any:
    """Acceleration, rate of the integral, motor torque and friction of one winch."""
    paid_out, rho = drum_state(q, c)
    speed = 0.0
    wanted = command
    if mode != TORQUE:
        cable_speed = command
        if mode == POSITION:
            cable_speed = c[17] * (command - home - paid_out)
        speed = max(min(cable_speed / rho, c[7]), -c[7])
        wanted = c[15] * (speed - w) + z
    torque = max(min(wanted, c[8]), -c[8])
    if torque * w > 0.0:
        fade = (1.0 + SPEED_MARGIN - abs(w) / c[7]) / SPEED_MARGIN
        torque *= max(min(fade, 1.0), 0.0)
    integral_rate = 0.0
    if mode != TORQUE:
        integral_rate = c[16] * (speed - w) + (c[16] / c[15]) * (torque - wanted)
    viscous = c[11] * w
    net = torque + rho * tension - viscous
    largest = c[9] + (c[10] - c[9]) * np.exp(-abs(w) / c[12]) + c[14] * brake
    dry = max(min(net + (c[6] / c[13]) * w, largest), -largest)
    return (net - dry) / c[6], integral_rate, torque, dry + viscous


@njit(cache=True)
def winch_rates(
    state: Array,
    tensions: Array,
    command: Array,
    brakes: Array,
    home: Array,
    mode: int,
    constants: Array,
    out: Array,
) -> None:
    """Writes the derivative of the state of m winches to `out`.

    Args:
        state: Angles, speeds and, but in torque mode, integrals, shape (3 m,) or (2 m,).
        tensions: At the drums, shape (m,) [N].
        command: As `cdpr_drake.winch_law.MODES` says, shape (m,).
        brakes: 1 where the brake holds, shape (m,).
        home: Unstrained lengths where the angles are zero, shape (m,) [m].
        mode: `TORQUE`, `VELOCITY` or `POSITION`.
        constants: From `pack_winch`.
        out: Shape of `state`.
    """
    m = tensions.shape[0]
    for i in range(m):
        w = state[m + i]
        z = 0.0 if mode == TORQUE else state[2 * m + i]
        rates = _one_winch(
            state[i], w, z, tensions[i], command[i], brakes[i], home[i], mode, constants
        )
        out[i] = w
        out[m + i] = rates[0]
        if mode != TORQUE:
            out[2 * m + i] = rates[1]


@njit(cache=True)
def winch_torques(
    state: Array,
    tensions: Array,
    command: Array,
    brakes: Array,
    home: Array,
    mode: int,
    constants: Array,
    out: Array,
) -> None:
    """Writes motor torques and friction [N m] to `out`, shape (2, m); arguments as above."""
    m = tensions.shape[0]
    for i in range(m):
        z = 0.0 if mode == TORQUE else state[2 * m + i]
        rates = _one_winch(
            state[i], state[m + i], z, tensions[i], command[i], brakes[i], home[i], mode, constants
        )
        out[0, i] = rates[2]
        out[1, i] = rates[3]


@njit(cache=True)
def winch_lengths(state: Array, home: Array, constants: Array, out: Array) -> None:
    """Writes unstrained lengths [m] and their rates [m/s] to `out`, shape (2, m)."""
    m = home.shape[0]
    for i in range(m):
        paid_out, rho = drum_state(state[i], constants)
        out[0, i] = home[i] + paid_out
        out[1, i] = rho * state[m + i]
