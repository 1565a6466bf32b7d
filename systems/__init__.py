"""Drake blocks of cable robots, their settings, and what wires them into diagrams.

Rooms: `robots`, `cameras`, `servos`, `estimators`, `tension_control`, `sensors`, `monitoring`,
`worlds` hold blocks, each with its settings beside it; `scenarios` composes settings into files,
`diagrams` adds blocks to a builder. What one needs for a diagram of one's own is exported here.
Ports are words; each block's class has a table of them. Vectors of m are in the order of the
robot's cables.
"""

from cdpr_drake.systems.cameras import (
    TARGETS,
    CameraSettings,
    ProjectedCamera,
    TargetDetector,
    TargetMeasurement,
    TargetSettings,
)
from cdpr_drake.systems.diagrams import (
    SCENARIO_SCHEMAS,
    Addition,
    TensionControl,
    TensionControlSettings,
    VisualServo,
    VisualServoBlocks,
    add_camera,
    add_estimator,
    add_target,
    add_tension_control,
    add_visual_servo,
    believed_robot,
    build_tension_control,
    build_visual_servo,
    load_scenario,
)
from cdpr_drake.systems.estimators import (
    ESTIMATORS,
    ConsecutiveImages,
    ControlIntegration,
    EncoderLengths,
    EstimatorKind,
    EstimatorSettings,
    EstimatorTask,
    FirstImage,
    FusionSettings,
    KnownObject,
    KnownTag,
    LengthEstimator,
    MeasuredPose,
    PoseEstimator,
    PoseFusion,
    ShiftedPose,
)
from cdpr_drake.systems.monitoring import (
    CablePictures,
    LogRow,
    MeshcatCables,
    Outcome,
    RunMonitor,
    StopRules,
    add_log,
)
from cdpr_drake.systems.robots import (
    CableForces,
    CableForces_,
    CableRobot,
    CableRobotPorts,
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    MotorWinch,
    PlatformPose,
    PlatformPose_,
    TensionDrivenCables,
    UpsRobot,
    VelocityWinch,
    WinchSettings,
    add_cable_robot,
    automatic_step,
    holding_tensions,
)
from cdpr_drake.systems.scenarios import (
    Scenario,
    TensionScenario,
    VisualServoSettings,
    all_scenario_names,
    scenario_kind,
    scenario_names,
)
from cdpr_drake.systems.sensors import (
    SENSORS,
    MotorEncoders,
    PoseSensor,
    SensorReadings,
    SensorSettings,
    TensionSensor,
)
from cdpr_drake.systems.servos import (
    SCHEMES,
    ControllerSettings,
    FeatureServo,
    OpenLoopServo,
    Perturbations,
)
from cdpr_drake.systems.tension_control import (
    ComputedTorque,
    PoseTracking,
    PoseTrajectorySource,
    TensionDistributor,
)
from cdpr_drake.systems.worlds import (
    ContactSettings,
    GroundSettings,
    ObstacleSettings,
    World,
    WorldClearances,
    WorldInScene,
    WorldSettings,
    add_contact,
    add_world_meters,
    make_world,
)

__all__ = [
    "ESTIMATORS", "SCENARIO_SCHEMAS", "SCHEMES", "SENSORS", "TARGETS", "Addition", "CableForces",
    "CableForces_", "CablePictures", "CableRobot", "CableRobotPorts", "CableRobotSettings",
    "CableSettings", "CameraSettings", "ComputedTorque", "ConsecutiveImages", "ContactSettings",
    "ControlIntegration", "ControllerSettings", "DampingSettings", "EncoderLengths",
    "EstimatorKind", "EstimatorSettings", "EstimatorTask", "FeatureServo", "FirstImage",
    "FusionSettings", "GroundSettings", "KnownObject", "KnownTag", "LengthEstimator", "LogRow",
    "MeasuredPose", "MeshcatCables", "MotorEncoders", "MotorWinch", "ObstacleSettings",
    "OpenLoopServo", "Outcome", "Perturbations", "PlatformPose", "PlatformPose_", "PoseEstimator",
    "PoseFusion", "PoseSensor", "PoseTracking", "PoseTrajectorySource", "ProjectedCamera",
    "RunMonitor", "Scenario", "SensorReadings", "SensorSettings", "ShiftedPose", "StopRules",
    "TargetDetector", "TargetMeasurement", "TargetSettings", "TensionControl",
    "TensionControlSettings", "TensionDistributor", "TensionDrivenCables", "TensionScenario",
    "TensionSensor", "UpsRobot", "VelocityWinch", "VisualServo", "VisualServoBlocks",
    "VisualServoSettings", "WinchSettings", "World", "WorldClearances", "WorldInScene",
    "WorldSettings", "add_cable_robot", "add_camera", "add_contact", "add_estimator", "add_log",
    "add_target", "add_tension_control", "add_visual_servo", "add_world_meters",
    "all_scenario_names", "automatic_step", "believed_robot", "build_tension_control",
    "build_visual_servo", "holding_tensions", "load_scenario", "make_world", "scenario_kind",
    "scenario_names",
]  # fmt: skip
