"""What was measured at poses, as residuals with derivatives: (model - measurement) / sigma.

A number that is NaN was not measured. A term evaluates to residuals, shape (k, rows), and their
derivatives by all parameters, shape (k, rows, n), and by what is unknown of its pose, shape
(k, rows, width); poses turn and move as in `stations.POSE`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.station_kernel import (
    ACROSS,
    ARM,
    BEND,
    LENGTH,
    RADIUS_SLOPE,
    SWIVEL_ANGLE,
    U,
)
from cdpr_drake.calibration.stations import POSE, Point, crosses, inverse_turn_slope, turn_vectors

Evaluated = tuple[Array, Array, Array]


class Term(ABC):
    """Measurements of one kind at all poses.

    Attributes:
        kind: What they are.
        unit: Of a residual times its sigma.
    """

    kind: str
    unit: str

    @abstractmethod
    def evaluate(self, at: Point) -> Evaluated:
        """Residuals over their sigmas and derivatives; zero where nothing was measured."""

    @abstractmethod
    def measured(self) -> npt.NDArray[np.bool_]:
        """Which rows count, shape (k, rows), as True and False."""

    @abstractmethod
    def sigmas(self) -> Array:
        """Standard deviations, shape (k, rows), in the units."""

    @abstractmethod
    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """What a row is, in words; with the names of the cables."""

    def row_unit(self, row: int) -> str:
        """Unit of a row: where there are two, the first half has the first."""
        units = self.unit.split(", ")
        return units[0] if len(units) == 1 or row < 3 else units[1]

    @abstractmethod
    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """The measurements at some of the poses."""

    def values(self, at: Point) -> Array:
        """What was measured, in the units, shape (k, rows): what a wrong factor multiplies.

        Zero where a factor means nothing, as of forces that should be in balance.
        """
        return np.zeros(self.measured().shape)

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Term:
        """What has the same residuals by `base`, which counts from nothing, as this by a model of
        each pose; these differ from `base` in what readings count from alone."""
        return self


def weighted(
    residual: Array, A: Array, B: Array, sigma: Array, valid: npt.NDArray[np.bool_]
) -> Evaluated:
    """Over sigma, and zero where it was not measured."""
    weight = np.where(valid, 1.0 / sigma, 0.0)
    residual = np.where(valid, residual, 0.0) * weight
    return residual, A * weight[:, :, None], B * weight[:, :, None]


@dataclass(eq=False)
class Lengths(Term):
    """Cable lengths that winches counted, from a reading each where counting began.

    A reading is model = start + (length / (1 + strain) - start - offset) / scale.

    Attributes:
        readings: Shape (k, m) [m].
        sigma: Their standard deviations, shape (k, m) [m].
        start: Reading of each cable at which counting began, shape (m,) [m].
        strain: By how much a cable is longer than counted, shape (k, m) [-].
    """

    readings: Array
    sigma: Array
    start: Array
    strain: Array
    kind = "lengths"
    unit = "m"

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        model, where = at.model, at.layout.slices
        m = self.readings.shape[1]
        per_length = 1.0 / (1.0 + self.strain)
        scale = model.length_scale
        counted = at.numbers[:, :, LENGTH] * per_length - self.start - model.length_offset
        residual = self.start + counted / scale - self.readings
        A, B = at.blank(m)
        i = np.arange(m)
        u, slope = at.vector(U), per_length / scale
        three = 3 * i[:, None] + np.arange(3)
        A[:, i[:, None], where["exit_points"].start + three] = -u * slope[:, :, None]
        u_P = np.einsum("kba,kmb->kma", at.stations.R, u)
        A[:, i[:, None], where["anchor_points"].start + three] = u_P * slope[:, :, None]
        A[:, i, where["length_offsets"].start + i] = -1.0 / scale
        A[:, i, where["length_scales"].start + i] = -counted / scale**2
        A[:, i, where["pulley_radii"].start + i] = at.numbers[:, :, RADIUS_SLOPE] * slope
        B[:, :, :3] = np.cross(at.vector(ARM), u) * slope[:, :, None]
        B[:, :, 3:POSE] = u * slope[:, :, None]
        return weighted(residual, A, B, self.sigma, self.measured())

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.isfinite(self.readings)

    def sigmas(self) -> Array:
        """As the base class says."""
        return self.sigma

    def values(self, at: Point) -> Array:
        """As the base class says."""
        return self.readings

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"length of {names[row]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return Lengths(self.readings[which], self.sigma[which], self.start, self.strain[which])

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Lengths:
        """As the base class says."""
        offsets = np.array([model.length_offset for model in models])
        return replace(self, readings=self.readings + offsets / base.length_scale)


@dataclass(eq=False)
class Swivels(Term):
    """Angles of pulleys about their swivel axes: reading = angle - zero.

    Attributes:
        readings: Shape (k, m) [rad].
        sigma: Their standard deviation [rad].
    """

    readings: Array
    sigma: float
    kind = "swivel angles"
    unit = "rad"

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        where, m = at.layout.slices, self.readings.shape[1]
        residual = at.numbers[:, :, SWIVEL_ANGLE] - at.model.swivel_offset - self.readings
        residual = (residual + np.pi) % (2.0 * np.pi) - np.pi
        A, B = at.blank(m)
        i, g = np.arange(m), at.vector(ACROSS)
        three = 3 * i[:, None] + np.arange(3)
        A[:, i[:, None], where["exit_points"].start + three] = -g
        A[:, i[:, None], where["anchor_points"].start + three] = np.einsum(
            "kba,kmb->kma", at.stations.R, g
        )
        A[:, i, where["swivel_offsets"].start + i] = -1.0
        B[:, :, :3], B[:, :, 3:POSE] = np.cross(at.vector(ARM), g), g
        return weighted(residual, A, B, self.sigmas(), self.measured())

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.isfinite(self.readings)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.full(self.readings.shape, self.sigma)

    def values(self, at: Point) -> Array:
        """As the base class says."""
        return self.readings

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"swivel angle of {names[row]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return Swivels(self.readings[which], self.sigma)

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Swivels:
        """As the base class says."""
        offsets = np.array([model.swivel_offset for model in models])
        return replace(self, readings=self.readings + offsets)


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

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        seen = self.measured()
        k = len(self.p)
        X_WK, X_PM, R_WP = at.model.X_WK, at.model.X_PM, at.stations.R
        R_WK = X_WK.rotation().matrix()
        R = R_WK @ np.where(seen[:, :1, None], self.R, np.eye(3))
        p = np.where(seen[:, :3], self.p, 0.0) @ R_WK.T
        lever = R_WP @ X_PM.translation()
        turns = turn_vectors(R_WP @ X_PM.rotation().matrix() @ np.swapaxes(R, 1, 2))
        residual = np.hstack([turns, at.stations.p + lever - p - X_WK.translation()])
        A, B = at.blank(6)
        slope = inverse_turn_slope(turns)
        B[:, :3, :3], B[:, 3:, :3] = slope, -crosses(lever)
        B[:, 3:, 3:POSE] = np.broadcast_to(np.eye(3), (k, 3, 3))
        begin = at.layout.slices["tracker"].start
        # exp(w) R_WK stands transposed and last in the turn: its slope is that of minus the turn.
        A[:, :3, begin : begin + 3] = -inverse_turn_slope(-turns)
        A[:, 3:, begin : begin + 3] = crosses(p)
        A[:, 3:, begin + 3 : begin + 6] = -np.eye(3)
        begin = at.layout.slices["marker"].start
        A[:, :3, begin : begin + 3] = slope @ R_WP
        A[:, 3:, begin + 3 : begin + 6] = R_WP
        return weighted(residual, A, B, self.sigmas(), seen)

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        whole = np.all(np.isfinite(self.p), axis=1) & np.all(np.isfinite(self.R), axis=(1, 2))
        return np.repeat(np.asarray(whole)[:, None], 6, axis=1)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.tile([self.sigma_turn] * 3 + [self.sigma_place] * 3, (len(self.p), 1))

    def values(self, at: Point) -> Array:
        """As the base class says; along the axes of W."""
        seen = self.measured()
        turns = turn_vectors(np.where(seen[:, :1, None], self.R, np.eye(3)))
        R_WK = at.model.X_WK.rotation().matrix()
        return np.hstack([turns @ R_WK.T, self.p @ R_WK.T])

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"tracker, {('turn', 'place')[row // 3]} {'xyz'[row % 3]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return replace(self, R=self.R[which], p=self.p[which])


@dataclass(eq=False)
class Tensions(Term):
    """Tensions that sensors measured.

    Attributes:
        readings: Shape (k, m) [N].
        sigma: Their standard deviations, shape (k, m) [N].
    """

    readings: Array
    sigma: Array
    kind = "tensions"
    unit = "N"

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        assert at.stations.tensions is not None
        m = self.readings.shape[1]
        A, B = at.blank(m)
        B[:, np.arange(m), POSE + np.arange(m)] = 1.0
        return weighted(at.stations.tensions - self.readings, A, B, self.sigma, self.measured())

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.isfinite(self.readings)

    def sigmas(self) -> Array:
        """As the base class says."""
        return self.sigma

    def values(self, at: Point) -> Array:
        """As the base class says."""
        return self.readings

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"tension of {names[row]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return Tensions(self.readings[which], self.sigma[which])


@dataclass(eq=False)
class EquilibriumTerm(Term):
    """The platform rests: tensions and weight balance up to what is not modelled.

    Attributes:
        count: Number of poses k.
        weight: Mass times gravity, in W, shape (3,) [N].
        p_PPcm: Centre of mass, shape (3,) [m].
        sigma_moment: What moments about Po may miss [N m].
        sigma_force: What forces may miss [N].
    """

    count: int
    weight: Array
    p_PPcm: Array
    sigma_moment: float
    sigma_force: float
    kind = "equilibrium"
    unit = "N m, N"

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        t = at.stations.tensions
        assert t is not None
        where, m = at.layout.slices, t.shape[1]
        u, arm, H = at.vector(U), at.vector(ARM), at.hessians
        J = np.concatenate([np.cross(arm, u), u], axis=2)
        f = self.weight
        lever = at.stations.R @ self.p_PPcm
        residual = -np.einsum("kmi,km->ki", J, t)
        residual[:, :3] += np.cross(lever, f)
        residual[:, 3:] += f
        A, B = at.blank(6)
        armx, ux = crosses(arm), crosses(u)
        # A step of B turns u by H; one of the arm changes the moment besides.
        by_point = np.concatenate([armx @ H, H], axis=2)  # (k, m, 6, 3)
        by_arm = by_point.copy()
        by_arm[:, :, :3] -= ux
        minus_t = -t[:, :, None, None]
        exits = -minus_t * by_point
        anchors = minus_t * (by_arm @ at.stations.R[:, None])
        A[:, :, where["exit_points"]] = np.moveaxis(exits, 1, 2).reshape(-1, 6, 3 * m)
        A[:, :, where["anchor_points"]] = np.moveaxis(anchors, 1, 2).reshape(-1, 6, 3 * m)
        bend = at.vector(BEND)
        bent = np.concatenate([np.cross(arm, bend), bend], axis=2) * -t[:, :, None]
        A[:, :, where["pulley_radii"]] = np.moveaxis(bent, 1, 2)
        B[:, :, :3] = np.sum(minus_t * (by_arm @ -armx), axis=1)
        B[:, :3, :3] += crosses(f) @ crosses(lever)
        B[:, :, 3:POSE] = np.sum(minus_t * by_point, axis=1)
        B[:, :, POSE:] = -np.moveaxis(J, 1, 2)
        sigma = np.tile([self.sigma_moment] * 3 + [self.sigma_force] * 3, (self.count, 1))
        return weighted(residual, A, B, sigma, np.ones((self.count, 6), dtype=bool))

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.ones((self.count, 6), dtype=bool)

    def sigmas(self) -> Array:
        """As the base class says."""
        return np.tile([self.sigma_moment] * 3 + [self.sigma_force] * 3, (self.count, 1))

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"{('moment', 'force')[row // 3]} along {'xyz'[row % 3]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return replace(self, count=len(np.arange(self.count)[which]))
