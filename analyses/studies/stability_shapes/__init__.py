"""Study: shapes of the servoing thesis' control stability workspaces, drawn as the thesis does.

Source: servoing thesis 3.3, 3.4.2 and 4.3.1, figures 3.8, 3.10, 3.13, 3.15, 3.17, 3.20, 3.22, 3.25,
3.27, 3.32, 4.2.
"""

from cdpr_drake.analyses.studies.stability_shapes.figures import FIGURES
from cdpr_drake.analyses.studies.stability_shapes.statements import JUDGES
from cdpr_drake.analyses.studies.stability_shapes.study import study_stability_shapes

__all__ = ["FIGURES", "JUDGES", "study_stability_shapes"]
