"""The assumptions with which the servoing thesis' stability tables are repeated.

The thesis does not say how it drew its perturbations. These assumptions, found by trying with rows
at hand that `recipes.yaml` names, come closest; among `recipe_variants` they are `one-exchange`.
They are the same for every table. What they give on all rows, and on those that were not in sight,
stands in the results of `cdpr study control-stability`.

- platform unrotated; the camera faces down, 0.08 m above the origin of ACROBOT's platforms and
  0.2 m above that of CAROCA's; on the planar robot it is at the platform's origin;
- the fully constrained ACROBOT has the points of tables 3.1 and A.1, but A4 and A6 in each other's
  place, `EXCHANGED`, and goes to the centre of the grid's box: by the printed numbers, and to the
  corner, half of the printed 97.0 % would be left at the baseline;
- the estimate is perturbed, the truth is the nominal model;
- 50 random perturbations per pose, every one at its full magnitude in its own direction, all at
  once; 1000 for the planar robot, whose grid is twelve times smaller; a pose is stable if Pi + Pi'
  is positive definite for each of them;
- PBVS with feature (1.47) and its [e_t]x, where e_t leads from the pose to the lower corner of the
  grid's box (planar: to the opposite corner of a square of half-size 0.55 m), and theta u is half a
  turn about z;
- spatial robots: the object is not perturbed, so L_s is the same on both sides, and IBVS needs no
  features;
- 2 1/2 D: one view at every pose, the object on the optical axis 0.46 m ahead, and theta u as under
  PBVS. A turn about the optical axis does not matter. The distance and the heights of the camera
  were chosen with A.14 and A.15 at hand;
- exit points share one random shift, and so do anchor points, but for the rows that vary them:
  there each point of ACROBOT is at a corner of its own cube, (+-r, +-r, +-r), each point of the
  planar robot on its own circle and each of the fully constrained ACROBOT on its own sphere;
  CAROCA's points are shifted in common there, too;
- the workspace is the set of cells of the grid with all corners stable.

Source: servoing thesis 3.3 and A.5, for what it says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.recipe_variants import (
    CENTRE,
    IN_USE,
    OPPOSITE_CORNER,
    Recipe,
    shipped_robot,
)
from cdpr_drake.analyses.studies.stability_tables import PublishedTable
from cdpr_drake.analyses.workspaces.servo_stability import PRINTED
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.errors import StabilityError
from cdpr_drake.stability.desired_view import FixedPlace, OppositeCorner, ServoTarget
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_all_verdicts, judge_stability
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count, grid_by_step

RECIPE = str(__doc__)
"""The words above, for results."""

DRAWS, PLANAR_DRAWS = 50, 1000
"""Random perturbations per pose of spatial robots and of the planar one."""

PLANAR_HALF_SIZE = 0.55
"""Half the square to whose corners the planar robot goes [m]."""


def recipe_grid(robot_name: str, quick: bool = False) -> WorkspaceGrid:
    """Grid of the published tables; `quick`: every fourth point in a plane, every second plane."""
    robot = shipped_robot(robot_name)
    known = workspace_defaults(robot, robot_name)
    grid = grid_by_step(known.lower, known.upper, known.step)
    if not quick:
        return grid
    _, nx, ny, nz = grid.shape
    counts = [(n - 1) // (4 if n > 20 else 2) + 1 if n > 1 else 1 for n in (nx, ny, nz)]
    return grid_by_count(grid.lower, grid.upper, counts)


def recipe_case(robot_name: str, scheme: str, recipe: Recipe = IN_USE) -> StabilityCase:
    """The case of a table by a recipe."""
    robot = shipped_robot(robot_name)
    known = workspace_defaults(robot, robot_name)
    planar = robot.motion_type().is_horizontal_body
    turn = np.array(recipe.seen.get(robot_name, recipe.turn))
    target: ServoTarget = FixedPlace(known.lower, turn)
    if planar:
        corner = np.full(3, PLANAR_HALF_SIZE)
        target = OppositeCorner(-corner, corner)
    elif scheme == "2.5d":
        view = recipe.view
        target = FixedPlace(known.lower, np.array(view.turn), np.array(view.place), np.eye(3))
    else:
        goal = recipe.goals.get(robot_name, recipe.goal)
        if goal == OPPOSITE_CORNER:
            target = OppositeCorner(known.lower, known.upper, turn)
        elif goal == CENTRE:
            target = FixedPlace((known.lower + known.upper) / 2.0, turn)
    X_PC = RigidTransform() if planar else recipe.mounting(robot_name)
    return StabilityCase(recipe.cables(robot_name), scheme, planar, X_PC, target, lever=PRINTED)


def recipe_options(robot_name: str, pieces: int | None = None) -> VerdictOptions:
    """How hard to look at the poses of a table.

    Args:
        robot_name: Whose table.
        pieces: Pieces that a certificate looks at, at most; None: the usual number.
    """
    planar = shipped_robot(robot_name).motion_type().is_horizontal_body
    options = VerdictOptions(draws=PLANAR_DRAWS if planar else DRAWS, margins=False)
    return options if pieces is None else replace(options, pieces=pieces)


def recipe_bounds(
    table: PublishedTable, name: str, value: float, recipe: Recipe = IN_USE
) -> PerturbationBounds:
    """Bounds of the row of a table that sets one bound, the others at the baseline.

    Args:
        table: The table.
        name: Name of the bound, angles with _deg.
        value: Its value [m, deg].
        recipe: How points are wrong, and whether what is seen is.

    Raises:
        StabilityError: There is no such bound.
    """
    bounds = single_bounds(_baseline(table.robot), name, value, table, recipe)
    if table.scheme == "pbvs" and table.robot in recipe.seen:
        return bounds.varied(d_theta_s=bounds.d_theta_pc)
    return bounds


@cache
def _baseline(robot_name: str) -> PerturbationBounds:
    """Baseline bounds of a robot that ships; reading its file for every row takes half a minute."""
    baseline = workspace_defaults(shipped_robot(robot_name), robot_name).bounds
    return baseline.varied(exits="common", anchors="common")


def single_bounds(
    others: PerturbationBounds,
    name: str,
    value: float,
    table: PublishedTable | None = None,
    recipe: Recipe = IN_USE,
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


@dataclass(frozen=True, eq=False)
class SampledTask:
    """Poses of a grid judged by samples.

    Attributes:
        case: Robot, scheme, target.
        bounds: Bounds of the perturbations.
        grid: The poses.
        options: How hard to look.
    """

    case: StabilityCase
    bounds: PerturbationBounds
    grid: WorkspaceGrid
    options: VerdictOptions

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `stable` of the poses start to stop, shape (n,) bool."""
        poses = self.grid.pose_rows(start, stop)
        judged = judge_stability(self.case, self.bounds, poses, "sampled", self.options)
        return {"stable": judged.stable}


@dataclass(frozen=True, eq=False)
class VerdictsTask(SampledTask):
    """Poses of a grid judged by every verdict."""

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """For each verdict whether the poses start to stop are stable, shape (n,) bool."""
        poses = self.grid.pose_rows(start, stop)
        judged = judge_all_verdicts(self.case, self.bounds, poses, self.options)
        return {verdict: chunk.stable for verdict, chunk in judged.items()}
