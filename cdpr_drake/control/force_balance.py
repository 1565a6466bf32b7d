"""Control of the platform's position alone: a point mass, whose force tensions balance.

The platform is taken for a point mass in its centre of mass. Tensions balance three rows of the
wrench, W_f t = f, and nobody asks for a moment: the platform turns as the cables turn it. So is
the public code of a simulator for Gazebo (github.com/oKermorgant/cdpr, cdpr3); the Gazebo thesis
writes (6.5) for the whole wrench.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.straight_cables import ALL_ROWS
from cdpr_drake.tensions.problem import TensionProblem

WRENCH, FORCE = "wrench", "force"

BALANCES = {
    WRENCH: "moments and forces, by which the platform's pose is held",
    FORCE: "forces alone, as on a point mass: moments are not held, and the platform turns",
}
"""What tensions balance, by name."""

TURNING = ALL_ROWS[:3]
"""Components of a spatial vector that are moments, or turns."""


def balanced_rows(motions: tuple[int, ...], balance: str) -> tuple[int, ...]:
    """Components of a wrench that tensions balance, of those that the platform can move.

    Args:
        motions: Components (rotation, translation) that the platform can move.
        balance: A name of `BALANCES`.
    """
    return tuple(row for row in motions if balance == WRENCH or row not in TURNING)


def force_problem(problem: TensionProblem, turns: int) -> TensionProblem:
    """The same problem without its moments, so that its redundancy is larger by as many.

    Args:
        problem: Rows (moments, forces).
        turns: How many rows, the first ones, are moments.

    Raises:
        TensionProblemError: The rows of forces are singular.
    """
    return TensionProblem(
        problem.W[turns:], problem.wrench[turns:], problem.lower, problem.upper,
        problem.reference, problem.scale_of_rows[turns:],
    )  # fmt: skip


def point_mass_force(
    p_WC: Array,
    v_WC: Array,
    p_WD: Array,
    v_WD: Array,
    a_WD: Array,
    *,
    mass: float,
    gravity: float,
    gains: tuple[float, float],
    damping: Array | float = 0.0,
) -> Array:
    """Force that makes a point mass follow a desired motion, shape (3,) in W [N].

        f = m (a_WD + Kp (p_WD - p_WC) + Kd (v_WD - v_WC) - g) + d v_WP

    Args:
        p_WC: Where the centre of mass C is, shape (3,) [m].
        v_WC: Its velocity, shape (3,) [m/s].
        p_WD: Where it should be, shape (3,) [m].
        v_WD: Its desired velocity, shape (3,) [m/s].
        a_WD: Its desired acceleration, shape (3,) [m/s^2].
        mass: Mass m [kg].
        gravity: Acceleration along -z of W [m/s^2].
        gains: Kp [1/s^2] and Kd [1/s].
        damping: Force d v_WP against the damping of Po's motion, shape (3,) [N]; default: none.

    Source: Gazebo thesis (6.4), (6.5), the rows of forces; (2.17) gives the sign of the weight.
    """
    Kp, Kd = gains
    errors = Kp * (np.asarray(p_WD) - p_WC) + Kd * (np.asarray(v_WD) - v_WC)
    wanted: Array = mass * (a_WD + errors + np.array([0.0, 0.0, gravity])) + damping
    return wanted


@njit(cache=True)
def write_point_mass_wrench(
    X: Motion, desired: Array, dynamics: Array, gains: Array, out: Array
) -> None:
    """Writes `point_mass_force` as a wrench about Po to `out`, shape (6,) [N m, N].

    Args:
        X: Motion of the platform, as `geometry.motion_kernel` has it.
        desired: Desired motion of P, a row as in `trajectories.pose_trajectory`, shape (19,).
        dynamics: `PlatformDynamics.packed`.
        gains: `TaskGains.packed`, of which those of translation count.
        out: The force through the centre of mass, with its moment about Po; 0 in components that
            cannot move. Overwritten.
    """
    x, y, z = dynamics[1], dynamics[2], dynamics[3]
    mass, gravity, Kp, Kd, moves = dynamics[0], dynamics[10], gains[2], gains[3], dynamics[11:17]
    cx, cy, cz = (
        X[0] * x + X[1] * y + X[2] * z,
        X[3] * x + X[4] * y + X[5] * z,
        X[6] * x + X[7] * y + X[8] * z,
    )
    ux, uy, uz = _cross(X[12], X[13], X[14], cx, cy, cz)
    dx, dy, dz = _rotated(desired, x, y, z)
    wx, wy, wz = desired[7], desired[8], desired[9]
    vx, vy, vz = _cross(wx, wy, wz, dx, dy, dz)
    tx, ty, tz = _cross(desired[13], desired[14], desired[15], dx, dy, dz)
    sx, sy, sz = _cross(wx, wy, wz, vx, vy, vz)
    fx = mass * (
        desired[16] + tx + sx
        + Kp * (desired[4] + dx - X[9] - cx)
        + Kd * (desired[10] + vx - X[15] - ux)
    )  # fmt: skip
    fy = mass * (
        desired[17] + ty + sy
        + Kp * (desired[5] + dy - X[10] - cy)
        + Kd * (desired[11] + vy - X[16] - uy)
    )  # fmt: skip
    fz = mass * (
        desired[18] + tz + sz
        + Kp * (desired[6] + dz - X[11] - cz)
        + Kd * (desired[12] + vz - X[17] - uz)
        + gravity
    )  # fmt: skip
    by_move = dynamics[18]
    fx = moves[3] * (fx + by_move * X[15])
    fy = moves[4] * (fy + by_move * X[16])
    fz = moves[5] * (fz + by_move * X[17])
    lx, ly, lz = _cross(cx, cy, cz, fx, fy, fz)
    out[0] = moves[0] * lx
    out[1] = moves[1] * ly
    out[2] = moves[2] * lz
    out[3], out[4], out[5] = fx, fy, fz


@njit(cache=True)
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Motion:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True)
def _rotated(q: Array, x: float, y: float, z: float) -> Motion:
    """A vector turned by the quaternion (w, x, y, z) that `q` begins with, of any size."""
    s = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, a, b, c = s * q[0], s * q[1], s * q[2], s * q[3]
    tx, ty, tz = _cross(a, b, c, x, y, z)
    tx, ty, tz = 2.0 * tx, 2.0 * ty, 2.0 * tz
    hx, hy, hz = _cross(a, b, c, tx, ty, tz)
    return x + w * tx + hx, y + w * ty + hy, z + w * tz + hz
