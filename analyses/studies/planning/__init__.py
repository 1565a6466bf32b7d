"""The study of planned motions: time-optimal along ten paths, against a convex program of its own.

The convex program shares nothing with the planner but the limits.
"""

from cdpr_drake.analyses.studies.planning.convex_timing import convex_time
from cdpr_drake.analyses.studies.planning.study import PlanningStudy, study_planning

__all__ = ["PlanningStudy", "convex_time", "study_planning"]
