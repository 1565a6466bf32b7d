"""The winches of `motor` as a numba kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.winches.drum import TURN
from cdpr_drake.winches.motor import POSITION, SPEED_MARGIN, TORQUE, WinchLaw

WINCH_CONSTANTS = 17
"""Numbers of a packed winch; see `pack_winch`."""


def pack_winch(law: WinchLaw) -> Array:
    """A kind of winch as one array for the kernels of this module, shape (17,).

    In order: radius, gear ratio, turns per layer (0: one layer), layer height, wound length at
    home; inertia, rated speed, rated torque; F_c, F_s, F_v, w_s, T; brake torque; Kp, Ki, K.
    """
    drum, friction = law.drum, law.friction
    turns = drum.layer_turns if drum.has_layers() else 0.0
    return np.array([
        drum.radius, drum.gear_ratio, turns, drum.layer_height, drum.wound,
        law.inertia, law.rated_speed, law.rated_torque,
        friction.coulomb, friction.static, friction.viscous, friction.stribeck_speed,
        friction.settling_time,
        law.brake_torque,
        *law.gains(), law.position_bandwidth,
    ])  # fmt: skip


@njit(cache=True)
def drum_turning(paid_out: float, c: Array) -> Any:
    """dl/dq [m/rad] and d2l/dq2 [m/rad^2] where this much cable is paid out [m]."""
    first, gear, turns, h = c[0], c[1], c[2], c[3]
    if turns == 0.0:
        return first / gear, 0.0
    wound, whole = c[4] - paid_out, turns * TURN
    a = 0.5 * h * whole
    b = whole * first - a + 0.5 * h * TURN
    held = max(wound, 0.0)
    layer = np.floor(2.0 * held / (b + np.sqrt(b * b + 4.0 * a * held)))
    radius = first + h * layer
    excess = wound - layer * (a * layer + b) - radius * (turns - 1.0) * TURN
    if excess <= 0.0:
        return radius / gear, 0.0
    climb = 2.0 * excess / (radius + np.sqrt(radius * radius + 2.0 * h / TURN * excess))
    return (radius + h * climb / TURN) / gear, -h / TURN / (gear * gear)


@njit(cache=True)
def _one_winch(
    length: float,
    rate: float,
    z: float,
    tension: float,
    command: float,
    brake: float,
    home: float,
    mode: int,
    c: Array,
) -> Any:
    """Length acceleration, rate of the integral, motor torque and friction of one winch."""
    J, rated_speed, rated_torque = c[5], c[6], c[7]
    coulomb, static, viscous, stribeck_speed, settling = c[8], c[9], c[10], c[11], c[12]
    Kp, Ki, K = c[14], c[15], c[16]
    rho, rho_per_angle = drum_turning(length - home, c)
    w = rate / rho
    speed = 0.0
    wanted = command
    if mode != TORQUE:
        cable_speed = command
        if mode == POSITION:
            cable_speed = K * (command - length)
        speed = max(min(cable_speed / rho, rated_speed), -rated_speed)
        wanted = Kp * (speed - w) + z
    torque = max(min(wanted, rated_torque), -rated_torque)
    if torque * w > 0.0:
        fade = (1.0 + SPEED_MARGIN - abs(w) / rated_speed) / SPEED_MARGIN
        torque *= max(min(fade, 1.0), 0.0)
    integral_rate = 0.0
    if mode != TORQUE:
        integral_rate = Ki * (speed - w) + (Ki / Kp) * (torque - wanted)
    net = torque + rho * tension - viscous * w
    largest = coulomb + (static - coulomb) * np.exp(-abs(w) / stribeck_speed) + c[13] * brake
    dry = max(min(net + (J / settling) * w, largest), -largest)
    acceleration = rho * (net - dry) / J + rho_per_angle * w * w
    return acceleration, integral_rate, torque, dry + viscous * w


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
        state: Unstrained lengths, their rates and, but in torque mode, integrals, shape (3 m,) or
            (2 m,).
        tensions: At the drums, shape (m,) [N].
        command: As `motor.MODES` says, shape (m,).
        brakes: 1 where the brake holds, shape (m,).
        home: Unstrained lengths where the angles are zero, shape (m,) [m].
        mode: `TORQUE`, `VELOCITY` or `POSITION`.
        constants: From `pack_winch`.
        out: Shape of `state`.
    """
    m = tensions.shape[0]
    for i in range(m):
        rate = state[m + i]
        z = 0.0 if mode == TORQUE else state[2 * m + i]
        winch = _one_winch(
            state[i], rate, z, tensions[i], command[i], brakes[i], home[i], mode, constants
        )
        out[i] = rate
        out[m + i] = winch[0]
        if mode != TORQUE:
            out[2 * m + i] = winch[1]


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
        winch = _one_winch(
            state[i], state[m + i], z, tensions[i], command[i], brakes[i], home[i], mode, constants
        )
        out[0, i] = winch[2]
        out[1, i] = winch[3]
