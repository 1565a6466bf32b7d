"""Positions that were measured without a rotation, as residuals with derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.stations import POSE, Point, crosses
from cdpr_drake.calibration.terms import Evaluated, Term, weighted


@dataclass(frozen=True, eq=False)
class Course:
    """What a tracker told over time, between its instants by cubic splines.

    Attributes:
        times: Of the winches at the poses, shape (k,) [s]; they may have a clock of their own.
        spline: Positions in K over time [m], by the tracker's clock.
    """

    times: Array
    spline: CubicSpline

    @staticmethod
    def of(times: Array, points: Array) -> Course:
        """Through the positions that are there, shape (k, 3) [m]; rows grow in time."""
        seen = np.isfinite(points).all(axis=1)
        return Course(times, CubicSpline(times[seen], points[seen], extrapolate=True))

    def at(self, clock: float) -> tuple[Array, Array]:
        """Positions [m] and velocities [m/s] in K, (k, 3), of a tracker that is so late [s]."""
        return self.spline(self.times + clock), self.spline(self.times + clock, 1)

    def only(self, which: npt.NDArray[np.generic] | slice) -> Course:
        """At some of the poses."""
        return replace(self, times=self.times[which])


@dataclass(eq=False)
class TrackedPoints(Term):
    """Positions of a marker on the platform that a tracker measured in its frame.

    Attributes:
        points: Positions p_KM in K, shape (k, 3) [m]; NaN where none was measured.
        sigma: Standard deviation of a coordinate [m].
        normal: Direction in W in which positions are less sure, as that of a plane out of which
            the platform shakes, shape (3,); zero: none is.
        sigma_along: Standard deviation along it [m].
        course: The same over time, where the tracker's clock may be another; or None.
    """

    points: Array
    sigma: float
    normal: Array
    sigma_along: float
    course: Course | None = None
    kind = "tracked positions"
    unit = "m"

    @cached_property
    def _whitening(self) -> Array:
        """By which residuals along W are multiplied to have their sigma in all directions."""
        n = self.normal
        return np.asarray(np.eye(3) + (self.sigma / self.sigma_along - 1.0) * np.outer(n, n))

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        k, where, seen = len(self.points), at.layout.slices, self.measured()
        X_WK, X_PM, R_WP = at.model.X_WK, at.model.X_PM, at.stations.R
        R_WK = X_WK.rotation().matrix()
        if self.course is None:
            told, speed = self.points, np.zeros((k, 3))
        else:
            told, speed = self.course.at(at.model.clock)
        p, v = (np.where(seen, x, 0.0) @ R_WK.T for x in (told, speed))
        lever = R_WP @ X_PM.translation()
        residual = at.stations.p + lever - p - X_WK.translation()
        A, B = at.blank(3)
        B[:, :, :3] = -crosses(lever)
        B[:, :, 3:POSE] = np.broadcast_to(np.eye(3), (k, 3, 3))
        begin = where["tracker"].start
        A[:, :, begin : begin + 3] = crosses(p)
        A[:, :, begin + 3 : begin + 6] = -np.eye(3)
        begin = where["marker"].start
        A[:, :, begin + 3 : begin + 6] = R_WP
        A[:, :, where["clock"].start] = -v
        W = self._whitening
        return weighted(residual @ W.T, W @ A, W @ B, self.sigmas(), seen)

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        whole = np.asarray(np.isfinite(self.points).all(axis=1))
        return np.repeat(whole[:, None], 3, axis=1)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.full(self.points.shape, self.sigma)

    def values(self, at: Point) -> Array:
        """As the base class says, along the axes of W."""
        R_WK = at.model.X_WK.rotation().matrix()
        return np.asarray(self.points @ R_WK.T @ self._whitening.T)

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"tracker, place {'xyz'[row]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        course = None if self.course is None else self.course.only(which)
        return replace(self, points=self.points[which], course=course)
