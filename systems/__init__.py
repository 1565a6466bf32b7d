"""Drake blocks: cable forces, winches, cameras, detectors, servos, estimators, and their wiring."""

from cdpr_drake.systems.cable_forces import CableForces, CableForces_
from cdpr_drake.systems.cable_robot import CableRobot, automatic_step, holding_tensions
from cdpr_drake.systems.computed_torque import ComputedTorque, platform_dynamics
from cdpr_drake.systems.control_integration import ControlIntegration
from cdpr_drake.systems.counted_lengths import CountedLengths
from cdpr_drake.systems.feature_servo import FeatureServo
from cdpr_drake.systems.image_estimators import ConsecutiveImages, FirstImage, KnownObject
from cdpr_drake.systems.length_estimator import LengthEstimator
from cdpr_drake.systems.log_row import LogRow, pose_from_row, pose_row
from cdpr_drake.systems.measured_pose import MeasuredPose
from cdpr_drake.systems.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.motor_encoders import MotorEncoders
from cdpr_drake.systems.motor_winch import MotorWinch
from cdpr_drake.systems.platform_pose import PlatformPose, PlatformPose_
from cdpr_drake.systems.pose_estimator import KnownTag, PoseEstimator
from cdpr_drake.systems.pose_estimators import ESTIMATORS
from cdpr_drake.systems.pose_fusion import FusionTuning, Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.pose_sensor import PoseSensor
from cdpr_drake.systems.pose_tracking import PoseTracking
from cdpr_drake.systems.pose_trajectory_source import PoseTrajectorySource
from cdpr_drake.systems.projected_camera import ProjectedCamera
from cdpr_drake.systems.run_monitor import Outcome, RunMonitor, StopRules
from cdpr_drake.systems.scenario import Scenario, load_scenario
from cdpr_drake.systems.scenario_cables import CableSettings
from cdpr_drake.systems.scenario_damping import DampingSettings
from cdpr_drake.systems.scenario_files import all_scenario_names, scenario_kind, scenario_names
from cdpr_drake.systems.scenario_winches import WinchSettings, make_winches
from cdpr_drake.systems.servo_camera import scene_adder
from cdpr_drake.systems.servo_model import ServoModel, make_servo_model
from cdpr_drake.systems.sight import Sight
from cdpr_drake.systems.target_detector import TargetDetector
from cdpr_drake.systems.target_measurement import TargetMeasurement
from cdpr_drake.systems.tension_control import TensionControl, build_tension_control
from cdpr_drake.systems.tension_distributor import TensionDistributor
from cdpr_drake.systems.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.tension_scenario import TensionScenario, load_tension_scenario
from cdpr_drake.systems.tension_sensor import TensionSensor
from cdpr_drake.systems.ups_robot import UpsRobot
from cdpr_drake.systems.velocity_winch import VelocityWinch
from cdpr_drake.systems.visual_servo import VisualServo, build_visual_servo

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
