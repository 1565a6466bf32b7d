from .all_recipes import study_recipes as study_recipes
from .figures import FIGURES as FIGURES
from .recipe_judges import RECIPE_CHECKS as RECIPE_CHECKS
from .recipes import study_recipe as study_recipe
from .statements import CHECKS as CHECKS
from .study import study_control_stability as study_control_stability
