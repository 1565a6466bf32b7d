"""Balance at rest of platforms that move less than a body in space, as residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.stations import Point
from cdpr_drake.calibration.terms import EquilibriumTerm, Evaluated
from cdpr_drake.geometry.motion_type import FREE, MotionType


@dataclass(eq=False)
class RestrictedEquilibrium(EquilibriumTerm):
    """The platform rests: tensions and weight balance along the motions that it has.

    What it cannot move something else holds, so forces and moments there do not count.

    Attributes:
        motion: Motion type of the platform.
    """

    motion: MotionType = FREE

    def evaluate(self, at: Point) -> Evaluated:
        """As the base class says; moments and forces have one sigma each, which bases keep."""
        r, A, B = super().evaluate(at)
        bases = np.array([self.motion.basis(R).T for R in at.stations.R])
        bases = bases.reshape(-1, self.motion.freedom, 6)
        return (bases @ r[:, :, None])[:, :, 0], bases @ A, bases @ B

    def measured(self) -> npt.NDArray[np.bool_]:
        """As the base class says."""
        return np.ones((self.count, self.motion.freedom), dtype=bool)

    def sigmas(self) -> Array:
        """As the base class says."""
        turns, moves = self.motion.num_turns, self.motion.num_moves
        return np.tile([self.sigma_moment] * turns + [self.sigma_force] * moves, (self.count, 1))

    def row_name(self, row: int, names: tuple[str, ...]) -> str:
        """As the base class says."""
        return self.motion.words()[row]

    def row_unit(self, row: int) -> str:
        """As the base class says."""
        return "N m" if row < self.motion.num_turns else "N"
