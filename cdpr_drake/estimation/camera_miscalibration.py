"""What if a camera is not where it is told to be: a belief for each answer, weighed and mixed.

A camera's calibration is as good as it is told, or, with some probability, it is worse: its error c
is drawn from N(0, T) or from N(0, Q), with Q > T. The filter runs on Q, so that it trusts no
calibration further than that. That a camera is as told is then one reading more, of its error, by

    N(c; 0, T) = N(c; 0, Q) N(c; 0, R) / N(0; 0, Q + R),    R^-1 = T^-1 - Q^-1,

which is 0 with a covariance R: taken in by the Kalman update, with the likelihood

    p(all readings | as told) / p(all readings | worse) = N(c_est; 0, P + R) / N(0; 0, Q + R).

So one filter serves all answers, nothing is decided too early, and what a wrong camera has done to
the other errors goes with it when it is found out. In a linear filter this is exact.

Beliefs are mixed by the moments of their errors, so that the covariance has also what the answers
differ by.

Source: Gaussian sums, Sorenson and Alspach, Automatica 7(4), 1971; moments of a mixture,
Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, 1.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_filter import ON_BOARD, FusedBelief, apart, correct, moved_by
from cdpr_drake.geometry.poses import logarithm

LEARNT = 0.05
"""Directions of a calibration's error of which a smaller share of the variance is gone are not
judged: what linearization leaves out is of the size of what is known of them."""

NEGLIGIBLE = 1e-9
"""An answer less probable than that is not worth a belief [-]."""


@dataclass(frozen=True)
class Calibration:
    """What is told of where a camera is.

    Attributes:
        columns: Where its error stands in P, `ON_BOARD` or `EXTERNAL`.
        X: Its pose as told, on the platform or in the world [m].
        told: Standard deviations of the error of that, as told, shape (6,) [rad, m].
        wrong: The same if it is worse than told, each larger; None: it is as told [rad, m].
        probability: Of that [-].
    """

    columns: slice
    X: RigidTransform
    told: Array
    wrong: Array | None = None
    probability: float = 0.0

    @property
    def prior(self) -> Array:
        """Standard deviations that the filter starts from, shape (6,) [rad, m]."""
        return self.told if self.wrong is None else self.wrong

    def error(self, belief: FusedBelief) -> Array:
        """The error of what is told that a belief has, a twist in the camera's frame as told,
        shape (6,) [rad, m]."""
        X = belief.X_PC if self.columns == ON_BOARD else belief.X_WE
        return np.asarray(logarithm(self.X.inverse() @ X))


@dataclass(frozen=True)
class Answer:
    """A belief under one answer to which cameras are worse than told.

    Attributes:
        wrong: Of each camera, whether it is.
        probability: Of this answer, by all readings [-].
        belief: What is believed under it.
    """

    wrong: tuple[bool, ...]
    probability: float
    belief: FusedBelief


def answers(belief: FusedBelief, cameras: Sequence[Calibration]) -> list[Answer]:
    """All answers but negligible ones, the most probable first.

    Args:
        belief: That of the filter, which started from `Calibration.prior`.
        cameras: What is told of each camera.
    """
    choices = []
    for camera in cameras:
        sure = (camera.probability <= 0.0, camera.probability >= 1.0)
        choices.append([False] if camera.wrong is None or sure[0] else [True] if sure[1] else
                       [False, True])  # fmt: skip
    found, logs = list[tuple[tuple[bool, ...], FusedBelief]](), list[float]()
    for wrong in product(*choices):
        likely, under = 0.0, belief
        for camera, is_wrong in zip(cameras, wrong, strict=True):
            if camera.wrong is None:
                continue
            share = camera.probability if is_wrong else 1.0 - camera.probability
            likely += np.log(share)
            if not is_wrong:
                under, log = _as_told(under, camera)
                likely += log
        found.append((wrong, under))
        logs.append(likely)
    weights = np.exp(np.array(logs) - np.max(logs))
    weights /= np.sum(weights)
    kept = [k for k in np.argsort(-weights) if weights[k] > NEGLIGIBLE]
    total = float(np.sum(weights[kept]))
    return [Answer(found[k][0], float(weights[k]) / total, found[k][1]) for k in kept]


def _as_told(belief: FusedBelief, camera: Calibration) -> tuple[FusedBelief, float]:
    """The belief if a camera is as told, and the logarithm of how much likelier the readings then
    are."""
    assert camera.wrong is not None
    T, Q = camera.told**2, camera.wrong**2
    R = np.diag(T * Q / (Q - T))
    H = np.zeros((6, len(belief.covariance)))
    H[:, camera.columns] = np.eye(6)
    innovation = -camera.error(belief)
    S = belief.covariance[camera.columns, camera.columns] + R
    before = np.diag(Q) + R
    log = -0.5 * (
        innovation @ np.linalg.solve(S, innovation)
        + np.linalg.slogdet(S)[1]
        - np.linalg.slogdet(before)[1]
    )
    return correct(belief, H, innovation, R), float(log)


def mixture(found: Sequence[Answer]) -> FusedBelief:
    """The belief with mean and covariance of all answers together."""
    first = found[0].belief
    if len(found) == 1:
        return first
    shares = np.array([answer.probability for answer in found])
    errors = np.array([apart(answer.belief, first) for answer in found])
    mean = shares @ errors
    rest = errors - mean
    P = np.einsum("k,ki,kj->ij", shares, rest, rest)
    for answer in found:
        P += answer.probability * answer.belief.covariance
    return replace(moved_by(first, mean), covariance=P)


@dataclass(frozen=True)
class CalibrationVerdict:
    """What readings say of a camera's calibration.

    Attributes:
        probability: That it is worse than told; NaN where nobody doubts it [-].
        surprise: How far it is from what is told, if that is so: chi-square distributed [-].
        freedom: Degrees of freedom of that: directions in which something was learnt.
        error: The error of what is told, a twist in the camera's frame, shape (6,) [rad, m].
        deviation: Standard deviation of that, shape (6,) [rad, m].
    """

    probability: float
    surprise: float
    freedom: int
    error: Array
    deviation: Array

    def row(self) -> Array:
        """All of it as numbers, shape (15,)."""
        numbers = [self.probability, self.surprise, self.freedom]
        return np.concatenate([numbers, self.error, self.deviation])


def calibration_verdicts(
    found: Sequence[Answer], cameras: Sequence[Calibration]
) -> list[CalibrationVerdict]:
    """What readings say of each camera, from all answers, see `answers`."""
    whole, results = mixture(found), []
    for k, camera in enumerate(cameras):
        right = [answer for answer in found if not answer.wrong[k]]
        surprise, freedom = np.nan, 0
        if right:
            surprise, freedom = surprise_of(right[0].belief, camera)
        results.append(
            CalibrationVerdict(
                np.nan
                if camera.wrong is None
                else sum(answer.probability for answer in found if answer.wrong[k]),
                surprise,
                freedom,
                camera.error(whole),
                np.sqrt(np.diagonal(whole.covariance)[camera.columns]),
            )
        )
    return results


def surprise_of(belief: FusedBelief, camera: Calibration) -> tuple[float, int]:
    """How far the estimated error is from what is told, and degrees of freedom of that.

    What a filter estimates of an error with prior covariance T has covariance T - P, as long as
    all is as told. Directions of which less than `LEARNT` of the variance is gone count not.

    Args:
        belief: The belief under the answer that the camera is as told.
        camera: What is told of it.
    """
    doubtful = camera.told > 0.0  # what is told to be exact is not judged
    told = camera.told[doubtful]
    scaled = camera.error(belief)[doubtful] / told
    P = belief.covariance[camera.columns, camera.columns][np.ix_(doubtful, doubtful)]
    shares, directions = np.linalg.eigh(np.eye(len(told)) - P / np.outer(told, told))
    judged_ones = shares > LEARNT
    if not np.any(judged_ones):
        return 0.0, 0
    parts = (directions[:, judged_ones].T @ scaled) ** 2 / shares[judged_ones]
    return float(np.sum(parts)), int(np.count_nonzero(judged_ones))


def explained_variance(belief: FusedBelief, columns: slice, prior: Array) -> Array:
    """Shares of the variance of an error that readings have taken away, ascending, shape (6,).

    0: nothing was learnt in that direction, which is not observable; 1: all is known of it.

    Args:
        belief: What is believed.
        columns: Where the error stands in P.
        prior: Its standard deviations at the start, shape (6,) [rad, m].
    """
    P = belief.covariance[columns, columns] / np.outer(prior, prior)
    return np.asarray(np.linalg.eigvalsh(np.eye(len(prior)) - P))
