"""The study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.analyses.studies.framework.summary import note_coarse
from cdpr_drake.analyses.studies.published.stability_recipe import RECIPE, recipe_options
from cdpr_drake.analyses.studies.stability_shapes.figures import FIGURES
from cdpr_drake.analyses.studies.stability_shapes.items import Shape, shape_cases, shape_row
from cdpr_drake.analyses.studies.stability_shapes.statements import CHECKS

CHUNK = 2000
"""Poses per chunk."""

ASSUMPTIONS = (
    "Perturbations as in the study control-stability, see its recipe; by samples alone.",
    "Figure 4.2: the bounds D1 to D4 are not printed; here the least that hold the printed sets "
    "d1 to d4, points of the cables each in a direction of its own. A position must be stable "
    "unturned and turned by +-30 deg about x, y and z.",
    "Figure 3.10: its combinations 2 and 16 are not printed; here 2 and 13 of analysis II.",
)


def shares_table(runs: Runs) -> Table:
    """Shares of the box, beside the published ones."""
    table = new_table(
        "Control stability workspaces, share of the box in per cent",
        ("figure", "robot", "scheme", "bounds"),
        ("published", "here"),
    )
    for run in runs:
        words = (run[key] for key in ("figure", "robot", "scheme", "panel"))
        table.add_row(*words, Shape(run).printed, f"{run['share_percent']:.1f}")
    return note_coarse(table, runs, "not to be compared with the published numbers.")


def parameters(form: Form) -> Mapping[str, Any]:
    """What all workspaces have in common."""
    robots = dict.fromkeys(str(case.keys["robot"]) for case in shape_cases(form))
    return {"recipe": RECIPE, "options": {name: recipe_options(name) for name in robots}}


STUDY = Study(
    name="stability-shapes",
    title="Shapes of control stability workspaces, drawn as the thesis does",
    source="servoing thesis 3.3, 4.3.1",
    cases=shape_cases,
    reduce=shape_row,
    chunk=CHUNK,
    unit="poses",
    parameters=parameters,
    assumptions=ASSUMPTIONS,
    stated="What the servoing thesis states",
    checks=CHECKS,
    tables=[shares_table],
    figures=FIGURES,
)
