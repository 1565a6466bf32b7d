"""Estimators of the platform's pose as Drake blocks.

`ESTIMATORS` is their table: a new one is a block and a row of it. Every estimator has the output
X_WP and inputs that bear the names of what it reads.

Source: servoing thesis 2.1 and 2.3, estimators 1 to 7; fusion: see `estimation.pose_filter`; of two
cameras: perspectives, and `estimation.sensor_filter`.
"""

from cdpr_drake.systems.estimators.control_integration import ControlIntegration
from cdpr_drake.systems.estimators.encoder_lengths import EncoderLengths
from cdpr_drake.systems.estimators.fusion_task import Eye, FusionTask
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
    SeenPlatform,
)
from cdpr_drake.systems.estimators.kinds import (
    ESTIMATORS,
    SENSOR_FUSION,
    EstimatorKind,
    EstimatorTask,
)
from cdpr_drake.systems.estimators.length_estimator import LengthEstimator
from cdpr_drake.systems.estimators.measured_pose import MeasuredPose, ShiftedPose
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator
from cdpr_drake.systems.estimators.pose_fusion import Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.estimators.sensor_fusion import MOTION_SIZE, SOURCES, SensorFusion
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings
from cdpr_drake.systems.estimators.settings import EstimatorSettings
from cdpr_drake.systems.estimators.tuning import (
    FusionSettings,
    KnownTagSettings,
    PlatformTagSettings,
)

__all__ = [
    "ESTIMATORS", "MOTION_SIZE", "SENSOR_FUSION", "SOURCES", "ConsecutiveImages",
    "ControlIntegration", "EncoderLengths", "EstimatorKind", "EstimatorSettings", "EstimatorTask",
    "Eye", "FirstImage", "FusionSettings", "FusionTask", "KnownObject", "KnownTag",
    "KnownTagSettings", "Landmark", "LengthEstimator", "MeasuredPose", "PlatformTagSettings",
    "PoseEstimator", "PoseFusion", "SeenObject", "SeenPlatform", "SensorFusion",
    "SensorFusionSettings", "ShiftedPose",
]  # fmt: skip
