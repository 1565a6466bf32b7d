"""Study: what moving points is worth: ACROBOT for wrenches to resist, CAROCA for visual servoing.

Exit points move by up to 10 cm, anchor points of CAROCA by up to 5 cm, with the half-turn symmetry
of both robots kept; what was gained is proven, not taken from the search.
"""

from cdpr_drake.analyses.studies.design.study import DesignStudy, study_design

__all__ = ["DesignStudy", "study_design"]
