"""Why a table is not met: bounds whose rows the printed numbers or the definition rule out.

A reason is computed, not told: the rows of a bound count as ruled out for a recipe if one of them

- prints more than any target, view and camera leaves with the recipe's cables (`LimitRow`);
- prints more than a row whose errors it contains (`nested_pairs`);
- prints less than a row that contains its errors, if the recipe moves exit points in common
  (`covering_pairs`).

A table is explained if the rows of all other bounds are met.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    DIGIT,
    NestedPair,
    covering_pairs,
    nested_pairs,
)
from cdpr_drake.analyses.studies.control_stability.recipes import RULES, RecipeStudy
from cdpr_drake.analyses.studies.published.recipe_variants import FULLY_CONSTRAINED, RECIPES, Recipe
from cdpr_drake.analyses.studies.published.stability_tables import PublishedTable

MET = 5.0
"""A table whose mean absolute difference is not larger counts as met [points]."""


@dataclass(frozen=True)
class LimitRow:
    """A printed row and what any target leaves at most.

    Attributes:
        table: Name of the table.
        bound: Name of the bound.
        value: Its value [m].
        printed: Printed share [%].
        at_most: What is left by the largest of the volume's rules [%].
        arrangement: Name of the recipe whose anchor points were taken.
    """

    table: str
    bound: str
    value: float
    printed: float
    at_most: float
    arrangement: str = "present"

    @property
    def excluded(self) -> bool:
        """Whether more is printed than is left."""
        return self.printed > self.at_most + DIGIT


@dataclass(frozen=True)
class TableReason:
    """A table that a recipe does not meet.

    Attributes:
        recipe: Name of the recipe.
        table: Name of the table.
        mean: Mean absolute difference over all rows [points].
        rows: What rules rows out, in words, by bound.
        rest: Mean absolute difference over the rows of all other bounds [points].
    """

    recipe: str
    table: str
    mean: float
    rows: dict[str, str]
    rest: float

    @property
    def explained(self) -> bool:
        """Whether the rows of all other bounds are met."""
        return bool(self.rows) and self.rest <= MET


def table_reasons(
    one: RecipeStudy, tables: Sequence[PublishedTable], limits: Sequence[LimitRow]
) -> list[TableReason]:
    """Of each table that a recipe does not meet."""
    found = []
    for table in tables:
        mean = one.difference(RULES[0], table.name)
        if not mean > MET:
            continue
        rows = ruled_out(one.recipe, table, limits)
        rest = [
            abs(row.shares[RULES[0]] - row.published)
            for row in one.rows
            if row.table == table.name and row.bound not in rows
        ]
        found.append(TableReason(one.recipe.name, table.name, mean, rows, float(np.mean(rest))))
    return found


def ruled_out(recipe: Recipe, table: PublishedTable, limits: Sequence[LimitRow]) -> dict[str, str]:
    """What rules rows of a table out for a recipe, in words, by bound."""
    words: dict[str, list[str]] = {}
    for row in limits:
        # Recipes have other cables for this robot alone.
        same = RECIPES[row.arrangement].anchors == recipe.anchors
        if row.table == table.name and row.excluded and (same or table.robot != FULLY_CONSTRAINED):
            words.setdefault(row.bound, []).append(
                f"{row.value:g} m prints {row.printed:.1f}, any target leaves {row.at_most:.1f}"
            )
    pairs = [(pair, "more") for pair in nested_pairs(table) if pair.contradictory]
    if recipe.directions(table.robot, table.scheme, "r_A") == "common":
        pairs += [(pair, "less") for pair in covering_pairs(table) if pair.less]
    for pair, word in pairs:
        words.setdefault("r_A", []).append(pair_words(pair, word))
    return {bound: "; ".join(some) for bound, some in words.items()}


def pair_words(pair: NestedPair, word: str) -> str:
    """A pair of rows in words."""
    return (
        f"{pair.r_A:g} m prints {pair.first:.1f}, {word} than r_bp = {pair.r_bp:g} m with "
        f"{pair.second:.1f}"
    )


def reasons_table(reasons: Sequence[TableReason], quick: bool) -> Table:
    """A line per bound that is ruled out."""
    table = new_table(
        f"Tables above {MET:g} points, and which of their bounds are ruled out",
        ("recipe", "table", "bound", "what rules its rows out"), ("points", "other bounds"),
    )  # fmt: skip
    table.caption = (
        f"A table is explained if the rows of the other bounds are off by at most {MET:g} points."
    )
    if quick:
        table.caption += " Coarse grid."
    for reason in reasons:
        for bound, words in (reason.rows or {"none": "nothing was found"}).items():
            table.add_row(
                reason.recipe, reason.table, bound, words,
                f"{reason.mean:.1f}", f"{reason.rest:.1f}",
            )  # fmt: skip
    return table
