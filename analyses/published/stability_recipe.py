"""The assumptions with which the servoing thesis' stability tables are repeated.

The thesis does not say how it drew its perturbations. These assumptions, found by trying when
tables A.8, A.10, A.12, A.14, A.17 and a few rows of the others were at hand, come closest. They are
the same for every table. In the others, by the mean over all rows, sampled shares are off by 1.5
(A.16), 2.4 (A.18), 4.8 (A.9), 5.8 (A.13), 9.4 (A.15) and 38.6 points (A.11): the fully constrained
robot is not met, not even at the baseline (50.7 instead of 97.0 %).

- platform unrotated, camera at the platform's origin and aligned with it;
- the estimate is perturbed, the truth is the nominal model;
- 50 random perturbations per pose, every one at its full magnitude in its own direction, all at
  once; 1000 for the planar robot, whose grid is twelve times smaller; a pose is stable if Pi + Pi'
  is positive definite for each of them;
- PBVS with feature (1.47) and its [e_t]x, where e_t leads from the pose to the lower corner of the
  grid's box (planar: to the opposite corner of a square of half-size 0.55 m), and theta u is half a
  turn about z;
- spatial robots: the object is not perturbed, so L_s is the same on both sides, and IBVS needs no
  features;
- 2 1/2 D: one view at every pose, the object 0.45 m ahead and 0.4 m to the side, and a rotation
  error of 120 deg about the image's x axis. The thesis gives neither. Of some 300 random views this
  one, rounded, came closest to A.14 and to five rows of A.15 (the baseline, r_bp = 1 m, r_pc from
  0.2 m on), leaving r_A and r_B out: mean differences of 1.2 (d_theta_pc below 30 deg) and, with
  30.0 in the place of 35.2 at r_bp = 1 m, 2.7 points. It was not fitted to the other rows of A.15,
  and meets neither the rows of r_A and r_B nor A.13;
- exit points share one random shift, and so do anchor points, but for the rows that vary them:
  there each point of ACROBOT is at a corner of its own cube, (+-r, +-r, +-r), and each point of the
  planar robot on its own circle; CAROCA's points are shifted in common there, too;
- the workspace is the set of cells of the grid with all corners stable.

Source: servoing thesis 3.3 and A.5, for what it says.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.published.recipe_variants import OPPOSITE_CORNER, PRESENT, Recipe
from cdpr_drake.analyses.published.stability_tables import PublishedTable
from cdpr_drake.analyses.stability import workspace_defaults
from cdpr_drake.errors import StabilityError
from cdpr_drake.models import load_robot
from cdpr_drake.stability import (
    FixedPlace,
    OppositeCorner,
    PerturbationBounds,
    ServoTarget,
    StabilityCase,
    VerdictOptions,
)
from cdpr_drake.workspaces import WorkspaceGrid, grid_by_count, grid_by_step

RECIPE = str(__doc__)
"""The words above, for results."""

DRAWS, PLANAR_DRAWS = 50, 1000
"""Random perturbations per pose of spatial robots and of the planar one."""

PLANAR_HALF_SIZE = 0.55
"""Half the square to whose corners the planar robot goes [m]."""


def recipe_grid(robot_name: str, quick: bool = False) -> WorkspaceGrid:
    """Grid of the published tables; `quick`: every fourth point in a plane, every second plane."""
    robot = load_robot(robot_name)
    known = workspace_defaults(robot, robot_name)
    grid = grid_by_step(known.lower, known.upper, known.step)
    if not quick:
        return grid
    _, nx, ny, nz = grid.shape
    counts = [(n - 1) // (4 if n > 20 else 2) + 1 if n > 1 else 1 for n in (nx, ny, nz)]
    return grid_by_count(grid.lower, grid.upper, counts)


def recipe_case(robot_name: str, scheme: str, recipe: Recipe = PRESENT) -> StabilityCase:
    """The case of a table by a recipe."""
    robot = load_robot(robot_name)
    known = workspace_defaults(robot, robot_name)
    planar = robot.motion_type().is_horizontal_body
    turn = np.array(recipe.turn)
    target: ServoTarget = FixedPlace(known.lower, turn)
    if planar:
        corner = np.full(3, PLANAR_HALF_SIZE)
        target = OppositeCorner(-corner, corner)
    elif scheme == "2.5d":
        view = recipe.view
        target = FixedPlace(known.lower, np.array(view.turn), np.array(view.place), np.eye(3))
    elif recipe.goal == OPPOSITE_CORNER:
        target = OppositeCorner(known.lower, known.upper, turn)
    X_PC = RigidTransform() if planar else recipe.mounting(robot_name)
    return StabilityCase(recipe.cables(robot_name), scheme, planar, X_PC, target)


def recipe_options(robot_name: str, pieces: int | None = None) -> VerdictOptions:
    """How hard to look at the poses of a table.

    Args:
        robot_name: Whose table.
        pieces: Pieces that a certificate looks at, at most; None: the usual number.
    """
    planar = load_robot(robot_name).motion_type().is_horizontal_body
    options = VerdictOptions(draws=PLANAR_DRAWS if planar else DRAWS, margins=False)
    return options if pieces is None else replace(options, pieces=pieces)


def recipe_bounds(
    table: PublishedTable, name: str, value: float, recipe: Recipe = PRESENT
) -> PerturbationBounds:
    """Bounds of the row of a table that sets one bound, the others at the baseline.

    Args:
        table: The table.
        name: Name of the bound, angles with _deg.
        value: Its value [m, deg].
        recipe: How points are wrong.

    Raises:
        StabilityError: There is no such bound.
    """
    return single_bounds(_baseline(table.robot), name, value, table, recipe)


@cache
def _baseline(robot_name: str) -> PerturbationBounds:
    """Baseline bounds of a robot that ships; reading its file for every row takes half a minute."""
    baseline = workspace_defaults(load_robot(robot_name), robot_name).bounds
    return baseline.varied(exits="common", anchors="common")


def single_bounds(
    others: PerturbationBounds,
    name: str,
    value: float,
    table: PublishedTable | None = None,
    recipe: Recipe = PRESENT,
) -> PerturbationBounds:
    """`others` with one bound set; points of a table as the recipe says."""
    changes: dict[str, float | str] = {name: value}
    if name.endswith("_deg"):
        changes = {name.removesuffix("_deg"): math.radians(value)}
    if table is not None and name in ("r_A", "r_B"):
        directions = recipe.directions(table.robot, table.scheme, name)
        changes["exits" if name == "r_A" else "anchors"] = directions
    if value < 0.0:
        raise StabilityError(f"{name}: found {value:g}; accepted: a number >= 0")
    return others.varied(**changes)
