"""What may be wanted of a design, as a table: numbers of a robot over a grid of poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.analyses.workspaces.servo_stability import stability_case
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CdprError, DesignError
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.static_feasibility import statically_feasible

EXIT_ERROR = 1e-3
"""Accuracy is that of exit points which are off by so much, in one coordinate each [m]."""

ACCURACY_POSES = 9
"""Poses at which accuracy is asked for: the first, the last, and some evenly between them."""


@dataclass(frozen=True, eq=False)
class GoalContext:
    """What designs are judged by.

    Attributes:
        grid: Poses of the platform.
        required: Wrenches to resist; None: none beside the weight.
        bounds: Bounds of the perturbations of control stability.
    """

    grid: WorkspaceGrid
    required: SpatialSet | None
    bounds: PerturbationBounds


@dataclass(frozen=True)
class Goal:
    """Something that may be wanted.

    Attributes:
        title: What it is.
        unit: Its unit.
        value: The number of a robot; None: that of a condition.
        condition: Kind, as 0 and 1, or measure over the poses, 0 where it makes no sense.
        combine: One number of these.
        smaller: Whether less of it is better.
        proven_as: Kind of `cdpr workspace --certify` that proves a volume; empty: none.
    """

    title: str
    unit: str
    value: Callable[[Robot, GoalContext], float] | None = None
    condition: str = ""
    combine: Callable[[Array], Any] = np.mean
    smaller: bool = False
    proven_as: str = ""


def _share(kind: str, proven: bool = False) -> Goal:
    """Share of the poses that are of a kind."""
    title = f"share of poses: {KINDS[kind].title}"
    return Goal(title, "-", condition=kind, proven_as=kind if proven else "")


def _least(measure: str) -> Goal:
    """Least of a measure over the poses."""
    about = MEASURES[measure]
    return Goal(f"least {about.title}", about.unit, condition=measure, combine=np.min)


def share_of_stable_poses(robot: Robot, judging: GoalContext) -> float:
    """Share of the poses where the platform can be held and position-based servoing is proven
    stable."""
    grid = judging.grid
    case = stability_case(robot, "pbvs", grid)
    rows = grid.pose_rows(0, grid.size)
    options = VerdictOptions(margins=False)
    stable = judge_stability(case, judging.bounds, rows, "certified", options).stable
    about = pose_conditions(robot)
    held = statically_feasible(
        about.case, grid.positions(0, grid.size), grid.rotations(0, grid.size)
    )
    return float(np.mean(stable & held))


def _accuracy(robot: Robot, judging: GoalContext) -> float:
    """Root mean square, over poses that can be held, of how far Po is off; infinite without one."""
    grid, platform = judging.grid, rigid_platform(robot)
    cables = robot.cable_set()
    chosen = np.unique(np.linspace(0, grid.size - 1, ACCURACY_POSES).astype(int))
    squares = []
    for k in chosen:
        R = RotationMatrix.ProjectToRotationMatrix(grid.rotations(k, k + 1)[0])
        X_WP = RigidTransform(R, grid.positions(k, k + 1)[0])
        try:
            held = hold_robot(robot, X_WP, cables, ELASTIC)
            by = pose_sensitivity(cables, ELASTIC, platform, X_WP, held.unstrained_lengths)
        except CdprError:
            continue
        squares.append(float(np.sum(by.exit_points[3:] ** 2)) * EXIT_ERROR**2)
    return float(np.sqrt(np.mean(squares))) if squares else np.inf


def _power(robot: Robot, judging: GoalContext) -> float:
    winch = robot.winch
    torque = np.nan if winch.motor_torque is None else winch.motor_torque
    return float(len(robot.cables) * torque * winch.rated_motor_speed())


GOALS: dict[str, Goal] = {
    **{
        name: _share(name, proven=True)
        for name in ("static", "wrench-feasible", "wrench-closure", "interference-free")
    },
    **{name: _share(name) for name in ("statically-stable", "singularity-free")},
    "csw": Goal(
        "share of poses: held, and the visual servo is stable", "-", share_of_stable_poses
    ),
    **{
        name: _least(name)
        for name in ("capacity-margin", "stiffness", "frequency", "dexterity", "clearance")
    },
    "survives": _share("single-failure", proven=True),
    "breaks-survived": Goal(
        "mean number of single breaks after which the weight is held", "-",
        condition="breaks-survived",
    ),
    "tension-factor": Goal("mean tension factor", "-", condition="tension-factor"),
    "payload": Goal("least payload", "kg", condition="payload", combine=np.min),
    "accuracy": Goal(
        "rms error of the position, exit points off by 1 mm", "m", _accuracy, smaller=True
    ),
    "power": Goal("rated power of all motors", "W", _power, smaller=True),
    "speed": Goal("rated cable speed", "m/s", lambda robot, _: robot.winch.rated_cable_speed()),
    "cables": Goal(
        "number of cables", "-", lambda robot, _: float(len(robot.cables)), smaller=True
    ),
}  # fmt: skip
"""Goals by name."""


NEEDS_SPARE = ("wrench-closure", "survives", "breaks-survived")
"""Goals that make sense only with more cables than degrees of freedom."""


def can_close(robot: Robot) -> bool:
    """Whether a robot has enough cables for wrench closure: more than degrees of freedom."""
    return len(robot.cables) > robot.motion_type().freedom


def check_goals(robot: Robot, judging: GoalContext, names: Sequence[str]) -> None:
    """Refuses goals that a robot cannot be asked for, before anything is searched.

    Args:
        robot: The robot as it is, with all its cables.
        judging: Poses and wrenches.
        names: Names of `GOALS`.

    Raises:
        DesignError: There is one.
    """
    if "wrench-feasible" in names and judging.required is None:
        raise DesignError(
            "goals wrench-feasible: found no wrench to resist; accepted: a force or a moment above "
            "0"
        )
    freedom = robot.motion_type().freedom
    spare = [name for name in names if name in NEEDS_SPARE]
    if spare and not can_close(robot):
        raise DesignError(
            f"goals {spare[0]}: found {len(robot.cables)} cables of {robot.name} for {freedom} "
            f"degrees of freedom; accepted: robots with more than {freedom}"
        )
    case = pose_conditions(robot).case
    moved = [row - 3 for row in case.rows if row >= 3]
    if "payload" in names and not np.any(np.array(case.down)[moved]):
        raise DesignError(
            f"goals payload: found the planar {robot.name}, whose plane carries the weight; "
            "accepted: robots that hold it by their cables"
        )


def goal_signs(names: Sequence[str]) -> Array:
    """1 of goals of which more is better, -1 of others, shape (n,)."""
    return np.array([-1.0 if GOALS[name].smaller else 1.0 for name in names])
