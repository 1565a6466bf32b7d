"""A motor with gear, drum, friction, brake and inner loops: from tension to acceleration.

All angles, speeds and torques are the motor's; positive pays cable out. With tension t, motor
torque tau and dry friction f of `friction`,

    J dw/dt = tau + rho t - F_v w - f,   l0 = l_home + paid_out(q),   rho = dl0/dq,

rho being the drum's radius over the gear ratio. The state is the unstrained length l0, its rate
s = rho w, and z: ds/dt = rho dw/dt + (drho/dq) w^2. The tension enters the acceleration only, so a
winch may feed the cables that pull on it. The inner loops are those of a servo drive: a speed loop

    tau = Kp (w* - w) + z,   dz/dt = Ki (w* - w) + (Ki / Kp) (tau_limited - tau),

whose last part keeps z from winding up, and around it, in position mode, w* = K (l0* - l0) / rho.
w* ends at the rated speed, tau at the rated torque; beyond the rated speed the drive can brake but
not drive: driving torque fades out over `SPEED_MARGIN`.

Arrays may hold AutoDiffXd; `motor_kernel` is the same for floats, faster.

Source: Gazebo thesis (2.20), (2.21), there without gear, and with the opposite sign of q; servoing
thesis (1.1), (1.21).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw, held_friction
from cdpr_drake.winches.groups import WinchGroups

TORQUE, VELOCITY, POSITION = 0, 1, 2
MODES = {"torque": TORQUE, "velocity": VELOCITY, "position": POSITION}
"""What a winch is commanded: motor torque [N m], cable velocity [m/s], unstrained length [m]."""

SPEED_MARGIN = 0.05
"""Share of the rated speed above it over which driving torque fades to zero."""


@dataclass(frozen=True, kw_only=True)
class WinchLaw:
    """A kind of winch; all winches of a robot are alike but for the cables on them.

    Attributes:
        drum: The drum with its gear.
        inertia: J of rotor, gear and drum, at the motor's shaft [kg m^2].
        rated_speed: Of the motor [rad/s].
        rated_torque: Of the motor; infinite: no limit [N m].
        friction: Friction at the motor's shaft.
        brake_torque: What the holding brake holds at the motor's shaft; 0: no brake [N m].
        velocity_bandwidth: b of the speed loop, Kp = J b, Ki = J b^2 / 4: two poles at -b / 2
            [rad/s].
        position_bandwidth: K of the position loop [1/s].
        groups: Which cables are on one winch; None: each is on a winch of its own.
    """

    drum: Drum
    inertia: float
    rated_speed: float
    rated_torque: float = np.inf
    friction: FrictionLaw = FrictionLaw()  # noqa: RUF009  frozen
    brake_torque: float = 0.0
    velocity_bandwidth: float = 200.0
    position_bandwidth: float = 20.0
    groups: WinchGroups | None = None

    @property
    def leaders(self) -> tuple[int, ...]:
        """For each cable the first one on its winch; empty where none share one."""
        return self.groups.leaders() if self.groups and self.groups.are_shared() else ()

    def pulls(self, torques: Array) -> Array:
        """Torque on the winch that each cable is on, from those of single cables, shape (m,)."""
        if not self.leaders:
            return torques
        leaders = np.array(self.leaders)
        return np.asarray((leaders[:, np.newaxis] == leaders) @ torques)

    def gains(self) -> tuple[float, float]:
        """Kp [N m s/rad] and Ki [N m/rad] of the speed loop."""
        b = self.velocity_bandwidth
        return self.inertia * b, self.inertia * b**2 / 4.0

    def poles(self, mode: int) -> Array:
        """Eigenvalues of a winch with a slack cable, within its limits, shape (n,) [rad/s].

        Dry friction counts by its settling alone, as a pole of its own.
        """
        (Kp, Ki), J = self.gains(), self.inertia
        K = self.position_bandwidth if mode == POSITION else 0.0
        loop = 0.0 if mode == TORQUE else 1.0
        viscous = self.friction.viscous
        A = np.array(
            [
                [0.0, 1.0, 0.0],
                [-loop * Kp * K / J, -(loop * Kp + viscous) / J, loop / J],
                [-loop * Ki * K, -loop * Ki, 0.0],
            ]
        )
        poles = np.linalg.eigvals(A if loop else A[:2, :2]).astype(complex)
        if self.friction.static == 0.0 and self.brake_torque == 0.0:
            return poles
        return np.append(poles, -1.0 / self.friction.settling_time)


@dataclass(frozen=True)
class WinchMotion:
    """Result of `winch_motion` for m winches, each of shape (m,).

    Attributes:
        speed: w [rad/s].
        acceleration: dw/dt [rad/s^2].
        length_acceleration: ds/dt [m/s^2].
        integral_rate: dz/dt; zero in torque mode [N m/s].
        torque: tau, as limited [N m].
        friction: All friction, f + F_v w, brakes included [N m].
    """

    speed: Array
    acceleration: Array
    length_acceleration: Array
    integral_rate: Array
    torque: Array
    friction: Array


def winch_motion(
    law: WinchLaw,
    mode: int,
    state: tuple[Array, Array, Array],
    tensions: Array,
    command: Array,
    brakes: Array,
    *,
    home: Array,
) -> WinchMotion:
    """Accelerations and torques of the winches of m cables.

    The state of cables on one winch is that of one motor: their w and z are the same.

    Args:
        law: The kind of winch.
        mode: `TORQUE`, `VELOCITY` or `POSITION`.
        state: Unstrained lengths l0 [m], their rates s [m/s], integrals z [N m], shape (m,) each;
            in torque mode z is not read.
        tensions: At the drums, shape (m,) [N].
        command: As `MODES` says, shape (m,).
        brakes: 1 where the brake holds, 0 where it is released, shape (m,).
        home: l_home, unstrained lengths where q is zero, shape (m,) [m].
    """
    length, rate, z = state
    rho, rho_per_angle = law.drum.turning(length - home)
    lead, w = rho, rate / rho
    if law.leaders:
        first = np.array(law.leaders)
        lead, w, z = lead[first], w[first], z[first]
        length, command, brakes = length[first], command[first], brakes[first]
    Kp, Ki = law.gains()
    if mode == TORQUE:
        wanted = command
    else:
        cable_speed = command
        if mode == POSITION:
            cable_speed = law.position_bandwidth * (command - length)
        speed = np.maximum(np.minimum(cable_speed / lead, law.rated_speed), -law.rated_speed)
        wanted = Kp * (speed - w) + z
    limited = np.maximum(np.minimum(wanted, law.rated_torque), -law.rated_torque)
    fade = (1.0 + SPEED_MARGIN - np.abs(w) / law.rated_speed) / SPEED_MARGIN
    share = np.where(limited * w > 0.0, np.maximum(np.minimum(fade, 1.0), 0.0), 1.0)
    torque = limited * share
    integral_rate = 0.0 * w
    if mode != TORQUE:
        integral_rate = Ki * (speed - w) + (Ki / Kp) * (torque - wanted)
    viscous = law.friction.viscous * w
    net = torque + law.pulls(rho * tensions) - viscous
    largest = law.friction.dry(w) + law.brake_torque * brakes
    dry = held_friction(largest, net, w, law.inertia, law.friction.settling_time)
    acceleration = (net - dry) / law.inertia
    return WinchMotion(
        w, acceleration, rho * acceleration + rho_per_angle * w * w, integral_rate, torque,
        dry + viscous,
    )  # fmt: skip


def resting_motors(law: WinchLaw, mode: int, home: Array, lengths: Array, tensions: Array) -> Array:
    """State at rest of the winches that hold m tensions, shape (3 m,), or (2 m,) in torque mode.

    Unstrained lengths, their rates and, but in torque mode, integrals of the speed loops.

    Args:
        law: The kind of winch.
        mode: `TORQUE`, `VELOCITY` or `POSITION`.
        home: Unstrained lengths where the angles are zero, shape (m,) [m].
        lengths: Unstrained lengths, shape (m,) [m].
        tensions: At the drums, shape (m,) [N].
    """
    lengths = np.asarray(lengths, float)
    parts = [lengths, np.zeros(len(lengths))]
    if mode != TORQUE:
        parts.append(-law.pulls(law.drum.turning(lengths - home)[0] * tensions))
    return np.concatenate(parts)
