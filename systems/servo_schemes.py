"""The visual servoing schemes that a scenario can name; a new one is one entry of `SCHEMES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pydrake.systems.framework import System

from cdpr_drake.servo_law import AdaptiveGain
from cdpr_drake.systems.pose_servo import PoseServo, ServoTuning

if TYPE_CHECKING:
    # The schema takes the names of the schemes from here.
    from cdpr_drake.systems.scenario import Scenario
    from cdpr_drake.systems.servo_model import ServoModel

SchemeFactory = Callable[["Scenario", "ServoModel"], System]
"""Makes the servo of a scenario for the robot as the controller believes it to be; its ports are
those of `PoseServo`."""


def _pbvs(scenario: Scenario, model: ServoModel) -> System:
    c = scenario.controller
    tuning = ServoTuning(AdaptiveGain(c.lambda_0, c.lambda_infinity, c.lambda_slope), c.sigma)
    return PoseServo(model, tuning, scenario.desired.transform(), c.rate)


SCHEMES: dict[str, SchemeFactory] = {"pbvs": _pbvs}
"""By the name that a scenario gives as `controller.scheme`."""
