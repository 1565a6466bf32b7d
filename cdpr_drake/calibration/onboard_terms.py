"""What sensors on the platform measure, as residuals with derivatives: tags seen, and tilt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.stations import POSE, Point, crosses
from cdpr_drake.calibration.terms import Evaluated, Term, weighted
from cdpr_drake.vision.pinhole import Pinhole

NEAREST = 1e-6
"""A point this close to the focal plane, or behind it, has no image [m]."""

STEEP = 1e-6
"""Where the cosine of the pitch is less, roll and yaw turn about one axis."""


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

    def evaluate(self, at: Point) -> Evaluated:
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
        A, B = at.blank(8 * count)
        rows = (k, 8 * count, 3)
        where = at.layout.slices
        order = list(model.tags)
        arms = crosses(np.moveaxis(c_W, 1, 2))  # (t, 4, 3, 3)
        for n, tag in enumerate(self.tags):
            begin, mine = where["tags"].start + 6 * order.index(tag), slice(8 * n, 8 * n + 8)
            A[:, mine, begin : begin + 3] = (by_W[:, n] @ -arms[n]).reshape(k, 8, 3)
            A[:, mine, begin + 3 : begin + 6] = by_W[:, n].reshape(k, 8, 3)
        begin = where["camera"].start
        s_x = crosses(np.moveaxis(s_P, 2, 3))
        A[:, :, begin : begin + 3] = (by_P @ s_x).reshape(rows)
        A[:, :, begin + 3 : begin + 6] = -by_P.reshape(rows)
        q_x = crosses(np.moveaxis(q_W, 2, 3))
        B[:, :, :3] = (by_W @ q_x).reshape(rows)
        B[:, :, 3:POSE] = -by_W.reshape(rows)
        residual = np.where(seen[..., None] & ~np.isfinite(residual), np.inf, residual)
        return weighted(residual.reshape(k, 8 * count), A, B, self.sigmas(), self.measured())

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        whole = np.asarray(np.all(np.isfinite(self.uv), axis=3))
        return np.repeat(whole.reshape(len(self.uv), -1), 2, axis=1)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.full((len(self.uv), 8 * len(self.tags)), self.sigma)

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        corner, axis = divmod(row % 8, 2)
        return f"tag {self.tags[row // 8]}, corner {corner + 1}, {'uv'[axis]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return replace(self, uv=self.uv[which])


@dataclass(eq=False)
class Tilts(Term):
    """Roll, pitch and yaw of the platform that an inclinometer or an IMU on it measured.

    The rotation of the platform in W is Rz(yaw) Ry(pitch) Rx(roll): roll and pitch are against the
    vertical, yaw is about it from the x axis of W, each from the zero that the model has for it.

    Attributes:
        angles: Roll, pitch and yaw, shape (k, 3) [rad]; NaN where one was not measured.
        sigma_tilt: Standard deviation of roll and pitch [rad].
        sigma_yaw: Of yaw [rad].

    Source: rates of these angles from angular velocity in W, as in Diebel, Representing attitude,
    2006, (67), there in the platform frame.
    """

    angles: Array
    sigma_tilt: float
    sigma_yaw: float
    kind = "inclination"
    unit = "rad"

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says; infinite where the platform is pitched by a right angle."""
        R = at.stations.R
        level = np.hypot(R[:, 0, 0], R[:, 1, 0])  # cosine of the pitch
        roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
        pitch = np.arctan2(-R[:, 2, 0], level)
        yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
        residual = np.column_stack([roll, pitch, yaw]) - at.model.tilt_zero - self.angles
        residual = (residual + np.pi) % (2.0 * np.pi) - np.pi
        A, B = at.blank(3)
        upright = level > STEEP
        safe = np.where(upright, level, 1.0)
        c, s = R[:, 0, 0] / safe, R[:, 1, 0] / safe  # of the yaw
        B[:, 0, 0], B[:, 0, 1] = c / safe, s / safe
        B[:, 1, 0], B[:, 1, 1] = -s, c
        slope = -R[:, 2, 0] / safe
        B[:, 2, 0], B[:, 2, 1], B[:, 2, 2] = slope * c, slope * s, 1.0
        three = np.arange(3)
        A[:, three, at.layout.slices["tilt_zeros"].start + three] = -1.0
        residual = np.where(upright[:, None], residual, np.inf)
        return weighted(residual, A, B, self.sigmas(), self.measured())

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.isfinite(self.angles)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.tile([self.sigma_tilt, self.sigma_tilt, self.sigma_yaw], (len(self.angles), 1))

    def values(self, at: Point) -> Array:
        """As the base class says."""
        return self.angles

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return ("roll", "pitch", "yaw")[row]

    def only(self, which: npt.NDArray[np.generic] | slice) -> Tilts:
        """As the base class says."""
        return replace(self, angles=self.angles[which])
