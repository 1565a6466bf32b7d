"""Which exchange of two cables the rows of one bound of A.11 choose.

The numbering of tables 3.1 and A.1, and every exchange of two cables in it, are held against the
rows of one bound alone. What they choose can be confirmed by the rows of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import combinations

from cdpr_drake.analyses.studies.control_stability.recipes import (
    EXCHANGED,
    RULES,
    table_grid,
)
from cdpr_drake.analyses.studies.control_stability.tables import mean_difference, published
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.published.recipe_variants import (
    EXCHANGED_CABLES,
    FULLY_CONSTRAINED,
    exchanged_anchors,
)
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import BASELINE_VALUES, TABLES
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.models.robot_loader import load_robot

CHOOSING_BOUND = "r_bp"
"""Its rows choose; it concerns no single point, so it does not matter how points are wrong."""

PRINTED = "none"
"""Name of the numbering as it is printed."""

PAIRS = ((0, 0), *combinations(range(8), 2))
"""Numbers of the cables in each other's place, from 0: none, then every exchange of two."""

TABLE = next(table for table in TABLES if table.robot == FULLY_CONSTRAINED)


def exchange_name(one: int, other: int) -> str:
    """Name of an exchange of cables, numbered from 0."""
    return PRINTED if one == other else f"A{one + 1} A{other + 1}"


def exchange_cases(form: Form) -> Iterator[Case]:
    """The rows that choose, with every exchange and none."""
    case = recipe_case(FULLY_CONSTRAINED, TABLE.scheme, EXCHANGED_CABLES)
    cables = load_robot(FULLY_CONSTRAINED).cable_set().without_pulleys()
    word, options = form.grid, recipe_options(FULLY_CONSTRAINED)
    grid = table_grid(FULLY_CONSTRAINED, word)
    for pair in PAIRS:
        name = exchange_name(*pair)
        other = replace(case, cables=exchanged_anchors(cables, *pair))
        for value, share in TABLE.rows[CHOOSING_BOUND].items():
            bounds = recipe_bounds(TABLE, CHOOSING_BOUND, value, EXCHANGED_CABLES)
            yield Case(
                name=f"exchange {name} {value:g}",
                keys={
                    "question": EXCHANGED, "exchange": name, "table": TABLE.name,
                    "bound": CHOOSING_BOUND, "value": value, "grid": word,
                },
                task=SampledTask(other, bounds, grid, options),
                items=grid.size,
                printed={"box_percent": f"{share:g}"},
            )  # fmt: skip


def exchange_means(runs: Runs) -> dict[str, float]:
    """Mean absolute difference over the rows that choose, the smallest first [points].

    Raises:
        MissingRuns: A row is missing.
    """
    rows = runs(question=EXCHANGED)
    if len(rows) < len(PAIRS) * len(TABLE.rows[CHOOSING_BOUND]):
        raise MissingRuns(CHOOSING_BOUND)
    means = {name: mean_difference(some, "box") for name, some in rows.by("exchange")}
    return dict(sorted(means.items(), key=lambda item: item[1]))


def other_rows(rows: Iterable[Run]) -> list[float]:
    """Differences of the rows of A.11 that do not choose, without repetitions of the baseline.

    Args:
        rows: Of a recipe.

    Returns:
        Absolute differences [points].
    """
    return [
        abs(run[f"{RULES[0]}_percent"] - published(run))
        for run in rows
        if run["table"] == TABLE.name
        and run["bound"] != CHOOSING_BOUND
        and run["value"] != BASELINE_VALUES[run["bound"]]
    ]
