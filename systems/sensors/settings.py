"""Scenario section `sensors`: what estimators read besides images, and what is logged.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models import (
    encoder_names,
    load_encoder,
    load_pose_sensor,
    load_tension_sensor,
    pose_sensor_names,
    tension_sensor_names,
)
from cdpr_drake.schema import number, text, texts

IDEAL = "ideal"
"""A sensor that says what is true."""

SENSORS = ("tension", "encoder", "tracker", "metrology")
"""Every sensor that a scenario may have besides its camera."""


@dataclass(kw_only=True)
class SensorSettings:
    """Types of sensors, from the catalogue; one is there if an estimator reads it or it is logged.

    A rate is at most that of the type, and at most one reading per integration step.
    """

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
    metrology: str = text(
        "Type of what measures the platform's pose for comparison; nothing uses it.",
        "c_track",
        choices=(IDEAL, *pose_sensor_names()),
    )
    tension_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    encoder_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    tracker_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    metrology_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    log: list[str] = texts("Sensors that are logged, used or not.", choices=SENSORS)

    def kind(self, sensor: str) -> str:
        """Type of one of `SENSORS`."""
        return str(getattr(self, sensor))

    def rate(self, sensor: str) -> float | None:
        """Readings of one of `SENSORS` per second [Hz]; None: it is ideal and does not sample."""
        largest = self.largest_rate(sensor)
        given = getattr(self, f"{sensor}_rate")
        return None if largest is None else float(given or largest)

    def largest_rate(self, sensor: str) -> float | None:
        """The most readings per second that the type of one of `SENSORS` makes [Hz], or None."""
        kind = self.kind(sensor)
        if kind == IDEAL:
            return None
        if sensor == "tension":
            return load_tension_sensor(kind).rate_hz
        if sensor == "encoder":
            return load_encoder(kind).rate_hz
        return load_pose_sensor(kind).rate_hz
