"""Study: the servoing thesis' control stability workspaces, by samples, by search, and by proof."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.control_stability.figures import FIGURES
from cdpr_drake.analyses.studies.control_stability.recipes import BY_NAME, recipe_study, table_grid
from cdpr_drake.analyses.studies.control_stability.statements import CHECKS
from cdpr_drake.analyses.studies.control_stability.tables import (
    SHARE,
    rows_of,
    stability_tables,
)
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.published.recipe_choices import CHOICES
from cdpr_drake.analyses.studies.published.recipe_variants import RECIPES
from cdpr_drake.analyses.studies.published.stability_recipe import (
    RECIPE,
    recipe_bounds,
    recipe_case,
    recipe_options,
    single_bounds,
)
from cdpr_drake.analyses.studies.published.stability_tables import (
    BASELINE_VALUES,
    TABLES,
    PublishedTable,
)
from cdpr_drake.analyses.workspaces.stability_tasks import VerdictsTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import VERDICTS
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

CHUNK = 500
"""Poses per chunk, a second's work or less, a few in rows of coverage."""

COVERAGE_SHARES = (0.25, 1.0)
"""Parts of the baseline bounds at which certified poses are counted against searched ones."""

ROW_PIECES, COVERAGE_PIECES, QUICK_PIECES = 1, 600, 20
"""Pieces of a certificate at most, in rows of the tables and in rows of coverage, full and quick:
cutting the perturbations where the whole proves nothing would take hours in rows of large bounds.
"""

QUICK_TABLES = ("A.8", "A.10", "A.17")
"""Tables of the quick form."""


def asked(form: Form) -> list[PublishedTable]:
    """Tables that are repeated."""
    return [table for table in TABLES if not form.quick or table.name in QUICK_TABLES]


def cases(form: Form) -> Iterator[Case]:
    """All 468 printed rows and rows of coverage; in the quick form few, on coarse grids."""
    for table in asked(form):
        yield from table_cases(table, form)


def table_cases(table: PublishedTable, form: Form) -> Iterator[Case]:
    """The rows of a table; what several ask alike, as at the baseline, is computed once."""
    grid, case = table_grid(table.robot, form.grid), recipe_case(table.robot, table.scheme)
    alike: dict[tuple[PerturbationBounds, int], str] = {}
    for bound, value, bounds in _rows(table, form.quick):
        of_coverage = bound == SHARE
        pieces = (QUICK_PIECES if form.quick else COVERAGE_PIECES) if of_coverage else ROW_PIECES
        options = recipe_options(table.robot, pieces)
        name = f"{table.name} {bound}={value:g}"
        first = alike.setdefault((bounds, options.pieces), name)
        yield Case(
            name=name,
            keys={"table": table.name, "bound": bound, "value": value, "grid": form.grid},
            data=grid.shape,
            task=VerdictsTask(case, bounds, grid, options) if first == name else None,
            items=grid.size,
            same_task="" if first == name else first,
            printed={} if of_coverage else {"sampled_percent": f"{table.rows[bound][value]:g}"},
        )  # fmt: skip


def _rows(table: PublishedTable, quick: bool) -> Iterator[tuple[str, float, PerturbationBounds]]:
    """Bound, value and bounds of the rows of a table; the baseline comes once."""
    some = next(iter(table.rows))
    baseline = recipe_bounds(table, some, BASELINE_VALUES[some])
    baseline = single_bounds(baseline.varied(exits="common", anchors="common"), "r_bp", 0.03)
    for share in COVERAGE_SHARES:
        yield SHARE, share, baseline.scaled(share)
    for name, row in table.rows.items():
        values = list(row)
        for value in values[1:-1:2] if quick else values:
            yield name, value, recipe_bounds(table, name, value)


def stability_row(case: Case, stable: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """What is stable.

    Returns:
        By verdict its share of the full workspace, cells with all corners stable, VERDICT_percent,
        and poses of the grid, VERDICT_poses; poses: of the grid; ordered: whether at every pose
        certified implies searched and searched implies sampled.
    """
    table = BY_NAME[case.keys["table"]]
    axes = table_grid(table.robot, case.keys["grid"]).axes
    sampled, searched, certified = (stable[verdict] for verdict in VERDICTS)
    shares = {
        f"{verdict}_percent": 100.0
        * workspace_volume(inside.reshape(case.data)[0], axes, VolumeRule.CORNERS).value
        / table.full
        for verdict, inside in stable.items()
    }
    return {
        **shares,
        **{f"{verdict}_poses": int(np.sum(inside)) for verdict, inside in stable.items()},
        "poses": case.items,
        "ordered": bool(np.all(certified <= searched) and np.all(searched <= sampled)),
    }


def parameters(form: Form) -> Mapping[str, Any]:
    """What all rows have in common."""
    return {
        "recipe": RECIPE,
        "choices": [asdict(choice) for choice in CHOICES],
        "baseline": BASELINE_VALUES,
        "options": {table.name: asdict(recipe_options(table.robot)) for table in asked(form)},
        "pieces_in_rows_with_published_values": ROW_PIECES,
        "pieces_in_rows_of_coverage": QUICK_PIECES if form.quick else COVERAGE_PIECES,
    }


def numbers(runs: Runs) -> Mapping[str, Any]:
    """How many printed rows of each table are repeated."""
    return {
        "printed_rows": {
            table.name: {"repeated": len(rows_of(table, runs)), "of": table.size}
            for table in TABLES
            if any(run["table"] == table.name for run in runs)
        }
    }


STUDY = Study(
    name="control-stability",
    title="The servoing thesis' control stability workspaces, beside the printed ones",
    source="servoing thesis 3.3, tables A.8 to A.18",
    cases=cases,
    reduce=stability_row,
    chunk=CHUNK,
    unit="poses",
    parameters=parameters,
    numbers=numbers,
    stated="What the servoing thesis states",
    checks=CHECKS,
    tables=[stability_tables],
    figures=FIGURES,
    recipes={name: recipe_study(recipe) for name, recipe in RECIPES.items()},
)
