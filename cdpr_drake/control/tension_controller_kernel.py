"""From wanted tensions to motor torques: PID on measured tensions, and friction beside it.

With the wanted tension t_d, the measured one t_m, e = t_d - t_m, the speed s at which the winch
pays out and that at which it shall for the platform's motion, s_d, a winch shall go at s_c and
pulls with c,

    s_c = s_d - clip((1 + K_P) e / K_D, -u, u),
    c = t_m + K_D (s - s_c) + K_I int K_D (s - s_c) dt.

Within the clip that is t_d + K_P e + K_D (s - s_d) and the integral: the wanted tension and a PID.
The rate of a taut cable's tension is that of its winding times its stiffness; D takes the winding
itself from the drive, since the difference of two readings is noise, and of a slack cable says
nothing. For the same reason I gathers K_D (s - s_c): at rest that is (1 + K_P) e, and where
friction holds a winch that shall go, it grows without waiting for the tension. u is how fast a
winch may wind or pay out beside what the platform's motion asks for; a slack cable is wound up at
u. The motor's torque is

    tau = -rho c + sign(s_c) (F_c + (F_s - F_c) exp(-|q_dot| / w_s)) + F_v q_dot,

with q_dot = s_c / rho and rho = r_w / R_g: what friction takes is paid in the direction in which
the winch shall go, also before it goes. Below a small speed the sign is a slope, else the loop
would chatter about rest.

Source: servoing thesis 5.2.3, Figs 5.6, 5.7, (5.7), (5.8); in print (5.7) lacks the sign and the
bars, and (5.8) the gear.
"""

from __future__ import annotations

import math

from numba import njit

from cdpr_drake.arrays import Array

(
    PROPORTIONAL, INTEGRAL, DERIVATIVE, WINDING_SPEED, SLACK_BELOW, TENSION_RATE, RADIUS,
    COULOMB, STATIC, VISCOUS, STRIBECK_SPEED, FADING_SPEED,
) = range(12)  # fmt: skip
"""Numbers of a loop: K_P [-], K_I [1/s], K_D [N s/m], u [m/s], tension below which a cable counts
as slack [N], largest rate of wanted tensions [N/s], rho [m/rad], friction F_c, F_s [N m], F_v
[N m s/rad], w_s [rad/s] as it is compensated, cable speed below which that fades [m/s]."""

LOOP_SIZE = 12

TAUT_AGAIN = 2.0
"""A slack cable counts as taut from this times the tension below which it counts as slack, so that
noise does not decide."""


@njit(cache=True)
def friction_torque(speed: float, loop: Array) -> float:
    """What the motor spends on friction [N m] to go at a cable speed [m/s], positive pays out."""
    w = speed / loop[RADIUS]
    dry = loop[COULOMB] + (loop[STATIC] - loop[COULOMB]) * math.exp(-abs(w) / loop[STRIBECK_SPEED])
    share = min(max(speed / loop[FADING_SPEED], -1.0), 1.0)
    return share * dry + loop[VISCOUS] * w


@njit(cache=True, inline="always")
def sort_slack(measured: Array, loop: Array, slack: Array) -> None:
    """Brings `slack`, 1 where a cable does not pull, up to date with measured tensions [N]."""
    for i in range(measured.shape[0]):
        if measured[i] < loop[SLACK_BELOW]:
            slack[i] = 1.0
        elif measured[i] >= TAUT_AGAIN * loop[SLACK_BELOW]:
            slack[i] = 0.0


@njit(cache=True, inline="always")
def take_over(
    target: Array, measured: Array, was: Array, slack: Array, lower: Array, loop: Array,
    wanted: Array,
) -> None:  # fmt: skip
    """Where the wanted tension begins of a cable that has just come taut.

    At the tension for which the loop winds at u, as it has done until now, t_m + K_D u / (1 + K_P),
    or where the distribution wants it, if that is less. Had it begun at its lower bound, the winch
    would have been stopped at the very moment at which the others let go, and the cable's tension
    would have fallen below the bound again while the wanted one rose.

    Args:
        target: Tensions by the distribution, shape (m,) [N].
        measured: Tensions, shape (m,) [N].
        was: 1 where a cable did not pull at the step before, shape (m,).
        slack: 1 where it does not pull now, shape (m,).
        lower: Smallest tensions, shape (m,) [N].
        loop: Numbers of the loop, shape (`LOOP_SIZE`,).
        wanted: Wanted tensions, shape (m,) [N]; changed.
    """
    ahead = loop[DERIVATIVE] * loop[WINDING_SPEED] / (1.0 + loop[PROPORTIONAL])
    for i in range(target.shape[0]):
        if was[i] != 0.0 and slack[i] == 0.0:
            wanted[i] = max(min(target[i], measured[i] + ahead), lower[i])


@njit(cache=True, inline="always")
def approach(target: Array, slack: Array, lower: Array, most: float, wanted: Array) -> float:
    """Moves wanted tensions towards a target by at most a step [N]; returns the largest change.

    All go by the same share of their way, so that a wrench between two balanced ones is balanced.
    A slack cable's wanted tension is its lower bound; where it begins when the cable comes taut,
    `take_over` says.
    """
    largest = 0.0
    for i in range(target.shape[0]):
        if slack[i] == 0.0:
            largest = max(largest, abs(target[i] - wanted[i]))
    share = 1.0 if largest <= most else most / largest
    for i in range(target.shape[0]):
        if slack[i] == 0.0:
            wanted[i] += share * (target[i] - wanted[i])
        else:
            wanted[i] = lower[i]
    return share * largest


@njit(cache=True)
def winch_torque(
    wanted: float, measured: float, speed: float, wanted_speed: float, slack: bool, gathered: float,
    period: float, loop: Array,
) -> tuple[float, float]:  # fmt: skip
    """Torque of one motor [N m], positive pays out, and the integral part of c [N] after this step.

    Args:
        wanted: t_d [N].
        measured: t_m [N].
        speed: s, at which the winch pays out [m/s].
        wanted_speed: s_d [m/s].
        slack: Whether the cable counts as slack: it is wound up, whatever its error.
        gathered: The integral part so far [N]; it ends at K_D u.
        period: Time between steps [s].
        loop: Numbers of the loop, shape (`LOOP_SIZE`,).
    """
    D, u = loop[DERIVATIVE], loop[WINDING_SPEED]
    beside = -u
    if not slack:
        beside = -(1.0 + loop[PROPORTIONAL]) * (wanted - measured) / D
        beside = min(max(beside, -u), u)
    aim = wanted_speed + beside
    wrong = D * (speed - aim)
    gathered = min(max(gathered + loop[INTEGRAL] * wrong * period, -D * u), D * u)
    torque = -loop[RADIUS] * (measured + wrong + gathered) + friction_torque(aim, loop)
    return torque, gathered
