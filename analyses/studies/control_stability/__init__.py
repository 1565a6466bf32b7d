"""The servoing thesis' control stability workspaces, computed again beside the printed ones.

Source: servoing thesis 3.3, tables A.8 to A.18.
"""

from cdpr_drake.analyses.studies.control_stability.all_recipes import study_recipes
from cdpr_drake.analyses.studies.control_stability.figures import FIGURES
from cdpr_drake.analyses.studies.control_stability.recipe_judges import RECIPE_JUDGES
from cdpr_drake.analyses.studies.control_stability.recipes import study_recipe
from cdpr_drake.analyses.studies.control_stability.statements import JUDGES
from cdpr_drake.analyses.studies.control_stability.study import study_control_stability

__all__ = [
    "FIGURES", "JUDGES", "RECIPE_JUDGES", "study_control_stability", "study_recipe",
    "study_recipes",
]  # fmt: skip
