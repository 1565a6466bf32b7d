"""The servoing thesis' case studies: published configurations, run here and judged."""

from cdpr_drake.analyses.studies.cases.case_1 import CASE_1
from cdpr_drake.analyses.studies.cases.case_2 import CASE_2
from cdpr_drake.analyses.studies.cases.case_3 import CASE_3
from cdpr_drake.analyses.studies.cases.case_4 import CASE_4
from cdpr_drake.analyses.studies.cases.case_5 import CASE_5
from cdpr_drake.analyses.studies.cases.case_6 import CASE_6
from cdpr_drake.analyses.studies.cases.case_7 import CASE_7
from cdpr_drake.analyses.studies.cases.case_8 import CASE_8
from cdpr_drake.analyses.studies.cases.case_9 import CASE_9
from cdpr_drake.analyses.studies.cases.case_9_torque import CASE_9_TORQUE
from cdpr_drake.analyses.studies.cases.case_10 import CASE_10
from cdpr_drake.analyses.studies.cases.case_a6 import CASE_A6
from cdpr_drake.analyses.studies.cases.definition import CaseStudy, Configuration
from cdpr_drake.analyses.studies.cases.study import run_case_study
from cdpr_drake.analyses.studies.cases.tension_tracking import TENSION_TRACKING

CASE_STUDIES: tuple[CaseStudy, ...] = (
    CASE_1,
    CASE_2,
    CASE_3,
    CASE_4,
    CASE_5,
    CASE_6,
    CASE_7,
    CASE_8,
    CASE_9,
    CASE_9_TORQUE,
    CASE_10,
    CASE_A6,
    TENSION_TRACKING,
)
"""All case studies, in the order of the thesis; then what follows from them."""

__all__ = ["CASE_STUDIES", "CaseStudy", "Configuration", "run_case_study"]
