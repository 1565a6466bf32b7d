"""The Gazebo thesis' comparison of tension methods, repeated.

Source: Gazebo thesis 6.2 and 6.3.
"""

from cdpr_drake.analyses.studies.tension_methods.coverage import cover
from cdpr_drake.analyses.studies.tension_methods.figures import FIGURES, coverage_figure
from cdpr_drake.analyses.studies.tension_methods.statements import JUDGES
from cdpr_drake.analyses.studies.tension_methods.study import study_tension_methods

__all__ = ["FIGURES", "JUDGES", "cover", "coverage_figure", "study_tension_methods"]
