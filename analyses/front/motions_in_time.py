"""A motion of a robot among what moves, proven at every instant."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.planning.timed_plan_results import TimedRun
from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.analyses.workspaces.timed_sets import find_timed_sets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.timed_motion import MotionInTime, motion_in_time, straight_time
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_shapes import MovingObstacle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JUDGED = 2000
"""Samples of a motion that are judged by the exact checks of poses."""

MOVING_CHECKS = ("cables off what moves", "platform off what moves")
"""Names of the checks beside the kinds."""


class DrawnTimedPlan(TimedRun):
    """A `TimedRun` that draws itself."""

    def plot(self) -> Figure:
        """The way in space and time."""
        from cdpr_drake.analyses.planning.timed_plan_figures import space_time_figure

        return space_time_figure(self)


def check_timed(method: str, accelerations: Any, ends: Sequence[Array]) -> None:
    """Refuses what is not planned among obstacles that move.

    Raises:
        PlanningError: Something is not accepted.
    """
    if method != "sequences":
        raise PlanningError(
            f"method: found {method!r} with obstacles that move; accepted: sequences"
        )
    if not np.array_equal(ends[0][3:], ends[1][3:]):
        raise PlanningError(
            "from, to: found two orientations with obstacles that move; accepted: one"
        )
    if np.ndim(accelerations) == 0 and accelerations == 0.0:
        raise PlanningError(
            "accelerations: found 0 with obstacles that move; accepted: above 0, since when it is "
            "where depends on them"
        )


@verb()
def plan_among_moving(
    robot: Robot, sets: ProvenSets, things: Sequence[MovingObstacle], ends: tuple[Array, Array],
    task: PathTask, least: str, *, arguments: dict[str, Any], begin: float,
    say: Callable[[str], None],
) -> DrawnTimedPlan:  # fmt: skip
    """A motion among what moves, in sets that are proven otherwise.

    Args:
        robot: The robot.
        sets: Sets that are proven but for what moves.
        things: What moves.
        ends: Start at time 0 and goal, shape (6,) each [m, rad].
        task: The robot with its limits.
        least: length or time.
        arguments: What was asked, for JSON.
        begin: When the search for sets began, by `time.perf_counter` [s].
        say: Called with a line on what is done now.

    Raises:
        WorkspaceError: As `find_timed_sets`.
        PlanningError: As `motion_in_time`.
    """
    if sets.about["accelerations_m_s2"] is None or sets.conditions is None:
        raise PlanningError(
            "sets: found sets of a file, or without accelerations, with obstacles that move; "
            "accepted: sets that were found with accelerations"
        )
    box = np.array(sets.about["accelerations_m_s2"], float)
    clearance = float(sets.about["clearance_m"])
    whole = straight_time(task, ends[0], ends[1], box)
    timed = find_timed_sets(robot, sets, things, ends, whole, clearance=clearance, say=say)
    between = time.perf_counter()
    found = motion_in_time(timed, *ends, task, box, cost=least, say=say)
    took = time.perf_counter() - between
    around = sets.conditions.around
    assert around is not None
    return DrawnTimedPlan(
        robot=robot, limits=task.limits, arguments=arguments, planning_time=took, found=found,
        things=tuple(things), around=around, sets_time=between - begin,
        judged=judged_in_time(sets, found, things, around, JUDGED),
    )  # fmt: skip


def judged_in_time(
    sets: ProvenSets, found: MotionInTime, things: Sequence[MovingObstacle],
    around: Surroundings, count: int,
) -> tuple[int, dict[str, int]]:  # fmt: skip
    """Samples of a motion, evenly in time, and of each check at how many it fails exactly."""
    motion = found.plan.trajectory
    times = np.linspace(motion.start_time, motion.end_time, count)
    poses = [motion.pose(float(t)) for t in times]
    p = np.array([X.translation() for X in poses])
    R = np.array([X.rotation().matrix() for X in poses])
    failed = {name: int(np.count_nonzero(~holds)) for name, holds in sets.judge(p, R).items()}
    gaps = moving_clearances(around, things, times, p[:, np.newaxis], R[:, np.newaxis])[:, 0]
    hit = ~(gaps > float(sets.about["clearance_m"]))
    return count, failed | {
        name: int(np.count_nonzero(hit[:, k])) for k, name in enumerate(MOVING_CHECKS)
    }
