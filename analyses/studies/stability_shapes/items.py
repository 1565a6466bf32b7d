"""The workspaces of the study: of which robot, under which bounds, in which figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Run
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.studies.published.stability_tables import (
    BASELINE_VALUES,
    TABLES,
    PublishedTable,
)
from cdpr_drake.analyses.workspaces.stability_question import PRINTED
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.arrays import Array
from cdpr_drake.stability.desired_view import OppositeCorner, ServoTarget
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

PANELS: dict[str, tuple[str, tuple[tuple[str, float], ...]]] = {
    "3.13": ("A.10", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 10.0),
                      ("d_theta_bp_deg", 30.0), ("r_B", 0.03), ("r_A", 0.1))),
    "3.15": ("A.12", (("r_bp", 0.3), ("r_bp", 1.0), ("d_theta_bp_deg", 10.0),
                      ("d_theta_pc_deg", 20.0), ("r_B", 0.1), ("r_A", 0.1))),
    "3.17": ("A.11", (("r_bp", 0.1), ("r_bp", 0.25), ("d_theta_bp_deg", 20.0),
                      ("d_theta_pc_deg", 50.0), ("r_A", 0.05))),
    "3.20": ("A.14", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 10.0),
                      ("d_theta_bp_deg", 20.0), ("d_theta_bp_deg", 30.0), ("r_B", 0.02),
                      ("r_A", 0.1))),
    "3.22": ("A.15", (("r_bp", 1.0), ("d_theta_bp_deg", 20.0), ("r_pc", 0.3), ("r_B", 0.4),
                      ("r_A", 0.2))),
    "3.25": ("A.17", (("r_bp", 0.1), ("r_bp", 0.5), ("d_theta_bp_deg", 30.0), ("r_B", 0.03),
                      ("r_A", 0.1))),
    "3.27": ("A.18", (("r_bp", 1.0), ("d_theta_bp_deg", 50.0), ("d_theta_pc_deg", 50.0),
                      ("r_B", 0.4), ("r_A", 0.4))),
}  # fmt: skip
"""By the thesis' figure: table of its numbers, and rows that are drawn beside the baseline. Rows of
which the text names the panel are among them; which the others are, the text does not say."""

BASELINE = "baseline"

NESTED_FIGURE = "3.8"

NESTED_TABLE = "A.8"

NESTED: dict[str, tuple[float, ...]] = {
    "r_bp": (0.05, 0.1), "r_A": (0.03, 0.06), "r_B": (0.03, 0.06), "r_pc": (0.2,),
    "d_theta_bp_deg": (20.0, 30.0), "d_theta_pc_deg": (30.0, 50.0), "r_s": (0.5,),
}  # fmt: skip
"""Planar robot: rows of the table that are drawn over the baseline, a panel for each bound. Which
ones figure 3.8 shows the text says of r_bp=0.1 and r_pc=0.2 alone."""

SINGLE_FIGURE, SINGLE_ROBOT = "3.32", "acrobot_small"

SINGLE_VOLUME = (0.514, 1.014)
"""Printed volume with the camera turned by 55 deg alone, and the full one [m^3]."""

SINGLE_PLACES = np.array([[0.097, -0.026, 0.323], [0.164, 0.066, 0.1]])
"""Where the platform of section 3.4.2 starts; where it ends is lost in the text: above the tag."""

UNTURNED = np.zeros((1, 3))

PLANAR_FIGURE = "3.10"

COMBINATIONS = {
    "Cb. 2": PerturbationBounds(r_s=0.5, r_pc=0.3, d_theta_pc=math.radians(6.0)),
    "Cb. 13": PerturbationBounds(r_s=0.3, r_pc=0.2, d_theta_pc=math.radians(61.0)),
}
"""Combinations of section 3.2.1 whose numbers are printed, of its analysis II. Figure 3.10 shows
number 2 and 16 of analysis III, whose numbers are not."""

TURNED_FIGURE = "4.2"

SETS = {
    "D1": PerturbationBounds(r_bp=0.19, d_theta_bp=math.radians(8.4), d_theta_pc=math.radians(18)),
    "D2": PerturbationBounds(
        r_bp=0.13, d_theta_bp=math.radians(9.5), r_pc=0.05, d_theta_pc=math.radians(12.5),
        r_A=0.005, r_B=0.005,
    ),
    "D3": PerturbationBounds(
        r_bp=0.075, d_theta_bp=math.radians(8), r_pc=0.05, d_theta_pc=math.radians(18), r_A=0.01,
        r_B=0.01,
    ),
    "D4": PerturbationBounds(r_bp=0.11, d_theta_bp=math.radians(6), d_theta_pc=math.radians(15)),
}  # fmt: skip
"""The least bounds that hold the printed sets d1 to d4; figure 4.2's own are not printed."""

TURN = math.radians(30.0)
"""Servoing thesis 4.3.1: the platform may be turned so far about any axis [rad]."""

TURNED_PLACES = np.array([[0.107, -0.026, 0.35], [0.30, 0.25, 0.12]])
"""Start and goal of the platform in section 4.3.1 [m]."""

TURNED_TABLE = "A.13"
"""The small platform of ACROBOT under 2 1/2 D."""


def shape_case(
    figure: str,
    name: str,
    robot: str,
    scheme: str,
    bounds: PerturbationBounds,
    *,
    quick: bool,
    angles: Array = UNTURNED,
    printed: float | None = None,
    target: ServoTarget | None = None,
    places: Array | None = None,
) -> Case:
    """A workspace to compute.

    Args:
        figure: The thesis' number of the figure.
        name: Of the panel, such as `r_bp=0.5`; once in a figure.
        robot: Name of the robot.
        scheme: Of visual servoing.
        bounds: What limits the perturbations.
        quick: Whether on a coarse grid.
        angles: Orientations in all of which a position must be stable, shape (k, 3) [rad].
        printed: Published share of the full workspace [%]; None where there is none.
        target: What is servoed to; None: that of the recipe.
        places: Start and goal of the platform that are drawn, shape (2, 3) [m]; None where none
            are printed.
    """
    known = recipe_case(robot, scheme)
    if target is not None:  # with it goes the camera's place of section 3.4.2, see there
        known = StabilityCase(known.cables, scheme, target=target, lever=PRINTED)
    grid = WorkspaceGrid(recipe_grid(robot, quick).axes, angles)
    return Case(
        name=f"{figure} {name}",
        keys={
            "figure": figure, "panel": name, "robot": robot, "scheme": scheme,
            "grid": Form(quick).grid,
        },
        data={"bounds": bounds.as_dict(), "places_m": places},
        task=SampledTask(known, bounds, grid, recipe_options(robot)),
        items=grid.size,
        printed={} if printed is None else {"share_percent": f"{printed:g}"},
    )  # fmt: skip


def shape_row(case: Case, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The workspace by the verdicts on its poses.

    Returns:
        share_percent: of the whole box; positions_inside of positions; bounds; orientations_rad;
        inside: which positions are stable in all orientations, shape (nx, ny, nz); x_m, y_m, z_m:
        of the grid; places_m: start and goal, shape (2, 3), or None.
    """
    assert isinstance(case.task, SampledTask)
    grid = case.task.grid
    inside = np.all(arrays["stable"].reshape(grid.shape), axis=0)
    volume, full = (
        workspace_volume(one, grid.axes, VolumeRule.CORNERS).value
        for one in (inside, np.ones_like(inside))
    )
    return {
        "share_percent": 100.0 * volume / full,
        "positions_inside": int(np.sum(inside)),
        "positions": inside.size,
        "orientations_rad": grid.angles.tolist(),
        "inside": inside,
        **dict(zip(("x_m", "y_m", "z_m"), grid.axes, strict=True)),
        **case.data,
    }


@dataclass(frozen=True, eq=False)
class Shape:
    """A workspace that was computed.

    Attributes:
        run: Its row.
    """

    run: Run

    @property
    def name(self) -> str:
        """Of its panel."""
        return str(self.run["panel"])

    @property
    def inside(self) -> np.ndarray:
        """Which positions are stable in all orientations, shape (nx, ny, nz)."""
        return np.asarray(self.run["inside"])

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Of the grid [m]."""
        return self.run["x_m"], self.run["y_m"], self.run["z_m"]

    @property
    def share(self) -> float:
        """Of the whole box [%]."""
        return float(self.run["share_percent"])

    @property
    def printed(self) -> str:
        """Published share of the whole box [%]; empty where there is none."""
        return self.run.printed.get("share_percent", "")

    def points(self) -> Array:
        """Positions inside, shape (k, 3) [m]."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), -1)[self.inside]

    def top(self) -> float:
        """The highest plane with a point inside, above the lowest plane [m]; -inf if empty."""
        heights = np.flatnonzero(np.any(self.inside, axis=(0, 1)))
        z = self.axes[2]
        return float(z[heights[-1]] - z[0]) if len(heights) else -math.inf

    def areas(self) -> Array:
        """Share of the points of each plane of equal height that is inside, upwards, (nz,) [-]."""
        return np.asarray(np.mean(self.inside, axis=(0, 1)))

    def holds(self, place: Array) -> bool:
        """Whether the grid's position nearest to a place, shape (3,) [m], is inside."""
        nearest = tuple(
            int(np.argmin(np.abs(axis - x))) for axis, x in zip(self.axes, place, strict=True)
        )
        return bool(self.inside[nearest])


def shape_cases(form: Form) -> Iterator[Case]:
    """All of them, figure by figure; in the quick form on coarse grids."""
    shape = partial(shape_case, quick=form.quick)
    tables: Mapping[str, PublishedTable] = {table.name: table for table in TABLES}
    for figure, (name, rows) in PANELS.items():
        table = tables[name]
        for bound, value in (("r_bp", BASELINE_VALUES["r_bp"]), *rows):
            yield _row(shape, figure, table, bound, value)
    for bound, value in (
        ("r_bp", BASELINE_VALUES["r_bp"]),
        *((bound, value) for bound, values in NESTED.items() for value in values),
    ):
        yield _row(shape, NESTED_FIGURE, tables[NESTED_TABLE], bound, value)
    for combination, bounds in COMBINATIONS.items():
        yield shape(PLANAR_FIGURE, combination, "planar", "pbvs", bounds)
    table = tables[TURNED_TABLE]
    turns = np.vstack([np.zeros((1, 3)), TURN * np.eye(3), -TURN * np.eye(3)])
    for name, bounds in SETS.items():
        yield shape(
            TURNED_FIGURE, name, table.robot, table.scheme, bounds,
            angles=turns, places=TURNED_PLACES,
        )  # fmt: skip
    # Without the turns, as in figure 3.20a, but of the platform of case VII.
    yield _row(shape, TURNED_FIGURE, table, "r_bp", BASELINE_VALUES["r_bp"])
    whole = recipe_grid(SINGLE_ROBOT)
    yield shape(
        SINGLE_FIGURE, "d_theta_pc=55 deg alone", SINGLE_ROBOT, "pbvs",
        PerturbationBounds(d_theta_pc=math.radians(55.0)),
        printed=round(100.0 * SINGLE_VOLUME[0] / SINGLE_VOLUME[1], 1),
        target=OppositeCorner(whole.lower, whole.upper), places=SINGLE_PLACES,
    )  # fmt: skip


def _row(
    shape: Callable[..., Case], figure: str, table: PublishedTable, bound: str, value: float
) -> Case:
    """A row of a table as a panel of a figure."""
    first = bound == "r_bp" and value == BASELINE_VALUES["r_bp"]
    words = f"{bound.removesuffix('_deg')}={value:g}" + (" deg" if bound.endswith("_deg") else "")
    return shape(
        figure, BASELINE if first else words, table.robot, table.scheme,
        recipe_bounds(table, bound, value), printed=table.rows[bound][value],
    )  # fmt: skip
