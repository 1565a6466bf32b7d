"""Why a table is not met: bounds whose rows the printed numbers or the definition rule out.

A reason is computed, not told: the rows of a bound count as ruled out for a recipe if one of them

- prints more than any target, view and camera leaves with the recipe's cables (`excluded`);
- prints more than a row whose errors it contains (`nested_pairs`);
- prints less than a row that contains its errors, if the recipe moves exit points in common
  (`covering_pairs`).

A table is explained if the rows of all other bounds are met.
"""

from __future__ import annotations

from dataclasses import dataclass

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    NestedPair,
    covering_pairs,
    excluded,
    nested_pairs,
)
from cdpr_drake.analyses.studies.control_stability.recipes import (
    ANY_TARGET,
    BY_NAME,
    ROW,
    difference,
)
from cdpr_drake.analyses.studies.control_stability.tables import MET, published
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.summary import note_coarse
from cdpr_drake.analyses.studies.published.recipe_variants import (
    FULLY_CONSTRAINED,
    IN_USE,
    RECIPES,
    Recipe,
)
from cdpr_drake.analyses.studies.published.stability_tables import PublishedTable


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


def by_mean(runs: Runs) -> dict[str, Runs]:
    """Rows by recipe, the smallest mean over all rows first.

    Raises:
        MissingRuns: There are none yet.
    """
    apart = dict(runs(question=ROW).by("recipe"))
    return dict(sorted(apart.items(), key=lambda item: difference(item[1])))


def reasons_of(runs: Runs) -> list[TableReason]:
    """Of the tables that the recipe in use does not meet, and the best one.

    Raises:
        MissingRuns: There are no rows yet.
    """
    rows = by_mean(runs)
    limits = runs(question=ANY_TARGET) if runs.has(question=ANY_TARGET) else Runs(())
    return [
        reason
        for name in dict.fromkeys((IN_USE.name, *list(rows)[:1]))
        if name in rows
        for reason in table_reasons(RECIPES[name], rows[name], limits)
    ]


def table_reasons(recipe: Recipe, rows: Runs, limits: Runs) -> list[TableReason]:
    """Of each table that a recipe does not meet.

    Args:
        recipe: The recipe.
        rows: Its rows.
        limits: What any target leaves.
    """
    found = []
    for table, mine in rows.by("table"):
        mean = difference(mine)
        if mean <= MET:
            continue
        words = ruled_out(recipe, BY_NAME[table], limits)
        rest = difference(run for run in mine if run["bound"] not in words)
        found.append(TableReason(recipe.name, table, mean, words, rest))
    return found


def ruled_out(recipe: Recipe, table: PublishedTable, limits: Runs) -> dict[str, str]:
    """What rules rows of a table out for a recipe, in words, by bound."""
    words: dict[str, list[str]] = {}
    for run in limits:
        # Recipes have other cables for this robot alone.
        same = RECIPES[run["arrangement"]].anchors == recipe.anchors
        mine = run["table"] == table.name and (same or table.robot != FULLY_CONSTRAINED)
        if mine and excluded(run):
            words.setdefault(run["bound"], []).append(
                f"{run['value']:g} m prints {published(run):.1f}, any target leaves "
                f"{run['at_most_percent']:.1f}"
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


def reasons_table(runs: Runs) -> Table:
    """A line per bound that is ruled out.

    Raises:
        MissingRuns: There are no rows yet.
    """
    table = new_table(
        f"Tables above {MET:g} points, and which of their bounds are ruled out",
        ("recipe", "table", "bound", "what rules its rows out"), ("points", "other bounds"),
    )  # fmt: skip
    table.caption = (
        f"A table is explained if the rows of the other bounds are off by at most {MET:g} points."
    )
    for reason in reasons_of(runs):
        for bound, words in (reason.rows or {"none": "nothing was found"}).items():
            table.add_row(
                reason.recipe, reason.table, bound, words,
                f"{reason.mean:.1f}", f"{reason.rest:.1f}",
            )  # fmt: skip
    return note_coarse(table, runs)
