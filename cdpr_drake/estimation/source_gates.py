"""Takes readings of sources into a fused belief, or leaves them out where they cannot be right.

A reading whose normalized innovation is larger than chance allows is left out. A source of which
everything was left out for longer than a patience is believed to be out of calibration: what was
known of that is forgotten, and found anew from what the others say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_filter import COUNTED, FusedBelief, correct, forget
from cdpr_drake.estimation.sensor_models import Sight, depth_innovation, gate, normalized_innovation

USED, NOTHING, REJECTED = 1.0, 0.0, -1.0
"""What became of a source; of depths and lengths, the share that was used."""

ACCEPTED = -1.0
"""Stands for the time since when a source is left out, while it is not."""


@dataclass(frozen=True)
class Gates:
    """When readings are left out.

    Attributes:
        probability: With which a right reading is left out; 0: none ever is.
        patience: Time after which a source is believed to be out of calibration [s].
        lost: Standard deviations of a camera's pose then, shape (6,) [rad, m]; the last is also
            that of a length.
    """

    probability: float
    patience: float
    lost: Array

    def is_wrong(self, nis: float, size: int) -> bool:
        """Whether an innovation of so many numbers is less likely than that."""
        return self.probability > 0.0 and nis > gate(size, self.probability)


@dataclass(frozen=True)
class GateDecision:
    """What became of a reading.

    Attributes:
        belief: The belief after it.
        status: `USED`, `REJECTED`, or the share that was used.
        nis: Its normalized innovation squared over its degrees of freedom, NaN without one [-].
        refused_since: Since when its source is left out [s]; `ACCEPTED`: it is not.
        anew: Whether its calibration was forgotten before, to be found anew.
    """

    belief: FusedBelief
    status: float
    nis: float
    refused_since: float = ACCEPTED
    anew: bool = False


def take_image(
    belief: FusedBelief,
    sight_of: Callable[[FusedBelief], Sight],
    read: Callable[[FusedBelief, Sight], tuple[Array, Array]],
    calibration: slice,
    gates: Gates,
    refused: tuple[float, float],
) -> GateDecision:
    """Takes in the pose that a camera measured.

    Args:
        belief: Belief before.
        sight_of: What the camera is expected to see of a belief.
        read: Gives the innovation of what it saw, shape (6,) [rad, m], and the covariance of that
            one's error, a twist of the object in the object, shape (6, 6).
        calibration: Where the error of the camera's pose stands in P.
        gates: When readings are left out.
        refused: Since when the camera is left out, and the time now [s].
    """
    (since, now), anew = refused, False
    sight = sight_of(belief)
    innovation, R = read(belief, sight)
    nis = normalized_innovation(belief, sight.H, innovation, R)
    if gates.is_wrong(nis, 6):
        since = now if since < 0.0 else since
        left_out = GateDecision(belief, REJECTED, nis / 6.0, since)
        if now - since < gates.patience:
            return left_out
        belief, anew = forget(belief, calibration, gates.lost**2), True
        sight = sight_of(belief)
        innovation, R = read(belief, sight)
        if gates.is_wrong(normalized_innovation(belief, sight.H, innovation, R), 6):
            return left_out
    return GateDecision(correct(belief, sight.H, innovation, R), USED, nis / 6.0, anew=anew)


def take_depths(
    belief: FusedBelief,
    sight_of: Callable[[FusedBelief], Sight],
    points: Array,
    depths: Array,
    deviations: Array,
    gates: Gates,
) -> GateDecision:
    """Takes in depths of an object's points, one after the other.

    Args:
        belief: Belief before.
        sight_of: What the camera is expected to see of a belief.
        points: The points in the object's frame, shape (3, n) [m].
        depths: What was measured, shape (n,) [m]; 0: nothing.
        deviations: Standard deviations, shape (n,) [m].
        gates: When readings are left out.
    """
    used, nis = [], []
    for k in np.flatnonzero(depths > 0.0):
        H, innovation = depth_innovation(sight_of(belief), points[:, [k]], depths[[k]])
        R = deviations[[k]][:, np.newaxis] ** 2
        nis.append(normalized_innovation(belief, H, innovation, R))
        used.append(not gates.is_wrong(nis[-1], 1))
        if used[-1]:
            belief = correct(belief, H, innovation, R)
    if not used:
        return GateDecision(belief, NOTHING, np.nan)
    return GateDecision(belief, _share(np.array(used), len(points.T)), float(np.mean(nis)))


def take_lengths(
    belief: FusedBelief,
    measured: tuple[Array, Array, float],
    taut: Array,
    gates: Gates,
    refused: Array,
    elapsed: float,
) -> tuple[GateDecision, Array]:
    """Takes in counted lengths, each by itself left out or not.

    Args:
        belief: Belief before.
        measured: H, shape (m, k), innovation, shape (m,) [m], as `length_innovation`, and the
            standard deviation of a counted length [m].
        taut: Which cables are taut, shape (m,).
        gates: When readings are left out.
        refused: For how long each was left out, shape (m,) [s].
        elapsed: Time since the reading before [s].

    Returns:
        What became of them, and for how long each is left out, shape (m,) [s].
    """
    H, innovation, deviation = measured
    P, m = belief.covariance, len(innovation)
    nis = innovation**2 / (np.einsum("ij,jk,ik->i", H, P, H) + deviation**2)
    wrong = np.array([gates.is_wrong(value, 1) for value in nis]) & taut
    refused = np.where(wrong, refused + elapsed, 0.0)
    for k in np.flatnonzero(refused > gates.patience):
        belief = forget(belief, slice(COUNTED + k, COUNTED + k + 1), gates.lost[-1:] ** 2)
        refused[k] = 0.0
    if not np.any(taut):
        return GateDecision(belief, NOTHING, np.nan), refused
    used = np.flatnonzero(taut & ~wrong)
    if len(used):
        belief = correct(belief, H[used], innovation[used], deviation**2 * np.eye(len(used)))
    return GateDecision(belief, _share(taut & ~wrong, m), float(np.mean(nis[taut]))), refused


def _share(used: Array, count: int) -> float:
    """Share of readings that was used, `REJECTED` where none was."""
    return float(np.count_nonzero(used)) / count if np.any(used) else REJECTED
