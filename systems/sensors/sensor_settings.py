"""Scenario section `sensors`: all of it, with the sensors that look at the world and at motion."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

import numpy as np

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.models.sensor_catalogue import (
    DepthSensorModel,
    InertialSensorModel,
    RangeSensorModel,
    depth_sensor_names,
    inertial_sensor_names,
    load_depth_sensor,
    load_inertial_sensor,
    load_range_sensor,
    range_sensor_names,
)
from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    Name,
    OneOf,
    Refusal,
    Scope,
    Text,
    filled,
    number_words,
    repeated,
    settings,
    values,
)
from cdpr_drake.systems.sensors.depth_sensor import binned
from cdpr_drake.systems.sensors.pan_tilt import MODES, PanTiltJoints
from cdpr_drake.systems.sensors.scene_shapes import ROLES
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.sensors.sensor_readings import check_rate
from cdpr_drake.systems.sensors.wheel_odometry import WheelModel

PLATFORM, WORLD, HEAD = "platform", "world", "pan_tilt"
"""What carries a sensor."""


def _origin() -> Pose:
    return Pose(position=np.zeros(3))


@settings
class RangeSettings:
    """A laser scanner or a single beam; it is logged as scan_NAME."""

    name: Annotated[Name, "Name, which also tells its noise from that of others."]
    type: Annotated[str, OneOf(range_sensor_names()), "Type of the catalogue."] = "hokuyo"
    carrier: Annotated[
        Text, "What carries it: platform, world, pan_tilt, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose,
        "Pose of its frame S in the carrier: x ahead, y to the left, beams in the plane z = 0.",
    ] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Scans; null: the type's."] = None
    beams: Annotated[
        int | None, In(ge=1, le=10000), "Beams, over the same angles; null: the type's."
    ] = None
    noise: Annotated[
        float | None,
        In("m", ge=0.0),
        "Standard deviation of a reading, whatever its range; null: as the type has it.",
    ] = None
    sees: Annotated[
        str, OneOf(ROLES), "What beams end on: what cameras see, or what things bump into."
    ] = "perception"

    def model(self) -> RangeSensorModel:
        """The type, with what is set here."""
        found = load_range_sensor(self.type)
        if self.beams is not None:
            found = replace(found, beams=self.beams)
        if self.noise is not None:
            found = replace(found, noise=self.noise, noise_share=0.0)
        return found if self.rate is None else replace(found, rate_hz=self.rate)

    def largest_rate(self) -> float:
        """The most scans per second that the type makes [Hz]."""
        return load_range_sensor(self.type).rate_hz


@settings
class InertialSettings:
    """An inertial measurement unit on the platform, logged as specific_force, angular_velocity."""

    type: Annotated[str, OneOf(inertial_sensor_names()), "Type of the catalogue."] = "adis16448"
    pose: Annotated[Pose, "Pose of its frame S on the platform."] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None

    def model(self) -> InertialSensorModel:
        """The type, with what is set here."""
        found = load_inertial_sensor(self.type)
        return found if self.rate is None else replace(found, rate_hz=self.rate)

    def largest_rate(self) -> float:
        """The most readings per second that the type makes [Hz]."""
        return load_inertial_sensor(self.type).rate_hz


@settings
class DepthSettings:
    """A depth camera, rendered; the middle row of its images is logged as depth_row."""

    type: Annotated[str, OneOf(depth_sensor_names()), "Type of the catalogue."] = "kinect"
    carrier: Annotated[
        Text, "What carries it: platform, world, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose, "Pose of its frame C in the carrier: z ahead, x to the right, y down."
    ] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Images; null: the type's."] = None
    binning: Annotated[
        int,
        In(ge=1, le=64),
        "Pixels of the type's image, across and down, for which one is rendered.",
    ] = 4
    noise: Annotated[
        float | None,
        In("m", ge=0.0),
        "Standard deviation of a depth, whatever its size; null: as the type has it.",
    ] = None

    def model(self) -> DepthSensorModel:
        """The type, with what is set here."""
        found = binned(load_depth_sensor(self.type), self.binning)
        if self.noise is not None:
            found = replace(found, noise=self.noise, noise_per_square=0.0)
        return found if self.rate is None else replace(found, rate_hz=self.rate)

    def largest_rate(self) -> float:
        """The most images per second that the type takes [Hz]."""
        return load_depth_sensor(self.type).rate_hz


@settings
class PanTiltSettings:
    """A head on two joints, which swings and carries range sensors; its angles are logged."""

    carrier: Annotated[
        Text, "What carries it: platform, world, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose,
        "Pose of the joints' frame M in the carrier: z ahead, x to the right, y down; pan"
        " turns to the right about y, then tilt upwards about x.",
    ] = filled(_origin)
    arm: Annotated[
        np.ndarray, In("m", 3), "Position of the head's origin from where the axes meet."
    ] = values(0.0, 0.0, 0.0)
    lower_deg: Annotated[np.ndarray, In("deg", 2), "Smallest angles, pan and tilt."] = values(
        -160.0, -45.0
    )
    upper_deg: Annotated[np.ndarray, In("deg", 2), "Largest angles."] = values(160.0, 90.0)
    speed_deg: Annotated[np.ndarray, In("deg/s", 2, gt=0.0), "Largest speeds."] = values(
        120.0, 120.0
    )
    mode: Annotated[str, OneOf(MODES), "What its commands are."] = "position"
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Looks at the command."] = 100.0
    swing_deg: Annotated[
        np.ndarray, In("deg", 2), "How far the commands swing to either side, pan and tilt."
    ] = values(0.0, 0.0)
    swing_period: Annotated[np.ndarray, In("s", 2, gt=0.0), "Periods of these sines."] = values(
        4.0, 4.0
    )
    counts_per_turn: Annotated[int, In(ge=4), "Counts of an encoder per turn."] = 4096
    zero_error_deg: Annotated[
        float, In("deg", ge=0.0), "Standard deviation of an encoder's zero."
    ] = 0.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Limits with nothing between."""
        if not np.all(self.lower_deg <= self.upper_deg):
            accepted = f"at most upper_deg, {number_words(self.upper_deg)} [deg]"
            yield "lower_deg", number_words(self.lower_deg), accepted

    def joints(self) -> PanTiltJoints:
        """The joints."""
        return PanTiltJoints(
            lower=np.radians(self.lower_deg),
            upper=np.radians(self.upper_deg),
            speed=np.radians(self.speed_deg),
            counts_per_turn=self.counts_per_turn,
            zero_error=float(np.radians(self.zero_error_deg)),
        )


@settings
class OdometrySettings:
    """Odometry of the mobile robot that carries the target, logged as X_WO_odometry."""

    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Samples."] = 50.0
    wheel_radius: Annotated[float, In("m", gt=0.0), "Radius of the wheels."] = 0.02
    counts_per_turn: Annotated[int, In(ge=4), "Counts of an encoder per turn of a wheel."] = 4096
    scale_error: Annotated[
        float, In("-", ge=0.0), "Standard deviation of the relative error of a wheel's radius."
    ] = 0.0
    base_error: Annotated[
        float,
        In("-", ge=0.0, lt=0.2),
        "Standard deviation of the relative error of the wheels' distance.",
    ] = 0.0
    slip: Annotated[
        float,
        In("m/sqrt(m)", ge=0.0),
        "Standard deviation of what a wheel turns too much on one metre, growing with the"
        " root of the way.",
    ] = 0.0

    def wheels(self) -> WheelModel:
        """The wheels."""
        return WheelModel(
            radius=self.wheel_radius,
            counts_per_turn=self.counts_per_turn,
            scale_error=self.scale_error,
            base_error=self.base_error,
            slip=self.slip,
        )


@settings
class SensorSuite(SensorSettings):
    """Sensors of the robot: those that estimators read, and such as look round, which are logged.

    What looks round has its own rate, at most that of its type, and at most one reading per
    integration step.
    """

    range_sensors: Annotated[list[RangeSettings], "Laser scanners and single beams."] = filled(list)
    imu: Annotated[InertialSettings | None, "Inertial measurement unit; null: none."] = None
    depth: Annotated[DepthSettings | None, "Depth camera; null: none."] = None
    pan_tilt: Annotated[PanTiltSettings | None, "A head on two joints; null: none."] = None
    odometry: Annotated[
        OdometrySettings | None, "Odometry of the mobile robot that carries the target; null: none."
    ] = None

    def looks_round(self) -> bool:
        """Whether there is a sensor that looks at the world or at motion."""
        others = (self.imu, self.depth, self.pan_tilt, self.odometry)
        return bool(self.range_sensors) or any(other is not None for other in others)

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Sensors on what is not there, or faster than their type, and names that come twice."""
        yield from super().refusals(scope)
        yield from repeated((one.name for one in self.range_sensors), "range_sensors[{}].name")
        target, world = scope.whole.target, scope.whole.world
        there = [PLATFORM, WORLD, *(["target"] if target.carrier == "world" else [])]
        there += [] if world is None else world.moving()
        carried: dict[str, RangeSettings | DepthSettings | PanTiltSettings | None] = {
            f"range_sensors[{k}]": sensor for k, sensor in enumerate(self.range_sensors)
        } | {"depth": self.depth, "pan_tilt": self.pan_tilt}
        for name, sensor in carried.items():
            on_head = isinstance(sensor, RangeSettings) and self.pan_tilt is not None
            known = [*there, HEAD] if on_head else there
            if sensor is not None and sensor.carrier not in known:
                found = f"{sensor.carrier}, which is not there"
                yield f"{name}.carrier", found, ", ".join(known)[:200]
        for name, one in self._typed().items():
            rate, largest = one.rate, one.largest_rate()
            if rate is not None and rate > largest:
                yield f"{name}.rate", f"{rate:g}", f"at most {largest:g} [Hz], that of {one.type}"
        on_wheels = target.motion is not None and target.motion.mobile_robot is not None
        if self.odometry is not None and not on_wheels:
            found = "a target that no mobile robot carries"
            yield "odometry", found, "null, or target.motion.mobile_robot"

    def _typed(self) -> dict[str, RangeSettings | InertialSettings | DepthSettings]:
        """Those that are of a type of the catalogue, by their place in the section."""
        found: dict[str, RangeSettings | InertialSettings | DepthSettings] = {
            f"range_sensors[{k}]": sensor for k, sensor in enumerate(self.range_sensors)
        }
        if self.imu is not None:
            found["imu"] = self.imu
        if self.depth is not None:
            found["depth"] = self.depth
        return found

    def own_period(self) -> float:
        """Time between readings of the fastest of these sensors [s]; infinite without any."""
        return min((1.0 / rate for rate in self.own_rates().values()), default=float("inf"))

    def check_step(self, max_step: float) -> None:
        """Refuses such of these sensors as read more often than the simulation steps [s].

        Raises:
            ScenarioError: Names the field, its rate and the largest one.
        """
        for field, rate in self.own_rates().items():
            check_rate(field, rate, max_step)

    def own_rates(self) -> dict[str, float]:
        """Readings per second of these sensors by their place in the section [Hz]."""
        rates = {f"{field}.rate": found.model().rate_hz for field, found in self._typed().items()}
        if self.pan_tilt is not None:
            rates["pan_tilt.rate"] = self.pan_tilt.rate
        if self.odometry is not None:
            rates["odometry.rate"] = self.odometry.rate
        return rates
