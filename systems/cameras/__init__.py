"""Cameras as Drake blocks: rendered or projected, and the targets in front of them.

Every camera gives X_CO, found, and the target's marks, whether it detects them in an image, in a
window of it, or projects them. `TARGETS` is the table of kinds of targets.
"""

from cdpr_drake.systems.cameras.cable_camera import CableCamera
from cdpr_drake.systems.cameras.camera_checks import check_camera
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.region_camera import RegionCamera
from cdpr_drake.systems.cameras.scene_picture import SceneCamera
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.cameras.settings import PROJECTED, REGION, RENDERED, CameraSettings
from cdpr_drake.systems.cameras.target_detector import TargetDetector
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.target_settings import TargetSettings
from cdpr_drake.systems.cameras.targets import TARGETS, TargetPattern

__all__ = [
    "PROJECTED", "REGION", "RENDERED", "TARGETS", "CableCamera", "CameraSettings",
    "ProjectedCamera", "RegionCamera", "SceneCamera", "SceneTarget", "TargetDetector",
    "TargetMeasurement", "TargetPattern", "TargetSettings", "check_camera",
]  # fmt: skip
