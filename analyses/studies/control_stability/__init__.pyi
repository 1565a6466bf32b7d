from .all_recipes import study_recipes as study_recipes
from .recipe_judges import RECIPE_CHECKS as RECIPE_CHECKS
from .recipes import study_recipe as study_recipe
from .study import STUDY as STUDY
