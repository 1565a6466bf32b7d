"""PBVS with the features in the order of the theses."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.visual_features import POSE_NAMES, ObjectPoseFeatures, Sighting

ORDER = np.array([3, 4, 5, 0, 1, 2])
"""Of rows: translation, rotation."""


class TranslationFirst(ObjectPoseFeatures):
    """(p_CO, theta u) in the place of (theta u, p_CO), with the rows of L in the same order."""

    names = tuple(POSE_NAMES[row] for row in ORDER)

    def evaluate(self, seen: Sighting) -> tuple[Array, Array]:
        """As the base class says."""
        error, L = super().evaluate(seen)
        return error[ORDER], L[ORDER]

    def packed(self) -> None:
        """None: it is asked in Python."""
