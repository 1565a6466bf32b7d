"""The schema of a scenario file: one servo run, with units and accepted ranges.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.schema import FASTEST, number, optional_section, section, text
from cdpr_drake.systems.monitoring import StabilitySettings
from cdpr_drake.systems.robots import CableRobotSettings
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.run_settings import (
    IntegrationSettings,
    ScenarioHeader,
    StopSettings,
)
from cdpr_drake.systems.scenarios.visual_servo_settings import VisualServoSettings

DEFAULT_SCENARIO = "acrobot_pbvs_taut"


@dataclass(kw_only=True)
class Scenario(VisualServoSettings, CableRobotSettings, ScenarioHeader):
    """One run of a visual servo on a cable robot: both, and when and how it is run."""

    kind: str = text("Kind of run.", VISUAL_SERVO, choices=(VISUAL_SERVO,))
    stop: StopSettings = section("When the run ends.", StopSettings)
    integration: IntegrationSettings = section("Integration.", IntegrationSettings, required=False)
    stability: StabilitySettings | None = optional_section(
        "The stability criterion along the run, in its log; null: not logged."
    )
    log_rate: float = number("Rows of the log per second.", "Hz", 50.0, above=0.0, at_most=FASTEST)
