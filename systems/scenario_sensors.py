"""Scenario section `sensors`: what estimators read besides images.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.fields import text
from cdpr_drake.models import encoder_names, pose_sensor_names, tension_sensor_names

IDEAL = "ideal"
"""A sensor that says what is true."""


@dataclass(kw_only=True)
class SensorSettings:
    """Types of sensors, from the catalogue; one is there only if an estimator reads it."""

    tension: str = text(
        "Type of the tension sensors.", IDEAL, choices=(IDEAL, *tension_sensor_names())
    )
    encoder: str = text(
        "Type of the encoders on the motors.", IDEAL, choices=(IDEAL, *encoder_names())
    )
    tracker: str = text(
        "Type of what measures the platform's pose from outside.",
        "vive",
        choices=(IDEAL, *pose_sensor_names()),
    )
