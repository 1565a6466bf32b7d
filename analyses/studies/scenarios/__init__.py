"""Study: every scenario that comes with the package, as it ships, beside what its file expects.

The full form takes each file as it stands, with rendered images where it says so; the quick form
projects targets and cuts what is long.
"""

from cdpr_drake.analyses.studies.scenarios.statements import JUDGES
from cdpr_drake.analyses.studies.scenarios.study import (
    FIGURES,
    ScenariosStudy,
    study_scenarios,
)

__all__ = ["FIGURES", "JUDGES", "ScenariosStudy", "study_scenarios"]
