"""From the twist that a visual servo wants to the wrench that the cables shall put on the platform.

A servo wants the twist V_d with L V_d = -lambda e, so that its features' error e fades by lambda.
Let the twist V itself obey

    d/dt (V_d - V) + mu (V_d - V) + kappa int (V_d - V) dt = 0,

that is, let the platform be accelerated by

    A = dV_d/dt + mu (V_d - V) + kappa int (V_d - V) dt.

Then L (V - V_d) = de/dt + lambda e fades, and the features have the second order error dynamics
(d/dt + mu) (d/dt + lambda) e = 0 with two poles of one's own choice; the integral takes up what
force errors would leave. Twists are those of P in P, as the servo gives them. In W

    A_WP = R_WP A + (0, w x v),

and the wrench is `computed_torque` of that acceleration, with the velocity terms of the twist that
the platform has. The latter comes from the speeds of the winches whose cables pull, see
`twist_from_winches`: no sensor but those of the drives is asked.

Source: servoing thesis 5.2.3, Fig. 5.5; the error dynamics are not in it: there the tensions are
those that hold the pose at which the platform will be expected after the next step.
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute

ROTATION_PRIOR, TRANSLATION_PRIOR = 1e-6, 1e-4
"""Weight [m^2, -] of the believed twist beside one cable's speed, in the fit of a twist: what six
cables determine is off by less than a thousandth, what too few leave open is what was wanted."""


@njit(cache=True)
def to_world(X: Motion, V_P: Array, V_W: Array) -> None:
    """Writes a spatial vector in P, shape (6,), expressed in W to `V_W`; X as `floating_motion`."""
    for k in (0, 3):
        x, y, z = V_P[k], V_P[k + 1], V_P[k + 2]
        V_W[k] = X[0] * x + X[1] * y + X[2] * z
        V_W[k + 1] = X[3] * x + X[4] * y + X[5] * z
        V_W[k + 2] = X[6] * x + X[7] * y + X[8] * z


@njit(cache=True)
def to_platform(X: Motion, V_W: Array, V_P: Array) -> None:
    """The inverse of `to_world`."""
    for k in (0, 3):
        x, y, z = V_W[k], V_W[k + 1], V_W[k + 2]
        V_P[k] = X[0] * x + X[3] * y + X[6] * z
        V_P[k + 1] = X[1] * x + X[4] * y + X[7] * z
        V_P[k + 2] = X[2] * x + X[5] * y + X[8] * z


@njit(cache=True)
def winch_speed(W: Array, V_W: Array, i: int) -> float:
    """Rate of the length of cable i [m/s] with the platform's twist in W, shape (6,).

    Args:
        W: Wrench matrix, shape (6, m), or (3, m) for 2T1R, rows (moment about z, f_x, f_y).
        V_W: Twist (w, v) of P in W [rad/s, m/s].
        i: Number of the cable.
    """
    first = 0 if W.shape[0] == 6 else 2
    rate = 0.0
    for k in range(W.shape[0]):
        rate -= W[k, i] * V_W[first + k]
    return rate


@njit(cache=True)
def twist_from_winches(
    W: Array, rates: Array, slack: Array, believed: Array, normal: Array, pivots: Array, out: Array
) -> None:
    """Writes the platform's twist in W that fits the speeds of the winches best to `out`.

    Least squares over the cables that pull, drawn to a believed twist where these leave something
    open: fewer of them than the platform has degrees of freedom, say.

    Args:
        W: Wrench matrix, shape (6, m), or (3, m) for 2T1R.
        rates: Of the unstrained lengths, shape (m,) [m/s]; what cables are stretched by counts as
            motion of the platform, as far as it looks like one.
        slack: 1 where a cable does not pull, shape (m,).
        believed: Twist (w, v) of P in W, shape (6,) [rad/s, m/s].
        normal: Work space, shape (n, n).
        pivots: Work space, shape (n,).
        out: The twist, shape (6,); components that cannot move are 0.
    """
    n, m = W.shape
    first = 0 if n == 6 else 2
    turning = 3 if n == 6 else 1
    for k in range(6):
        out[k] = 0.0
    change = out[first : first + n]
    for j in range(n):
        for k in range(n):
            normal[j, k] = 0.0
        normal[j, j] = ROTATION_PRIOR if j < turning else TRANSLATION_PRIOR
    for i in range(m):
        if slack[i] != 0.0:
            continue
        beyond = rates[i] - winch_speed(W, believed, i)
        for j in range(n):
            change[j] -= W[j, i] * beyond
            for k in range(n):
                normal[j, k] += W[j, i] * W[k, i]
    eliminate(normal, n, pivots)
    substitute(normal, n, pivots, change)
    for j in range(n):
        change[j] += believed[first + j]


@njit(cache=True)
def wanted_acceleration(
    X: Motion, wanted: Array, feed: Array, twist: Array, gathered: Array, mu: float, kappa: float,
    out: Array,
) -> None:  # fmt: skip
    """Writes A_WP in W, shape (6,) [rad/s^2, m/s^2], to `out`; see the module.

    Args:
        X: Pose of the platform, as `floating_motion`.
        wanted: V_d in P, shape (6,) [rad/s, m/s].
        feed: dV_d/dt in P, shape (6,).
        twist: V in P, shape (6,).
        gathered: int (V_d - V) dt in P, shape (6,) [rad, m].
        mu: Rate at which a wrong twist fades [1/s].
        kappa: Gain of the integral [1/s^2].
        out: The acceleration.
    """
    local = (
        feed[0] + mu * (wanted[0] - twist[0]) + kappa * gathered[0],
        feed[1] + mu * (wanted[1] - twist[1]) + kappa * gathered[1],
        feed[2] + mu * (wanted[2] - twist[2]) + kappa * gathered[2],
        # a in W, turned into P, is dv/dt + w x v.
        feed[3] + mu * (wanted[3] - twist[3]) + kappa * gathered[3]
        + twist[1] * twist[5] - twist[2] * twist[4],
        feed[4] + mu * (wanted[4] - twist[4]) + kappa * gathered[4]
        + twist[2] * twist[3] - twist[0] * twist[5],
        feed[5] + mu * (wanted[5] - twist[5]) + kappa * gathered[5]
        + twist[0] * twist[4] - twist[1] * twist[3],
    )  # fmt: skip
    for k in (0, 3):
        for j in range(3):
            out[k + j] = (
                X[3 * j] * local[k] + X[3 * j + 1] * local[k + 1] + X[3 * j + 2] * local[k + 2]
            )
