"""What may be wanted of a design, as a table: numbers of a robot over a grid of poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES, conditions_at
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

SERVO_VERDICT = "certified"
"""How stability is judged: proven, pose by pose."""


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


Value = Callable[[Robot, GoalContext], float]


@dataclass(frozen=True)
class Goal:
    """Something that may be wanted.

    Attributes:
        title: What it is.
        unit: Its unit.
        value: The number.
        smaller: Whether less of it is better.
        proven_as: Kind of `cdpr workspace --certify` that proves a volume; empty: none.
    """

    title: str
    unit: str
    value: Value
    smaller: bool = False
    proven_as: str = ""


def _arrays(robot: Robot, judging: GoalContext, name: str) -> Array:
    """A kind (as 0 and 1) or measure at all poses of the grid."""
    about = pose_conditions(robot, required=judging.required)
    arrays = conditions_at(about, judging.grid, [name], 0, judging.grid.size)
    return np.asarray(arrays[name], float)


def _share(name: str) -> Value:
    return lambda robot, judging: float(np.mean(_arrays(robot, judging, name)))


def _least(name: str) -> Value:
    """Least over the poses; a pose at which the measure makes no sense has none: 0 or less."""

    def value(robot: Robot, judging: GoalContext) -> float:
        values = _arrays(robot, judging, name)
        return float(np.min(np.where(np.isfinite(values), values, 0.0)))

    return value


def _mean(name: str) -> Value:
    def value(robot: Robot, judging: GoalContext) -> float:
        values = _arrays(robot, judging, name)
        return float(np.mean(np.where(np.isfinite(values), values, 0.0)))

    return value


def servo_stable(robot: Robot, judging: GoalContext, verdict: str) -> np.ndarray:
    """At which poses the platform can be held and position-based servoing is stable, shape (n,).

    Args:
        robot: The robot.
        judging: Poses and bounds.
        verdict: One of `stability.verdict.VERDICTS`; certified: proven.
    """
    grid = judging.grid
    case = stability_case(robot, "pbvs", grid)
    rows = grid.pose_rows(0, grid.size)
    options = VerdictOptions(margins=False)
    stable = judge_stability(case, judging.bounds, rows, verdict, options).stable
    about = pose_conditions(robot)
    held = statically_feasible(
        about.case, grid.positions(0, grid.size), grid.rotations(0, grid.size)
    )
    return np.asarray(stable & held, bool)


def _control_stability(robot: Robot, judging: GoalContext) -> float:
    return float(np.mean(servo_stable(robot, judging, SERVO_VERDICT)))


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
        name: Goal(
            f"share of poses: {KINDS[name].title}",
            "-",
            _share(name),
            proven_as=name if name in proven else "",
        )
        for proven in [("static", "wrench-feasible", "wrench-closure", "interference-free")]
        for name in (*proven, "statically-stable", "singularity-free")
    },
    "csw": Goal("share of poses: held, and the visual servo is stable", "-", _control_stability),
    **{
        name: Goal(f"least {MEASURES[name].title}", MEASURES[name].unit, _least(name))
        for name in ("capacity-margin", "stiffness", "frequency", "dexterity", "clearance")
    },
    "survives": Goal(
        f"share of poses: {KINDS['single-failure'].title}",
        "-",
        _share("single-failure"),
        proven_as="single-failure",
    ),
    "breaks-survived": Goal(
        "mean number of single breaks after which the weight is held", "-", _mean("breaks-survived")
    ),
    "tension-factor": Goal("mean tension factor", "-", _mean("tension-factor")),
    "payload": Goal("least payload", "kg", _least("payload")),
    "accuracy": Goal(
        "rms error of the position, exit points off by 1 mm", "m", _accuracy, smaller=True
    ),
    "power": Goal("rated power of all motors", "W", _power, smaller=True),
    "speed": Goal("rated cable speed", "m/s", lambda robot, _: robot.winch.rated_cable_speed()),
    "cables": Goal(
        "number of cables", "-", lambda robot, _: float(len(robot.cables)), smaller=True
    ),
}
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


def evaluate_goals(robot: Robot, judging: GoalContext, names: tuple[str, ...]) -> Array:
    """Values of goals, larger is better: those of which less is better with the sign changed."""
    values = [GOALS[name].value(robot, judging) for name in names]
    signs = [-1.0 if GOALS[name].smaller else 1.0 for name in names]
    return np.array(values) * signs
