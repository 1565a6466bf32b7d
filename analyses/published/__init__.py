"""What was published, as data: tables of the theses, and the recipe that repeats them."""

from cdpr_drake.analyses.published.stability_recipe import (
    DRAWS,
    RECIPE,
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
    single_bounds,
)
from cdpr_drake.analyses.published.stability_tables import BASELINE_VALUES, TABLES, PublishedTable

__all__ = [
    "BASELINE_VALUES", "DRAWS", "RECIPE", "TABLES", "PublishedTable", "recipe_bounds",
    "recipe_case", "recipe_grid", "recipe_options", "single_bounds",
]  # fmt: skip
