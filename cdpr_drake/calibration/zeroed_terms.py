"""Cables that were counted from zero, by lengths or motor angles, as residuals with derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.station_kernel import ARM, LENGTH, RADIUS_SLOPE, U
from cdpr_drake.calibration.stations import POSE, Point, Stations
from cdpr_drake.calibration.terms import Evaluated, Term, weighted
from cdpr_drake.winches.drum import Drum


@dataclass(eq=False)
class ZeroedCables(Term):
    """What was paid out since winches stood at zero: cable lengths, or what motor angles say.

    Winches stood at zero at a pose that is known, where cables were as long as the model says
    there, and by `length_offset` longer; without such a pose `length_offset` is the whole length
    at zero. A residual is length / (1 + strain) - length there - offset - scale * paid out. What a
    motor pays out follows its drum, see `winches.drum`: with one turn in a layer the square of the
    radius at which line leaves falls in proportion to what is paid out, as in firmware of
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

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says."""
        model, where = at.model, at.layout.slices
        m = self.readings.shape[1]
        slope = 1.0 / (1.0 + self.strain)
        paid, by_radius = self.paid_out(model)
        scale = model.length_scale
        residual = at.numbers[:, :, LENGTH] * slope - model.length_offset - scale * paid
        residual = residual - self.added
        A, B = at.blank(m)
        i, u = np.arange(m), at.vector(U)
        three = 3 * i[:, None] + np.arange(3)
        exits, anchors = where["exit_points"].start + three, where["anchor_points"].start + three
        radii = where["pulley_radii"].start + i
        u_P = np.einsum("kba,kmb->kma", at.stations.R, u)
        A[:, i[:, None], exits] = -u * slope[:, :, None]
        A[:, i[:, None], anchors] = u_P * slope[:, :, None]
        A[:, i, radii] = at.numbers[:, :, RADIUS_SLOPE] * slope
        A[:, i, where["length_offsets"].start + i] = -1.0
        A[:, i, where["length_scales"].start + i] = -paid
        A[:, i, where["drum_radii"].start + i] = -scale * by_radius
        A[:, i, where["common_drum_radius"].start] = -scale * by_radius
        if self.zero is not None:
            home = Point(model, Stations.at([self.zero]), at.layout)
            v = home.vector(U)[0]
            residual = residual - home.numbers[0, :, LENGTH]
            A[:, i[:, None], exits] += v
            A[:, i[:, None], anchors] -= v @ home.stations.R[0]
            A[:, i, radii] -= home.numbers[0, :, RADIUS_SLOPE]
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
        """As the base class says: cable that was paid out [m]."""
        return at.model.length_scale * self.paid_out(at.model)[0]

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return f"{'length' if self.drum is None else 'motor angle'} of {names[row]}"

    def only(self, which: npt.NDArray[np.generic] | slice) -> Term:
        """As the base class says."""
        return replace(
            self, readings=self.readings[which], sigma=self.sigma[which],
            strain=self.strain[which], added=self.added[which],
        )  # fmt: skip

    def counted_by(
        self, models: Sequence[CalibrationModel], base: CalibrationModel
    ) -> ZeroedCables:
        """As the base class says."""
        offsets = np.array([model.length_offset for model in models])
        return replace(self, added=self.added + offsets)
