"""The catalogue of sensors, as published: of tensions, angles, poses, ranges, motion, depth."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np

from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.declarations import FASTEST, In, Refusal, Scope, Text, number_words, settings
from cdpr_drake.schema.typed_yaml import closest, load_typed

_FOLDER = Path(__file__).parent / "sensors"

_Model = TypeVar("_Model")


@settings
class SensorModel:
    """What files of all sensors say."""

    name: Annotated[Text, "Name, the same as that of its file."]
    title: Annotated[Text, "Maker and type."]
    source: Annotated[Text, "Where the values stand."]
    assumptions: Annotated[Text, "Assumed values, and the reason for each."] = ""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Limits, of sensors that have some, that nothing lies between."""
        limits = getattr(self, "limits", None)
        if limits is not None and limits[0] >= limits[1]:
            yield "limits", number_words(limits), "smallest < largest"


@settings
class TensionSensorModel(SensorModel):
    """A type of tension sensor; one is fixed to every cable."""

    limits: Annotated[np.ndarray, In("N", 2), "Smallest and largest reading."]
    accuracy: Annotated[float, In("N", ge=0.0), "Largest constant error of a sensor."]
    repeatability: Annotated[float, In("N", ge=0.0), "Standard deviation of repeated readings."]
    resolution: Annotated[float, In("N", ge=0.0), "Step between readings; 0: none."] = 0.0
    rate_hz: Annotated[float, In("Hz", gt=0.0), "Largest number of readings per second."]


@settings
class EncoderModel(SensorModel):
    """A type of encoder; one is on every motor's shaft."""

    counts_per_turn: Annotated[int, In(ge=1), "Counts per turn of the motor."]
    rate_hz: Annotated[float, In("Hz", gt=0.0), "Largest number of readings per second."]


@settings
class PoseSensorModel(SensorModel):
    """A system that measures the pose of the platform from outside."""

    position_accuracy: Annotated[
        float, In("m", ge=0.0), "Constant error of position, where it was registered."
    ]
    rotation_accuracy_deg: Annotated[float, In("deg", ge=0.0), "Constant error of rotation."]
    position_repeatability: Annotated[
        float, In("m", ge=0.0), "Standard deviation of each coordinate."
    ]
    rotation_repeatability_deg: Annotated[
        float, In("deg", ge=0.0), "Standard deviation of each component of the rotation vector."
    ]
    error_per_distance: Annotated[
        float, In("m/m", ge=0.0), "Error of position per distance from where it was registered."
    ] = 0.0
    error_per_angle: Annotated[
        float, In("m/rad", ge=0.0), "Error of position per angle from how it was registered."
    ] = 0.0
    rate_hz: Annotated[float, In("Hz", gt=0.0), "Largest number of poses per second."]


@settings
class RangeSensorModel(SensorModel):
    """A laser scanner, whose beams are a fan in the plane z = 0 of its frame S, or one beam.

    Angles are from x, the front, towards y, the left.
    """

    first_angle_deg: Annotated[float, In("deg", ge=-360, le=360), "Angle of the first beam."]
    last_angle_deg: Annotated[float, In("deg", ge=-360, le=360), "Angle of the last beam."]
    beams: Annotated[int, In(ge=1, le=10000), "Beams, evenly from the first to the last."]
    limits: Annotated[np.ndarray, In("m", 2, ge=0.0, le=100000.0), "Smallest and largest range."]
    noise: Annotated[float, In("m", ge=0.0), "Standard deviation of a reading."]
    noise_share: Annotated[
        float, In("m/m", ge=0.0), "What is added to that for each metre of range."
    ] = 0.0
    resolution: Annotated[float, In("m", ge=0.0), "Step between readings; 0: none."] = 0.0
    rate_hz: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Largest number of scans per second."]

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Limits that nothing lies between, and angles that go backwards."""
        yield from super().refusals(scope)
        if self.first_angle_deg > self.last_angle_deg:
            yield "first_angle_deg", f"{self.first_angle_deg:g}", "<= last_angle_deg"


@settings
class InertialSensorModel(SensorModel):
    """An inertial measurement unit: three accelerometers and three gyroscopes along x, y, z of S.

    White noise by its density, so that it grows with the root of the rate; a bias that begins
    anywhere and walks at random.
    """

    accelerometer_noise: Annotated[float, In("m/s^2/sqrt(Hz)", ge=0.0), "Density of white noise."]
    accelerometer_walk: Annotated[float, In("m/s^3/sqrt(Hz)", ge=0.0), "Random walk of the bias."]
    accelerometer_bias: Annotated[
        float, In("m/s^2", ge=0.0), "Standard deviation of the bias at time 0."
    ]
    accelerometer_limit: Annotated[float, In("m/s^2", gt=0.0), "Largest reading, either way."]
    gyroscope_noise: Annotated[float, In("rad/s/sqrt(Hz)", ge=0.0), "Density of white noise."]
    gyroscope_walk: Annotated[float, In("rad/s^2/sqrt(Hz)", ge=0.0), "Random walk of the bias."]
    gyroscope_bias: Annotated[
        float, In("rad/s", ge=0.0), "Standard deviation of the bias at time 0."
    ]
    gyroscope_limit: Annotated[float, In("rad/s", gt=0.0), "Largest reading, either way."]
    rate_hz: Annotated[
        float, In("Hz", gt=0.0, le=FASTEST), "Largest number of readings per second."
    ]


@settings
class DepthSensorModel(SensorModel):
    """A depth camera; depth is along the optical axis."""

    width: Annotated[int, In("px", ge=1, le=4096), "Pixels of a row."]
    height: Annotated[int, In("px", ge=1, le=4096), "Rows."]
    focal_length: Annotated[
        float, In("px", ge=1.0, le=100000.0), "Focal length, of rows and columns."
    ]
    limits: Annotated[np.ndarray, In("m", 2, ge=0.001, le=10000.0), "Smallest and largest depth."]
    noise: Annotated[float, In("m", ge=0.0), "Standard deviation of a depth."]
    noise_per_square: Annotated[
        float, In("1/m", ge=0.0), "What is added to that for each square metre of depth squared."
    ] = 0.0
    rate_hz: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Largest number of images per second."]


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
    return _load("tension", name, TensionSensorModel)


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
    return _load("range", name, RangeSensorModel)


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
    return _load("depth", name, DepthSensorModel)


def _names(kind: str) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in (_FOLDER / kind).glob("*.yaml")))


def _load(kind: str, name: str, schema: type[_Model]) -> _Model:
    what: Any = schema  # a key of the cache
    model: _Model = _read(kind, name, what)
    return model


@lru_cache
def _read(kind: str, name: str, schema: type[Any]) -> Any:
    """Read once, as the catalogue is the package's."""
    if name not in _names(kind):
        raise RobotFileError(f"{kind} sensor {name!r} is unknown; {closest(name, _names(kind))}")
    path = _FOLDER / kind / f"{name}.yaml"
    return load_typed(schema, path, error=RobotFileError, scope=lambda one: Scope(one, path))
