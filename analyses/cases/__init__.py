"""The servoing thesis' case studies: published configurations, run here and judged."""

from cdpr_drake.analyses.cases.case_3 import CASE_3
from cdpr_drake.analyses.cases.case_4 import CASE_4
from cdpr_drake.analyses.cases.case_result import run_case_study
from cdpr_drake.analyses.cases.case_study import CaseStudy, Configuration

CASE_STUDIES: tuple[CaseStudy, ...] = (CASE_3, CASE_4)
"""All case studies, in the order of the thesis."""

__all__ = ["CASE_STUDIES", "CaseStudy", "Configuration", "run_case_study"]
