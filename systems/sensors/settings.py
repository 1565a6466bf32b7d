"""Scenario section `sensors`: what estimators read besides images, and what is logged.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass, replace
from typing import Any

from cdpr_drake.schema import number, text, texts
from cdpr_drake.systems.sensors.kinds import IDEAL, SENSORS


def _types(sensor: str) -> tuple[str, ...]:
    return (IDEAL, *SENSORS[sensor].types())


@dataclass(kw_only=True)
class SensorSettings:
    """Types of sensors, from the catalogue; one is there if an estimator reads it or it is logged.

    A rate is at most that of the type, and at most one reading per integration step. A sensor of
    the table that has no key here is of its default type and reads at its rate.
    """

    tension: str = text("Type of the tension sensors.", IDEAL, choices=_types("tension"))
    encoder: str = text("Type of the encoders on the motors.", IDEAL, choices=_types("encoder"))
    tracker: str = text(
        "Type of what measures the platform's pose from outside.",
        SENSORS["tracker"].default,
        choices=_types("tracker"),
    )
    metrology: str = text(
        "Type of what measures the platform's pose for comparison; nothing uses it.",
        SENSORS["metrology"].default,
        choices=_types("metrology"),
    )
    tension_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    encoder_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    tracker_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    metrology_rate: float | None = number("Readings; null: the type's.", "Hz", None, above=0.0)
    tension_accuracy: float | None = number(
        "Largest constant error of a tension sensor beyond its reading on a slack cable; 0: that "
        "reading holds it; null: the type's.",
        "N",
        None,
        at_least=0.0,
    )
    log: list[str] = texts("Sensors that are logged, used or not.", choices=SENSORS)

    def kind(self, sensor: str) -> str:
        """Type of one of `SENSORS`."""
        return str(getattr(self, sensor, SENSORS[sensor].default))

    def model(self, sensor: str) -> Any:
        """The type of one of `SENSORS` that is not ideal, with what is set beside it here."""
        found = SENSORS[sensor].load(self.kind(sensor))
        accuracy = getattr(self, f"{sensor}_accuracy", None)
        return found if accuracy is None else replace(found, accuracy=accuracy)

    def rate(self, sensor: str) -> float | None:
        """Readings of one of `SENSORS` per second [Hz]; None: it is ideal and does not sample."""
        largest = self.largest_rate(sensor)
        given = getattr(self, f"{sensor}_rate", None)
        return None if largest is None else float(given or largest)

    def largest_rate(self, sensor: str) -> float | None:
        """The most readings per second that the type of one of `SENSORS` makes [Hz], or None."""
        kind = self.kind(sensor)
        return None if kind == IDEAL else float(SENSORS[sensor].load(kind).rate_hz)
