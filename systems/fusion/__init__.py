"""What a fusion of sensors is told and may read: of a servo's settings, and checks of them.

The filter itself is `estimators.SensorFusion`; here is what needs settings of camera, robot and
sensors together.
"""

from cdpr_drake.systems.fusion.calibration_findings import calibration_facts, found_calibrations
from cdpr_drake.systems.fusion.checks import check_sensor_fusion
from cdpr_drake.systems.fusion.readings import FusionReadings, fusion_ports, platform_camera
from cdpr_drake.systems.fusion.task import fusion_task, is_asked_for, steers

__all__ = [
    "FusionReadings", "calibration_facts", "check_sensor_fusion", "found_calibrations",
    "fusion_ports", "fusion_task", "is_asked_for", "platform_camera", "steers",
]  # fmt: skip
