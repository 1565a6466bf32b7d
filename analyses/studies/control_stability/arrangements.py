"""The baseline of A.11 with every arrangement of the robot's anchor points.

Cables from above hold the upper points or the lower ones, those from the floor the others, each at
a corner that lies to that of its exit point as it does for all cables from the same height.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from cdpr_drake.analyses.studies.control_stability.exchanges import TABLE
from cdpr_drake.analyses.studies.control_stability.recipes import ARRANGED, table_grid
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.published.recipe_variants import PRESENT, arranged_anchors
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_options,
)
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask

CORNERS = {
    "as its exit point": (False, False), "other x": (True, False), "other y": (False, True),
    "opposite": (True, True),
}  # fmt: skip
"""Corner that a cable holds relative to that of its exit point: whether with the other sign along
x, and along y."""

ARRANGEMENTS = tuple(product(CORNERS, CORNERS, (False, True)))
"""Corners of cables from above, of those from the floor, and whether the latter hold the upper
points."""


def arrangement_cases(form: Form) -> Iterator[Case]:
    """The baseline of A.11 with every arrangement of anchor points."""
    case = recipe_case(TABLE.robot, TABLE.scheme, PRESENT)
    bounds = recipe_bounds(TABLE, "r_bp", 0.03)
    word, options = form.grid, recipe_options(TABLE.robot)
    grid = table_grid(TABLE.robot, word)
    for above, below, crossed in ARRANGEMENTS:
        cables = arranged_anchors(case.cables, CORNERS[above], CORNERS[below], crossed)
        name = f"{'lower' if crossed else 'upper'}, {above}; {below}"
        yield Case(
            name=f"anchors {name}",
            keys={
                "question": ARRANGED, "anchors": name, "table": TABLE.name, "bound": "r_bp",
                "value": 0.03, "grid": word,
            },
            task=SampledTask(replace(case, cables=cables), bounds, grid, options),
            items=grid.size,
        )  # fmt: skip
