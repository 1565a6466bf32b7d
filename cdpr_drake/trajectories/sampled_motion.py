"""Motions that are given by samples, in arrays or in a file that `cdpr plan` wrote."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.schema.input_files import input_bytes
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, PosePath, hermite
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE
from cdpr_drake.trajectories.timed_path import TimedPath

MOTION_COLUMNS = (
    "qw", "qx", "qy", "qz", "x_m", "y_m", "z_m",
    "wx_rad_s", "wy_rad_s", "wz_rad_s", "vx_m_s", "vy_m_s", "vz_m_s",
    "alphax_rad_s2", "alphay_rad_s2", "alphaz_rad_s2", "ax_m_s2", "ay_m_s2", "az_m_s2",
)  # fmt: skip
"""Names of the numbers of a motion row in a file, beside `TIME_COLUMN`."""

TIME_COLUMN = "time_s"

UNIT_WITHIN = 1e-6
"""By which the length of a quaternion may differ from 1: files have rounded numbers."""

REST_WITHIN = 1e-3
"""Velocities at the ends of a motion that count as rest [rad/s, m/s]."""

BELONGS_WITHIN = 0.1
"""By which mean velocities may differ from those that poses have, over the largest velocity: more
means other units or other columns."""


def sampled_motion(times: Array, rows: Array) -> TimedPath:
    """The motion through samples: polynomials of degree 5 that meet poses and both derivatives.

    Where samples are as dense as steps of control, these see the samples, whatever jumps between.

    Args:
        times: Shape (n,), n >= 2, growing [s].
        rows: Motion rows, shape (n, 19), at rest in the first and in the last.

    Raises:
        TrajectoryError: A number is not accepted; names the sample.
    """
    times, rows = np.asarray(times, float), np.array(rows, float)
    _check(times, rows)
    q = rows[:, :4]
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips)[:, np.newaxis]
    values = np.hstack([q, rows[:, 4:7]])
    # q' = (0, w) q / 2 and q'' = ((0, alpha) q + (0, w) q') / 2.
    turn = 0.5 * _product(rows[:, 7:10], q)
    growth = 0.5 * (_product(rows[:, 13:16], q) + _product(rows[:, 7:10], turn))
    first, second = np.hstack([turn, rows[:, 10:13]]), np.hstack([growth, rows[:, 16:]])
    first[[0, -1]] = 0.0  # rest, where files have a rounded one
    steps = np.diff(times)
    apart = np.diff(values, axis=0) / steps[:, np.newaxis] - 0.5 * (first[1:] + first[:-1])
    most = float(np.max(np.abs(first)))
    worst = int(np.argmax(np.max(np.abs(apart), axis=1)))
    if np.max(np.abs(apart)) > BELONGS_WITHIN * most + REST_WITHIN:
        raise TrajectoryError(
            f"motion: at {times[worst]:g} s velocities are not those of the poses, up to "
            f"{np.max(np.abs(apart)):.3g} apart; accepted: samples of one motion, in rad, m and s"
        )
    pieces = np.empty((len(steps), PIECE_NUMBERS))
    for k, step in enumerate(steps):
        ends = ((values[i], first[i], second[i]) for i in (k, k + 1))
        pieces[k] = hermite(float(step), *ends)
    breaks = times - times[0]
    return TimedPath.make(PosePath(breaks, pieces), breaks, np.ones(len(times)), float(times[0]))


def read_motion(path: Path, later: float = 0.0) -> TimedPath:
    """A motion from a table with `TIME_COLUMN` and `MOTION_COLUMNS`, such as motion.csv of a plan.

    Other columns are left out.

    Args:
        path: The table.
        later: By which its times are later than the file says [s].

    Raises:
        TrajectoryError: The file cannot be read, or a line is not accepted; names file and line.
    """
    try:
        lines = input_bytes(path).decode("utf-8-sig").splitlines()
    except FileNotFoundError as problem:
        raise TrajectoryError(f"{path}: there is no such file of a motion") from problem
    except (OSError, UnicodeDecodeError) as problem:
        raise TrajectoryError(f"{path}: cannot be read as text: {problem}") from problem
    table = list(csv.reader(lines))
    head = [name.strip() for name in table[0]] if table else []
    wanted = (TIME_COLUMN, *MOTION_COLUMNS)
    missing = [name for name in wanted if name not in head]
    if missing:
        raise TrajectoryError(
            f"{path}: line 1: found no column {missing[0]}; accepted: {', '.join(wanted[:4])}, ... "
            "as motion.csv of cdpr plan has them"
        )
    columns = [head.index(name) for name in wanted]
    rows = []
    for number, words in enumerate(table[1:], 2):
        if not any(word.strip() for word in words):
            continue
        try:
            row = [float(words[k]) for k in columns]
        except (ValueError, IndexError):
            row = [np.nan]
        if not np.all(np.isfinite(row)):
            raise TrajectoryError(
                f"{path}: line {number}: found {','.join(words)[:80]!r}; accepted: finite numbers "
                f"in the columns of line 1"
            )
        rows.append(row)
    samples = np.array(rows).reshape(-1, len(wanted))
    try:
        return sampled_motion(samples[:, 0] + later, samples[:, 1:])
    except TrajectoryError as problem:
        raise TrajectoryError(f"{path}: {problem}") from problem


def _check(times: Array, rows: Array) -> None:
    n = len(times)
    if n < 2 or rows.shape != (n, MOTION_SIZE):
        raise TrajectoryError(f"motion: found {n} samples; accepted: at least 2")
    if not np.all(np.diff(times) > 0.0) or times[0] < 0.0:
        k = int(np.argmin(np.diff(times)))
        raise TrajectoryError(
            f"motion: found the time {times[k + 1]:g} s after {times[k]:g} s; accepted: times from "
            "0 on that grow"
        )
    off = np.abs(np.linalg.norm(rows[:, :4], axis=1) - 1.0)
    if np.max(off) > UNIT_WITHIN:
        k = int(np.argmax(off))
        raise TrajectoryError(
            f"motion: at {times[k]:g} s: found a quaternion of length {1.0 + off[k]:.6g} or its "
            "inverse; accepted: 1"
        )
    for k in (0, n - 1):
        speed = float(np.max(np.abs(rows[k, 7:13])))
        if speed > REST_WITHIN:
            raise TrajectoryError(
                f"motion: at {times[k]:g} s: found velocities up to {speed:.3g}; accepted: rest at "
                "both ends"
            )


def _product(vectors: Array, quaternions: Array) -> Array:
    """(0, w) q of each row, shape (n, 4)."""
    w, (a, b) = vectors, (quaternions[:, :1], quaternions[:, 1:])
    scalar = -np.sum(w * b, axis=1, keepdims=True)
    return np.hstack([scalar, a * w + np.cross(w, b)])
