"""Sensors that a scenario can have beside its camera: what estimators read, and what is logged.

`SENSORS` is their table; a new one is one entry of it. `SensorSettings` is the part of the scenario
section `sensors` that chooses their types.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydrake.systems.framework import System

from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.sensor_catalogue import (
    encoder_names,
    load_encoder,
    load_pose_sensor,
    load_tension_sensor,
    pose_sensor_names,
    tension_sensor_names,
)
from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, filled, repeated, settings
from cdpr_drake.systems.sections import Section
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor

IDEAL = "ideal"
"""A sensor that reads the true value."""

METROLOGY_SEED = 104_729
"""Added to the seed, so that metrology does not share the tracker's noise."""


@dataclass(frozen=True, kw_only=True)
class SensorKind:
    """One sensor.

    Attributes:
        reading: What it reads, as estimators and logs name it.
        truth: The robot's port that it measures.
        block: Name of its block.
        output: Name of the block's output.
        default: Its type where none is named.
        types: Names of the types that there are, without `IDEAL`.
        load: The type of a name, which has `rate_hz`, the most readings per second [Hz].
        make: Makes the block from a type, the robot, the seed and the rate [Hz].
    """

    reading: str
    truth: str
    block: str
    output: str
    default: str
    types: Callable[[], tuple[str, ...]]
    load: Callable[[str], Any]
    make: Callable[[Any, Robot, int, float], System]


def _tensions(model: Any, robot: Robot, seed: int, rate: float) -> System:
    return TensionSensor(model, len(robot.cables), seed, robot.slack_readings, rate)


def _encoders(model: Any, robot: Robot, seed: int, rate: float) -> System:
    cables = robot.cable_set().without_pulleys()  # by convention counts are zero at straight ones
    home = cable_lengths(robot.home.transform(), cables.p_WA, cables.p_PB)
    return MotorEncoders(model, robot.drum(), home, rate=rate, groups=robot.winch_groups())


def _pose(model: Any, robot: Robot, seed: int, rate: float) -> System:
    """Registered with the platform at home, in the middle of the robot."""
    return PoseSensor(model, robot.home.transform(), seed, rate)


def _metrology(model: Any, robot: Robot, seed: int, rate: float) -> System:
    return _pose(model, robot, seed + METROLOGY_SEED, rate)


SENSORS: dict[str, SensorKind] = {
    "tension": SensorKind(
        reading="measured_tensions", truth="tensions", block="tension_sensors",
        output="measured_tensions", default=IDEAL,
        types=tension_sensor_names, load=load_tension_sensor, make=_tensions,
    ),
    "encoder": SensorKind(
        reading="measured_lengths", truth="unstrained_lengths", block="encoders",
        output="measured_lengths", default=IDEAL,
        types=encoder_names, load=load_encoder, make=_encoders,
    ),
    "tracker": SensorKind(
        reading="X_WP_measured", truth="X_WP", block="tracker",
        output="X_WP_measured", default="vive",
        types=pose_sensor_names, load=load_pose_sensor, make=_pose,
    ),
    "metrology": SensorKind(
        reading="X_WP_metrology", truth="X_WP", block="metrology",
        output="X_WP_measured", default="c_track",
        types=pose_sensor_names, load=load_pose_sensor, make=_metrology,
    ),
}  # fmt: skip
"""By the name that a scenario gives; its section `sensors` may have keys for type and rate."""


def _types(sensor: str) -> tuple[str, ...]:
    return (IDEAL, *SENSORS[sensor].types())


@settings
class SensorSettings:
    """Types of sensors, from the catalogue; one is there if an estimator reads it or it is logged.

    A rate is at most that of the type, and at most one reading per integration step. A sensor of
    the table that has no key here is of its default type and reads at its rate.
    """

    tension: Annotated[str, OneOf(_types("tension")), "Type of the tension sensors."] = IDEAL
    encoder: Annotated[str, OneOf(_types("encoder")), "Type of the encoders on the motors."] = IDEAL
    tracker: Annotated[
        str, OneOf(_types("tracker")), "Type of what measures the platform's pose from outside."
    ] = SENSORS["tracker"].default
    metrology: Annotated[
        str,
        OneOf(_types("metrology")),
        "Type of what measures the platform's pose for comparison; nothing uses it.",
    ] = SENSORS["metrology"].default
    tension_rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None
    encoder_rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None
    tracker_rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None
    metrology_rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None
    tension_accuracy: Annotated[
        float | None,
        In("N", ge=0.0),
        "Largest constant error of a tension sensor beyond its reading on a slack cable; "
        "0: that reading holds it; null: the type's.",
    ] = None
    log: Annotated[list[str], OneOf(SENSORS), "Sensors that are logged, used or not."] = filled(
        list
    )

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Rates beyond those of types, and sensors that are logged twice."""
        yield from repeated(self.log, "log[{}]")
        for sensor in SENSORS:
            rate, largest = self.rate(sensor), self.largest_rate(sensor)
            if rate is not None and largest is not None and rate > largest:
                accepted = f"at most {largest:g} [Hz], that of {self.kind(sensor)}"
                yield f"{sensor}_rate", f"{rate:g}", accepted

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

    def sampled(self) -> list[str]:
        """Those of `log` that sample."""
        return [sensor for sensor in self.log if self.rate(sensor) is not None]

    def largest_rate(self, sensor: str) -> float | None:
        """The most readings per second that the type of one of `SENSORS` makes [Hz], or None."""
        kind = self.kind(sensor)
        return None if kind == IDEAL else float(SENSORS[sensor].load(kind).rate_hz)


class TypedSensor(Section):
    """Base of sections for a sensor of a type of the catalogue, with fields `type` and `rate`."""

    type: str
    rate: float | None

    @staticmethod
    @abstractmethod
    def load(name: str) -> Any:
        """The type of a name, which has `rate_hz`, the most readings per second [Hz]."""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A rate beyond that of the type."""
        largest = self.load(self.type).rate_hz
        if self.rate is not None and self.rate > largest:
            yield "rate", f"{self.rate:g}", f"at most {largest:g} [Hz], that of {self.type}"

    def model(self) -> Any:
        """The type, with the rate that is set here."""
        model = self.load(self.type)
        return model if self.rate is None else replace(model, rate_hz=self.rate)

    def sampling_rate(self) -> float:
        """Readings per second [Hz]."""
        return float(self.model().rate_hz)
