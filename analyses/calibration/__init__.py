"""Calibration of a robot from a log: reads what was measured, asks, reports, writes a robot file.

A log is text with columns that bear their names and units, see `read_log`. What comes out is a
robot file that scenarios take as `perturbations.believed_robot`, and all numbers as JSON.

Source: see `cdpr_drake.calibration`.
"""

from cdpr_drake.analyses.calibration.asked import CalibrationTask, Sigmas, TagPlace
from cdpr_drake.analyses.calibration.campaign import (
    Campaign,
    calibrated_scenario,
    run_campaign,
    servo_again,
)
from cdpr_drake.analyses.calibration.held_poses import rest_poses
from cdpr_drake.analyses.calibration.log_file import CalibrationLog, read_log
from cdpr_drake.analyses.calibration.proposal import NextPoses, next_poses
from cdpr_drake.analyses.calibration.report import (
    calibration_dict,
    calibration_drawings,
    calibration_tables,
    write_calibration,
)
from cdpr_drake.analyses.calibration.robots import calibrated_robot, calibration_model
from cdpr_drake.analyses.calibration.tag_file import read_tags
from cdpr_drake.analyses.calibration.task import Calibration, calibrate
from cdpr_drake.analyses.calibration.tracker import shifted_log

__all__ = [
    "Calibration", "CalibrationLog", "CalibrationTask", "Campaign", "NextPoses", "Sigmas",
    "TagPlace", "calibrate", "calibrated_robot", "calibrated_scenario", "calibration_dict",
    "calibration_drawings", "calibration_model", "calibration_tables", "next_poses", "read_log",
    "read_tags", "rest_poses", "run_campaign", "servo_again", "shifted_log", "write_calibration",
]  # fmt: skip
