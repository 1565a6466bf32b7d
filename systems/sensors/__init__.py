"""Sensors beside cameras as Drake blocks: tensions, motor encoders, poses from outside.

`SENSORS` is their table. Readings carry bias, noise, resolution and rate of a type of the
catalogue, repeatable by a seed.
"""

from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.readings import READINGS, SensorReadings
from cdpr_drake.systems.sensors.settings import SENSORS, SensorSettings
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor

__all__ = [
    "READINGS", "SENSORS", "MotorEncoders", "PoseSensor", "SensorReadings", "SensorSettings",
    "TensionSensor",
]  # fmt: skip
