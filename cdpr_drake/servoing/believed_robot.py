"""What controllers and estimators believe about the robot that they move."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pydrake.math import RigidTransform

from cdpr_drake.geometry import ALL_ROWS, PLANAR_ROWS, CableSet


@dataclass(frozen=True)
class BelievedRobot:
    """What controller and estimators believe about the robot; the simulated robot may differ.

    Attributes:
        cables: All constants of the cables.
        X_PC: Camera C on the platform [m].
        X_WP0: Pose of the platform at the start [m].
        motions: Components of the platform's twist in P, ordered (rotation, translation), that
            the robot can move: all six, or (2, 3, 4) for 2T1R.
        cable_speed: Largest cable speed to ask for [m/s].
    """

    cables: CableSet
    X_PC: RigidTransform
    X_WP0: RigidTransform
    motions: tuple[int, ...] = ALL_ROWS
    cable_speed: float = math.inf

    def is_planar(self) -> bool:
        """Whether the platform slides in a plane, 2T1R."""
        return self.motions == PLANAR_ROWS
