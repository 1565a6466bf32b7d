"""Sensors that look at the world and at motion, as Drake blocks.

Laser scanners and beams, an inertial measurement unit, a depth camera, a head on two joints,
odometry of the mobile robot; `add_looking_sensors` adds those of a scenario's section `sensors`.
Each has its own rate and its own stream of random numbers, repeatable by a seed. Frames: S of a
sensor (x ahead, y to the left), C of a camera (z ahead, y down), H of a head, B of what carries it.

Source: each block names its own.
"""

from cdpr_drake.systems.perception.blocks import LookingSensors, add_imu, add_looking_sensors
from cdpr_drake.systems.perception.depth_at_points import DepthAtPoints
from cdpr_drake.systems.perception.depth_sensor import (
    DepthSensor,
    binned,
    depth_pinhole,
    pixel_directions,
)
from cdpr_drake.systems.perception.inertial_motion import InertialMotion
from cdpr_drake.systems.perception.inertial_sensor import InertialSensor
from cdpr_drake.systems.perception.pan_tilt import PanTilt, PanTiltJoints, head_pose
from cdpr_drake.systems.perception.range_sensor import RangeSensor
from cdpr_drake.systems.perception.scene_shapes import ROLES, SceneShapes
from cdpr_drake.systems.perception.settings import (
    DepthSettings,
    InertialSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
    SensorSuite,
)
from cdpr_drake.systems.perception.wheel_odometry import WheelModel, WheelOdometry, arc_end

__all__ = [
    "ROLES", "DepthAtPoints", "DepthSensor", "DepthSettings", "InertialMotion", "InertialSensor",
    "InertialSettings", "LookingSensors", "OdometrySettings", "PanTilt", "PanTiltJoints",
    "PanTiltSettings", "RangeSensor", "RangeSettings", "SceneShapes", "SensorSuite", "WheelModel",
    "WheelOdometry", "add_imu", "add_looking_sensors", "arc_end", "binned", "depth_pinhole",
    "head_pose", "pixel_directions",
]  # fmt: skip
