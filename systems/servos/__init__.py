"""Visual servos as Drake blocks, their schemes and settings.

`SCHEMES` is the table of schemes: a new one is a class of features and a row of it.

Source: servoing thesis 1.4 and 4.2.
"""

from cdpr_drake.systems.servos.feature_servo import (
    MODE_PORT,
    FeatureServo,
    control_step,
    make_sighting,
)
from cdpr_drake.systems.servos.open_loop_servo import OpenLoopServo, open_loop_plan
from cdpr_drake.systems.servos.open_loop_settings import OpenLoopSettings
from cdpr_drake.systems.servos.perturbation_settings import Perturbations, PoseShift
from cdpr_drake.systems.servos.planned_pose_servo import PlannedPoseServo
from cdpr_drake.systems.servos.planned_pose_settings import PosePlanSettings
from cdpr_drake.systems.servos.schemes import (
    SCHEMES,
    FeatureSettings,
    ideal_sighting,
    make_features,
)
from cdpr_drake.systems.servos.settings import (
    ControllerSettings,
    FeatureTrajectory,
    NextTask,
    PartitionSettings,
    SwitchSettings,
)

__all__ = [
    "MODE_PORT", "SCHEMES", "ControllerSettings", "FeatureServo", "FeatureSettings",
    "FeatureTrajectory", "NextTask", "OpenLoopServo", "OpenLoopSettings", "PartitionSettings",
    "Perturbations", "PlannedPoseServo", "PosePlanSettings", "PoseShift", "SwitchSettings",
    "control_step", "ideal_sighting", "make_features", "make_sighting", "open_loop_plan",
]  # fmt: skip
