"""What pulls at a platform in addition to its cables and its weight, by its momentum.

Newton's and Euler's laws with measured turns, tensions and positions; without a tracker, turns and
cable lengths give positions. Nothing is predicted, so that a hand at the platform shows at the
instant at which it pulls, while a prediction is off from there on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.identification.swing_log import Stretch
from cdpr_drake.identification.swing_model import SwingModel
from cdpr_drake.identification.swing_states import paths_of, places_by_lengths, pose_rows_of

SMOOTH, ORDER = 0.18, 4
"""Span [s] and order of the polynomials that smooth and differentiate: up to some 8 Hz."""

PULL = 0.5
"""A pull is the mean over so long [s]: about a swing, in which noise and slow sensors are out."""

PULLED = 0.03
"""Share of the weight from which on a mean pull is no error of sensors: a tracker's noise of 1 mm
makes up to 2 % at 50 readings per second."""


@dataclass(frozen=True, eq=False)
class Unexplained:
    """What neither cables nor weight explain in a stretch.

    Attributes:
        time: Of its inner instants, shape (n,) [s].
        force: In W, shape (n, 3) [N].
        moment: About the centre of mass, in W, shape (n, 3) [N m].
    """

    time: Array
    force: Array
    moment: Array

    def means(self, values: Array) -> Array:
        """Means of forces or moments over `PULL` from each instant on, shape (j, 3)."""
        n = self._count()
        sums = np.cumsum(np.vstack([np.zeros(3), values]), axis=0)
        return np.asarray((sums[n:] - sums[:-n]) / n)

    def largest(self, values: Array) -> tuple[float, float]:
        """The largest mean over `PULL` of forces or moments, and its middle instant [s]."""
        sizes = np.linalg.norm(self.means(values), axis=1)
        k = int(np.argmax(sizes))
        return float(sizes[k]), float(np.mean(self.time[k : k + self._count()]))

    def _count(self) -> int:
        step = float(self.time[1] - self.time[0])
        return min(max(round(PULL / step), 1), len(self.time))


def unexplained(
    model: SwingModel, vector: Array, stretch: Stretch, places: Array
) -> Unexplained | None:
    """What pulls in addition to cables and weight.

    Args:
        model: The robot.
        vector: The unknown vector.
        stretch: The stretch.
        places: Near positions of Po at its instants, shape (n, 3) [m].

    Returns:
        None if some tensions, turns or positions are missing, or the stretch is too short.
    """
    step, log = stretch.step, stretch.log
    window = 2 * round(0.5 * SMOOTH / step) + 1
    if window <= ORDER or stretch.count <= 2 * window or not np.isfinite(stretch.tensions).all():
        return None
    if not np.all(stretch.known > 0.0):
        return None
    at = np.minimum(stretch.time + model.by_name(vector)["sensor.late"], log.turn_time[-1])
    turns, p = model.unsensed(vector, log.turns_at(at), log.positions_at(at))
    pulls = model.unsensed_tensions(vector, stretch.tensions)
    if p is None:
        p = places_by_lengths(model, vector, turns, pulls, places)
    if not np.isfinite(p).all():
        return None

    def smooth(rows: Array, derivative: int) -> Array:
        return np.asarray(savgol_filter(rows, window, ORDER, deriv=derivative, delta=step, axis=0))

    platform = model.platform(vector)
    R, c, mass = turns.as_matrix(), platform.p_PCo, platform.mass
    arms = R @ c
    force, moment = np.empty_like(arms), np.empty_like(arms)  # of cables about the centre of mass
    try:
        for k, row in enumerate(pose_rows_of(turns, p)):
            about_Po = -paths_of(model, row).J.T @ pulls[k]
            force[k] = about_Po[3:]
            moment[k] = about_Po[:3] - np.cross(arms[k], about_Po[3:])
    except CableGeometryError:
        return None
    force = mass * smooth(p + arms, 2) - smooth(force, 0) - mass * platform.acceleration()
    I_central = platform.I_PPo + mass * (np.outer(c, c) - float(c @ c) * np.eye(3))
    momentum = R @ I_central @ np.swapaxes(R, 1, 2) @ _turning(turns, step)[:, :, None]
    moment = smooth(momentum[:, :, 0], 1) - smooth(moment, 0)
    inner = slice(window // 2, -(window // 2))  # at the ends polynomials make noise of noise
    return Unexplained(stretch.time[inner], force[inner], moment[inner])


def _turning(turns: Rotation, step: float) -> Array:
    """Angular velocities in W by central differences, shape (n, 3) [rad/s]."""
    n = len(turns)
    first, last = np.maximum(np.arange(n) - 1, 0), np.minimum(np.arange(n) + 1, n - 1)
    turned = (turns[last] * turns[first].inv()).as_rotvec()
    return np.asarray(turned / (step * (last - first))[:, None])
