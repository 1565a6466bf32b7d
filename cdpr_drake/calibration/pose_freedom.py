"""Which coordinates of a pose are unknown: those that the platform's motion type has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.stations import POSE
from cdpr_drake.geometry.motion_type import FREE, MotionType

STATION_TYPICAL = 0.01
"""What makes turns [rad] and places [m] of a pose, and tensions in hundreds of newtons,
comparable."""


@dataclass(frozen=True, eq=False)
class PoseFreedom:
    """Unknowns of poses in the coordinates of a motion type.

    A pose has six coordinates, turns about and translations along the axes of W. Where a motion
    type has some of these, its unknowns are those; in an oblique plane, on an oblique line and for
    a beam they are components along `MotionType.basis`. Behind them stand the pose's tensions.

    Attributes:
        motion: Motion type of the platform.
    """

    motion: MotionType = FREE

    def columns(self, width: int) -> npt.NDArray[np.intp] | None:
        """Which of the width coordinates and tensions are unknown; None where none alone is."""
        if self.motion.rows is None:
            return None
        return np.array([*self.motion.rows, *range(POSE, width)])

    def count(self, width: int) -> int:
        """Unknowns of a pose that has so many coordinates and tensions."""
        return self.motion.freedom + width - POSE

    def scale(self, width: int) -> Array:
        """Typical sizes of the unknowns, shape (q,)."""
        scale = np.full(self.count(width), STATION_TYPICAL)
        scale[self.motion.freedom :] *= 1e2
        return scale

    def narrow(self, B: Array, R: Array) -> Array:
        """Derivatives by all coordinates, shape (k, rows, width), for the unknowns, (k, rows, q).

        Args:
            B: The derivatives.
            R: Rotations of the platform in W, shape (k, 3, 3).
        """
        columns = self.columns(B.shape[2])
        if columns is not None:
            return np.asarray(B[:, :, columns])
        return np.concatenate([B[:, :, :POSE] @ self._bases(R), B[:, :, POSE:]], axis=2)

    def widen(self, steps: Array, R: Array, width: int) -> Array:
        """Steps of the unknowns, shape (k, q), as steps of all coordinates, shape (k, width)."""
        wide, columns = np.zeros((len(steps), width)), self.columns(width)
        if columns is not None:
            wide[:, columns] = steps
            return wide
        n = self.motion.freedom
        wide[:, :POSE] = np.einsum("kab,kb->ka", self._bases(R), steps[:, :n])
        wide[:, POSE:] = steps[:, n:]
        return wide

    def coordinates(self, steps: Array, R: Array) -> Array:
        """Steps of all coordinates, shape (k, width), as those of the unknowns, shape (k, q).

        What `widen` makes of them is what of the steps the motion type has.
        """
        columns = self.columns(steps.shape[1])
        if columns is not None:
            return np.asarray(steps[:, columns])
        moves = np.einsum("kab,ka->kb", self._bases(R), steps[:, :POSE])
        return np.concatenate([moves, steps[:, POSE:]], axis=1)

    def labels(self, width: int) -> list[str]:
        """Names of the unknowns, as turn0, place2, tension1."""
        columns = self.columns(width)
        tensions = [f"tension{i}" for i in range(width - POSE)]
        if columns is None:
            turns, moves = self.motion.num_turns, self.motion.num_moves
            named = [f"turn{i}" for i in range(turns)] + [f"place{i}" for i in range(moves)]
            return [*named, *tensions]
        every = [*(f"{w}{i}" for w in ("turn", "place") for i in range(3)), *tensions]
        return [every[c] for c in columns]

    def turn_axes(self) -> Array:
        """Axes in W about which starts are turned, shape (s, 3); none for a point mass."""
        if self.motion.num_turns == 1:
            return np.asarray(self.motion.axis, float)[None]
        return np.eye(3) if self.motion.num_turns else np.zeros((0, 3))

    def _bases(self, R: Array) -> Array:
        if self.motion.name == "2R3T":
            return np.array([self.motion.basis(each) for each in R]).reshape(
                -1, POSE, self.motion.freedom
            )
        return np.broadcast_to(self.motion.basis(np.eye(3)), (len(R), POSE, self.motion.freedom))


BODY = PoseFreedom()
"""All six coordinates."""
