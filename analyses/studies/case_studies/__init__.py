"""The servoing thesis' case studies of pose estimation and servoing, I to VIII and A.6."""

from cdpr_drake.analyses.studies.case_studies.case_1 import CASE_1
from cdpr_drake.analyses.studies.case_studies.case_2 import CASE_2
from cdpr_drake.analyses.studies.case_studies.case_3 import CASE_3
from cdpr_drake.analyses.studies.case_studies.case_4 import CASE_4
from cdpr_drake.analyses.studies.case_studies.case_5 import CASE_5
from cdpr_drake.analyses.studies.case_studies.case_6 import CASE_6
from cdpr_drake.analyses.studies.case_studies.case_7 import CASE_7
from cdpr_drake.analyses.studies.case_studies.case_8 import CASE_8
from cdpr_drake.analyses.studies.case_studies.case_a6 import CASE_A6
from cdpr_drake.analyses.studies.framework.case_definition import CaseStudy

CASE_STUDIES: tuple[CaseStudy, ...] = (
    CASE_1,
    CASE_2,
    CASE_3,
    CASE_4,
    CASE_5,
    CASE_6,
    CASE_7,
    CASE_8,
    CASE_A6,
)
"""In the order of the thesis."""

__all__ = ["CASE_STUDIES"]
