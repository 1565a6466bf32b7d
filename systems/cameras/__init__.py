"""Cameras as Drake blocks: rendered or projected, and the targets in front of them.

Every camera gives X_CO, found, and the target's marks, whether it detects them in an image or
projects them. `TARGETS` is the table of kinds of targets.
"""

from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.cameras.settings import PROJECTED, RENDERED, CameraSettings
from cdpr_drake.systems.cameras.target_detector import TargetDetector
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.target_settings import TargetSettings
from cdpr_drake.systems.cameras.targets import TARGETS, TargetPattern

__all__ = [
    "PROJECTED", "RENDERED", "TARGETS", "CameraSettings", "ProjectedCamera", "SceneTarget",
    "TargetDetector", "TargetMeasurement", "TargetPattern", "TargetSettings",
]  # fmt: skip
