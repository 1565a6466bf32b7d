"""Runs the study, and what it leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.published.stability_recipe import RECIPE, recipe_options
from cdpr_drake.analyses.studies.stability_shapes.figures import shape_drawings
from cdpr_drake.analyses.studies.stability_shapes.items import (
    Shape,
    shape_items,
    shape_of,
    shape_task,
)
from cdpr_drake.analyses.studies.stability_shapes.statements import shape_statements
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.workspaces.pose_grid import grid_arguments, plain

CHUNK = 2000
"""Poses per chunk."""

ASSUMPTIONS = (
    "Perturbations as in the study control-stability, see its recipe; by samples alone.",
    "Figure 4.2: the bounds D1 to D4 are not printed; here the least that hold the printed sets "
    "d1 to d4, points of the cables each in a direction of its own. A position must be stable "
    "unturned and turned by +-30 deg about x, y and z.",
    "Figure 3.10: its combinations 2 and 16 are not printed; here 2 and 13 of analysis II.",
)


@dataclass(frozen=True, eq=False)
class StabilityShapes(DrawnStudy, StoppableStudy):
    """What the study found; verdicts on all poses are in the folder's `parts.npz`.

    Attributes:
        quick: Whether it was the quick form, on coarse grids.
        shapes: Workspaces that were finished.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    shapes: tuple[Shape, ...]
    progress: WorkProgress

    @property
    def statements(self) -> list[Statement]:
        """What the thesis says of shapes, judged."""
        return shape_statements(self.shapes, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, numbers, statements."""
        robots = dict.fromkeys(one.item.robot for one in self.shapes)
        return {
            "study": "stability-shapes",
            "source": "servoing thesis 3.3, 4.3.1",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.progress.wall_time,
            "versions": package_versions(),
            "assumptions": list(ASSUMPTIONS),
            "parameters": {
                "recipe": RECIPE,
                "options": {name: plain(recipe_options(name)) for name in robots},
            },
            "workspaces": [one.as_dict() for one in self.shapes],
            "statements": [one.as_dict() for one in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = new_table(
            "Control stability workspaces, share of the box in per cent",
            ("figure", "robot", "scheme", "bounds"),
            ("published", "here"),
        )
        if self.quick:
            table.caption = "Coarse grid: not to be compared with the published numbers."
        for one in self.shapes:
            item = one.item
            printed = "" if item.printed is None else f"{item.printed:g}"
            table.add_row(
                item.figure, item.robot, item.scheme, item.name, printed, f"{one.share:.1f}"
            )
        return [table, statement_table("What the servoing thesis states", self.statements)]

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """See `shape_drawings`."""
        return shape_drawings(self.shapes)


def study_stability_shapes(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> StabilityShapes:
    """Computes the workspaces; each is a task of a sweep.

    Args:
        quick: On coarse grids.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    items = {item.key: item for item in shape_items()}
    tasks = {key: (shape_task(item, quick), item.grid(quick).size) for key, item in items.items()}
    arguments = {
        "cdpr_drake": code_version(),
        "study": "stability-shapes",
        "quick": quick,
        "workspaces": {
            key: {"bounds": item.bounds.as_dict(), "grid": plain(grid_arguments(item.grid(quick)))}
            for key, item in items.items()
        },
    }
    result = run_study_sweep(tasks, CHUNK, "poses", arguments, session)
    shapes = tuple(
        shape_of(item, quick, result.finished[key]["stable"])
        for key, item in items.items()
        if key in result.finished
    )
    return StabilityShapes(quick, shapes, result.progress)
