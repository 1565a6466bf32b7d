"""Numba kernels of tasks: what is observed of robots and what it is worth, one row after the other.

Every row is computed alone, by the same instructions whatever the number of rows: so many robots
see the same bits as one does.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_rates import cable_rates_from_base_twist
from cdpr_drake.geometry.rotation_kernel import quaternion_into
from cdpr_drake.vision.pinhole import images_of, is_pictured

LENGTH, SPEED, TURN_SPEED, TENSION = range(4)
"""Entries of the scales of a task [m, m/s, rad/s, N]."""

PLATFORM = 12
"""Numbers that `write_platform` gives of the platform, before those of the cables."""


@njit(cache=True)
def write_turn(q: Array, other: Array, out: Array) -> float:
    """out[:3] <- rotation vector, in the first frame, that turns it into the other one [rad].

    Args:
        q: Unit quaternion wxyz of a frame, begins a row of `pose_row`.
        other: That of the other one.
        out: Overwritten.

    Returns:
        The angle, from 0 to pi [rad].
    """
    a, b, c, d = q[0], -q[1], -q[2], -q[3]
    e, f, g, h = other[0], other[1], other[2], other[3]
    w = a * e - b * f - c * g - d * h
    x = a * f + b * e + c * h - d * g
    y = a * g - b * h + c * e + d * f
    z = a * h + b * g - c * f + d * e
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    angle = 2.0 * math.atan2(size, w)
    per = angle / size if size > 1e-12 else 2.0
    out[0], out[1], out[2] = per * x, per * y, per * z
    return angle


@njit(cache=True)
def write_platform(
    poses: Array, twists: Array, tensions: Array, home: Array, scales: Array, out: Array
) -> None:
    """Writes what a robot knows of itself: place and turn from home, velocities, tensions.

    Args:
        poses: Rows of `pose_row`, shape (n, 7) [-, m].
        twists: Of P in W, shape (n, 6) [rad/s, m/s].
        tensions: Shape (n, m) [N].
        home: A row as of poses.
        scales: See `LENGTH`.
        out: The first `PLATFORM` + m numbers of each row are overwritten [-].
    """
    for i in range(poses.shape[0]):
        for k in range(3):
            out[i, k] = (poses[i, 4 + k] - home[4 + k]) / scales[LENGTH]
            out[i, 6 + k] = twists[i, 3 + k] / scales[SPEED]
            out[i, 9 + k] = twists[i, k] / scales[TURN_SPEED]
        write_turn(home, poses[i], out[i, 3:6])
        for k in range(tensions.shape[1]):
            out[i, PLATFORM + k] = tensions[i, k] / scales[TENSION]


@njit(cache=True)
def write_aims(poses: Array, aims: Array, scales: Array, out: Array, errors: Array) -> None:
    """Writes where goals are as seen from platforms.

    Args:
        poses: Rows of `pose_row`, shape (n, 7) [-, m].
        aims: The same of the goals.
        scales: See `LENGTH`.
        out: Place of the goal less that of Po, then the rotation vector in P to the goal; the first
            6 numbers of each row are overwritten [-, rad].
        errors: Distance and angle, shape (n, 2), overwritten [m, rad].
    """
    for i in range(poses.shape[0]):
        total = 0.0
        for k in range(3):
            apart = aims[i, 4 + k] - poses[i, 4 + k]
            total += apart * apart
            out[i, k] = apart / scales[LENGTH]
        errors[i, 0] = math.sqrt(total)
        errors[i, 1] = write_turn(poses[i], aims[i], out[i, 3:6])


@njit(cache=True)
def write_distances(points: Array, aims: Array, length: float, out: Array, errors: Array) -> None:
    """As `write_aims` of points, shape (n, 3) [m]: 3 numbers a row, and distances, shape (n,)."""
    for i in range(points.shape[0]):
        total = 0.0
        for k in range(3):
            apart = aims[i, k] - points[i, k]
            total += apart * apart
            out[i, k] = apart / length
        errors[i] = math.sqrt(total)


@njit(cache=True)
def add_closeness(errors: Array, scales: Array, weights: Array, rewards: Array) -> None:
    """Adds weight (1 - tanh e) to rewards, e the root of the sum of (error / scale)^2.

    Args:
        errors: Shape (n, k).
        scales: Of each error, shape (k,).
        weights: Shape (n,).
        rewards: Shape (n,), changed.
    """
    for i in range(errors.shape[0]):
        total = 0.0
        for k in range(errors.shape[1]):
            part = errors[i, k] / scales[k]
            total += part * part
        rewards[i] += weights[i] * (1.0 - math.tanh(math.sqrt(total)))


@njit(cache=True)
def take_costs(
    actions: Array, tensions: Array, upper: float, effort: float, overload: float, rewards: Array
) -> None:
    """Takes from rewards the mean square of the actions, and the share of overloaded cables.

    Args:
        actions: Shape (n, a) [-].
        tensions: Shape (n, m) [N].
        upper: Above which a cable is overloaded [N].
        effort: Weight of the mean square.
        overload: Weight of the share.
        rewards: Shape (n,), changed.
    """
    a, m = actions.shape[1], tensions.shape[1]
    for i in range(rewards.shape[0]):
        square, over = 0.0, 0
        for k in range(a):
            square += actions[i, k] * actions[i, k]
        for k in range(m):
            over += tensions[i, k] > upper
        rewards[i] -= effort * square / a + overload * over / m


@njit(cache=True)
def write_rates(poses: Array, twists: Array, cables: Array, out: Array) -> None:
    """Writes rates of cable lengths that give platforms twists.

    Args:
        poses: Rows of `pose_row`, shape (n, 7) [-, m].
        twists: Of P in W, shape (n, 6) [rad/s, m/s].
        cables: `CableSet.packed` of the robot that is believed, shape (m, 17).
        out: Shape (n, m), overwritten [m/s].
    """
    R = np.empty((3, 3))
    for i in range(poses.shape[0]):
        quaternion_into(poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], 2.0, R)
        rates = cable_rates_from_base_twist(R, poses[i, 4:], cables, twists[i])
        for k in range(rates.shape[0]):
            out[i, k] = rates[k]


@njit(cache=True)
def write_references(
    times: Array, amplitudes: Array, rates: Array, phases: Array, ramp: float, out: Array
) -> None:
    """Writes sums of sines that begin at rest: offset, velocity and acceleration, in directions.

    x(t) = s(t) A sin(w t + phi), s the quintic from 0 at rest to 1 at rest within the ramp.

    Args:
        times: Shape (n,) [s].
        amplitudes: A of each direction, shape (n, k) [m].
        rates: w [rad/s].
        phases: phi [rad].
        ramp: Time of the ramp [s].
        out: Shape (n, 3, k), overwritten [m, m/s, m/s^2].
    """
    for i in range(times.shape[0]):
        u = min(times[i] / ramp, 1.0)
        s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
        s1 = 30.0 * u * u * (1.0 + u * (u - 2.0)) / ramp
        s2 = 60.0 * u * (1.0 + u * (2.0 * u - 3.0)) / (ramp * ramp)
        for k in range(amplitudes.shape[1]):
            w, at = rates[i, k], rates[i, k] * times[i] + phases[i, k]
            a, sine, cosine = amplitudes[i, k], math.sin(at), math.cos(at)
            out[i, 0, k] = a * s * sine
            out[i, 1, k] = a * (s1 * sine + s * w * cosine)
            out[i, 2, k] = a * (s2 * sine + 2.0 * s1 * w * cosine - s * w * w * sine)


@njit(cache=True)
def write_marks(
    poses: Array, X_PC: Array, objects: Array, points: Array, camera: Array, border: float,
    marks: Array, found: np.ndarray,
) -> None:  # fmt: skip
    """Writes the images of points of objects in cameras on platforms, and whether they are seen.

    Args:
        poses: X_WP, rows of `pose_row`, shape (n, 7) [-, m].
        X_PC: Camera on the platform, shape (3, 4) [-, m].
        objects: X_WO of each, shape (n, 3, 4) [-, m].
        points: In O, shape (3, k) [m].
        camera: `Pinhole.numbers`.
        border: As of `is_pictured` [px].
        marks: (u, v) of each point, shape (n, 2 k), overwritten where they are seen [px].
        found: Shape (n,), overwritten.
    """
    k = points.shape[1]
    R, R_WC, p_WC = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    X, uv = np.empty(12), np.empty((2, k))
    for i in range(poses.shape[0]):
        quaternion_into(poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], 2.0, R)
        for a in range(3):
            for b in range(3):
                R_WC[a, b] = R[a, 0] * X_PC[0, b] + R[a, 1] * X_PC[1, b] + R[a, 2] * X_PC[2, b]
            p_WC[a] = poses[i, 4 + a]
            p_WC[a] += R[a, 0] * X_PC[0, 3] + R[a, 1] * X_PC[1, 3] + R[a, 2] * X_PC[2, 3]
        O = objects[i]  # noqa: E741
        for b in range(4):
            x, y, z = O[0, b], O[1, b], O[2, b]
            if b == 3:
                x, y, z = x - p_WC[0], y - p_WC[1], z - p_WC[2]
            for a in range(3):
                X[3 * b + a] = R_WC[0, a] * x + R_WC[1, a] * y + R_WC[2, a] * z
        found[i] = is_pictured(points, X, camera, border)
        if found[i]:
            images_of(points, X, camera, uv)
            for j in range(k):
                marks[i, 2 * j], marks[i, 2 * j + 1] = uv[0, j], uv[1, j]


@njit(cache=True)
def place_points(poses: Array, p_PT: Array, out: Array) -> None:
    """Writes where points of platforms are in W.

    Args:
        poses: Rows of `pose_row`, shape (n, 7) [-, m].
        p_PT: The point of each platform in P, shape (n, 3) [m].
        out: Shape (n, 3), overwritten [m].
    """
    R = np.empty((3, 3))
    for i in range(poses.shape[0]):
        quaternion_into(poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], 2.0, R)
        for a in range(3):
            out[i, a] = poses[i, 4 + a] + (
                R[a, 0] * p_PT[i, 0] + R[a, 1] * p_PT[i, 1] + R[a, 2] * p_PT[i, 2]
            )
