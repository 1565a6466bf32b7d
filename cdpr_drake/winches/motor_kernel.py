"""The winches of `motor` as a numba kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.winches.drum import TURN
from cdpr_drake.winches.motor import POSITION, SPEED_MARGIN, TORQUE, WinchLaw

WINCH_CONSTANTS = 18
"""Numbers of a packed winch; see `pack_winch`."""

LEADER = 17
"""Column of `pack_winch` with the first cable on the same winch."""


def pack_winch(law: WinchLaw) -> Array:
    """Winches as rows for the kernels of this module, shape (1, 18), or (m, 18) one a cable.

    One row where all cables are alike, each on a winch of its own. In order: radius, gear ratio,
    turns per layer (0: one layer), layer height, wound length at home; inertia, rated speed, rated
    torque; F_c, F_s, F_v, w_s, T; brake torque; Kp, Ki, K; first cable on the same winch.
    """
    drum, friction = law.drum, law.friction
    turns = drum.layer_turns if drum.has_layers() else 0.0
    alike = np.array([
        np.nan, drum.gear_ratio, turns, np.nan, np.nan,
        law.inertia, law.rated_speed, law.rated_torque,
        friction.coulomb, friction.static, friction.viscous, friction.stribeck_speed,
        friction.settling_time,
        law.brake_torque,
        *law.gains(), law.position_bandwidth, 0.0,
    ])  # fmt: skip
    each = {0: drum.radius, 3: drum.layer_height, 4: drum.wound}
    count = max(*(np.size(value) for value in each.values()), len(law.leaders))
    rows = np.tile(alike, (count, 1))
    for column, value in each.items():
        rows[:, column] = value
    if law.leaders:
        rows[:, LEADER] = law.leaders
    elif count > 1:
        rows[:, LEADER] = np.arange(count)
    return rows


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
    w: float,
    rho: float,
    z: float,
    pull: float,
    command: float,
    brake: float,
    mode: int,
    c: Array,
) -> Any:
    """Torque that accelerates a motor, rate of the integral, motor torque and friction.

    `pull` is what all cables on the winch put on the motor, the sum of rho t [N m].
    """
    J, rated_speed, rated_torque = c[5], c[6], c[7]
    coulomb, static, viscous, stribeck_speed, settling = c[8], c[9], c[10], c[11], c[12]
    Kp, Ki, K = c[14], c[15], c[16]
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
    net = torque + pull - viscous * w
    largest = coulomb + (static - coulomb) * np.exp(-abs(w) / stribeck_speed) + c[13] * brake
    dry = max(min(net + (J / settling) * w, largest), -largest)
    return net - dry, integral_rate, torque, dry + viscous * w


@njit(cache=True)
def _winch_of_cable(
    i: int, state: Array, tensions: Array, command: Array, brakes: Array, home: Array, mode: int,
    constants: Array,
) -> Any:  # fmt: skip
    """`_one_winch` of the winch that cable i is on; rho and drho/dq of that cable, and w."""
    m = tensions.shape[0]
    if constants.shape[0] == 1:
        c, first = constants[0], i
        rho, bend = drum_turning(state[i] - home[i], c)
        lead, pull = rho, rho * tensions[i]
    else:
        c = constants[i]
        first = int(c[LEADER])
        rho, bend = drum_turning(state[i] - home[i], c)
        lead, _ = drum_turning(state[first] - home[first], constants[first])
        pull = 0.0
        for k in range(m):
            if int(constants[k, LEADER]) == first:
                pull += drum_turning(state[k] - home[k], constants[k])[0] * tensions[k]
    z = 0.0 if mode == TORQUE else state[2 * m + first]
    w = state[m + first] / lead
    net, integral_rate, torque, friction = _one_winch(
        state[first], w, lead, z, pull, command[first], brakes[first], mode, c
    )
    return net, integral_rate, torque, friction, rho, bend, w


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
    """Writes the derivative of the state of winches with m cables to `out`.

    Several cables may be on one winch: their drums turn as one, by the sum of their torques.

    Args:
        state: Unstrained lengths, their rates and, but in torque mode, integrals, shape (3 m,) or
            (2 m,).
        tensions: At the drums, shape (m,) [N].
        command: As `motor.MODES` says, shape (m,); the same for all cables on one winch.
        brakes: 1 where the brake holds, shape (m,).
        home: Unstrained lengths where the angles are zero, shape (m,) [m].
        mode: `TORQUE`, `VELOCITY` or `POSITION`.
        constants: From `pack_winch`.
        out: Shape of `state`.
    """
    m = tensions.shape[0]
    for i in range(m):
        net, integral_rate, _, _, rho, rho_per_angle, w = _winch_of_cable(
            i, state, tensions, command, brakes, home, mode, constants
        )
        out[i] = state[m + i]
        out[m + i] = rho * net / constants[0, 5] + rho_per_angle * w * w
        if mode != TORQUE:
            out[2 * m + i] = integral_rate


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
    for i in range(tensions.shape[0]):
        _, _, torque, friction, _, _, _ = _winch_of_cable(
            i, state, tensions, command, brakes, home, mode, constants
        )
        out[0, i] = torque
        out[1, i] = friction
