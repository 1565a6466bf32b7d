"""Study: what the theses show on an example: a trajectory, polygons of tensions, what they cost.

Source: Gazebo thesis 6.2, figures 6.2 to 6.7; servoing thesis 1.3.4, figure 1.19.
"""

from cdpr_drake.analyses.studies.worked_examples.statements import JUDGES
from cdpr_drake.analyses.studies.worked_examples.study import WorkedExamples, study_worked_examples

__all__ = ["JUDGES", "WorkedExamples", "study_worked_examples"]
