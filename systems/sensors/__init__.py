"""Sensors beside cameras as Drake blocks: tensions, motor encoders, poses from outside.

`SENSORS` is their table. Readings carry bias, noise, resolution and rate of a type of the
catalogue, repeatable by a seed.
"""

from cdpr_drake.systems.sensors.kinds import IDEAL, SENSORS, SensorKind
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.readings import SensorReadings, check_rate, make_sensor
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor
from cdpr_drake.systems.sensors.settings import SensorSettings
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor

__all__ = [
    "IDEAL", "SENSORS", "MotorEncoders", "PoseSensor", "SampledSensor", "SensorKind",
    "SensorReadings", "SensorSettings", "TensionSensor", "check_rate", "make_sensor",
]  # fmt: skip
