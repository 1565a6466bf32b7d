"""Computed torque in task space: the wrench that makes the platform follow a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, types
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import write_point_mass_wrench
from cdpr_drake.errors import ControlGainError
from cdpr_drake.geometry.motion_kernel import Motion, floating_motion, planar_motion
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.geometry.straight_cables import ALL_ROWS
from cdpr_drake.numerics.kernel_calls import array_addresses, matrix_at, vector_at
from cdpr_drake.numerics.shared_kernels import VECTOR, shared
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, motion_row, write_motion


@dataclass(frozen=True)
class PlatformDynamics:
    """What the controller believes about the platform; the simulated one may differ.

    Attributes:
        M_PPo_P: Spatial inertia about Po, expressed in P [kg, m].
        gravity: Acceleration along -z of W [m/s^2].
        motions: Components of a spatial vector in W, ordered (rotation, translation), that the
            platform can move: all six, or `PLANAR_ROWS` of `geometry.straight_cables` for 2T1R.
        point_mass: Whether it is taken for a point mass in its centre of mass, which a force moves
            and nothing turns, see `force_balance`.
        damping: Viscous damping of its motion about Po: force per velocity of Po [N s/m] and
            moment per angular velocity [N m s/rad].
    """

    M_PPo_P: SpatialInertia
    gravity: float = 9.81
    motions: tuple[int, ...] = ALL_ROWS
    point_mass: bool = False
    damping: tuple[float, float] = (0.0, 0.0)

    @property
    def is_damped(self) -> bool:
        """Whether its motion is damped."""
        return any(self.damping)

    def packed(self) -> Array:
        """For the kernels of this module, shape (`DYNAMICS_SIZE`,)."""
        mass, p_PPcm = self.M_PPo_P.get_mass(), self.M_PPo_P.get_com()
        G = self.M_PPo_P.CalcRotationalInertia().CopyToFullMatrix3()
        moves = np.zeros(6)
        moves[list(self.motions)] = 1.0
        parts = (
            [mass], p_PPcm, np.diag(G), [G[0, 1], G[0, 2], G[1, 2]], [self.gravity], moves,
            [float(self.point_mass)], self.damping,
        )  # fmt: skip
        return np.concatenate(parts)


DYNAMICS_SIZE = 20
"""Of packed dynamics: mass [kg], p_PPcm (3) [m], moments (xx, yy, zz) and products (xy, xz, yz) of
inertia about Po in P [kg m^2], gravity [m/s^2], six flags, 1 where a component can move, one that
is 1 where it is taken for a point mass, and damping of translation [N s/m] and rotation
[N m s/rad]."""

POINT_MASS, DAMPING = 17, 18
"""Places of the flag of a point mass, and of the damping (translation, rotation)."""


@dataclass(frozen=True)
class TaskGains:
    """Gains of the computed torque, one for all or one each for (rotation, translation).

    Attributes:
        stiffness: Kp, acceleration per error, at least 0 [1/s^2].
        damping: Kd, acceleration per error of velocity, at least 0 [1/s].
    """

    stiffness: float | tuple[float, float]
    damping: float | tuple[float, float]

    def packed(self) -> Array:
        """(Kp, Kd) rotation, then (Kp, Kd) translation, shape (4,) [1/s^2, 1/s].

        Raises:
            ControlGainError: A gain is negative or not finite, or there are not one or two.
        """
        columns = []
        for name, gain in (("stiffness", self.stiffness), ("damping", self.damping)):
            given = np.atleast_1d(np.asarray(gain, float))
            if given.shape not in ((1,), (2,)) or not np.all(np.isfinite(given) & (given >= 0.0)):
                raise ControlGainError(
                    f"{name} of a computed torque must be one number or (rotation, translation), "
                    f"each at least 0, found {gain}"
                )
            columns.append(np.broadcast_to(given, 2))
        return np.array(columns).T.ravel()


def computed_torque(
    X_WP: RigidTransform,
    V_WP: Array,
    X_WD: RigidTransform,
    V_WD: Array,
    A_WD: Array,
    *,
    dynamics: PlatformDynamics,
    gains: TaskGains,
) -> Array:
    """Wrench that the cables must put on the platform so that it follows a desired motion.

        F_P_W = M (A_WD + Kp e + Kd (V_WD - V_WP)) + b

    with M the spatial inertia about Po in W and b the terms of velocity and damping less weight,

        b = (w x I w + d_r w, m w x (w x c) + d_t v) - (c x m g, m g),   c = p_PPcm in W.

    The error e is (2 sign(q_w) (q_x, q_y, q_z), p_PD) in W, q being the quaternion of the rotation
    R_WD R_PW from P to D. That rotation part is 2 sin(theta / 2) u: for small angles the rotation
    vector theta u, and largest, not undetermined in size, at half a turn.

    Args:
        X_WP: Pose of the platform P in the world W.
        V_WP: Its spatial velocity (w, v) in W, shape (6,) [rad/s, m/s].
        X_WD: Desired pose, D being where P should be.
        V_WD: Desired velocity, as V_WP.
        A_WD: Desired spatial acceleration (alpha, a) in W, shape (6,) [rad/s^2, m/s^2].
        dynamics: Inertia, gravity, damping and the components that can move.
        gains: Kp and Kd.

    Returns:
        F_P_W about Po, shape (6,) [N m, N]; 0 in components that cannot move, whose errors and
        desired accelerations do not count. Of a point mass the force of
        `force_balance.point_mass_force` through the centre of mass, with its moment about Po.

    Source: Gazebo thesis (6.4), (6.5), which leaves out terms of velocity and damping, takes Po for
    the centre of mass, and whose (2.17) gives the sign of the weight.
    """
    state = np.concatenate([pose_row(X_WP), np.asarray(V_WP, float)])
    F = np.empty(6)
    floating_wrench(state, motion_row(X_WD, V_WD, A_WD), dynamics.packed(), gains.packed(), F)
    return F


@shared(types.void(*[VECTOR] * 5))
@njit(cache=True)
def floating_wrench(
    state: Array, desired: Array, dynamics: Array, gains: Array, out: Array
) -> None:
    """Writes `computed_torque` of a floating platform to `out`, shape (6,) [N m, N].

    Args:
        state: State of the platform as MultibodyPlant gives it, shape (13,).
        desired: Desired motion, a row as in `trajectories.pose_trajectory`, shape (19,).
        dynamics: `PlatformDynamics.packed`.
        gains: `TaskGains.packed`.
        out: F_P_W, overwritten.
    """
    scale = 1.0 / np.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2 + state[3] ** 2)
    q = (scale * state[0], scale * state[1], scale * state[2], scale * state[3])
    _wrench(q, floating_motion(state), desired, dynamics, gains, out)


@njit(cache=True)
def planar_wrench(
    state: Array, desired: Array, dynamics: Array, gains: Array, height: float, out: Array
) -> None:
    """As `floating_wrench` for a planar joint in the plane z = height [m], state of shape (6,)."""
    q = (np.cos(0.5 * state[2]), 0.0, 0.0, np.sin(0.5 * state[2]))
    _wrench(q, planar_motion(state, height), desired, dynamics, gains, out)


@njit(cache=True)
def tracking_wrench(
    time: float,
    stretches: Array,
    state: Array,
    dynamics: Array,
    gains: Array,
    height: float,
    desired: Array,
    out: Array,
) -> None:
    """Writes `computed_torque` along a trajectory: `write_motion` and then the platform's wrench.

    Args:
        time: Time [s].
        stretches: `PoseTrajectory.stretches`.
        state: State of the platform, shape (13,) floating or (6,) planar.
        dynamics: `PlatformDynamics.packed`.
        gains: `TaskGains.packed`.
        height: As `planar_wrench` [m]; not used for a floating platform.
        desired: Gets the desired motion, shape (19,).
        out: F_P_W, overwritten.
    """
    write_motion(time, stretches, desired)
    if state.shape[0] == 6:
        planar_wrench(state, desired, dynamics, gains, height, out)
    else:
        floating_wrench(state, desired, dynamics, gains, out)


class TrackingStep:
    """What `tracking_wrench` needs besides time and state, at one address for one controller.

    Attributes:
        table: Where all of it is, for `tracking_wrench_at`.
    """

    def __init__(self, stretches: Array, dynamics: Array, gains: Array, height: float) -> None:
        """Arguments as of `tracking_wrench`."""
        self._kept = (
            np.ascontiguousarray(stretches),
            dynamics,
            gains,
            np.array([float(height)]),
            np.empty(MOTION_SIZE),
        )
        self.table = array_addresses(self._kept)


@njit(cache=True)
def tracking_wrench_at(table: np.ndarray, time: float, state: Array, out: Array) -> None:
    """`tracking_wrench` with what a `TrackingStep` keeps: fewer arguments cost less from Python."""
    tracking_wrench(
        time,
        matrix_at(table, 0),
        state,
        vector_at(table, 1),
        vector_at(table, 2),
        vector_at(table, 3)[0],
        vector_at(table, 4),
        out,
    )


@njit(cache=True)
def _wrench(
    q: Motion, X: Motion, desired: Array, dynamics: Array, gains: Array, out: Array
) -> None:
    if dynamics[POINT_MASS] != 0.0:
        write_point_mass_wrench(X, desired, dynamics, gains, out)
        return
    # q_D times the conjugate of q; either sign of a quaternion and, for q_D, any size will do.
    pw, px, py, pz = q
    dw, dx, dy, dz = desired[0], desired[1], desired[2], desired[3]
    twice = 2.0 / np.sqrt(dw * dw + dx * dx + dy * dy + dz * dz)
    if dw * pw + dx * px + dy * py + dz * pz < 0.0:
        twice = -twice
    Kp, Kd, moves = gains[0], gains[1], dynamics[11:]
    ax = moves[0] * (
        desired[13]
        + Kp * twice * (-dw * px + dx * pw - dy * pz + dz * py)
        + Kd * (desired[7] - X[12])
    )
    ay = moves[1] * (
        desired[14]
        + Kp * twice * (-dw * py + dx * pz + dy * pw - dz * px)
        + Kd * (desired[8] - X[13])
    )
    az = moves[2] * (
        desired[15]
        + Kp * twice * (-dw * pz - dx * py + dy * px + dz * pw)
        + Kd * (desired[9] - X[14])
    )
    Kp, Kd = gains[2], gains[3]
    bx = moves[3] * (desired[16] + Kp * (desired[4] - X[9]) + Kd * (desired[10] - X[15]))
    by = moves[4] * (desired[17] + Kp * (desired[5] - X[10]) + Kd * (desired[11] - X[16]))
    bz = moves[5] * (desired[18] + Kp * (desired[6] - X[11]) + Kd * (desired[12] - X[17]))

    mass, gravity = dynamics[0], dynamics[10]
    wx, wy, wz = X[12], X[13], X[14]
    cx, cy, cz = _turn(X, dynamics[1], dynamics[2], dynamics[3])
    # Acceleration of the centre of mass less gravity, times the mass: the force.
    ux, uy, uz = _cross(wx, wy, wz, cx, cy, cz)
    vx, vy, vz = _cross(wx, wy, wz, ux, uy, uz)
    tx, ty, tz = _cross(ax, ay, az, cx, cy, cz)
    fx, fy, fz = mass * (bx + tx + vx), mass * (by + ty + vy), mass * (bz + tz + vz + gravity)
    # Moment about Po: I alpha + w x I w + c x m (a - g).
    lx, ly, lz = _inertia_times(X, dynamics, ax, ay, az)
    hx, hy, hz = _inertia_times(X, dynamics, wx, wy, wz)
    gx, gy, gz = _cross(wx, wy, wz, hx, hy, hz)
    sx, sy, sz = _cross(cx, cy, cz, mass * bx, mass * by, mass * (bz + gravity))
    by_move, by_turn = dynamics[DAMPING], dynamics[DAMPING + 1]
    out[0] = moves[0] * (lx + gx + sx + by_turn * wx)
    out[1] = moves[1] * (ly + gy + sy + by_turn * wy)
    out[2] = moves[2] * (lz + gz + sz + by_turn * wz)
    out[3] = moves[3] * (fx + by_move * X[15])
    out[4] = moves[4] * (fy + by_move * X[16])
    out[5] = moves[5] * (fz + by_move * X[17])


@njit(cache=True)
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Motion:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True)
def _turn(X: Motion, x: float, y: float, z: float) -> Motion:
    """R_WP times a vector in P."""
    return (
        X[0] * x + X[1] * y + X[2] * z,
        X[3] * x + X[4] * y + X[5] * z,
        X[6] * x + X[7] * y + X[8] * z,
    )


@njit(cache=True)
def _inertia_times(X: Motion, dynamics: Array, x: float, y: float, z: float) -> Motion:
    """R I R' times a vector in W, I being the rotational inertia about Po in P."""
    px = X[0] * x + X[3] * y + X[6] * z
    py = X[1] * x + X[4] * y + X[7] * z
    pz = X[2] * x + X[5] * y + X[8] * z
    xx, yy, zz, xy, xz, yz = dynamics[4:10]
    return _turn(
        X,
        xx * px + xy * py + xz * pz,
        xy * px + yy * py + yz * pz,
        xz * px + yz * py + zz * pz,
    )
