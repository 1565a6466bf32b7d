"""A path of features to be tracked, at constant speed or with a smooth start and end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array

PROFILES = ("constant", "smooth")


@dataclass(frozen=True)
class FeaturePlan:
    """How to get from the features that are seen first to the final ones.

    Attributes:
        final: s*_fin, shape (k,).
        duration: t_full [s]; None: from `speeds`.
        speeds: Desired mean speed of each feature, shape (k,) [1/s of its unit]; the slowest
            feature sets t_full. Unused where the duration is given.
        waypoints: Features between the first and the final ones, shape (n, k); none: straight.
        profile: "constant" speed, or "smooth", a quintic from rest to rest.
        replan_error: Norm of s - s*(t) beyond which a new plan starts from what is seen; None:
            never.

    Source: servoing thesis 4.2, algorithm 1.
    """

    final: Array
    duration: float | None = None
    speeds: Array | None = None
    waypoints: Array | None = None
    profile: str = "constant"
    replan_error: float | None = None

    def time_needed(self, start: Array, passed: int = 0) -> float:
        """t_full [s] from features s_init, shape (k,), by way of the waypoints not passed yet.

        A given duration is returned as it is. Source: servoing thesis (4.3), (4.4).
        """
        if self.duration is not None:
            return self.duration
        assert self.speeds is not None
        legs = np.abs(np.diff(self.corners(start, passed), axis=0)) / self.speeds
        return float(np.sum(np.max(legs, axis=1)))

    def way(self, start: Array, passed: int = 0) -> float:
        """Length of the path in the features, whatever their units."""
        legs = np.diff(self.corners(start, passed), axis=0)
        return float(np.sum(np.linalg.norm(legs, axis=1)))

    def corners(self, start: Array, passed: int = 0) -> Array:
        """Start, waypoints beyond the passed ones, and end of the path, shape (n + 2, k)."""
        if self.waypoints is None:
            return np.stack((start, self.final))
        return np.vstack([start, self.waypoints[passed:], self.final])

    def at(
        self, start: Array, t_full: float, time: float, passed: int = 0
    ) -> tuple[Array, Array, int]:
        """s*(t), ds*/dt, shape (k,) each, and the waypoints passed, at a time [s] since the start.

        Source: servoing thesis (4.5)-(4.7); the legs between waypoints take time by their length.
        """
        share, rate = _profile(self.profile, time / t_full if t_full > 0.0 else 1.0)
        corners = self.corners(start, passed)
        legs = np.diff(corners, axis=0)
        ends = np.cumsum(np.sqrt(np.sum(legs * legs, axis=1)))
        last = len(ends) - 1
        if share >= 1.0 or ends[-1] == 0.0:
            return self.final, np.zeros(len(start)), passed + last
        covered = share * ends[-1]
        k = min(int(np.searchsorted(ends, covered, side="right")), last)
        begun = ends[k - 1] if k > 0 else 0.0
        direction = legs[k] / (ends[k] - begun)
        return (
            corners[k] + (covered - begun) * direction,
            rate / t_full * ends[-1] * direction,
            passed + k,
        )


def _profile(name: str, time: float) -> tuple[float, float]:
    """Share of the path and its derivative at a share of the time [-]."""
    if time >= 1.0:
        return 1.0, 0.0
    if name == "constant":
        return time, 1.0
    t2 = time * time
    return t2 * time * (10.0 - 15.0 * time + 6.0 * t2), 30.0 * t2 * (1.0 - 2.0 * time + t2)
