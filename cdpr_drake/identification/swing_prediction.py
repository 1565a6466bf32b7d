"""Stretches of a swing as they are predicted, and what pulls in addition to cables and weight.

The pull is by the momentum: Newton's and Euler's laws with measured turns, tensions and positions;
without a tracker, turns and cable lengths give positions. It needs no prediction, so that a hand at
the platform shows at the instant at which it pulls, while a prediction is off from there on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, IdentificationError
from cdpr_drake.identification.swing_log import Stretch
from cdpr_drake.identification.swing_model import SwingModel, earlier
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


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedStretch:
    """A stretch and its prediction.

    Attributes:
        stretch: What was measured.
        lead: The first state is by so much of it [s]; infinite: it was fitted.
        tensions: Predicted readings of load cells, shape (n, m) [N].
        turned: Rotation vectors from predicted to measured turns, in the sensor's frame, shape
            (n, 3) [rad].
        measured_turns: Rotation vectors from the mean measured turn, shape (n, 3) [rad].
        predicted_turns: The same of predicted readings.
        positions: Measured in W, or where the measured turns and the cables' lengths put Po,
            shape (n, 3) [m]; NaN where neither does.
        places: Predictions of `positions`.
        unexplained: What pulls in addition to cables and weight; None: it cannot be told.
    """

    stretch: Stretch
    lead: float
    tensions: Array
    turned: Array
    measured_turns: Array
    predicted_turns: Array
    positions: Array
    places: Array
    unexplained: Unexplained | None = None

    def after_lead(self) -> np.typing.NDArray[np.bool_]:
        """Instants that are predicted, or all, shape (n,)."""
        time = self.stretch.time
        if self.lead >= time[-1] - time[0]:
            return np.ones(len(time), bool)
        return np.asarray(time - time[0] > self.lead)

    def turn_rms(self) -> float:
        """Angle between predicted and measured turns, root mean square [rad]."""
        rows = self.turned[self.after_lead() & self.stretch.covered]
        return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))

    def position_rms(self) -> float | None:
        """Distance of predicted and measured positions, root mean square [m]."""
        off = np.sum((self.places - self.positions) ** 2, axis=1)
        rows = off[self.after_lead() & np.isfinite(off) & self.stretch.covered]
        return float(np.sqrt(np.mean(rows))) if len(rows) else None

    def tension_rms(self) -> float | None:
        """Of all cables [N]."""
        off = (self.tensions - self.stretch.tensions)[self.after_lead()]
        off = off[np.isfinite(off)]
        return float(np.sqrt(np.mean(off**2))) if off.size else None


def unexplained(
    model: SwingModel, vector: Array, stretch: Stretch, places: Array
) -> Unexplained | None:
    """What pulls in addition to cables and weight.

    Args:
        model, vector, stretch: The robot at its unknown vector, and what was measured.
        places: Near positions of Po at the instants, shape (n, 3) [m].

    Returns:
        None if some tensions, turns or positions are missing, or the stretch is too short.
    """
    step, log = stretch.step, stretch.log
    window = 2 * round(0.5 * SMOOTH / step) + 1
    if window <= ORDER or stretch.count <= 2 * window or not np.isfinite(stretch.tensions).all():
        return None
    if not stretch.covered.all():
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


def predicted(
    model: SwingModel, vector: Array, stretch: Stretch, moved: Array, lead: float
) -> PredictedStretch:
    """A stretch by the motion from its first state.

    Raises:
        IdentificationError: The motion does not go on to the end of the stretch.
    """
    states, tensions = model.run(vector, moved, stretch.count, stretch.step)
    if not np.isfinite(states).all():
        raise IdentificationError(
            f"stretch from {stretch.time[0]:g} s: found no motion that goes on to its end"
        )
    turns, _ = model.sensed(vector, states, stretch.step)
    _, places = earlier(states, stretch.step, model.by_name(vector)["sensor.late"])
    measured = stretch.turns
    R_WP, p = model.unsensed(vector, measured, stretch.positions)
    if p is None:
        pulls = model.unsensed_tensions(vector, stretch.tensions)
        pulls = np.where(np.isfinite(pulls), pulls, tensions)
        p = places_by_lengths(model, vector, R_WP, pulls, places)
    middle = measured.mean().inv()
    return PredictedStretch(
        stretch=stretch, lead=lead, tensions=model.sensed_tensions(vector, tensions),
        turned=(turns.inv() * measured).as_rotvec(), positions=p, places=places,
        measured_turns=(middle * measured).as_rotvec(),
        predicted_turns=(middle * turns).as_rotvec(),
        unexplained=unexplained(model, vector, stretch, places),
    )  # fmt: skip


def pulled(
    model: SwingModel, vector: Array, stretches: Sequence[PredictedStretch]
) -> tuple[str, ...]:
    """Remarks on stretches in which something else than cables and weight pulls."""
    platform = model.platform(vector)
    weight = platform.mass * float(np.linalg.norm(platform.acceleration()))
    remarks = []
    for each in stretches:
        if each.unexplained is None:
            continue
        force, at = each.unexplained.largest(each.unexplained.force)
        if force > PULLED * weight:
            time = each.stretch.time
            remarks.append(
                f"stretch {time[0]:.6g}:{time[-1]:.6g}: about {at:.4g} s neither cables nor weight "
                f"explain {force:.3g} N, the mean over {PULL:g} s: a hand, or a wire?"
            )
    return tuple(remarks)


def _turning(turns: Rotation, step: float) -> Array:
    """Angular velocities in W by central differences, shape (n, 3) [rad/s]."""
    n = len(turns)
    first, last = np.maximum(np.arange(n) - 1, 0), np.minimum(np.arange(n) + 1, n - 1)
    turned = (turns[last] * turns[first].inv()).as_rotvec()
    return np.asarray(turned / (step * (last - first))[:, None])
