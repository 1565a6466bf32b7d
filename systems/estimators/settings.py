"""Scenario section `estimator`: how the controller knows the platform's pose.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.schema import optional_section, section, text, texts
from cdpr_drake.systems.estimators.kinds import ESTIMATORS
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings
from cdpr_drake.systems.estimators.tuning import (
    FusionSettings,
    KnownTagSettings,
    PlatformTagSettings,
)


@dataclass(kw_only=True)
class EstimatorSettings:
    """The estimator of the platform's pose."""

    kind: str = text("Estimator.", "control_integration", choices=ESTIMATORS)
    compare: list[str] = texts(
        "Estimators that run beside it and are logged; nothing uses what they say.",
        choices=ESTIMATORS,
    )
    known_tag: KnownTagSettings | None = optional_section(
        "A tag whose pose is known, at which the estimate begins anew from time to time."
    )
    platform_tag: PlatformTagSettings | None = optional_section(
        "A tag on the platform and a second camera, in the world, that sees it; for kinds "
        "eye_to_hand and sensor_fusion."
    )
    fusion: FusionSettings = section("Tuning of kind fusion.", FusionSettings, required=False)
    sensor_fusion: SensorFusionSettings = section(
        "Sources and tuning of kind sensor_fusion.", SensorFusionSettings, required=False
    )
