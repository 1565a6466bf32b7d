"""Cases IX and X of the servoing thesis, cables that are slack at the start, and what follows:
winches by torque, and tension management beside trajectory tracking."""

from cdpr_drake.analyses.studies.tension_cases import (
    case_9,
    case_9_torque,
    case_10,
    tension_tracking,
)

TENSION_CASES = tuple(case.STUDY for case in (case_9, case_9_torque, case_10, tension_tracking))
"""In the order of the thesis; then what follows from them."""

__all__ = ["TENSION_CASES"]
