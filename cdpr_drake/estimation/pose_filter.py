"""A filter for the platform's pose that fuses control, images and cable lengths.

The state is the pose X = X_WP of the platform, its pose X0 at the start, the pose Y = X_WO of an
object at rest that the camera sees, the camera's pose C = X_PC on the platform, and for each cable
what is wrong with its counted length, b, its exit point, a, and its anchor point, d. The winches
count lengths from the pose that was believed at the start, so they tell l(X) - l(X0). Errors of
the poses in W are twists in W at its origin, that of the camera is one in its own frame:

    X_true = exp(x) X,   Y_true = exp(y) Y,   X0_true = exp(x0) X0,   C_true = C exp(c),

those of b, a, d are differences; P is the covariance of all, shape (24 + 7 m, 24 + 7 m). In first
order of the errors, with Ad the adjoint, J_W the length Jacobian for twists at the origin of W and
u the unit vector of a cable from A to B in W:

    motion     X <- X exp(V dt)             x <- x + Ad(X) w,   b <- b + n
    image      Z = X_CO = (X C)^-1 Y        log(Z^-1 Z_seen) = Ad(Y^-1) (y - x) - Ad(Z^-1) c + v
    lengths    z = l(X) - l(X0) + b         z_counted - z = J_W(X) x - J_W(X0) x0 + b
               + (u(X0) - u(X)) a + (R' u(X) - R0' u(X0)) d + n
    known tag  K = X_CK = (X C)^-1 X_WK     log(K^-1 K_seen) = -Ad(X_WK^-1) x - Ad(K^-1) c + v

Errors in W, and not in P, keep the filter consistent: whatever it corrects, the image equation
stays blind to a motion of everything together (x = y), so it gains no certainty about the absolute
pose that no image can give. What gives it is the start pose, and the lengths: they change along
the path as only the true absolute pose explains. So an error of the start pose is found and
removed, as far as errors of camera and points leave it visible; the filter knows how far.

Source: the invariant extended Kalman filter of Barrau and Bonnabel, An EKF-SLAM algorithm with
consistency properties, 2015; here with cable lengths, start pose and calibration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import adjoint, cross_matrix, exponential, logarithm

POSE = slice(0, 6)
OBJECT = slice(6, 12)
START = slice(12, 18)
CAMERA = slice(18, 24)
LENGTHS = 24
"""Where the errors stand in P: of pose, object, start pose, camera and, from here on, m lengths, m
exit points and m anchor points, x, y, z of the first cable first."""


def error_size(count: int) -> int:
    """Size of P for a number of cables m."""
    return LENGTHS + 7 * count


@dataclass(frozen=True)
class PoseBelief:
    """What the filter believes.

    Attributes:
        X_WP: Pose of the platform [m].
        X_WO: Pose of the object [m]; None before the first image.
        X_WP0: Pose of the platform when the winches began to count [m].
        X_PC: Camera on the platform [m].
        parameters: b, then a and d of every cable, shape (7 m,) [m].
        covariance: P, shape (24 + 7 m, 24 + 7 m) [rad, m].
    """

    X_WP: RigidTransform
    X_WO: RigidTransform | None
    X_WP0: RigidTransform
    X_PC: RigidTransform
    parameters: Array
    covariance: Array

    @property
    def offsets(self) -> Array:
        """b, shape (m,) [m]."""
        return self.parameters[: len(self.parameters) // 7]


def start_belief(
    X_WP: RigidTransform,
    X_PC: RigidTransform,
    pose: Array,
    camera: Array,
    offsets: Array,
    points: tuple[float, float] = (0.0, 0.0),
) -> PoseBelief:
    """The belief when the winches begin to count.

    Args:
        X_WP: Pose believed then [m].
        X_PC: Camera believed on the platform [m].
        pose: Covariance of the pose's error as a twist of P in P, shape (6, 6) [rad, m].
        camera: Covariance of c, shape (6, 6) [rad, m].
        offsets: Variances of b, shape (m,) [m^2].
        points: Variances of each coordinate of the exit and of the anchor points [m^2].
    """
    m = len(offsets)
    Ad = adjoint(X_WP)
    P = np.zeros((error_size(m), error_size(m)))
    for rows in (POSE, START):
        for columns in (POSE, START):
            P[rows, columns] = Ad @ pose @ Ad.T
    P[CAMERA, CAMERA] = camera
    np.einsum("ii->i", P)[LENGTHS:] = np.concatenate([offsets, np.repeat(points, 3 * m)])
    return PoseBelief(X_WP, None, X_WP, X_PC, np.zeros(7 * m), P)


def predict(
    belief: PoseBelief, V_P: Array, elapsed: float, noise: Array, drift: Array
) -> PoseBelief:
    """The belief after the platform was told to move.

    Args:
        belief: Belief before.
        V_P: Twist of P in P that was asked for, shape (6,) [rad/s, m/s].
        elapsed: For how long [s].
        noise: Variance per time of the error of the motion, a twist of P in P, shape (6,)
            [rad^2/s, m^2/s].
        drift: Variance per time of b, shape (m,) [m^2/s].
    """
    X_WP = belief.X_WP @ exponential(V_P * elapsed)
    Ad = adjoint(X_WP)
    P = belief.covariance.copy()
    P[POSE, POSE] += (Ad * (noise * elapsed)) @ Ad.T
    np.einsum("ii->i", P)[LENGTHS : LENGTHS + len(drift)] += drift * elapsed
    return replace(belief, X_WP=X_WP, covariance=P)


def update_image(belief: PoseBelief, X_CO: RigidTransform, covariance: Array) -> PoseBelief:
    """The belief after an image of the object at rest; the first one tells where the object is.

    Args:
        belief: Belief before.
        X_CO: Measured pose of the object O in the camera [m].
        covariance: Of the measurement's error, a twist of O in O, shape (6, 6) [rad, m].
    """
    X_WC = belief.X_WP @ belief.X_PC
    if belief.X_WO is None:
        X_WO = X_WC @ X_CO
        # exp(y) = exp(x) exp(Ad(X C) c) Y exp(-v) Y^-1
        G = np.eye(len(belief.covariance))
        G[OBJECT, OBJECT] = 0.0
        G[OBJECT, POSE] = np.eye(6)
        G[OBJECT, CAMERA] = adjoint(X_WC)
        P = G @ belief.covariance @ G.T
        Ad = adjoint(X_WO)
        P[OBJECT, OBJECT] += Ad @ covariance @ Ad.T
        return replace(belief, X_WO=X_WO, covariance=P)
    Z = X_WC.inverse() @ belief.X_WO
    H = np.zeros((6, len(belief.covariance)))
    H[:, OBJECT] = adjoint(belief.X_WO.inverse())
    H[:, POSE] = -H[:, OBJECT]
    H[:, CAMERA] = -adjoint(Z.inverse())
    return _correct(belief, H, logarithm(Z.inverse() @ X_CO), covariance)


def update_known_object(
    belief: PoseBelief, X_WK: RigidTransform, X_CK: RigidTransform, covariance: Array
) -> PoseBelief:
    """The belief after an image of an object K whose pose X_WK is known; else as `update_image`."""
    K = (belief.X_WP @ belief.X_PC).inverse() @ X_WK
    H = np.zeros((6, len(belief.covariance)))
    H[:, POSE] = -adjoint(X_WK.inverse())
    H[:, CAMERA] = -adjoint(K.inverse())
    return _correct(belief, H, logarithm(K.inverse() @ X_CK), covariance)


def update_lengths(
    belief: PoseBelief,
    counted: Array,
    now: tuple[Array, Array],
    start: tuple[Array, Array],
    variances: Array,
) -> PoseBelief:
    """The belief after the winches counted.

    Args:
        belief: Belief before.
        counted: Change of each length since the start, corrected for stretch where that is
            modelled, shape (m,) [m].
        now: Lengths at X_WP of the cables as they are on paper, shape (m,) [m], and their Jacobian
            J with l_dot = J V_WP for the twist of P in W, shape (m, 6), as `length_jacobian`.
        start: The same at X_WP0.
        variances: Of the counted changes, shape (m,) [m^2]; infinite for a cable to leave out.
    """
    used = np.flatnonzero(np.isfinite(variances))
    if len(used) == 0:
        return belief
    m = len(counted)
    per_parameter = np.zeros((m, 7 * m))
    each = np.arange(m)
    per_parameter[each, each] = 1.0
    # The last three columns of J are the unit vectors u.
    exits = start[1][:, 3:] - now[1][:, 3:]
    anchors = (
        now[1][:, 3:] @ belief.X_WP.rotation().matrix()
        - start[1][:, 3:] @ belief.X_WP0.rotation().matrix()
    )
    for k in range(3):
        per_parameter[each, m + 3 * each + k] = exits[:, k]
        per_parameter[each, 4 * m + 3 * each + k] = anchors[:, k]
    H = np.zeros((len(used), len(belief.covariance)))
    H[:, POSE] = now[1][used] @ _to_platform(belief.X_WP)
    H[:, START] = -start[1][used] @ _to_platform(belief.X_WP0)
    H[:, LENGTHS:] = per_parameter[used]
    expected = now[0] - start[0] + per_parameter @ belief.parameters
    return _correct(belief, H, (counted - expected)[used], np.diag(variances[used]))


def _to_platform(X_WP: RigidTransform) -> Array:
    """T with V_WP = T V for a twist V in W at the origin of W, shape (6, 6)."""
    T = np.eye(6)
    T[3:, :3] = -cross_matrix(X_WP.translation())
    return T


def _correct(belief: PoseBelief, H: Array, innovation: Array, R: Array) -> PoseBelief:
    """The Kalman update."""
    P = belief.covariance
    HP = H @ P
    K = np.linalg.solve(HP @ H.T + R, HP).T
    correction = K @ innovation
    P = P - K @ HP
    X_WO = belief.X_WO
    if X_WO is not None:
        X_WO = exponential(correction[OBJECT]) @ X_WO
    return PoseBelief(
        exponential(correction[POSE]) @ belief.X_WP,
        X_WO,
        exponential(correction[START]) @ belief.X_WP0,
        belief.X_PC @ exponential(correction[CAMERA]),
        belief.parameters + correction[LENGTHS:],
        (P + P.T) / 2.0,
    )


def image_covariance(X_CO: RigidTransform, p_OK: Array, pixel_noise: float, focal: float) -> Array:
    """Covariance of an object's pose from image points, a twist of O in O, shape (6, 6) [rad, m].

    For a pose of least squares over the reprojection of n >= 3 points, in first order.

    Args:
        X_CO: Pose of the object in the camera [m].
        p_OK: Its points, shape (3, n) [m].
        pixel_noise: Standard deviation of each coordinate of a point [px].
        focal: Focal length [px].
    """
    L = image_jacobian(X_CO, p_OK)
    return np.asarray((pixel_noise / focal) ** 2 * np.linalg.inv(L.T @ L), float)


def image_jacobian(X_CO: RigidTransform, p_OK: Array) -> Array:
    """L with (dx_1, dy_1, dx_2, ...) = L (w, v): how an object's points go in the image at unit
    distance, for a twist of O in O, shape (2 n, 6).

    Args:
        X_CO: Pose of the object in the camera [m].
        p_OK: Its points, shape (3, n) [m].
    """
    R = X_CO.rotation().matrix()
    L = np.empty((2 * p_OK.shape[1], 6))
    for k, p in enumerate(p_OK.T):
        x, y, z = R @ p + X_CO.translation()
        # d(x/z, y/z) / dp_C, and dp_C = R (w x p + v) for a twist (w, v) of O in O
        D = np.array([[1.0 / z, 0.0, -x / z**2], [0.0, 1.0 / z, -y / z**2]]) @ R
        L[2 * k : 2 * k + 2, :3] = -D @ cross_matrix(p)
        L[2 * k : 2 * k + 2, 3:] = D
    return L
