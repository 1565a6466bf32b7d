"""The catalogue of sensors, as published: of tensions, angles, poses, ranges, motion, depth."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.fields import FASTEST, array, number, text, whole
from cdpr_drake.schema.typed_yaml import closest, load_typed

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


@dataclass(kw_only=True)
class RangeSensorModel:
    """A laser scanner, whose beams are a fan in the plane z = 0 of its frame S, or one beam.

    Angles are from x, the front, towards y, the left.
    """

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    first_angle_deg: float = number("Angle of the first beam.", "deg", at_least=-360, at_most=360)
    last_angle_deg: float = number("Angle of the last beam.", "deg", at_least=-360, at_most=360)
    beams: int = whole("Beams, evenly from the first to the last.", at_least=1, at_most=10_000)
    limits: np.ndarray = array("Smallest and largest range.", "m", (2,), at_least=0.0, at_most=1e5)
    noise: float = number("Standard deviation of a reading.", "m", at_least=0.0)
    noise_share: float = number(
        "What is added to that for each metre of range.", "m/m", 0.0, at_least=0.0
    )
    resolution: float = number("Step between readings; 0: none.", "m", 0.0, at_least=0.0)
    rate_hz: float = number("Largest number of scans per second.", "Hz", above=0.0, at_most=FASTEST)
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")


@dataclass(kw_only=True)
class InertialSensorModel:
    """An inertial measurement unit: three accelerometers and three gyroscopes along x, y, z of S.

    White noise by its density, so that it grows with the root of the rate; a bias that begins
    anywhere and walks at random.
    """

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    accelerometer_noise: float = number("Density of white noise.", "m/s^2/sqrt(Hz)", at_least=0.0)
    accelerometer_walk: float = number("Random walk of the bias.", "m/s^3/sqrt(Hz)", at_least=0.0)
    accelerometer_bias: float = number(
        "Standard deviation of the bias at time 0.", "m/s^2", at_least=0.0
    )
    accelerometer_limit: float = number("Largest reading, either way.", "m/s^2", above=0.0)
    gyroscope_noise: float = number("Density of white noise.", "rad/s/sqrt(Hz)", at_least=0.0)
    gyroscope_walk: float = number("Random walk of the bias.", "rad/s^2/sqrt(Hz)", at_least=0.0)
    gyroscope_bias: float = number(
        "Standard deviation of the bias at time 0.", "rad/s", at_least=0.0
    )
    gyroscope_limit: float = number("Largest reading, either way.", "rad/s", above=0.0)
    rate_hz: float = number(
        "Largest number of readings per second.", "Hz", above=0.0, at_most=FASTEST
    )
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")


@dataclass(kw_only=True)
class DepthSensorModel:
    """A depth camera; depth is along the optical axis."""

    name: str = text("Name, the same as that of its file.")
    title: str = text("Maker and type.")
    source: str = text("Where the values stand.")
    width: int = whole("Pixels of a row.", unit="px", at_least=1, at_most=4096)
    height: int = whole("Rows.", unit="px", at_least=1, at_most=4096)
    focal_length: float = number(
        "Focal length, of rows and columns.", "px", at_least=1.0, at_most=1e5
    )
    limits: np.ndarray = array("Smallest and largest depth.", "m", (2,), at_least=1e-3, at_most=1e4)
    noise: float = number("Standard deviation of a depth.", "m", at_least=0.0)
    noise_per_square: float = number(
        "What is added to that for each square metre of depth squared.", "1/m", 0.0, at_least=0.0
    )
    rate_hz: float = number(
        "Largest number of images per second.", "Hz", above=0.0, at_most=FASTEST
    )
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


def range_sensor_names() -> tuple[str, ...]:
    """Names of the range sensors of the catalogue."""
    return _names("range")


def inertial_sensor_names() -> tuple[str, ...]:
    """Names of the inertial measurement units of the catalogue."""
    return _names("imu")


def depth_sensor_names() -> tuple[str, ...]:
    """Names of the depth cameras of the catalogue."""
    return _names("depth")


def load_range_sensor(name: str) -> RangeSensorModel:
    """Reads a range sensor of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    sensor = _load("range", name, RangeSensorModel)
    _check_limits(f"range sensor {name}", sensor.limits)
    if sensor.first_angle_deg > sensor.last_angle_deg:
        raise RobotFileError(f"range sensor {name}: first_angle_deg: accepted: <= last_angle_deg")
    return sensor


def load_inertial_sensor(name: str) -> InertialSensorModel:
    """Reads an inertial measurement unit of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    return _load("imu", name, InertialSensorModel)


def load_depth_sensor(name: str) -> DepthSensorModel:
    """Reads a depth camera of the catalogue.

    Raises:
        RobotFileError: There is none of that name; says which exist.
    """
    sensor = _load("depth", name, DepthSensorModel)
    _check_limits(f"depth sensor {name}", sensor.limits)
    return sensor


def _check_limits(what: str, limits: np.ndarray) -> None:
    if limits[0] >= limits[1]:
        raise RobotFileError(f"{what}: limits: accepted: smallest < largest [m]")


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
