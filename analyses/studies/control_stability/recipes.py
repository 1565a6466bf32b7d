"""Recipes on printed rows, by the thesis' own verdict: samples; `--recipe` asks for one of them.

Volumes are counted by three rules, so that a rule costs no second run.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cache, partial
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.control_stability.tables import mean_difference
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Arrays, Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import COARSE, note_coarse
from cdpr_drake.analyses.studies.published.recipe_choices import chosen_on
from cdpr_drake.analyses.studies.published.recipe_variants import Recipe
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import cell_hull_share, workspace_volume

CHUNK = 2000
"""Poses per chunk, about a second's work."""

QUICK_TABLES = ("A.11",)
"""Tables of the quick form, on coarse grids."""

CELL_HULLS = "cell_hulls"
RULES = ("corners", CELL_HULLS, "points")
"""Rules of volumes; the first is that of the study."""

ROW, ANY_TARGET, ARRANGED, EXCHANGED = "row", "any target", "arrangement", "exchange"
"""Values of the key column `question`: what a recipe gives for a printed row; what any target
leaves of it at most; what is left at the baseline of A.11 by an arrangement of its anchor points,
and of its rows that choose by an exchange of two cables."""

BY_NAME: Mapping[str, PublishedTable] = {table.name: table for table in TABLES}
"""The tables by name."""

Alike = dict[tuple[str, PerturbationBounds, str], str]
"""By what is asked the name of the case that asked it first."""


def asked_tables(form: Form) -> list[PublishedTable]:
    """Tables that recipes are held against."""
    return [table for table in TABLES if not form.quick or table.name in QUICK_TABLES]


@cache
def table_grid(robot: str, grid: str) -> WorkspaceGrid:
    """Grid of a robot's tables; reading its file for every row takes minutes.

    Args:
        robot: Its name.
        grid: COARSE or FULL.
    """
    return recipe_grid(robot, quick=grid == COARSE)


def recipe_cases(recipes: Iterable[Recipe], form: Form) -> Iterator[Case]:
    """Every row by every recipe; what several ask alike is computed once."""
    alike: Alike = {}
    for recipe in recipes:
        for table in asked_tables(form):
            yield from _table_cases(recipe, table, form.grid, alike)


def _table_cases(recipe: Recipe, table: PublishedTable, grid: str, alike: Alike) -> Iterator[Case]:
    poses = table_grid(table.robot, grid)
    case = recipe_case(table.robot, table.scheme, recipe)
    options = recipe_options(table.robot)
    about = json.dumps(plain(case), sort_keys=True)
    for bound, values in table.rows.items():
        for value, share in values.items():
            bounds = recipe_bounds(table, bound, value, recipe)
            name = f"{recipe.name} {table.name} {bound}={value:g}"
            # Every bound's row at the baseline asks the same, and so do recipes that differ
            # elsewhere.
            first = alike.setdefault((table.robot, bounds, about), name)
            yield Case(
                name=name,
                keys={
                    "question": ROW, "recipe": recipe.name, "table": table.name, "bound": bound,
                    "value": value, "fitted": chosen_on(table.name, bound, value), "grid": grid,
                },
                task=SampledTask(case, bounds, poses, options) if first == name else None,
                items=poses.size,
                same_task="" if first == name else first,
                printed={f"{RULES[0]}_percent": f"{share:g}"},
            )  # fmt: skip


def recipe_row(case: Case, arrays: Arrays) -> dict[str, Any]:
    """Share of the full workspace by every rule of the volume, RULE_percent."""
    table = BY_NAME[case.keys["table"]]
    grid = table_grid(table.robot, case.keys["grid"])
    inside = poses_inside(grid, arrays)
    volumes = {
        rule: workspace_volume(inside, grid.axes, rule) for rule in RULES if rule != CELL_HULLS
    }
    sizes = {rule: volume.value for rule, volume in volumes.items()}
    sizes[CELL_HULLS] = hull_share(inside) * volumes[RULES[0]].full
    return {f"{rule}_percent": 100.0 * sizes[rule] / table.full for rule in RULES}


def box_row(case: Case, arrays: Arrays) -> dict[str, Any]:
    """Share of the grid's box, cells with all corners stable."""
    grid = table_grid(BY_NAME[case.keys["table"]].robot, case.keys["grid"])
    return {"box_percent": box_percent(grid, poses_inside(grid, arrays), RULES[0])}


def box_percent(grid: WorkspaceGrid, inside: np.ndarray, rule: str) -> float:
    """Share of a grid's box by a rule of the volume [%]."""
    if rule == CELL_HULLS:
        return 100.0 * hull_share(inside)
    return 100.0 * workspace_volume(inside, grid.axes, rule).share


def poses_inside(grid: WorkspaceGrid, arrays: Arrays) -> np.ndarray:
    """Whether each pose of a grid is inside, shape (nx, ny, nz)."""
    inside: np.ndarray = np.asarray(arrays["stable"], bool).reshape(grid.shape)[0]
    return inside


def hull_share(inside: np.ndarray) -> float:
    """Share of the box by hulls of cells, without axes of one point."""
    return float(cell_hull_share(inside.reshape([n for n in inside.shape if n > 1])))


def difference(rows: Iterable[Run], rule: str = RULES[0], **where: Any) -> float:
    """Mean absolute difference of shares to the printed ones in points; NaN where there are none.

    Args:
        rows: Rows that repeat printed ones.
        rule: Of the volume.
        where: Values of key columns of those that count; None: any.
    """
    some = [run for run in rows if all(value in (None, run[key]) for key, value in where.items())]
    return mean_difference(some, rule)


def mean_differences(rows: Runs) -> dict[str, dict[str, float]]:
    """Mean absolute difference to the printed shares by rule and table [points]."""
    return {
        rule: {table: mean_difference(some, rule) for table, some in rows.by("table")}
        for rule in RULES
    }


def recipe_as_dict(recipe: Recipe) -> dict[str, Any]:
    """A recipe for JSON."""
    return {**asdict(recipe), "points": dict(recipe.points)}


def points_words(means: Sequence[float]) -> list[str]:
    """Means in cells of tables."""
    return ["" if np.isnan(mean) else f"{mean:.1f}" for mean in means]


def _table(runs: Runs, recipe: Recipe) -> Table:
    """Means by table and rule, over all rows, those in sight and the others."""
    headings = (rule.replace("_", " ") for rule in RULES)
    table = new_table(
        f"Recipe {recipe.name}: mean absolute difference to the printed shares [points]",
        ("table",), ("rows", *headings, "corners, in sight", "corners, others"),
    )  # fmt: skip
    table.caption = f"{recipe.words}."
    for name, rows in runs.by("table"):
        means = [mean_difference(rows, rule) for rule in RULES]
        means += [difference(rows, fitted=fitted) for fitted in (True, False)]
        one = BY_NAME[name]
        table.add_row(one.title, f"{len(rows)} of {one.size}", *points_words(means))
    return note_coarse(table, runs)


def recipe_study(recipe: Recipe) -> Study:
    """The study of one recipe on every row; A.11 on a coarse grid in the quick form."""
    return Study(
        name="control-stability",
        title=f"The printed control stability workspaces by the recipe {recipe.name}",
        source="servoing thesis 3.3, tables A.8 to A.18",
        cases=partial(recipe_cases, (recipe,)),
        reduce=recipe_row,
        chunk=CHUNK,
        unit="poses",
        parameters=lambda form: {"recipe": recipe_as_dict(recipe)},
        numbers=lambda runs: {"mean_absolute_difference_points": mean_differences(runs)},
        tables=[partial(_table, recipe=recipe)],
    )
