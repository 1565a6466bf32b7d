"""Study: what moving points is worth: ACROBOT for wrenches to resist, CAROCA for visual servoing.

Exit points of each move by up to 10 cm; what was gained is proven, not taken from the search.
"""

from cdpr_drake.analyses.studies.design.study import DesignStudy, study_design

__all__ = ["DesignStudy", "study_design"]
