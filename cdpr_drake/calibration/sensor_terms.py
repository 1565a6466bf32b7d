"""What trackers, the camera and tilt sensors measured at poses, as residuals with derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.stations import POSE, Point, crosses, inverse_turn_slope, turn_vectors
from cdpr_drake.calibration.terms import EVERY_ROW, Parts, Slopes, Term
from cdpr_drake.vision.pinhole import Pinhole

NEAREST = 1e-6
"""A point this close to the focal plane, or behind it, has no image [m]."""

STEEP = 1e-6
"""Where the cosine of the pitch is less, roll and yaw turn about one axis."""


@dataclass(eq=False)
class TrackedPoses(Term):
    """Poses X_KM of a marker on the platform that a tracker measured in its frame.

    Attributes:
        R: Rotations in K, shape (k, 3, 3); NaN where none was measured.
        p: Positions in K, shape (k, 3) [m].
        sigma_turn: Standard deviation of a rotation about each axis [rad].
        sigma_place: Of a coordinate of the position [m].
    """

    R: Array
    p: Array
    sigma_turn: float
    sigma_place: float
    kind = "tracked poses"
    unit = "rad, m"
    by_pose = ("R", "p")
    row_names = tuple(f"tracker, {what} {axis}" for what in ("turn", "place") for axis in "xyz")

    def parts(self, at: Point) -> Parts:
        seen = self.measured()
        X_WK, X_PM, R_WP = at.model.X_WK, at.model.X_PM, at.stations.R
        R_WK = X_WK.rotation().matrix()
        R = R_WK @ np.where(seen[:, :1, None], self.R, np.eye(3))
        p = np.where(seen[:, :3], self.p, 0.0) @ R_WK.T
        lever = R_WP @ X_PM.translation()
        turns = turn_vectors(R_WP @ X_PM.rotation().matrix() @ np.swapaxes(R, 1, 2))
        residual = np.hstack([turns, at.stations.p + lever - p - X_WK.translation()])
        slope = inverse_turn_slope(turns)
        B = at.blank(6)
        B[:, :3, :3], B[:, 3:, :3] = slope, -crosses(lever)
        B[:, 3:, 3:POSE] = np.eye(3)

        def slopes() -> Slopes:
            tracker, marker = (at.layout.slices[key].start for key in ("tracker", "marker"))
            first, last = slice(3), slice(3, 6)
            # exp(w) R_WK stands transposed and last in the turn: its slope is that of minus it.
            return [
                (first, slice(tracker, tracker + 3), -inverse_turn_slope(-turns)),
                (last, slice(tracker, tracker + 3), crosses(p)),
                (last, slice(tracker + 3, tracker + 6), -np.eye(3)),
                (first, slice(marker, marker + 3), slope @ R_WP),
                (last, slice(marker + 3, marker + 6), R_WP),
            ]

        return residual, B, slopes

    def measured(self) -> npt.NDArray[np.bool_]:
        whole = np.all(np.isfinite(self.p), axis=1) & np.all(np.isfinite(self.R), axis=(1, 2))
        return np.repeat(np.asarray(whole)[:, None], 6, axis=1)

    def sigmas(self) -> Array:
        return np.tile([self.sigma_turn] * 3 + [self.sigma_place] * 3, (len(self.p), 1))

    def values(self, at: Point) -> Array:
        """As the base class says; along the axes of W."""
        seen = self.measured()
        turns = turn_vectors(np.where(seen[:, :1, None], self.R, np.eye(3)))
        R_WK = at.model.X_WK.rotation().matrix()
        return np.hstack([turns @ R_WK.T, self.p @ R_WK.T])


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
    by_pose = ("points",)
    row_names = ("tracker, place x", "tracker, place y", "tracker, place z")

    @cached_property
    def _whitening(self) -> Array:
        """By which residuals along W are multiplied to have their sigma in all directions."""
        n = self.normal
        return np.asarray(np.eye(3) + (self.sigma / self.sigma_along - 1.0) * np.outer(n, n))

    def parts(self, at: Point) -> Parts:
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
        B = at.blank(3)
        B[:, :, :3] = -crosses(lever)
        B[:, :, 3:POSE] = np.eye(3)
        W = self._whitening

        def slopes() -> Slopes:
            tracker, marker = where["tracker"].start, where["marker"].start
            return [
                (EVERY_ROW, slice(tracker, tracker + 3), W @ crosses(p)),
                (EVERY_ROW, slice(tracker + 3, tracker + 6), -W),
                (EVERY_ROW, slice(marker + 3, marker + 6), W @ R_WP),
                (EVERY_ROW, where["clock"].start, -v @ W.T),
            ]

        return residual @ W.T, W @ B, slopes

    def measured(self) -> npt.NDArray[np.bool_]:
        whole = np.asarray(np.isfinite(self.points).all(axis=1))
        return np.repeat(whole[:, None], 3, axis=1)

    def values(self, at: Point) -> Array:
        """As the base class says, along the axes of W."""
        R_WK = at.model.X_WK.rotation().matrix()
        return np.asarray(self.points @ R_WK.T @ self._whitening.T)

    def only(self, which: npt.NDArray[np.generic] | slice) -> TrackedPoints:
        course = None if self.course is None else self.course.only(which)
        return replace(super().only(which), course=course)


@dataclass(eq=False)
class TagCorners(Term):
    """Images of the corners of tags that rest in the world.

    Attributes:
        tags: Numbers of the tags, as the model has them.
        points: Corners of each tag in its frame, shape (t, 3, 4) [m].
        uv: Their images, shape (k, t, 4, 2) [px]; NaN where a corner was not seen.
        sigma: Standard deviation of a coordinate [px].
        pinhole: The camera.
    """

    tags: tuple[int, ...]
    points: Array
    uv: Array
    sigma: float
    pinhole: Pinhole
    kind = "tag corners"
    unit = "px"
    by_pose = ("uv",)

    def parts(self, at: Point) -> Parts:
        """As the base class says; infinite where a corner that was seen lies behind the camera."""
        k, count = self.uv.shape[:2]
        model, stations = at.model, at.stations
        R_WP, R_PC = stations.R, model.X_PC.rotation().matrix()
        X_WT = [model.tags[tag] for tag in self.tags]
        R_WT = np.array([X.rotation().matrix() for X in X_WT])
        p_WT = np.array([X.translation() for X in X_WT])
        c_W = R_WT @ self.points  # (t, 3, 4)
        q_W = c_W[None] + p_WT[None, :, :, None] - stations.p[:, None, :, None]
        s_P = np.einsum("kba,ktbc->ktac", R_WP, q_W) - model.X_PC.translation()[:, None]
        p_C = np.einsum("ba,ktbc->ktca", R_PC, s_P)  # (k, t, 4, 3)
        seen = np.asarray(np.all(np.isfinite(self.uv), axis=3))
        z = np.where(p_C[..., 2] > NEAREST, p_C[..., 2], np.nan)
        x, y = p_C[..., 0] / z, p_C[..., 1] / z
        camera = self.pinhole
        residual = np.stack([camera.cx + camera.fx * x, camera.cy + camera.fy * y], 3) - self.uv
        slope = np.zeros((k, count, 4, 2, 3))
        slope[..., 0, 0], slope[..., 0, 2] = camera.fx / z, -camera.fx * x / z
        slope[..., 1, 1], slope[..., 1, 2] = camera.fy / z, -camera.fy * y / z
        slope = np.where(seen[..., None, None], slope, 0.0)
        by_P = slope @ R_PC.T
        by_W = np.einsum("ktcij,kaj->ktcia", by_P, R_WP)
        rows, where, order = (k, 8 * count, 3), at.layout.slices, list(model.tags)

        def slopes() -> Slopes:
            camera, s_x = where["camera"].start, crosses(np.moveaxis(s_P, 2, 3))
            arms = crosses(np.moveaxis(c_W, 1, 2))  # (t, 4, 3, 3)
            parts: Slopes = [
                (EVERY_ROW, slice(camera, camera + 3), (by_P @ s_x).reshape(rows)),
                (EVERY_ROW, slice(camera + 3, camera + 6), -by_P.reshape(rows)),
            ]
            for n, tag in enumerate(self.tags):
                begin, mine = where["tags"].start + 6 * order.index(tag), slice(8 * n, 8 * n + 8)
                by_turn = (by_W[:, n] @ -arms[n]).reshape(k, 8, 3)
                parts.append((mine, slice(begin, begin + 3), by_turn))
                parts.append((mine, slice(begin + 3, begin + 6), by_W[:, n].reshape(k, 8, 3)))
            return parts

        B, q_x = at.blank(8 * count), crosses(np.moveaxis(q_W, 2, 3))
        B[:, :, :3] = (by_W @ q_x).reshape(rows)
        B[:, :, 3:POSE] = -by_W.reshape(rows)
        residual = np.where(seen[..., None] & ~np.isfinite(residual), np.inf, residual)
        return residual.reshape(k, 8 * count), B, slopes

    def measured(self) -> npt.NDArray[np.bool_]:
        whole = np.asarray(np.all(np.isfinite(self.uv), axis=3))
        return np.repeat(whole.reshape(len(self.uv), -1), 2, axis=1)

    def values(self, at: Point) -> Array:
        """As the base class says: none."""
        return np.zeros(self.measured().shape)

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        corner, axis = divmod(row % 8, 2)
        return f"tag {self.tags[row // 8]}, corner {corner + 1}, {'uv'[axis]}"


@dataclass(eq=False)
class Tilts(Term):
    """Roll, pitch and yaw of the platform that an inclinometer or an IMU on it measured.

    The rotation of the platform in W is Rz(yaw) Ry(pitch) Rx(roll): roll and pitch are against the
    vertical, yaw is about it from the x axis of W, each from the zero that the model has for it.

    Attributes:
        readings: Roll, pitch and yaw, shape (k, 3) [rad]; NaN where one was not measured.
        sigma_tilt: Standard deviation of roll and pitch [rad].
        sigma_yaw: Of yaw [rad].

    Source: rates of these angles from angular velocity in W, as in Diebel, Representing attitude,
    2006, (67), there in the platform frame.
    """

    readings: Array
    sigma_tilt: float
    sigma_yaw: float
    kind = "inclination"
    unit = "rad"
    row_names = ("roll", "pitch", "yaw")

    def parts(self, at: Point) -> Parts:
        """As the base class says; infinite where the platform is pitched by a right angle."""
        R = at.stations.R
        level = np.hypot(R[:, 0, 0], R[:, 1, 0])  # cosine of the pitch
        roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
        pitch = np.arctan2(-R[:, 2, 0], level)
        yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
        residual = np.column_stack([roll, pitch, yaw]) - at.model.tilt_zero - self.readings
        residual = (residual + np.pi) % (2.0 * np.pi) - np.pi
        B = at.blank(3)
        upright = level > STEEP
        safe = np.where(upright, level, 1.0)
        c, s = R[:, 0, 0] / safe, R[:, 1, 0] / safe  # of the yaw
        B[:, 0, 0], B[:, 0, 1] = c / safe, s / safe
        B[:, 1, 0], B[:, 1, 1] = -s, c
        slope = -R[:, 2, 0] / safe
        B[:, 2, 0], B[:, 2, 1], B[:, 2, 2] = slope * c, slope * s, 1.0
        three = np.arange(3)
        zeros = at.layout.slices["tilt_zeros"].start + three
        return (
            np.where(upright[:, None], residual, np.inf), B, lambda: [(three, zeros, -1.0)]
        )  # fmt: skip

    def sigmas(self) -> Array:
        return np.tile([self.sigma_tilt, self.sigma_tilt, self.sigma_yaw], (len(self.readings), 1))
