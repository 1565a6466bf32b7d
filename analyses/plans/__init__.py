"""Planned motions of a robot: paths from files, its limits, the plan on the simulated robot.

Limits are those of the robot file: tensions, rated speed and torque of the motors; a share of them
is left to the feedback that tracks the plan.
"""

from cdpr_drake.analyses.plans.figures import phase_figure, plan_pictures
from cdpr_drake.analyses.plans.free_figures import distance_figure, free_pictures, limits_figure
from cdpr_drake.analyses.plans.free_motion import LEAST, NEAREST, FreeSettings, plan_free_motion
from cdpr_drake.analyses.plans.free_results import FreeRun
from cdpr_drake.analyses.plans.path_files import COLUMNS, G_CODE, PathFile, read_path
from cdpr_drake.analyses.plans.results import PlanRun
from cdpr_drake.analyses.plans.robot_task import (
    CORNERS,
    RESERVE,
    TOLERANCE,
    LimitSettings,
    length_scale,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.plans.tracking import TrackedPlan, track_plan

__all__ = [
    "COLUMNS", "CORNERS", "G_CODE", "LEAST", "NEAREST", "RESERVE", "TOLERANCE", "FreeRun",
    "FreeSettings", "LimitSettings", "PathFile", "PlanRun", "TrackedPlan", "distance_figure",
    "free_pictures", "length_scale", "limits_figure", "make_path", "path_task", "phase_figure",
    "plan_free_motion", "plan_pictures", "read_path", "robot_limits", "track_plan",
]  # fmt: skip
