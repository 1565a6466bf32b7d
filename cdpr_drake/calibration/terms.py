"""What was measured at poses, as residuals with derivatives: (model - measurement) / sigma.

Here are the base of all terms, what winches and their cables measure, and balance at rest; other
sensors are in `sensor_terms`. A number that is NaN was not measured. Poses turn and move as in
`stations.POSE`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

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
from cdpr_drake.calibration.stations import POSE, Point, Stations, crosses
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.winches.drum import Drum

Evaluated = tuple[Array, Array, Array]

Slopes = list[tuple[Any, Any, Any]]
"""Rows and columns of derivatives by parameters, and the values there at each pose."""

Parts = tuple[Array, Array, Callable[[], Slopes]]

EVERY_ROW = slice(None)


class Term(ABC):
    """Measurements of one kind at all poses, k poses of so many rows.

    Attributes:
        kind: What they are.
        unit: Of a residual times its sigma; of two units the first is of the first three rows.
        by_pose: Fields that have a row for each pose.
        row_names: What rows are, in words, unless `row_name` says it.
        readings: What was measured; terms without it say themselves what counts.
        sigma: Standard deviation, or one for each reading, in the unit.
    """

    kind: str
    unit: str
    by_pose: ClassVar[tuple[str, ...]] = ("readings",)
    row_names: ClassVar[tuple[str, ...]]
    readings: Array
    sigma: Any

    @abstractmethod
    def parts(self, at: Point) -> Parts:
        """Residuals in the unit, shape (k, rows), and their derivatives by what is unknown of each
        pose, shape (k, rows, width), and, as a function, by parameters."""

    def evaluate(self, at: Point) -> Evaluated:
        """Residuals over their sigmas, shape (k, rows), zero where nothing was measured, and their
        derivatives by all parameters, (k, rows, n), and by each pose, (k, rows, width)."""
        residual, B, slopes = self.parts(at)
        A = np.zeros((*residual.shape, at.layout.size))
        for rows, columns, values in slopes():
            A[:, rows, columns] = values
        weight = self.weights()
        return self._weighted(residual, weight), A * weight[:, :, None], B * weight[:, :, None]

    def by_poses(self, at: Point) -> tuple[Array, Array]:
        """As `evaluate`, without derivatives by parameters."""
        residual, B, _ = self.parts(at)
        weight = self.weights()
        return self._weighted(residual, weight), B * weight[:, :, None]

    def weights(self) -> Array:
        """One over sigma, zero where nothing was measured, shape (k, rows)."""
        return np.where(self.measured(), 1.0 / self.sigmas(), 0.0)

    def _weighted(self, residual: Array, weight: Array) -> Array:
        return np.where(self.measured(), residual, 0.0) * weight

    def measured(self) -> npt.NDArray[np.bool_]:
        """Which rows count, shape (k, rows)."""
        return np.isfinite(self.readings)

    def sigmas(self) -> Array:
        """Standard deviations, shape (k, rows), in the unit."""
        return np.broadcast_to(self.sigma, self.measured().shape)

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """What a row is, in words; with the names of the cables."""
        return self.row_names[row]

    def row_unit(self, row: int) -> str:
        """Unit of a row."""
        units = self.unit.split(", ")
        return units[0] if len(units) == 1 or row < 3 else units[1]

    def only(self, which: npt.NDArray[np.generic] | slice) -> Self:
        """The measurements at some of the poses."""
        some: dict[str, Any] = {name: getattr(self, name)[which] for name in self.by_pose}
        return replace(self, **some)  # type: ignore[type-var]

    def values(self, at: Point) -> Array:
        """What was measured, in the unit, shape (k, rows): what a wrong factor multiplies.

        Zero where a factor means nothing, as of forces that should be in balance.
        """
        return self.readings

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Term:
        """What has the same residuals by `base`, which counts from nothing, as this by a model of
        each pose; these differ from `base` in what readings count from alone."""
        return self


class CableTerm(Term):
    """Measurements of one number a cable."""

    word: str

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        return f"{self.word} of {names[row]}"


def _three(at: Point, group: str) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows, one a cable, and columns of the points of all cables in a group, shape (m, 3)."""
    i = np.arange(at.model.cables.count)[:, None]
    return i, at.layout.slices[group].start + 3 * i + np.arange(3)


def _own(at: Point, group: str) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows, one a cable, and columns of the numbers of all cables in a group, shape (m,)."""
    i = np.arange(at.model.cables.count)
    return i, at.layout.slices[group].start + i


def _common(at: Point, group: str) -> tuple[npt.NDArray[np.intp], int]:
    """Rows, one a cable, and the column of a number that all cables have in common."""
    return np.arange(at.model.cables.count), at.layout.slices[group].start


@dataclass(eq=False)
class Lengths(CableTerm):
    """Cable lengths that winches counted, from a reading each where counting began.

    A reading is model = (start + (length / (1 + strain) - start - offset) / scale) / common scale;
    the offset is the cable's own and the common one.

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
    word = "length"
    by_pose = ("readings", "sigma", "strain")

    def parts(self, at: Point) -> Parts:
        model, per_length = at.model, 1.0 / (1.0 + self.strain)
        scale, common = model.length_scale, model.common_length_scale
        offset = model.length_offset + model.common_length_offset
        counted = at.numbers[:, :, LENGTH] * per_length - self.start - offset
        whole = self.start + counted / scale
        u, slope = at.vector(U), per_length / scale / common

        def slopes() -> Slopes:
            u_P = np.einsum("kba,kmb->kma", at.stations.R, u)
            return [
                (*_three(at, "exit_points"), -u * slope[:, :, None]),
                (*_three(at, "anchor_points"), u_P * slope[:, :, None]),
                (*_own(at, "length_offsets"), -1.0 / scale / common),
                (*_own(at, "length_scales"), -counted / scale**2 / common),
                (*_common(at, "common_length_offset"), -1.0 / scale / common),
                (*_common(at, "common_length_scale"), -whole / common**2),
                (*_own(at, "pulley_radii"), at.numbers[:, :, RADIUS_SLOPE] * slope),
            ]

        B = at.blank(len(scale))
        B[:, :, :3] = np.cross(at.vector(ARM), u) * slope[:, :, None]
        B[:, :, 3:POSE] = u * slope[:, :, None]
        return whole / common - self.readings, B, slopes

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Lengths:
        offsets = np.array([model.length_offset for model in models])
        return replace(
            self, readings=self.readings + offsets / base.length_scale / base.common_length_scale
        )


@dataclass(eq=False)
class ZeroedCables(Term):
    """What was paid out since winches stood at zero: cable lengths, or what motor angles say.

    Winches stood at zero at a pose that is known, where cables were as long as the model says
    there, and by `length_offset` and the common one longer; without such a pose these are the whole
    length at zero. A residual is length / (1 + strain) - length there - offset - scale * paid out.
    What a motor pays out follows its drum, see `winches.drum`: with one turn in a layer the square
    of the radius at which line leaves falls in proportion to what is paid out, as in firmware of
    Hangprinters.

    Attributes:
        readings: Lengths [m] or, with a drum, motor angles [rad], positive pays out, shape (k, m).
        sigma: Standard deviations of the lengths, shape (k, m) [m].
        zero: Pose X_WP at which winches stood at zero [m]; None: not known.
        drum: The drums as they are believed; None: readings are lengths.
        strain: By how much a cable is longer than counted, shape (k, m) [-].
        added: What offsets are besides those of the model, shape (k, m) [m]; see `counted_by`.
        advantage: Parts of line side by side, shape (m,), or 1: over it the radii of `drum` are
            those of the drums themselves [-].

    Source: Ljungstroem, auto-calibration-simulation-for-hangprinter, simulation.py, 2023,
    `motor_pos_samples_to_distances_relative_to_origin`, for lengths by motor angles.
    """

    readings: Array
    sigma: Array
    zero: RigidTransform | None
    drum: Drum | None
    strain: Array
    added: Array
    advantage: Array | float = 1.0
    unit = "m"
    by_pose = ("readings", "sigma", "strain", "added")

    @property
    def kind(self) -> str:  # type: ignore[override]
        """What they are."""
        return "lengths" if self.drum is None else "motor angles"

    def paid_out(self, model: CalibrationModel) -> tuple[Array, Array]:
        """Cable that left the drums, shape (k, m) [m], and how it grows with their radii [-]."""
        if self.drum is None:
            return self.readings, np.zeros(self.readings.shape)
        grown = (model.drum_radius + model.common_drum_radius) / self.advantage
        drum = replace(self.drum, radius=self.drum.radius + grown)
        return drum.paid_out(self.readings), drum.per_radius(self.readings) / self.advantage

    def parts(self, at: Point) -> Parts:
        model, slope = at.model, 1.0 / (1.0 + self.strain)
        paid, by_radius = self.paid_out(model)
        common, u = model.common_length_scale, at.vector(U)
        scale, offset = model.length_scale * common, model.length_offset
        offset = offset + model.common_length_offset
        residual = at.numbers[:, :, LENGTH] * slope - offset - scale * paid
        residual = residual - self.added
        home = None
        if self.zero is not None:
            home = Point(model, Stations.at([self.zero]), at.layout)
            residual = residual - home.numbers[0, :, LENGTH]

        def slopes() -> Slopes:
            exits = -u * slope[:, :, None]
            anchors = np.einsum("kba,kmb->kma", at.stations.R, u) * slope[:, :, None]
            radii = at.numbers[:, :, RADIUS_SLOPE] * slope
            if home is not None:
                v = home.vector(U)[0]
                exits, anchors = exits + v, anchors - v @ home.stations.R[0]
                radii = radii - home.numbers[0, :, RADIUS_SLOPE]
            return [
                (*_three(at, "exit_points"), exits),
                (*_three(at, "anchor_points"), anchors),
                (*_own(at, "pulley_radii"), radii),
                (*_own(at, "length_offsets"), -1.0),
                (*_own(at, "length_scales"), -paid * common),
                (*_own(at, "drum_radii"), -scale * by_radius),
                (*_common(at, "common_drum_radius"), -scale * by_radius),
                (*_common(at, "common_length_offset"), -1.0),
                (*_common(at, "common_length_scale"), -paid * model.length_scale),
            ]

        B = at.blank(len(scale))
        B[:, :, :3] = np.cross(at.vector(ARM), u) * slope[:, :, None]
        B[:, :, 3:POSE] = u * slope[:, :, None]
        return residual, B, slopes

    def values(self, at: Point) -> Array:
        """As the base class says: cable that was paid out [m]."""
        scale = at.model.length_scale * at.model.common_length_scale
        return scale * self.paid_out(at.model)[0]

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        return f"{'length' if self.drum is None else 'motor angle'} of {names[row]}"

    def counted_by(
        self, models: Sequence[CalibrationModel], base: CalibrationModel
    ) -> ZeroedCables:
        offsets = np.array([model.length_offset for model in models])
        return replace(self, added=self.added + offsets)


@dataclass(eq=False)
class Swivels(CableTerm):
    """Angles of pulleys about their swivel axes: reading = angle - zero.

    Attributes:
        readings: Shape (k, m) [rad].
        sigma: Their standard deviation [rad].
    """

    readings: Array
    sigma: float
    kind = "swivel angles"
    unit = "rad"
    word = "swivel angle"

    def parts(self, at: Point) -> Parts:
        residual = at.numbers[:, :, SWIVEL_ANGLE] - at.model.swivel_offset - self.readings
        residual = (residual + np.pi) % (2.0 * np.pi) - np.pi
        g = at.vector(ACROSS)

        def slopes() -> Slopes:
            return [
                (*_three(at, "exit_points"), -g),
                (*_three(at, "anchor_points"), np.einsum("kba,kmb->kma", at.stations.R, g)),
                (*_own(at, "swivel_offsets"), -1.0),
            ]

        B = at.blank(g.shape[1])
        B[:, :, :3], B[:, :, 3:POSE] = np.cross(at.vector(ARM), g), g
        return residual, B, slopes

    def counted_by(self, models: Sequence[CalibrationModel], base: CalibrationModel) -> Swivels:
        offsets = np.array([model.swivel_offset for model in models])
        return replace(self, readings=self.readings + offsets)


@dataclass(eq=False)
class Tensions(CableTerm):
    """Tensions that sensors measured.

    Attributes:
        readings: Shape (k, m) [N].
        sigma: Their standard deviations, shape (k, m) [N].
    """

    readings: Array
    sigma: Array
    kind = "tensions"
    unit = "N"
    word = "tension"
    by_pose = ("readings", "sigma")

    def parts(self, at: Point) -> Parts:
        assert at.stations.tensions is not None
        m = self.readings.shape[1]
        B = at.blank(m)
        B[:, np.arange(m), POSE + np.arange(m)] = 1.0
        return at.stations.tensions - self.readings, B, list


@dataclass(eq=False)
class Rest(Term):
    """The platform rests: tensions and weight balance up to what is not modelled.

    Of a platform that moves less than a body in space they balance along the motions that it has:
    what it cannot move something else holds, so forces and moments there do not count.

    Attributes:
        count: Number of poses k.
        weight: Mass times gravity, in W, shape (3,) [N].
        p_PPcm: Centre of mass, shape (3,) [m].
        sigma_moment: What moments about Po may miss [N m].
        sigma_force: What forces may miss [N].
        motion: Motion type of a platform that moves less; None: a body in space.
    """

    count: int
    weight: Array
    p_PPcm: Array
    sigma_moment: float
    sigma_force: float
    motion: MotionType | None = None
    kind = "equilibrium"
    unit = "N m, N"

    def parts(self, at: Point) -> Parts:
        """As the base class says, of a body in space, in each of six rows."""
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
        armx, ux = crosses(arm), crosses(u)
        # A step of B turns u by H; one of the arm changes the moment besides.
        by_point = np.concatenate([armx @ H, H], axis=2)  # (k, m, 6, 3)
        by_arm = by_point.copy()
        by_arm[:, :, :3] -= ux
        minus_t = -t[:, :, None, None]

        def slopes() -> Slopes:
            exits = -minus_t * by_point
            anchors = minus_t * (by_arm @ at.stations.R[:, None])
            exits, anchors = (np.moveaxis(x, 1, 2).reshape(-1, 6, 3 * m) for x in (exits, anchors))
            bend = at.vector(BEND)
            bent = np.concatenate([np.cross(arm, bend), bend], axis=2) * -t[:, :, None]
            return [
                (EVERY_ROW, where["exit_points"], exits),
                (EVERY_ROW, where["anchor_points"], anchors),
                (EVERY_ROW, where["pulley_radii"], np.moveaxis(bent, 1, 2)),
            ]

        B = at.blank(6)
        B[:, :, :3] = np.sum(minus_t * (by_arm @ -armx), axis=1)
        B[:, :3, :3] += crosses(f) @ crosses(lever)
        B[:, :, 3:POSE] = np.sum(minus_t * by_point, axis=1)
        B[:, :, POSE:] = -np.moveaxis(J, 1, 2)
        return residual, B, slopes

    def weights(self) -> Array:
        """As the base class says, of a body in space."""
        return 1.0 / np.tile([self.sigma_moment] * 3 + [self.sigma_force] * 3, (self.count, 1))

    def _weighted(self, residual: Array, weight: Array) -> Array:
        return residual * weight

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says; moments and forces have one sigma each, which bases keep."""
        r, A, B = super().evaluate(at)
        if self.motion is None:
            return r, A, B
        bases = self._bases(at)
        return (bases @ r[:, :, None])[:, :, 0], bases @ A, bases @ B

    def by_poses(self, at: Point) -> tuple[Array, Array]:
        r, B = super().by_poses(at)
        if self.motion is None:
            return r, B
        bases = self._bases(at)
        return (bases @ r[:, :, None])[:, :, 0], bases @ B

    def _bases(self, at: Point) -> Array:
        """Motions at each pose, shape (k, freedom, 6)."""
        assert self.motion is not None
        bases = np.array([self.motion.basis(R).T for R in at.stations.R])
        return bases.reshape(-1, self.motion.freedom, 6)

    def measured(self) -> npt.NDArray[np.bool_]:
        rows = 6 if self.motion is None else self.motion.freedom
        return np.ones((self.count, rows), dtype=bool)

    def _turns(self) -> int:
        """Rows of moments, which come first."""
        return 3 if self.motion is None else self.motion.num_turns

    def sigmas(self) -> Array:
        sigmas = np.full(self.measured().shape, self.sigma_force)
        sigmas[:, : self._turns()] = self.sigma_moment
        return sigmas

    def values(self, at: Point) -> Array:
        return np.zeros(self.measured().shape)

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        if self.motion is not None:
            return self.motion.words()[row]
        return f"{('moment', 'force')[row // 3]} along {'xyz'[row % 3]}"

    def row_unit(self, row: int) -> str:
        return "N m" if row < self._turns() else "N"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Rest:
        return replace(self, count=len(np.arange(self.count)[which]))
