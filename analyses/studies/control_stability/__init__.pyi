from .recipes import recipe_study as recipe_study
from .study import STUDY as STUDY
