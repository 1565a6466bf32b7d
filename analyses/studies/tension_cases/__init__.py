"""Cases IX and X of the servoing thesis, cables that are slack at the start, and what follows:
winches by torque, and tension management beside trajectory tracking."""

from cdpr_drake.analyses.studies.framework.case_definition import CaseStudy
from cdpr_drake.analyses.studies.tension_cases.case_9 import CASE_9
from cdpr_drake.analyses.studies.tension_cases.case_9_torque import CASE_9_TORQUE
from cdpr_drake.analyses.studies.tension_cases.case_10 import CASE_10
from cdpr_drake.analyses.studies.tension_cases.tension_tracking import TENSION_TRACKING

TENSION_CASES: tuple[CaseStudy, ...] = (CASE_9, CASE_9_TORQUE, CASE_10, TENSION_TRACKING)
"""In the order of the thesis; then what follows from them."""

__all__ = ["TENSION_CASES"]
