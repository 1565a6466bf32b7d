"""The sensors that a scenario can have beside its camera; a new one is one entry of `SENSORS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydrake.systems.framework import System

from cdpr_drake.geometry import cable_lengths
from cdpr_drake.models import (
    Robot,
    encoder_names,
    load_encoder,
    load_pose_sensor,
    load_tension_sensor,
    pose_sensor_names,
    tension_sensor_names,
)
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
