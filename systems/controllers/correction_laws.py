"""The laws of tension management as a `TensionCorrector` asks them, one step at a time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus, writable
from cdpr_drake.tensions.slack_correction import (
    TensionFollower,
    adaptive_gains,
    length_correction,
    length_thresholds,
    polygon_correction,
    polygon_target,
    tension_correction,
)
from cdpr_drake.vision.cable_images import slack_from_image, slack_rates
from cdpr_drake.vision.pinhole import Pinhole


class CorrectionReadings:
    """What a law may look at; read when it does, since some are work and not every law needs them.

    Attributes:
        period: Time since the step before [s].
    """

    def __init__(self, read: Callable[[str], Any], period: float) -> None:
        """With what gives "tensions", "lengths" and "X_WP", and the time since the step before."""
        self._read, self.period = read, period

    @cached_property
    def tensions(self) -> Array:
        """Measured tensions, shape (m,) [N]."""
        return np.asarray(self._read("tensions"))

    @cached_property
    def lengths(self) -> Array:
        """Unstrained lengths that the winches count, shape (m,) [m]."""
        return np.asarray(self._read("lengths"))

    @cached_property
    def cable_points(self) -> Array:
        """Points of the cables in an image, as `CableCamera` gives them [px]."""
        return np.asarray(self._read("cable_points"))

    @cached_property
    def cable_surplus(self) -> Array:
        """Seen surplus lengths and their standard deviations, as `CablePictureCamera` gives them
        [m]."""
        return np.asarray(self._read("cable_surplus"))

    @cached_property
    def X_WP(self) -> RigidTransform:
        """Believed pose of the platform [m]."""
        pose: RigidTransform = self._read("X_WP")
        return pose


@dataclass(frozen=True, eq=False)
class LengthGain:
    """A gain that is in proportion to a cable's length, as how far it gives is.

    Attributes:
        share: Gain per length, shape (m,) [1/(N s)].
    """

    share: Array

    def each(self, lengths: Array) -> Array:
        """For lengths that are counted, shape (m,) [m]; shape (m,) [m/(N s)]."""
        return np.asarray(self.share * np.maximum(lengths, 0.0))


class CorrectionLaw(Protocol):
    """Cable velocities from readings; `memory` is what it keeps between steps, shape (k,)."""

    @property
    def memory(self) -> int:
        """How many numbers it keeps between steps."""

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """Cable velocities, shape (m,) [m/s], thresholds, shape (m,) [N], whether it could.

        What is kept in `memory` is changed in place; it begins as zeros.
        """


def each_gain(gain: Array | LengthGain, readings: CorrectionReadings) -> Array:
    """The gain of each cable now, shape (m,) [m/(N s)]."""
    return gain.each(readings.lengths) if isinstance(gain, LengthGain) else gain


def expected_lengths(cables: CableSet, readings: CorrectionReadings) -> Array | None:
    """Lengths at the believed pose, shape (m,) [m]; None where no cable can run there."""
    try:
        return cable_paths(readings.X_WP, cables).lengths
    except CableGeometryError:
        return None


@dataclass(frozen=True, eq=False)
class ConstantThreshold:
    """(5.1): the same threshold, shape (m,) [N], and gain, shape (m,) [m/(N s)], at all times."""

    threshold: Array
    gain: Array | LengthGain
    memory: int = 0

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`."""
        gains = each_gain(self.gain, readings)
        return tension_correction(readings.tensions, self.threshold, gains), self.threshold, True


@dataclass(frozen=True, eq=False)
class AdaptiveCorrection:
    """(5.4): a gain that grows with the surplus over the believed cables, `gain` [1/(N s)]."""

    threshold: Array
    gain: float
    cables: CableSet
    memory: int = 0

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`."""
        expected = expected_lengths(self.cables, readings)
        if expected is None:
            return np.zeros_like(self.threshold), self.threshold, False
        gains = adaptive_gains(readings.lengths, expected, self.gain)
        return tension_correction(readings.tensions, self.threshold, gains), self.threshold, True


@dataclass(frozen=True, eq=False)
class LengthThreshold:
    """A threshold from `threshold` to `highest`, shape (m,) [N], the shorter the cable is."""

    threshold: Array
    highest: Array
    shortest: float
    longest: float
    shape: str
    gain: Array | LengthGain
    memory: int = 0

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`."""
        thresholds = length_thresholds(
            readings.lengths, self.shortest, self.longest,
            lowest=self.threshold, highest=self.highest, shape=self.shape,
        )  # fmt: skip
        gains = each_gain(self.gain, readings)
        return tension_correction(readings.tensions, thresholds, gains), thresholds, True


@dataclass(frozen=True, eq=False)
class FollowedDistribution:
    """Follows the tensions that hold the platform at the believed pose, from both sides.

    Where a method finds none, no velocity is added, and the integral is kept.

    Attributes:
        robot: The robot, for its weight.
        cables: The believed cables.
        lower: Smallest wanted tension [N].
        upper: Largest [N].
        method: A name of `tensions.METHODS`.
        follower: The controller.
    """

    robot: Robot
    cables: CableSet
    lower: float
    upper: float
    method: str
    follower: TensionFollower

    @property
    def memory(self) -> int:
        """Integral and missing tensions of each cable, and whether there was a step before."""
        return 2 * self.cables.count + 1

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`."""
        m = self.cables.count
        wanted = self._wanted(readings.X_WP)
        if wanted is None:
            memory[-1] = 0.0
            return np.zeros(m), np.full(m, self.lower), False
        missing = wanted - readings.tensions
        before = memory[m : 2 * m].copy() if memory[-1] else None
        found, memory[:m] = self.follower.step(missing, before, memory[:m], readings.period)
        memory[m : 2 * m], memory[-1] = missing, 1.0
        return found, wanted, True

    def _wanted(self, X_WP: RigidTransform) -> Array | None:
        problem = _hold(self.robot, X_WP, (self.lower, self.upper), self.cables)
        return None if problem is None else _distributed(problem, self.method)


@dataclass(frozen=True, eq=False)
class InsidePolygon:
    """Keeps tensions inside the feasible polygon of the believed pose, by a margin.

    Where no tensions are feasible, no velocity is added.

    Attributes:
        robot: The robot, for its weight.
        cables: The believed cables.
        lower: Smallest wanted tension [N].
        upper: Largest [N].
        margin: Distance to keep from both [N].
        method: A name of `tensions.METHODS`, for the tensions that are approached.
        gain: Velocity per missing tension [m/(N s)]; of a `LengthGain` the least share counts, for
            the mean length.
        fastest: Largest velocity of a correction; more is scaled down together [m/s].
    """

    robot: Robot
    cables: CableSet
    lower: float
    upper: float
    margin: float
    method: str
    gain: float | LengthGain
    fastest: float
    memory: int = 0

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`; thresholds are the least tensions inside the polygon."""
        m = self.cables.count
        problem = _hold(self.robot, readings.X_WP, (self.lower, self.upper), self.cables)
        middle = None if problem is None else _distributed(problem, self.method)
        if problem is None or middle is None:
            return np.zeros(m), np.full(m, self.lower), False
        missing, least = polygon_target(
            readings.tensions, middle, writable(problem.W),
            lower=writable(problem.lower), upper=writable(problem.upper), margin=self.margin,
        )  # fmt: skip
        found = polygon_correction(
            readings.tensions, missing, least, writable(problem.W), readings.lengths,
            np.full(m, self._gain(readings.lengths)),
        )  # fmt: skip
        largest = float(np.max(np.abs(found)))
        return found * min(1.0, self.fastest / largest) if largest else found, least, True

    def _gain(self, lengths: Array) -> float:
        """Of a cable of mean length [m/(N s)]."""
        if isinstance(self.gain, LengthGain):
            return float(np.min(self.gain.share) * np.mean(lengths))
        return self.gain


def _hold(
    robot: Robot, X_WP: RigidTransform, limits: tuple[float, float], cables: CableSet
) -> TensionProblem | None:
    """The problem of holding the platform at the believed pose; None where there is none."""
    try:
        return tension_problem(robot, X_WP, limits=limits, cables=cables)
    except (CableGeometryError, TensionProblemError):
        return None


def _distributed(problem: TensionProblem, method: str) -> Array | None:
    solution = distribute(problem, method)
    return solution.tensions if solution.status == TensionStatus.FEASIBLE else None


@dataclass(frozen=True, eq=False)
class ExpectedLength:
    """(5.5): the two cables of least tension go to their length at the believed pose."""

    cables: CableSet
    allowance: float
    slowness: float
    memory: int = 0

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`; there is no threshold, and NaN stands for it."""
        expected, none = expected_lengths(self.cables, readings), np.full(self.cables.count, np.nan)
        if expected is None:
            return np.zeros(self.cables.count), none, False
        found = length_correction(
            readings.tensions, readings.lengths, expected,
            allowance=self.allowance, slowness=self.slowness, period=readings.period,
        )  # fmt: skip
        return found, none, True


CERTAIN = 2.0
"""Standard deviations that a seen surplus is taken to be smaller: what is not there is not wound
in."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SeenSlackRate:
    """As `ConstantThreshold`, and as fast as what is seen to hang through needs.

    Attributes:
        threshold: Tension below which a cable counts as slack, shape (m,) [N].
        gain: Velocity per missing tension, shape (m,) [m/(N s)], or one by length.
        allowance: Surplus that is left to the tension [m].
        time: In which the rest is wound in [s].
        fastest: Largest velocity of a correction [m/s].
    """

    threshold: Array
    gain: Array | LengthGain
    allowance: float
    time: float
    fastest: float
    memory: int = 0

    @abstractmethod
    def surplus(self, readings: CorrectionReadings) -> Array | None:
        """What hangs through, shape (m,) [m]; None where no cable can run at the believed pose."""

    def step(self, readings: CorrectionReadings, memory: Array) -> tuple[Array, Array, bool]:
        """As `CorrectionLaw`; where no cable can run at the believed pose, by tension alone."""
        gains = each_gain(self.gain, readings)
        alone = tension_correction(readings.tensions, self.threshold, gains)
        seen = self.surplus(readings)
        if seen is None:
            return alone, self.threshold, False
        found = slack_rates(
            alone, readings.tensions, self.threshold, seen,
            allowance=self.allowance, time=self.time, fastest=self.fastest,
        )  # fmt: skip
        return found, self.threshold, True


@dataclass(frozen=True, eq=False, kw_only=True)
class ImageSlackRate(SeenSlackRate):
    """By points of the cables that a camera sees.

    Attributes:
        cables: The believed cables.
        camera: The camera in W [m], its intrinsic parameters, its noise [px].
    """

    cables: CableSet
    camera: tuple[RigidTransform, Pinhole, float]

    def surplus(self, readings: CorrectionReadings) -> Array | None:
        """As the base class says."""
        pixels = readings.cable_points.reshape(self.cables.count, 2, -1)
        try:
            return slack_from_image(pixels, self.cables, readings.X_WP, *self.camera).surplus
        except CableGeometryError:
            return None


@dataclass(frozen=True, eq=False, kw_only=True)
class DetectedSlackRate(SeenSlackRate):
    """By surplus lengths that were found in rendered images."""

    def surplus(self, readings: CorrectionReadings) -> Array | None:
        """Only what is more than `CERTAIN` of its deviations, shape (m,) [m]."""
        surplus, sigma = readings.cable_surplus.reshape(2, -1)
        return np.asarray(surplus - CERTAIN * sigma)
