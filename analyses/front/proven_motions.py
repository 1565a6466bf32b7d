"""A motion of a robot from one pose to another that is proven at every instant."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.front.motions_in_time import (
    DrawnTimedPlan,
    check_timed,
    plan_among_moving,
)
from cdpr_drake.analyses.front.planning import (
    Limits,
    Say,
    asked_told,
    check_asked,
    chosen_limits,
    in_degrees,
    limits_told,
    planned_for,
    pose_numbers,
    silent,
    tracked_by,
)
from cdpr_drake.analyses.planning.proven_plan_results import ProvenRun
from cdpr_drake.analyses.planning.robot_path_task import length_scale
from cdpr_drake.analyses.workspaces.proven_sets import (
    BOXES,
    ProofSettings,
    ProvenSets,
    explain_pose,
)
from cdpr_drake.analyses.workspaces.workspace_files import load_all_obstacles
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, WorkspaceError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.path_in_sets import SEQUENCES, proven_motion
from cdpr_drake.planning.path_timing import STATIONS, PathPlan
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.proven_cells import CELLS
from cdpr_drake.workspaces.proven_sets import COVER

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACCELERATION = 0.25
"""Half width of the box of accelerations that is proven, where nobody says and nothing turns
[m/s^2]."""

JUDGED = 2000
"""Samples of a motion that are judged by the exact checks of poses."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProvenSettings:
    """What is asked of a proven motion.

    Attributes:
        least: length or time.
        obstacles: What cables and platform stay off, as `ProvenSets.find` takes it, or a file, in
            which they may also move.
        moving: Obstacles that move, beside those of a file.
        accelerations: Half widths of the box of accelerations that the motion stays in, one or
            three; 0: none, so that only poses are proven; None: `ACCELERATION`, or none where the
            orientation changes [m/s^2]. Where it changes, six, (angular, linear), see
            `ProvenSets.find` [rad/s^2, m/s^2].
        clearance: Least clearance of cables and platform [m].
        method: sequences or gcs.
        boxes: Boxes that are judged.
        cells: Cells of the raster on which they are merged.
        cover: Share of the proven cells that sets cover.
        sequences: Sequences of sets that are looked at.
        stations: Points of the path at which limits are asked.
        sets: Sets that were found before, in place of new ones.
    """

    least: str = "length"
    obstacles: Any = None
    moving: Sequence[MovingObstacle] = ()
    accelerations: Array | float | None = None
    clearance: float = 0.0
    method: str = "sequences"
    boxes: int = BOXES
    cells: int = CELLS
    cover: float = COVER
    sequences: int = SEQUENCES
    stations: int = STATIONS
    sets: ProvenSets | None = None


ASKED = tuple(field.name for field in fields(ProvenSettings))
"""What `plan_proven_motion` can be asked for by name."""


class DrawnProvenPlan(ProvenRun):
    """A `ProvenRun` that draws itself."""

    def plot(self) -> Figure:
        """Sets, obstacles and the path."""
        from cdpr_drake.analyses.planning.proven_plan_figures import sets_figure

        return sets_figure(self)


@verb()
def plan_proven_motion(
    robot: Robot | str | Path,
    start: object,
    goal: object,
    limits: Limits = None,
    *,
    pulleys: bool = True,
    track: bool = False,
    say: Say | None = None,
    **asked: Any,
) -> DrawnProvenPlan | DrawnTimedPlan:
    """A motion of a robot from one pose to another in sets of poses that are proven.

    With accelerations, where it turns also angular ones, it is proven of every instant that
    tensions within the limits (less the reserve) give the motion, and that cables and platform meet
    nothing. Among obstacles that move the sets are of poses and time, and the motion waits where it
    must.

    Args:
        robot: The robot, or its name or path.
        start: X_WP at its start, as `as_pose` takes it [m]; None: the home pose.
        goal: X_WP at its end, likewise.
        limits: As of `plan_path`.
        pulleys: Whether the cables run over the robot's pulleys.
        track: Whether the simulated robot also tracks the motion.
        say: Called with a line on what is done now.
        asked: Fields of `ProvenSettings`.

    Raises:
        PlanningError: The sets do not connect the poses, or something is not accepted.
        WorkspaceError: Something does not hold at an end, or is not proven there: which kind, and
            numbers.
    """
    check_asked(asked, ASKED)
    settings, tell = ProvenSettings(**asked), say or silent
    loaded, given = as_robot(robot, "plan_proven_motion"), chosen_limits(limits)
    task = planned_for(loaded, given, pulleys)
    ends = [pose_numbers(as_pose(loaded, pose)) for pose in (start, goal)]
    obstacles, moving = settings.obstacles, tuple(settings.moving)
    if isinstance(obstacles, str | Path):
        obstacles, found_moving = load_all_obstacles(Path(obstacles))
        moving = (*found_moving, *moving)
    begin = time.perf_counter()
    if moving:
        check_timed(settings.method, settings.accelerations, ends)
    sets = settings.sets
    if sets is None:
        proof = ProofSettings(
            boxes=settings.boxes, cells=settings.cells, clearance=settings.clearance,
            limits=(task.limits.lower, task.limits.upper), pulleys=pulleys,
        )  # fmt: skip
        sets = ProvenSets.find(
            loaded, None, np.array([end[3:] for end in ends]), obstacles,
            _accelerations(settings, ends), cover=settings.cover,
            must=dict(zip(("from", "to"), ends, strict=True)), settings=proof, say=tell,
        )  # fmt: skip
    else:
        _check_ends(sets, ends)
    arguments = limits_told(given, pulleys) | {
        "from": in_degrees(ends[0]),
        "to": in_degrees(ends[1]),
        **asked_told(asked, ("sets", "obstacles", "moving")),
    }
    if moving:
        timed = plan_among_moving(
            loaded,
            sets,
            moving,
            (ends[0], ends[1]),
            task,
            settings.least,
            arguments=arguments,
            begin=begin,
            say=tell,
        )
        own, log = tracked_by(loaded, given, timed.found.plan, say, track)
        return replace(timed, limits=own, tracked=log)
    between = time.perf_counter()
    try:
        found = proven_motion(
            sets, ends[0], ends[1], task, length_scale(loaded), cost=settings.least,
            method=settings.method, count=settings.sequences, stations=settings.stations, say=tell,
        )  # fmt: skip
    except PlanningError as problem:
        if not sets.cut or "do not connect" not in str(problem):
            raise
        raise PlanningError(
            f"{problem}; {sets.cut} open cells between them were cut further"
        ) from problem
    took = time.perf_counter() - between
    run = DrawnProvenPlan(
        robot=loaded, limits=task.limits, arguments=arguments, planning_time=took, found=found,
        sets_time=between - begin, judged=judged(sets, found.plan, JUDGED),
    )  # fmt: skip
    own, log = tracked_by(loaded, given, found.plan, say, track)
    return replace(run, limits=own, tracked=log)


def judged(sets: ProvenSets, plan: PathPlan, count: int) -> tuple[int, dict[str, int]]:
    """Samples of a motion, evenly in time, and of each kind at how many it fails exactly."""
    motion = plan.trajectory
    times = np.linspace(motion.start_time, motion.end_time, count)
    poses = [motion.pose(t) for t in times]
    found = sets.judge(
        np.array([X.translation() for X in poses]),
        np.array([X.rotation().matrix() for X in poses]),
    )
    return count, {name: int(np.count_nonzero(~holds)) for name, holds in found.items()}


def _accelerations(settings: ProvenSettings, ends: list[Array]) -> Array | float | None:
    given = settings.accelerations
    if given is None:
        return ACCELERATION if np.array_equal(ends[0][3:], ends[1][3:]) else None
    return None if np.ndim(given) == 0 and given == 0.0 else given


def _check_ends(sets: ProvenSets, ends: list[Array]) -> None:
    for where, pose in zip(("from", "to"), ends, strict=True):
        if not sets.covers(pose):
            why = explain_pose(sets, pose) if sets.conditions is not None else ""
            raise WorkspaceError(
                f"{where}: lies in none of {len(sets)} sets{': ' * bool(why)}{why}; accepted: a "
                "pose in one of them"
            )
