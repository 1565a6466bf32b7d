"""Drake blocks: cable forces, winches, cameras, detectors, servos, estimators, and their wiring."""

from cdpr_drake.systems.cameras.camera_mounting import Sight
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_detector import TargetDetector
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.diagrams.believed_robot import make_servo_model
from cdpr_drake.systems.diagrams.camera import scene_adder
from cdpr_drake.systems.diagrams.estimator_kinds import ESTIMATORS
from cdpr_drake.systems.diagrams.load import load_scenario, load_tension_scenario
from cdpr_drake.systems.diagrams.tension_control import TensionControl, build_tension_control
from cdpr_drake.systems.diagrams.visual_servo import VisualServo, build_visual_servo
from cdpr_drake.systems.estimators.control_integration import ControlIntegration
from cdpr_drake.systems.estimators.counted_lengths import CountedLengths
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
)
from cdpr_drake.systems.estimators.length_estimator import LengthEstimator
from cdpr_drake.systems.estimators.measured_pose import MeasuredPose
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator
from cdpr_drake.systems.estimators.pose_fusion import FusionTuning, Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.monitoring.log_row import LogRow, pose_from_row, pose_row
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules
from cdpr_drake.systems.robots.cable_forces import CableForces, CableForces_
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step, holding_tensions
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.platform_pose import PlatformPose, PlatformPose_
from cdpr_drake.systems.robots.settings import CableSettings, DampingSettings, WinchSettings
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.robots.ups_robot import UpsRobot
from cdpr_drake.systems.robots.velocity_winch import VelocityWinch
from cdpr_drake.systems.robots.winches import make_winches
from cdpr_drake.systems.scenarios.files import all_scenario_names, scenario_kind, scenario_names
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor
from cdpr_drake.systems.servos.believed_robot import ServoModel
from cdpr_drake.systems.servos.feature_servo import FeatureServo
from cdpr_drake.systems.tension_control.computed_torque import ComputedTorque, platform_dynamics
from cdpr_drake.systems.tension_control.pose_tracking import PoseTracking
from cdpr_drake.systems.tension_control.pose_trajectory_source import PoseTrajectorySource
from cdpr_drake.systems.tension_control.tension_distributor import TensionDistributor

__all__ = [
    "ESTIMATORS",
    "CableForces",
    "CableForces_",
    "CablePictures",
    "CableRobot",
    "CableSettings",
    "ComputedTorque",
    "ConsecutiveImages",
    "ControlIntegration",
    "CountedLengths",
    "DampingSettings",
    "FeatureServo",
    "FirstImage",
    "FusionTuning",
    "KnownObject",
    "KnownTag",
    "Landmark",
    "LengthEstimator",
    "LogRow",
    "MeasuredPose",
    "MeshcatCables",
    "MotorEncoders",
    "MotorWinch",
    "Outcome",
    "PlatformPose",
    "PlatformPose_",
    "PoseEstimator",
    "PoseFusion",
    "PoseSensor",
    "PoseTracking",
    "PoseTrajectorySource",
    "ProjectedCamera",
    "RunMonitor",
    "Scenario",
    "SeenObject",
    "ServoModel",
    "Sight",
    "StopRules",
    "TargetDetector",
    "TargetMeasurement",
    "TensionControl",
    "TensionDistributor",
    "TensionDrivenCables",
    "TensionScenario",
    "TensionSensor",
    "UpsRobot",
    "VelocityWinch",
    "VisualServo",
    "WinchSettings",
    "all_scenario_names",
    "automatic_step",
    "build_tension_control",
    "build_visual_servo",
    "holding_tensions",
    "load_scenario",
    "load_tension_scenario",
    "make_servo_model",
    "make_winches",
    "platform_dynamics",
    "pose_from_row",
    "pose_row",
    "scenario_kind",
    "scenario_names",
    "scene_adder",
]
