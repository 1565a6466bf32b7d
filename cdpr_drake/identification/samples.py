"""What a log says of the platform's motion, its cables and its winches, smoothed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.identification.regressor import SIZE, inertia_regressor
from cdpr_drake.identification.smoothing import Smoothed, Smoother
from cdpr_drake.tensions.control_step_kernel import wrench_matrix_at

BLOCK = 24
"""Samples whose noise counts as correlated; it is so over two or three."""

SHIFTS, LONGEST_SHIFT, SHIFTED_SHARE = 41, 0.5, 0.15
"""Shifts between clocks that are tried: how many, up to so many seconds and this share of a log."""

LEAST_SAMPLES, LENGTH_SCALE = 20, 0.1
"""Samples that a shift is looked for in, and length by which moments count beside forces [m]."""

LEAST_POSE, LEAST_TENSION = 1e-5, 1e-4
"""Least noise that is believed of poses [rad, m], and of tensions over the largest: logs of
simulations, or smoothed ones, have less, but what smoothing takes of the motion is more."""

STEP = 1e-5
"""Of central differences of wrench matrices [rad, m]."""


@dataclass(frozen=True, eq=False)
class LoggedMotion:
    """A motion and what pulled, at times apart by half a period of the bandwidth.

    Attributes:
        time: Shape (s,) [s].
        R_WP: Rotations, shape (s, 3, 3).
        p_WP: Positions of Po, shape (s, 3) [m].
        V_WP: Spatial velocities (w, v) in W, shape (s, 6) [rad/s, m/s].
        A_WP: Spatial accelerations (alpha, a) in W, shape (s, 6) [rad/s^2, m/s^2].
        tensions: Shape (s, m) [N].
        tension_rates: Their first and second derivatives, shape (2, s, m) [N/s, N/s^2].
        W: Wrench matrices, shape (s, 6, m).
        W_slopes: Their derivatives by a turn about and a way along each axis of W,
            shape (s, 6, m, 6) [1/rad, 1/m].
        lengths: Of the cables by the poses, shape (s, m) [m].
        sigma_tensions: Noise of single rows, shape (m,) [N].
        sigma_turn: Noise of a tracked rotation about an axis [rad].
        sigma_place: Noise of a tracked coordinate [m].
        smoothed: Poses (seven numbers) and tensions as they were smoothed.
        dropped: Rows of the log that were left out as outliers.
        raised: Whether the log is smoother than any sensor, and its noise counts as the least that
            is believed, `LEAST_POSE` and `LEAST_TENSION`.
    """

    time: Array
    R_WP: Array
    p_WP: Array
    V_WP: Array
    A_WP: Array
    tensions: Array
    tension_rates: Array
    W: Array
    W_slopes: Array
    lengths: Array
    sigma_tensions: Array
    sigma_turn: float
    sigma_place: float
    smoothed: tuple[Smoothed, Smoothed]
    dropped: int
    raised: bool

    @property
    def count(self) -> int:
        """Number of samples s."""
        return len(self.time)

    @property
    def pose_spread(self) -> Array:
        """Noise of single rows of poses, turns before places, shape (6,) [rad, m]."""
        return np.array([self.sigma_turn] * 3 + [self.sigma_place] * 3)

    @property
    def wrench(self) -> Array:
        """F_P_W of the cables about Po, shape (s, 6) [N m, N]."""
        return np.einsum("nij,nj->ni", self.W, self.tensions)

    def blocks(self) -> list[slice]:
        """Samples that are weighted together."""
        return [slice(k, min(k + BLOCK, self.count)) for k in range(0, self.count, BLOCK)]


def sample_motion(
    time: Array, poses: Array, tensions: Array, cables: CableSet, bandwidth: float
) -> LoggedMotion:
    """Smooths poses and tensions of a log, differentiates, and says how noisy they were.

    Args:
        time: Shape (k,) [s], growing.
        poses: Quaternions (w, x, y, z) and positions of X_WP, shape (k, 7) [-, m]; NaN: none.
        tensions: Shape (k, m) [N]; NaN: none.
        cables: The cables, at the ends of which the tensions act.
        bandwidth: Of the smoothing, see `smoothing` [Hz].

    Raises:
        IdentificationError: The log has too few rows, gaps, or another number of cables.
    """
    k, m = len(time), cables.count
    for what, found, wanted in (
        ("poses", np.shape(poses), (k, 7)), ("tensions", np.shape(tensions), (k, m)),
    ):  # fmt: skip
        if found != wanted:
            raise IdentificationError(f"{what}: found shape {found}; accepted: {wanted}")
    smoother = Smoother.over(time, bandwidth)
    X = smoother.fit(one_side(np.asarray(poses, float)))
    t = smoother.fit(np.asarray(tensions, float))
    at = smoother.sample_times()
    R, V, A, states = _motion(X, at)
    W, lengths = wrench_matrices(states, cables), np.empty((len(at), 2, m))
    packed = cables.packed()
    for n, state in enumerate(states):
        cable_motions(state, packed, 0.0, lengths[n])
    slopes = wrench_matrix_slopes(states, cables)
    fine = np.isfinite(slopes).all(axis=(1, 2, 3)) & np.isfinite(lengths).all(axis=(1, 2))
    if not fine.all():
        n = int(np.argmin(fine))
        raise IdentificationError(
            f"log: found a pose at {at[n]:.4g} s at which a cable cannot run; accepted: poses that "
            "the robot can have"
        )
    tension = t.at(at)
    least = LEAST_TENSION * float(np.max(np.abs(tension)))
    sigma_turn = 2.0 * float(np.sqrt(np.sum(X.sigma[:4] ** 2) / 3.0))
    sigma_place = float(np.sqrt(np.mean(X.sigma[4:] ** 2)))
    return LoggedMotion(
        at, R, states[:, 4:7], V, A, tension, np.array([t.at(at, 1), t.at(at, 2)]), W,
        slopes, lengths[:, 0], np.maximum(t.sigma, least), max(sigma_turn, LEAST_POSE),
        max(sigma_place, LEAST_POSE), (X, t), int(X.dropped.sum() + t.dropped.sum()),
        bool(min(sigma_turn, sigma_place) < LEAST_POSE or np.any(t.sigma < least)),
    )  # fmt: skip


def wrench_matrices(states: Array, cables: CableSet) -> Array:
    """Wrench matrices of a platform in states, shape (s, 13), each (6, m); NaN: a cable cannot."""
    W, packed = np.empty((len(states), 6, cables.count)), cables.packed()
    for n, state in enumerate(states):
        wrench_matrix_at(state, packed, 0.0, W[n])
    return W


def wrench_matrix_slopes(states: Array, cables: CableSet) -> Array:
    """Derivatives of `wrench_matrices` by turns about and ways along the axes of W.

    Returns:
        Shape (s, 6, m, 6) [1/rad, 1/m]; NaN: a cable cannot.
    """
    slopes = np.empty((len(states), 6, cables.count, 6))
    q, v = states[:, :1], states[:, 1:4]
    for k in range(6):
        ends = []
        for h in (STEP, -STEP):
            moved, axis = states.copy(), np.eye(3)[k % 3]
            if k < 3:
                moved[:, :1] = q - 0.5 * h * v @ axis[:, None]
                moved[:, 1:4] = v + 0.5 * h * (q * axis + np.cross(axis, v))
                moved[:, :4] /= np.linalg.norm(moved[:, :4], axis=1, keepdims=True)
            else:
                moved[:, 4:7] += h * axis
            ends.append(wrench_matrices(moved, cables))
        slopes[..., k] = (ends[0] - ends[1]) / (2.0 * STEP)
    return slopes


def pose_shift(samples: LoggedMotion, cables: CableSet, gravity: Array) -> tuple[float, float]:
    """By how much poses are late against tensions, and how much better the motion fits then.

    Inertial parameters are fitted for each shift that is tried, so that a wrong belief does not
    look like a wrong clock.

    Returns:
        The shift [s], positive where poses are late, and the factor by which the root mean square
        of what does not fit falls, at least 1; (0, 1) where the log is too short.
    """
    (X, _), span = samples.smoothed, float(samples.time[-1] - samples.time[0])
    most = min(LONGEST_SHIFT, SHIFTED_SHARE * span)
    inside = np.abs(samples.time - 0.5 * (samples.time[0] + samples.time[-1])) < 0.5 * span - most
    if np.sum(inside) < LEAST_SAMPLES:
        return 0.0, 1.0
    time, t = samples.time[inside], samples.tensions[inside]
    scale = np.array([1.0 / LENGTH_SCALE] * 3 + [1.0] * 3)

    def misfit(shift: float) -> float:
        R, V, A, states = _motion(X, time + shift)
        F = np.einsum("nij,nj->ni", wrench_matrices(states, cables), t) * scale
        Y = (inertia_regressor(R, V, A, gravity) * scale[:, None]).reshape(-1, SIZE)
        fit = np.linalg.lstsq(Y, F.ravel(), rcond=1e-6)[0]
        return float(np.sqrt(np.mean((Y @ fit - F.ravel()) ** 2)))

    shifts = np.linspace(-most, most, SHIFTS)
    found = [misfit(shift) for shift in shifts]
    best, step = shifts[int(np.argmin(found))], shifts[1] - shifts[0]
    fine = minimize_scalar(misfit, bounds=(best - step, best + step), method="bounded")
    return float(fine.x), max(misfit(0.0) / max(float(fine.fun), 1e-12), 1.0)


def one_side(poses: Array) -> Array:
    """Pose rows whose quaternions do not jump from q to -q, which is the same rotation."""
    rows = poses.copy()
    seen = np.flatnonzero(np.isfinite(rows).all(axis=1))
    inner = np.sum(rows[seen[1:], :4] * rows[seen[:-1], :4], axis=1)
    signs = np.cumprod(np.where(inner < 0.0, -1.0, 1.0))
    rows[seen[1:], :4] *= signs[:, None]
    return rows


def _motion(X: Smoothed, at: Array) -> tuple[Array, Array, Array, Array]:
    """Rotations, velocities, accelerations and states, shape (s, 13), of smoothed pose rows."""
    x, v, a = X.at(at), X.at(at, 1), X.at(at, 2)
    q, q_dot, q_ddot = x[:, :4], v[:, :4], a[:, :4]
    square = np.sum(q * q, axis=1, keepdims=True)
    # The spline's quaternion is not quite of length one: w = 2 vec(q' q*) / |q|^2 all the same.
    w = 2.0 * _vector_of_product(q_dot, q) / square
    grows = 2.0 * np.sum(q * q_dot, axis=1, keepdims=True) / square
    alpha = 2.0 * _vector_of_product(q_ddot, q) / square - grows * w
    unit = q / np.sqrt(square)
    V, A = np.hstack([w, v[:, 4:]]), np.hstack([alpha, a[:, 4:]])
    states = np.hstack([unit, x[:, 4:], V])
    return rotations_of_quaternions(np.ascontiguousarray(unit)), V, A, states


def _vector_of_product(a: Array, b: Array) -> Array:
    """Vector part of a b*, of quaternions (w, x, y, z), shape (n, 3)."""
    return np.asarray(b[:, :1] * a[:, 1:] - a[:, :1] * b[:, 1:] - np.cross(a[:, 1:], b[:, 1:]))


@dataclass(frozen=True, eq=False)
class WinchSamples:
    """Turning winches, in means over stretches in which each keeps its direction.

    Attributes:
        time: Of the samples, shape (s,) [s].
        cable: Whose winch, shape (s,).
        speed: Of the motor, positive pays out, shape (s,) [rad/s].
        friction: Torque that neither tension nor acceleration explain, shape (s,) [N m].
        rows: Rows of the log in each mean, shape (s,).
        excess: Mean share of the static friction's excess over Coulomb's that is there,
            exp(-|w| / w_s), shape (s,) [-]. That of the mean speed is smaller, and put Coulomb
            friction 1 % and viscous up to 4 % off.
    """

    time: Array
    cable: np.typing.NDArray[np.intp]
    speed: Array
    friction: Array
    rows: Array
    excess: Array


def sample_winches(
    time: Array, lengths: Array, tensions: Array, torques: Array, *, ratio: Array, inertia: float,
    bandwidth: float, least_speed: float, stribeck_speed: float,
) -> WinchSamples:  # fmt: skip
    """What winches lose, tau + rho t - J dw/dt, while they turn.

    Args:
        time: Shape (k,) [s].
        lengths: Unstrained lengths that winches count, shape (k, m) [m].
        tensions: At the drums, shape (k, m) [N].
        torques: Of the motors, positive pays out, shape (k, m) [N m].
        ratio: rho, way of the cable per angle of the motor, shape (m,) [m/rad].
        inertia: J at the motor's shaft [kg m^2].
        bandwidth: Of the smoothing [Hz].
        least_speed: Slower winches do not count: dry friction may hold them [rad/s].
        stribeck_speed: Over which static fades to Coulomb friction [rad/s].

    Raises:
        IdentificationError: As `Smoother`, or no winch turns as fast.
    """
    smoother = Smoother.over(time, bandwidth)
    l0 = smoother.fit(lengths, robust=False)
    w, w_dot = l0.at(time, 1) / ratio, l0.at(time, 2) / ratio
    lost = torques + ratio * tensions - inertia * w_dot
    window = np.floor((time - time[0]) * 2.0 * bandwidth).astype(int)
    rows = []
    for i in range(lengths.shape[1]):
        turning = np.where(np.abs(w[:, i]) > least_speed, np.sign(w[:, i]), 0.0)
        good = (turning != 0.0) & np.isfinite(lost[:, i])
        for n in np.unique(window[good]):
            mine = good & (window == n)
            if np.all(turning[mine] == turning[mine][0]):
                rows.append(
                    (np.mean(time[mine]), i, np.mean(w[mine, i]), np.mean(lost[mine, i]),
                     np.sum(mine), np.mean(np.exp(-np.abs(w[mine, i]) / stribeck_speed)))
                )  # fmt: skip
    if not rows:
        raise IdentificationError(
            f"log: winches: found none that turns faster than {least_speed:g} rad/s; accepted: a "
            "log in which they turn, to tell their friction"
        )
    table = np.array(rows)
    return WinchSamples(table[:, 0], table[:, 1].astype(int), *table[:, 2:].T)
