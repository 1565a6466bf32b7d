"""Where the robots that ship can work: static workspaces of the thesis, every kind, cross-checks.

Source: servoing thesis 1.3.3, figures 1.17 and 1.18; Gazebo thesis 2.6.
"""

from cdpr_drake.analyses.studies.workspaces.figures import FIGURES
from cdpr_drake.analyses.studies.workspaces.statements import JUDGES
from cdpr_drake.analyses.studies.workspaces.study import study_workspaces

__all__ = ["FIGURES", "JUDGES", "study_workspaces"]
