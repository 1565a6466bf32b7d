"""The catalogue of sensors: tension sensors, motor encoders and pose sensors, as published."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema import array, closest, load_typed, number, text, whole

_FOLDER = Path(__file__).parent / "sensors"

_Model = TypeVar("_Model")


@dataclass(kw_only=True)
class TensionSensorModel:
    """A type of tension sensor; one is fixed to every cable."""

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    limits: np.ndarray = array("Smallest and largest reading.", "N", (2,))
    accuracy: float = number("Largest constant error of a sensor.", "N", at_least=0.0)
    repeatability: float = number("Standard deviation of repeated readings.", "N", at_least=0.0)
    resolution: float = number("Step between readings; 0: none.", "N", 0.0, at_least=0.0)
    rate_hz: float = number("Largest number of readings per second.", "Hz", above=0.0)
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")


@dataclass(kw_only=True)
class EncoderModel:
    """A type of encoder; one is on every motor's shaft."""

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    counts_per_turn: int = whole("Counts per turn of the motor.", at_least=1)
    rate_hz: float = number("Largest number of readings per second.", "Hz", above=0.0)
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")


@dataclass(kw_only=True)
class PoseSensorModel:
    """A system that measures the pose of the platform from outside."""

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    position_accuracy: float = number(
        "Constant error of position, where it was registered.", "m", at_least=0.0
    )
    rotation_accuracy_deg: float = number("Constant error of rotation.", "deg", at_least=0.0)
    position_repeatability: float = number(
        "Standard deviation of each coordinate.", "m", at_least=0.0
    )
    rotation_repeatability_deg: float = number(
        "Standard deviation of each component of the rotation vector.", "deg", at_least=0.0
    )
    error_per_distance: float = number(
        "Error of position per distance from where it was registered.", "m/m", 0.0, at_least=0.0
    )
    error_per_angle: float = number(
        "Error of position per angle from how it was registered.", "m/rad", 0.0, at_least=0.0
    )
    rate_hz: float = number("Largest number of poses per second.", "Hz", above=0.0)
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")


def tension_sensor_names() -> tuple[str, ...]:
    """Names of the tension sensors of the catalogue."""
    return _names("tension")


def encoder_names() -> tuple[str, ...]:
    """Names of the encoders of the catalogue."""
    return _names("encoder")


def pose_sensor_names() -> tuple[str, ...]:
    """Names of the pose sensors of the catalogue."""
    return _names("pose")


def load_tension_sensor(name: str) -> TensionSensorModel:
    """Reads a tension sensor of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    sensor = _load("tension", name, TensionSensorModel)
    if sensor.limits[0] >= sensor.limits[1]:
        raise RobotFileError(f"tension sensor {name}: limits: accepted: smallest < largest [N]")
    return sensor


def load_encoder(name: str) -> EncoderModel:
    """Reads an encoder of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    return _load("encoder", name, EncoderModel)


def load_pose_sensor(name: str) -> PoseSensorModel:
    """Reads a pose sensor of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    return _load("pose", name, PoseSensorModel)


def _names(kind: str) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in (_FOLDER / kind).glob("*.yaml")))


def _load(kind: str, name: str, schema: type[_Model]) -> _Model:
    what: Any = schema
    model: _Model = _read(kind, name, what)
    return model


@lru_cache
def _read(kind: str, name: str, schema: type[Any]) -> Any:
    """Read once, as the catalogue is the package's."""
    if name not in _names(kind):
        raise RobotFileError(f"{kind} sensor {name!r} is unknown; {closest(name, _names(kind))}")
    return load_typed(schema, _FOLDER / kind / f"{name}.yaml", error=RobotFileError)
