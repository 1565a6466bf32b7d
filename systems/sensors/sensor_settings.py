"""Scenario section `sensors`: what estimators read, and its sections, see `systems.sections`."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.models.sensor_catalogue import inertial_sensor_names, load_inertial_sensor
from cdpr_drake.schema.declarations import In, OneOf, filled, settings
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.sections import with_sections
from cdpr_drake.systems.sensors.inertial_sensor import InertialMotion
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings, TypedSensor


def _origin() -> Pose:
    return Pose(position=np.zeros(3))


@settings
class InertialSettings(TypedSensor):
    """An inertial measurement unit on the platform, logged as specific_force, angular_velocity."""

    columns: ClassVar = {
        "specific_force": ("x_m_s2", "y_m_s2", "z_m_s2"),
        "angular_velocity": ("x_rad_s", "y_rad_s", "z_rad_s"),
        "imu_biases": ("ax_m_s2", "ay_m_s2", "az_m_s2", "wx_rad_s", "wy_rad_s", "wz_rad_s"),
    }
    load = staticmethod(load_inertial_sensor)

    type: Annotated[str, OneOf(inertial_sensor_names()), "Type of the catalogue."] = "adis16448"
    pose: Annotated[Pose, "Pose of its frame S on the platform."] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Readings; null: the type's."] = None

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds it, unless an estimator that reads it has."""
        name = f"{blocks.prefix}imu"
        sensor = add_imu(builder, blocks.block, self, seed=settings.seed, name=name)
        return {quantity: sensor.GetOutputPort(quantity) for quantity in self.columns}


def add_imu(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: InertialSettings,
    *,
    seed: int = 0,
    name: str = "imu",
) -> InertialMotion:
    """Adds an inertial measurement unit to a robot, or returns that of this name; its settings are
    those of the section `sensors`, its noise depends on the seed."""
    if builder.HasSubsystemNamed(name):
        there: InertialMotion = builder.GetSubsystemByName(name)
        return there
    sensor = builder.AddNamedSystem(
        name,
        InertialMotion(
            settings.model(), settings.pose.transform(),
            body=int(robot.in_plant.body_index),
            gravity=robot.robot.gravity_vector(), seed=seed,
        ),
    )  # fmt: skip
    for port in ("X_WP", "body_velocities", "body_accelerations"):
        builder.Connect(robot.GetOutputPort(port), sensor.GetInputPort(port))
    return sensor


@settings
@with_sections("sensors")
class SensorSuite(SensorSettings):
    """Sensors of the robot: those that estimators read, and such as look round, which are logged.

    What looks round has its own rate, at most that of its type, and at most one reading per
    integration step.
    """

    imu: Annotated[InertialSettings | None, "Inertial measurement unit; null: none."] = None
