"""What was published, as data: by section, tables of stability, the recipe that repeats them.

`published_registers` has every figure, table and statement of the theses with a result, and which
study's statement answers it.
"""

from cdpr_drake.analyses.published.recipe_choices import CHOICES, RecipeChoice, chosen_on
from cdpr_drake.analyses.published.recipe_variants import (
    EXCHANGE,
    EXCHANGED_CABLES,
    FULLY_CONSTRAINED,
    IN_USE,
    OTHER_ANCHORS,
    PRESENT,
    RECIPES,
    Recipe,
    arranged_anchors,
    exchanged_anchors,
)
from cdpr_drake.analyses.published.register import (
    PublishedItem,
    PublishedSection,
    Register,
    published_registers,
    read_register,
)
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
    "BASELINE_VALUES", "CHOICES", "DRAWS", "EXCHANGE", "EXCHANGED_CABLES",
    "FULLY_CONSTRAINED", "IN_USE", "OTHER_ANCHORS",
    "PRESENT", "RECIPE", "RECIPES", "TABLES",
    "PublishedItem", "PublishedSection", "PublishedTable", "Recipe", "RecipeChoice", "Register",
    "arranged_anchors", "chosen_on", "exchanged_anchors", "published_registers", "read_register",
    "recipe_bounds", "recipe_case", "recipe_grid", "recipe_options", "single_bounds",
]  # fmt: skip
