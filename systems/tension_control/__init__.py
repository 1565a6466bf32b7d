"""Control of cable tensions as Drake blocks: computed torque and distribution for dynamic control,
what takes up slack beside a visual servo, and visual servoing by torque.

Source: Gazebo thesis 6.1 and 6.2; servoing thesis 5.2.
"""

from cdpr_drake.systems.tension_control.computed_torque import ComputedTorque, platform_dynamics
from cdpr_drake.systems.tension_control.correction_laws import (
    AdaptiveGain,
    ConstantThreshold,
    CorrectionLaw,
    CorrectionReadings,
    ExpectedLength,
    FollowedDistribution,
    InsidePolygon,
    LengthThreshold,
    SeenSlackRate,
)
from cdpr_drake.systems.tension_control.management_settings import (
    ADAPTIVE,
    BY_LENGTH,
    CONSTANT,
    DISTRIBUTION,
    IMAGE,
    LENGTH,
    POLYGON,
    TensionManagement,
)
from cdpr_drake.systems.tension_control.pose_tracking import PoseTracking
from cdpr_drake.systems.tension_control.pose_trajectory_source import PoseTrajectorySource
from cdpr_drake.systems.tension_control.predictive_tensions import (
    PredictiveDistributor,
    PredictiveTensions,
)
from cdpr_drake.systems.tension_control.tension_corrector import TensionCorrector
from cdpr_drake.systems.tension_control.tension_distributor import TensionDistributor
from cdpr_drake.systems.tension_control.torque_controller import TorqueController
from cdpr_drake.systems.tension_control.torque_settings import SMALLEST_SLACK, TorqueControl

__all__ = [
    "ADAPTIVE", "BY_LENGTH", "CONSTANT", "DISTRIBUTION", "IMAGE", "LENGTH", "POLYGON",
    "SMALLEST_SLACK", "AdaptiveGain", "ComputedTorque", "ConstantThreshold", "CorrectionLaw",
    "CorrectionReadings", "ExpectedLength", "FollowedDistribution", "InsidePolygon",
    "LengthThreshold", "PoseTracking", "PoseTrajectorySource", "PredictiveDistributor",
    "PredictiveTensions", "SeenSlackRate", "TensionCorrector", "TensionDistributor",
    "TensionManagement", "TorqueControl", "TorqueController", "platform_dynamics",
]  # fmt: skip
