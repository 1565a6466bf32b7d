"""The servoing thesis' case studies of pose estimation and servoing, I to VIII and A.6."""

from cdpr_drake.analyses.studies.case_studies import (
    case_1,
    case_2,
    case_3,
    case_4,
    case_5,
    case_6,
    case_7,
    case_8,
    case_a6,
)

CASE_STUDIES = tuple(
    case.STUDY for case in (case_1, case_2, case_3, case_4, case_5, case_6, case_7, case_8, case_a6)
)
"""In the order of the thesis."""

__all__ = ["CASE_STUDIES"]
