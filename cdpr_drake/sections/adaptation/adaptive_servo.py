"""A visual servo whose model of the robot comes in by a port."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

BELIEVED_POINTS = "believed_points"


class AdaptiveServo(FeatureServo):
    """As `FeatureServo`, by exit and anchor points that may change while it runs.

    =============== =========== ==== ======================================================
    port            type        unit meaning
    =============== =========== ==== ======================================================
    believed_points vector(6 m) m    in, exit points in W cable by cable, then anchor points
                                     in P
    =============== =========== ==== ======================================================

    All other ports are those of `FeatureServo`.
    """

    def __init__(
        self, controller: ServoController, target: Target, pinhole: Pinhole, rate: float
    ) -> None:
        """As `FeatureServo`."""
        super().__init__(controller, target, pinhole, rate)
        self.DeclareVectorInputPort(BELIEVED_POINTS, 6 * controller.cable_count)

    def decide(
        self, read: Callable[[str], Any], memory: Array, time: float
    ) -> tuple[dict[str, Array], Array]:
        """As the base class says, by the points that stand at the input."""
        points = read(BELIEVED_POINTS).reshape(2, -1, 3)
        self.controller.believe(points[0].T, points[1].T)
        return super().decide(read, memory, time)
