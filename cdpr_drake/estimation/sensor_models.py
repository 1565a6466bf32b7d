"""What sensors read of a fused belief: expected readings, matrices, covariances, and a gate.

Each function gives H and the innovation of `sensor_filter.correct`; equations stand there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.pose_filter import image_jacobian
from cdpr_drake.estimation.sensor_filter import (
    COUNTED,
    EXTERNAL,
    OBJECT,
    ON_BOARD,
    POSE,
    VELOCITY,
    FusedBelief,
    Increments,
    know_object,
    pose_at,
    to_platform,
)
from cdpr_drake.geometry.poses import adjoint, cross_matrix, exponential, logarithm

ITERATIONS = 3
"""Of an update by an image: from errors of some degrees on, more change nothing that is seen."""


@dataclass(frozen=True)
class Sight:
    """What a camera is expected to see of a belief.

    Attributes:
        Z: Pose of object or tag in the camera [m].
        H: Its error, a twist of the object in the object, from those of the belief, shape (6, n).
    """

    Z: RigidTransform
    H: Array


def sight_on_board(belief: FusedBelief, steps: float) -> Sight:
    """What the camera on the platform saw of the object some control steps ago.

    The object's pose must be known, see `know_object`, `object_of_image`.
    """
    assert belief.X_WO is not None
    X_WP, parts = pose_at(belief, steps)
    Z = (X_WP @ belief.X_PC).inverse() @ belief.X_WO
    H = np.zeros((6, len(belief.covariance)))
    H[:, OBJECT] = adjoint(belief.X_WO.inverse())
    H[:, ON_BOARD] = -adjoint(Z.inverse())
    for columns, share in parts:
        H[:, columns] = -share * H[:, OBJECT]
    return Sight(Z, H)


def sight_external(belief: FusedBelief, X_PQ: RigidTransform, steps: float) -> Sight:
    """What the camera in the world saw of a tag at X_PQ on the platform, some steps ago."""
    X_WP, parts = pose_at(belief, steps)
    X_WQ = X_WP @ X_PQ
    Z = belief.X_WE.inverse() @ X_WQ
    H = np.zeros((6, len(belief.covariance)))
    H[:, EXTERNAL] = -adjoint(Z.inverse())
    Ad = adjoint(X_WQ.inverse())
    for columns, share in parts:
        H[:, columns] = share * Ad
    return Sight(Z, H)


def object_of_image(
    belief: FusedBelief, X_CO: RigidTransform, covariance: Array, steps: float
) -> FusedBelief:
    """The belief after the first image of an object of which nothing was known.

    Args:
        belief: Belief before.
        X_CO: Measured pose of the object in the camera on the platform [m].
        covariance: Of its error, a twist of O in O, shape (6, 6) [rad, m].
        steps: How long ago the image was taken, in control steps.
    """
    X_WP, parts = pose_at(belief, steps)
    X_WC = X_WP @ belief.X_PC
    X_WO = X_WC @ X_CO
    # exp(y) = exp(x) exp(Ad(X C) c) Y exp(-v) Y^-1
    F = np.eye(len(belief.covariance))
    F[OBJECT, OBJECT] = 0.0
    F[OBJECT, ON_BOARD] = adjoint(X_WC)
    for columns, share in parts:
        F[OBJECT, columns] = share * np.eye(6)
    known = know_object(belief, X_WO, covariance)
    P = F @ belief.covariance @ F.T
    P[OBJECT, OBJECT] += known.covariance[OBJECT, OBJECT]
    return FusedBelief(
        belief.X_WP, belief.velocity, X_WO, belief.X_PC, belief.X_WE, belief.biases,
        belief.offsets, belief.past, P,
    )  # fmt: skip


@dataclass(frozen=True)
class Look:
    """The pose of an object of points that a camera measured, and how well points are seen.

    Attributes:
        seen: The pose in the camera [m], which fits the image best.
        points: Points of the object in its frame, shape (3, n), n >= 3 [m].
        deviation: Standard deviation of each coordinate of a point in the image at unit distance,
            that of pixels over the focal length [-].
    """

    seen: RigidTransform
    points: Array
    deviation: float


def image_innovation(belief: FusedBelief, sight: Sight, look: Look) -> tuple[Array, Array]:
    """Innovation, shape (6,) [rad, m], and its covariance R, shape (6, 6), of a measured pose, by
    the points in the image.

    Points in the image are wrong by the same in every direction, poses are not: from afar a flat
    tag looks nearly the same tilted either way, and the pose that fits best may be the other one,
    or is nearer to it. So points are compared, those of the measured pose with those of the pose
    that is believed once the image is taken in, which is found by iteration: what stands for the
    measurement is the pose that fits them in first order round that.

    Source: the iterated extended Kalman filter, Bell and Cathey, IEEE Trans. Automatic Control
    38(2), 1993.
    """
    believed = sight.H @ belief.covariance @ sight.H.T
    wanted = _in_image(look.seen @ look.points)
    taken = np.zeros(6)  # the believed error once the image is taken in
    for _ in range(ITERATIONS):
        Z = sight.Z @ exponential(taken)
        p = Z @ look.points
        if np.any(p[2] <= 0.0):  # behind the camera there is no image to compare with
            Z, p = look.seen, look.seen @ look.points
        L = image_jacobian(Z, look.points)
        information = L.T @ L
        step = np.asarray(np.linalg.solve(information, L.T @ (wanted - _in_image(p))), float)
        R = np.asarray(look.deviation**2 * np.linalg.inv(information), float)
        innovation = logarithm(sight.Z.inverse() @ Z @ exponential(step))
        taken = believed @ np.linalg.solve(believed + R, innovation)
    return innovation, R


def _in_image(p_C: Array) -> Array:
    """Points at unit distance, x and y of each, from shape (3, n) [m] to (2 n,)."""
    return np.asarray((p_C[:2] / p_C[2]).T.ravel())


def depth_innovation(sight: Sight, points: Array, depths: Array) -> tuple[Array, Array]:
    """H, shape (n, k), and innovation, shape (n,) [m], of depths of an object's points.

    Args:
        sight: What the camera is expected to see.
        points: Points of the object in its frame, shape (3, n) [m].
        depths: What was measured of each along the optical axis, shape (n,) [m].
    """
    axis = sight.Z.rotation().matrix()[2]
    D = np.array([np.concatenate([-axis @ cross_matrix(p), axis]) for p in points.T])
    expected = axis @ points + sight.Z.translation()[2]
    return D @ sight.H, depths - expected


def length_innovation(
    belief: FusedBelief, counted: Array, lengths: Array, J: Array
) -> tuple[Array, Array]:
    """H, shape (m, k), and innovation, shape (m,) [m], of counted lengths.

    Args:
        belief: What is believed.
        counted: What the winches counted, shape (m,) [m].
        lengths: Lengths at X_WP of the cables as they are on paper, shape (m,) [m].
        J: Their Jacobian for the twist of P in W, shape (m, 6).
    """
    m = len(counted)
    H = np.zeros((m, len(belief.covariance)))
    H[:, POSE] = J @ to_platform(belief.X_WP)
    H[:, COUNTED : COUNTED + m] = np.eye(m)
    return H, counted - lengths - belief.offsets


def velocity_innovation(belief: FusedBelief, v_P: Array) -> tuple[Array, Array]:
    """H, shape (3, k), and innovation, shape (3,) [m/s], of Po's velocity in P as asked for."""
    R = belief.X_WP.rotation().matrix()
    H = np.zeros((3, len(belief.covariance)))
    H[:, VELOCITY] = R.T
    return H, v_P - R.T @ belief.velocity


def motion_between(before: Array, after: Array, p_PS: Array) -> Increments:
    """What the platform's origin felt between two motions of an IMU at p_PS, shape (3,) [m].

    The motions since the start, shape (19,) each, hold the rotation row by row, velocity [m/s] and
    position [m] of So without gravity, angular velocity in P [rad/s], and the time [s]; see
    the sensor for inertial motion.
    """
    R0, R1 = (values[:9].reshape(3, 3) for values in (before, after))
    elapsed = float(after[18] - before[18])
    velocity = R0.T @ (after[9:12] - before[9:12])
    position = R0.T @ (after[12:15] - before[12:15] - before[9:12] * elapsed)
    turn = RotationMatrix.ProjectToRotationMatrix(R0.T @ R1)
    # So goes round Po: v_S = v_P + w x r.
    round_before, round_after = (np.cross(values[15:18], p_PS) for values in (before, after))
    velocity -= turn.matrix() @ round_after - round_before
    position -= turn.matrix() @ p_PS - p_PS - round_before * elapsed
    return Increments(turn, velocity, position, elapsed)


def normalized_innovation(belief: FusedBelief, H: Array, innovation: Array, R: Array) -> float:
    """r' S^-1 r of an innovation (NIS) [-]: chi-square distributed while all is as modelled.

    Source: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation,
    2001, 5.4.2.
    """
    S = H @ belief.covariance @ H.T + R
    return float(innovation @ np.linalg.solve(S, innovation))


@cache
def gate(size: int, probability: float) -> float:
    """What a chi-square number of so many degrees of freedom exceeds with a probability [-]."""
    from scipy.special import gammaincinv  # not where no filter runs

    return float(2.0 * gammaincinv(0.5 * size, 1.0 - probability))


def sigmas_of(value: float, size: int) -> float:
    """How many standard deviations one normal number is from its mean as often as a chi-square
    number of so many degrees of freedom is larger than a value [-]."""
    from scipy.special import gammaincc, ndtri  # not where no filter runs

    chance = max(float(gammaincc(0.5 * size, 0.5 * value)), np.finfo(float).tiny)
    return float(-ndtri(0.5 * chance))
