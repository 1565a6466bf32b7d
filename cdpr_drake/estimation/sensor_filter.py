"""A filter for the platform's pose that fuses cameras on board and in the world, lengths, an IMU.

The state is the pose X = X_WP of the platform, its velocity v in W (with an IMU only), the pose
Y = X_WO of an object at rest, the camera C = X_PC on the platform, the camera E = X_WE in the
world, biases g of gyroscopes and a of accelerometers, for each cable what is wrong with its counted
length, b, and the poses X_1, X_2, ... of the platform at the last control steps, which late images
are about. Errors of poses in W are twists in W at its origin, those of cameras in their own frames:

    X_true = exp(x) X,   Y_true = exp(y) Y,   C_true = C exp(c),   E_true = E exp(e),

the others are differences, but for v_true = exp(x_w) v + n. P is the covariance of all. In first
order of the errors, with X the pose when the image was taken, V_P what was asked for, and dR, dv,
dp what an IMU felt in a time dt, less its biases:

    motion    X <- X exp(V_P dt)             x <- x + Ad(X) w
    IMU       R <- R dR                      x_w <- x_w - R g dt
              v <- v + G dt + R dv           n <- n + [G]x x_w dt - [v]x R g dt - R a dt
              p <- p + v dt + G dt^2/2 + R dp
                                             x_v <- x_v + n dt + [G]x x_w dt^2/2 - [p]x R g dt
    on board  Z = (X C)^-1 Y                 log(Z^-1 Z_seen) = Ad(Y^-1) (y - x) - Ad(Z^-1) c
    external  Z = E^-1 X X_PQ                log(Z^-1 Z_seen) = Ad((X X_PQ)^-1) x - Ad(Z^-1) e
    depths    d_k = (Z p_k)_z                d_k,seen - d_k = (R_Z (s_w x p_k + s_v))_z, s as above
    lengths   l(X) + b                       J_W(X) x + b
    velocity  R' v = v_P, as asked for       R' n

Winches count from the pose believed at the start, so b begins with -J_W(X_0) x_0: the error of the
start stands in P at once, and is found in motion. Errors in W keep the filter consistent: a motion
of platform, object and external camera together stays unseen, as it truly is.

Source: the invariant extended Kalman filter, Barrau and Bonnabel, IEEE Trans. Automatic Control
62(4), 2017; cloned poses for late measurements, Roumeliotis and Burdick, ICRA 2002.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import adjoint, cross_matrix, exponential, logarithm

POSE, VELOCITY, OBJECT = slice(0, 6), slice(6, 9), slice(9, 15)
ON_BOARD, EXTERNAL = slice(15, 21), slice(21, 27)
GYROSCOPES, ACCELEROMETERS = slice(27, 30), slice(30, 33)
COUNTED = 33
"""Where errors stand in P: of pose, velocity, object, both cameras, biases, from here on of the m
counted lengths, then of past poses, the latest first."""


@dataclass(frozen=True)
class FusedBelief:
    """What the filter believes.

    Attributes:
        X_WP: Pose of the platform [m].
        velocity: Of its origin in W, shape (3,) [m/s]; only moved by an IMU.
        X_WO: Pose of the object [m]; None: nothing is known of it.
        X_PC: Camera on the platform [m].
        X_WE: Camera in the world [m].
        biases: Of gyroscopes [rad/s], then accelerometers [m/s^2], in P, shape (6,).
        offsets: b, shape (m,) [m].
        past: Poses at the last control steps, the latest first [m].
        covariance: P, shape (33 + m + 6 n, 33 + m + 6 n).
    """

    X_WP: RigidTransform
    velocity: Array
    X_WO: RigidTransform | None
    X_PC: RigidTransform
    X_WE: RigidTransform
    biases: Array
    offsets: Array
    past: tuple[RigidTransform, ...]
    covariance: Array

    @property
    def pose_covariance(self) -> Array:
        """Covariance of the pose's error as a twist of P in P, shape (6, 6) [rad, m]."""
        Ad = adjoint(self.X_WP.inverse())
        return np.asarray(Ad @ self.covariance[POSE, POSE] @ Ad.T)


@dataclass(frozen=True)
class Prior:
    """How uncertain a belief is at the start; standard deviations, (rotation, translation).

    Attributes:
        pose: Of the platform's pose, a twist of P in P, shape (6,) [rad, m].
        on_board: Of the camera on the platform, in its frame, shape (6,) [rad, m].
        external: Of the camera in the world, in its frame, shape (6,) [rad, m].
        offsets: Of b beside what the start pose makes of it, shape (m,) [m].
        biases: Of gyroscopes and accelerometers, shape (6,) [rad/s, m/s^2].
    """

    pose: Array
    on_board: Array
    external: Array
    offsets: Array
    biases: Array


@dataclass(frozen=True)
class Increments:
    """What an IMU on the platform felt between two control steps, turned into P and to Po.

    Attributes:
        turn: Change of rotation dR.
        velocity: dv, in P as it was before, without gravity, shape (3,) [m/s].
        position: dp, the same, shape (3,) [m].
        elapsed: dt [s].
    """

    turn: RotationMatrix
    velocity: Array
    position: Array
    elapsed: float


def start_fusion(
    X_WP: RigidTransform,
    X_PC: RigidTransform,
    X_WE: RigidTransform,
    prior: Prior,
    J: Array,
    past: int,
) -> FusedBelief:
    """The belief at rest, when the winches begin to count.

    Args:
        X_WP: Pose believed then [m].
        X_PC: Camera believed on the platform [m].
        X_WE: Camera believed in the world [m].
        prior: How uncertain all that is.
        J: Length Jacobian there for the twist of P in W, shape (m, 6), as `length_jacobian`.
        past: Number of past poses to keep.
    """
    m = len(prior.offsets)
    Ad = adjoint(X_WP)
    x = (Ad * prior.pose**2) @ Ad.T
    size = COUNTED + m + 6 * past
    P = np.zeros((size, size))
    counted = slice(COUNTED, COUNTED + m)
    J_W = J @ to_platform(X_WP)
    poses = [POSE, *(past_columns(m, k) for k in range(past))]
    for rows in poses:
        for columns in poses:
            P[rows, columns] = x
        P[counted, rows] = -J_W @ x
        P[rows, counted] = -x @ J_W.T
    P[counted, counted] = J_W @ x @ J_W.T + np.diag(prior.offsets**2)
    P[ON_BOARD, ON_BOARD] = np.diag(prior.on_board**2)
    P[EXTERNAL, EXTERNAL] = np.diag(prior.external**2)
    biases = slice(GYROSCOPES.start, ACCELEROMETERS.stop)
    P[biases, biases] = np.diag(prior.biases**2)
    return FusedBelief(
        X_WP, np.zeros(3), None, X_PC, X_WE, np.zeros(6), np.zeros(m), (X_WP,) * past, P
    )


def past_columns(m: int, k: int) -> slice:
    """Where the error of the k-th past pose stands, 0 the latest, of a robot with m cables."""
    return slice(COUNTED + m + 6 * k, COUNTED + m + 6 * k + 6)


def know_object(belief: FusedBelief, X_WO: RigidTransform, covariance: Array) -> FusedBelief:
    """The belief with an object about whose pose something is known from elsewhere.

    Args:
        belief: Belief before.
        X_WO: Its pose [m].
        covariance: Of its error, a twist of O in O, shape (6, 6) [rad, m].
    """
    P = belief.covariance.copy()
    Ad = adjoint(X_WO)
    P[OBJECT, :] = P[:, OBJECT] = 0.0
    P[OBJECT, OBJECT] = Ad @ covariance @ Ad.T
    return replace(belief, X_WO=X_WO, covariance=P)


def remember_pose(belief: FusedBelief) -> FusedBelief:
    """The belief with its pose as the latest past one; the oldest is forgotten."""
    n, m = len(belief.past), len(belief.offsets)
    if n == 0:
        return belief
    first = COUNTED + m
    size = len(belief.covariance)
    order = np.concatenate(
        [np.arange(first), np.arange(6), np.arange(first, size - 6)]
    )  # a copy of the pose's rows, then all but the oldest
    P = belief.covariance[np.ix_(order, order)]
    return replace(belief, past=(belief.X_WP, *belief.past[:-1]), covariance=P)


def move(belief: FusedBelief, V_P: Array, elapsed: float, noise: Array) -> FusedBelief:
    """The belief after the platform was told to move.

    Args:
        belief: Belief before.
        V_P: Twist of P in P that was asked for, shape (6,) [rad/s, m/s].
        elapsed: For how long [s].
        noise: Variance per time of the error of the motion, a twist of P in P, shape (6,)
            [rad^2/s, m^2/s].
    """
    X_WP = belief.X_WP @ exponential(V_P * elapsed)
    Ad = adjoint(X_WP)
    P = belief.covariance.copy()
    P[POSE, POSE] += (Ad * (noise * elapsed)) @ Ad.T
    return replace(belief, X_WP=X_WP, covariance=P)


def move_inertially(
    belief: FusedBelief, felt: Increments, gravity: Array, noise: Array, walk: Array
) -> FusedBelief:
    """The belief after what an IMU felt.

    Args:
        belief: Belief before.
        felt: What it felt, biases and all.
        gravity: Acceleration of gravity in W, shape (3,) [m/s^2].
        noise: Variance per time of angular velocity and specific force, shape (6,)
            [rad^2/s, m^2/s^3].
        walk: Variance per time of the biases, shape (6,).
    """
    dt = felt.elapsed
    R, v, p = belief.X_WP.rotation().matrix(), belief.velocity, belief.X_WP.translation()
    turn = (
        felt.turn @ exponential(np.concatenate([-belief.biases[:3] * dt, np.zeros(3)])).rotation()
    )
    dv = felt.velocity - belief.biases[3:] * dt
    dp = felt.position - belief.biases[3:] * (0.5 * dt * dt)
    position = p + v * dt + 0.5 * dt * dt * gravity + R @ dp
    velocity = v + gravity * dt + R @ dv
    X_WP = RigidTransform(belief.X_WP.rotation() @ turn, position)
    F = np.eye(len(belief.covariance))
    G = cross_matrix(gravity)
    rotation, translation = slice(0, 3), slice(3, 6)
    F[VELOCITY, rotation] = G * dt
    F[translation, rotation] = G * (0.5 * dt * dt)
    F[translation, VELOCITY] = np.eye(3) * dt
    by_bias = np.zeros((9, 6))  # of rotation, translation, velocity
    by_bias[:3, :3] = -R * dt
    by_bias[3:6, :3] = -cross_matrix(position) @ R * dt
    by_bias[6:, :3] = -cross_matrix(velocity) @ R * dt
    by_bias[3:6, 3:] = -R * (0.5 * dt * dt)
    by_bias[6:, 3:] = -R * dt
    biases = slice(GYROSCOPES.start, ACCELEROMETERS.stop)
    F[:9, biases] = by_bias
    P = F @ belief.covariance @ F.T
    P[:9, :9] += (by_bias * (noise / dt)) @ by_bias.T
    P[biases, biases] += np.diag(walk * dt)
    return replace(belief, X_WP=X_WP, velocity=velocity, covariance=P)


def drift_lengths(belief: FusedBelief, variance: Array) -> FusedBelief:
    """The belief after b walked, by variances of shape (m,) [m^2]."""
    P = belief.covariance.copy()
    np.einsum("ii->i", P)[COUNTED : COUNTED + len(variance)] += variance
    return replace(belief, covariance=P)


def forget(belief: FusedBelief, columns: slice, variances: Array) -> FusedBelief:
    """The belief with errors of which no more is known than these variances, shape (k,)."""
    P = belief.covariance.copy()
    P[columns, :] = P[:, columns] = 0.0
    P[columns, columns] = np.diag(variances)
    return replace(belief, covariance=P)


def correct(belief: FusedBelief, H: Array, innovation: Array, R: Array) -> FusedBelief:
    """The Kalman update, by Joseph's form.

    Args:
        belief: Belief before.
        H: Measurement matrix, shape (k, n).
        innovation: What was measured less what was expected, shape (k,).
        R: Covariance of the measurement, shape (k, k).
    """
    P = belief.covariance
    HP = H @ P
    K = np.linalg.solve(HP @ H.T + R, HP).T
    d = K @ innovation
    rest = np.eye(len(P)) - K @ H
    P = rest @ P @ rest.T + K @ R @ K.T
    return replace(moved_by(belief, d), covariance=(P + P.T) / 2.0)


def moved_by(belief: FusedBelief, d: Array) -> FusedBelief:
    """The belief of which a belief has the errors d, shape (33 + m + 6 n,), with P as it was."""
    m = len(belief.offsets)
    turned = exponential(d[POSE])
    X_WO = belief.X_WO
    return FusedBelief(
        turned @ belief.X_WP,
        turned.rotation() @ belief.velocity + d[VELOCITY],
        None if X_WO is None else exponential(d[OBJECT]) @ X_WO,
        belief.X_PC @ exponential(d[ON_BOARD]),
        belief.X_WE @ exponential(d[EXTERNAL]),
        belief.biases + d[GYROSCOPES.start : ACCELEROMETERS.stop],
        belief.offsets + d[COUNTED : COUNTED + m],
        tuple(exponential(d[past_columns(m, k)]) @ X for k, X in enumerate(belief.past)),
        belief.covariance,
    )


def apart(belief: FusedBelief, other: FusedBelief) -> Array:
    """Errors d of another belief if this one is true: `moved_by(other, d)` is it, but for P."""
    m, d = len(belief.offsets), np.zeros(len(belief.covariance))
    turned = belief.X_WP @ other.X_WP.inverse()
    d[POSE] = logarithm(turned)
    d[VELOCITY] = belief.velocity - turned.rotation() @ other.velocity
    if belief.X_WO is not None and other.X_WO is not None:
        d[OBJECT] = logarithm(belief.X_WO @ other.X_WO.inverse())
    d[ON_BOARD] = logarithm(other.X_PC.inverse() @ belief.X_PC)
    d[EXTERNAL] = logarithm(other.X_WE.inverse() @ belief.X_WE)
    d[GYROSCOPES.start : ACCELEROMETERS.stop] = belief.biases - other.biases
    d[COUNTED : COUNTED + m] = belief.offsets - other.offsets
    for k, (X, Y) in enumerate(zip(belief.past, other.past, strict=True)):
        d[past_columns(m, k)] = logarithm(X @ Y.inverse())
    return d


def to_platform(X_WP: RigidTransform) -> Array:
    """T with V_WP = T V for a twist V in W at the origin of W, shape (6, 6)."""
    T = np.eye(6)
    T[3:, :3] = -cross_matrix(X_WP.translation())
    return T


def pose_at(belief: FusedBelief, steps: float) -> tuple[RigidTransform, list[tuple[slice, float]]]:
    """The platform's pose some control steps ago, and what its error is made of.

    Between two steps the pose is on the screw from one to the other, its error a mixture of theirs.

    Args:
        belief: What is believed.
        steps: How long ago, in control steps; at most as many as there are past poses.

    Returns:
        The pose [m], and columns of P with their shares.
    """
    m = len(belief.offsets)
    poses = [(belief.X_WP, POSE)]
    poses += [(X, past_columns(m, k)) for k, X in enumerate(belief.past)]
    later = min(int(steps), len(poses) - 1)
    share = min(max(steps - later, 0.0), 1.0)
    X, columns = poses[later]
    if share < 1e-6 or later + 1 == len(poses):
        return X, [(columns, 1.0)]
    before, older = poses[later + 1]
    way = logarithm(X.inverse() @ before)
    return X @ exponential(share * way), [(columns, 1.0 - share), (older, share)]
