"""Which exchange of two cables the rows of one bound of A.11 choose.

The numbering of tables 3.1 and A.1, and every exchange of two cables in it, are held against the
rows of one bound alone. What they choose can be confirmed by the rows of the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from cdpr_drake.analyses.studies.control_stability.recipes import RULES, RecipeStudy
from cdpr_drake.analyses.studies.published.recipe_variants import (
    EXCHANGED_CABLES,
    FULLY_CONSTRAINED,
    exchanged_anchors,
)
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import BASELINE_VALUES, TABLES
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.volume import workspace_volume

CHOOSING_BOUND = "r_bp"
"""Its rows choose; it concerns no single point, so it does not matter how points are wrong."""

PRINTED = "none"
"""Name of the numbering as it is printed."""

TABLE = next(table for table in TABLES if table.robot == FULLY_CONSTRAINED)


@dataclass(frozen=True)
class ExchangeRow:
    """A printed row, and what is left of the workspace after an exchange.

    Attributes:
        exchange: The exit points in each other's place, as "A2 A8", or `PRINTED`.
        value: Value of the bound [m].
        printed: Printed share [%].
        share: Ours [%].
    """

    exchange: str
    value: float
    printed: float
    share: float


def exchange_name(one: int, other: int) -> str:
    """Name of an exchange of cables, numbered from 0."""
    return PRINTED if one == other else f"A{one + 1} A{other + 1}"


def exchange_tasks(quick: bool) -> dict[str, tuple[str, float, SampledTask]]:
    """Exchange, value of the bound and sweep task by the task's name."""
    case = recipe_case(FULLY_CONSTRAINED, TABLE.scheme, EXCHANGED_CABLES)
    cables = load_robot(FULLY_CONSTRAINED).cable_set().without_pulleys()
    grid, options = recipe_grid(FULLY_CONSTRAINED, quick), recipe_options(FULLY_CONSTRAINED)
    tasks = {}
    for pair in ((0, 0), *combinations(range(cables.count), 2)):
        other = replace(case, cables=exchanged_anchors(cables, *pair))
        for value in TABLE.rows[CHOOSING_BOUND]:
            bounds = recipe_bounds(TABLE, CHOOSING_BOUND, value, EXCHANGED_CABLES)
            name = exchange_name(*pair)
            task = SampledTask(other, bounds, grid, options)
            tasks[f"exchange {name} {value:g}"] = (name, value, task)
    return tasks


def exchange_rows(
    tasks: Mapping[str, tuple[str, float, SampledTask]],
    finished: Mapping[str, Mapping[str, np.ndarray]],
) -> tuple[ExchangeRow, ...]:
    """Rows of the tasks that are finished."""
    rows = []
    for name, (exchange, value, task) in tasks.items():
        if name in finished:
            inside = np.asarray(finished[name]["stable"], bool).reshape(task.grid.shape)[0]
            share = 100.0 * workspace_volume(inside, task.grid.axes, RULES[0]).share
            printed = TABLE.rows[CHOOSING_BOUND][value]
            rows.append(ExchangeRow(exchange, value, printed, share))
    return tuple(rows)


def exchange_means(rows: tuple[ExchangeRow, ...]) -> dict[str, float]:
    """Mean absolute difference over the rows that choose, the smallest first [points].

    Raises:
        KeyError: A row is missing.
    """
    apart: dict[str, list[float]] = {}
    for row in rows:
        apart.setdefault(row.exchange, []).append(abs(row.share - row.printed))
    count = len(TABLE.rows[CHOOSING_BOUND])
    if not apart or any(len(some) < count for some in apart.values()):
        raise KeyError(CHOOSING_BOUND)
    means = {name: float(np.mean(some)) for name, some in apart.items()}
    return dict(sorted(means.items(), key=lambda item: item[1]))


def other_rows(one: RecipeStudy) -> list[float]:
    """Differences of the rows of A.11 that do not choose, without repetitions of the baseline.

    Returns:
        Absolute differences [points].
    """
    return [
        abs(row.shares[RULES[0]] - row.published)
        for row in one.rows
        if row.table == TABLE.name
        and row.bound != CHOOSING_BOUND
        and row.value != BASELINE_VALUES[row.bound]
    ]
