"""Every recipe on every printed row, and what the printed rows cannot be, whatever is chosen."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.control_stability.arrangements import arrangement_cases
from cdpr_drake.analyses.studies.control_stability.exchanges import exchange_cases
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    covering_pairs,
    excluded,
    limit_cases,
    limit_row,
    nested_pairs,
)
from cdpr_drake.analyses.studies.control_stability.recipe_statements import CHECKS
from cdpr_drake.analyses.studies.control_stability.recipes import (
    ANY_TARGET,
    ARRANGED,
    CHUNK,
    EXCHANGED,
    ROW,
    box_row,
    difference,
    mean_differences,
    points_words,
    recipe_as_dict,
    recipe_cases,
    recipe_row,
)
from cdpr_drake.analyses.studies.control_stability.table_reasons import (
    reasons_of,
    reasons_table,
)
from cdpr_drake.analyses.studies.control_stability.tables import published
from cdpr_drake.analyses.studies.framework.runs import Row, Runs
from cdpr_drake.analyses.studies.framework.study import Arrays, Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import note_coarse
from cdpr_drake.analyses.studies.published.recipe_variants import RECIPES
from cdpr_drake.analyses.studies.published.stability_tables import TABLES


def cases(form: Form) -> Iterator[Case]:
    """All recipes on all rows, and what they are held against; in the quick form of A.11 alone, on
    coarse grids."""
    yield from recipe_cases(RECIPES.values(), form)
    yield from limit_cases(form)
    yield from arrangement_cases(form)
    yield from exchange_cases(form)


ROWS: Mapping[str, Callable[[Case, Arrays], Row]] = {
    ROW: recipe_row, ANY_TARGET: limit_row, ARRANGED: box_row, EXCHANGED: box_row,
}  # fmt: skip
"""What gives the row of a case, by its question."""


def row(case: Case, arrays: Arrays) -> Row:
    """The row of a case."""
    return ROWS[case.keys["question"]](case, arrays)


def means_table(runs: Runs, words: str, fitted: bool | None) -> Table:
    """Means by recipe and table.

    Args:
        runs: Of the study.
        words: Which rows.
        fitted: Those in sight when the study's recipe was chosen, those that were not, or all.

    Raises:
        MissingRuns: There are no rows yet.
    """
    rows = runs(question=ROW)
    names = list(rows.counts("table"))
    table = new_table(
        f"Mean absolute difference to the printed shares [points], {words}",
        ("recipe",), (*names, "all"),
    )  # fmt: skip
    sight = "; ".join(f"{name}: {one.sight}" for name, one in RECIPES.items() if one.sight)
    table.caption = f"Chosen with more rows in sight: {sight or 'none'}."
    for name, some in rows.by("recipe"):
        means = [difference(some, table=asked, fitted=fitted) for asked in (*names, None)]
        table.add_row(name, *points_words(means))
    first = [run for run in rows.rows if run["recipe"] == rows.rows[0]["recipe"]]
    counts = [
        sum(fitted in (None, run["fitted"]) and asked in (None, run["table"]) for run in first)
        for asked in (*names, None)
    ]
    table.add_row("rows", *map(str, counts))
    return note_coarse(table, runs)


def limits_table(runs: Runs) -> Table:
    """Rows that print more than any target leaves.

    Raises:
        MissingRuns: There are no rows yet.
    """
    table = new_table(
        "Rows that print more than any target, view or camera leaves where each point is wrong "
        "within its own sphere; share of the full workspace in per cent",
        ("table", "anchors", "row"), ("printed", "at most"),
    )  # fmt: skip
    table.caption = "At most: the largest by all rules of the volume."
    for run in runs(question=ANY_TARGET):
        if excluded(run):
            table.add_row(
                run["table"], run["arrangement"], f"{run['bound']} = {run['value']:g} m",
                f"{published(run):.1f}", f"{run['at_most_percent']:.1f}",
            )  # fmt: skip
    return note_coarse(table, runs, "few poses decide.")


def pairs_table(runs: Runs) -> Table:
    """Printed rows that say something of each other; of no run."""
    table = new_table(
        "Printed rows of exit points beside rows of the platform's place, share in per cent",
        ("table", "row", "beside", "what it says"), ("printed", "beside it"),
    )  # fmt: skip
    table.caption = "From the printed numbers alone."
    for asked in TABLES:
        told = [(pair, "contradiction: leaves more") for pair in nested_pairs(asked)
                if pair.contradictory]  # fmt: skip
        told += [(pair, "not a common shift") for pair in covering_pairs(asked) if pair.less]
        for pair, words in told:
            table.add_row(
                pair.table, f"r_A = {pair.r_A:g} m", f"r_bp = {pair.r_bp:g} m", words,
                f"{pair.first:.1f}", f"{pair.second:.1f}",
            )  # fmt: skip
    return table


def numbers(runs: Runs) -> Mapping[str, Any]:
    """Means by recipe, rule and table; printed rows beside each other; why tables are not met.

    Raises:
        MissingRuns: There are no rows yet.
    """
    return {
        "mean_absolute_difference_points": {
            name: mean_differences(rows) for name, rows in runs(question=ROW).by("recipe")
        },
        "nested_rows": [
            {**asdict(pair), "contradictory": pair.contradictory}
            for table in TABLES
            for pair in nested_pairs(table)
        ],
        "covering_rows": [
            {**asdict(pair), "less": pair.less}
            for table in TABLES
            for pair in covering_pairs(table)
        ],
        "reasons": [
            {**asdict(reason), "explained": reason.explained} for reason in reasons_of(runs)
        ],
    }  # fmt: skip


STUDY = Study(
    name="stability-recipes",
    title="Every recipe for the printed control stability workspaces, and what none can give",
    source="servoing thesis 3.3, tables A.8 to A.18",
    cases=cases,
    reduce=row,
    chunk=CHUNK,
    unit="poses",
    before="listing rows",
    parameters=lambda form: {
        "recipes": {name: recipe_as_dict(recipe) for name, recipe in RECIPES.items()}
    },
    numbers=numbers,
    stated="What follows for the printed tables",
    checks=CHECKS,
    tables=[
        *(
            partial(means_table, words=words, fitted=fitted)
            for words, fitted in (
                ("all rows", None),
                ("rows in sight when the study's recipe was chosen", True),
                ("rows that were not", False),
            )
        ),
        limits_table,
        pairs_table,
        reasons_table,
    ],
)
