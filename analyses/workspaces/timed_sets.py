"""Sets of poses and time of a robot among obstacles that move: how long, how fine, and of what."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.timed_cells import PoseRaster, clear_cells
from cdpr_drake.workspaces.timed_sets import TimedSets, sets_in_time

POSE_CELLS = 2**15
"""Cells of poses, at most; each in `FEWEST_STEPS` to `MOST_STEPS` intervals of time."""

FEWEST_STEPS, MOST_STEPS = 32, 128
FINE = 24
"""Steps of time in the time of a straight motion, at least, within those limits."""

AFTER = 2.0
"""Times of a straight motion that are looked at after everything has come to rest, or is gone."""

LONGEST = 8.0
"""Times of a straight motion that are looked at where something moves for ever."""

LOOKS = 400
"""Instants at which it is looked whether something is still there."""


def find_timed_sets(
    robot: Robot, static: ProvenSets, things: Sequence[MovingObstacle], ends: tuple[Array, Array],
    whole: float, *, clearance: float = 0.0, say: Callable[[str], None] = lambda words: None,
) -> TimedSets:  # fmt: skip
    """Proves poses and times that are clear of what moves, among those that are proven otherwise.

    Args:
        robot: The robot.
        static: Sets in which all else is proven, with their cells.
        things: What moves.
        ends: Start at time 0 and goal, shape (6,) each [m, rad].
        whole: Time of a straight motion between them [s].
        clearance: Least clearance of cables and platform from what moves [m].
        say: Told what is done now.

    Raises:
        WorkspaceError: The sets have no cells, or as `sets_in_time`.
    """
    if static.cells is None or static.conditions is None:
        raise WorkspaceError("sets: found sets of a file; accepted: sets that were found")
    horizon = _horizon(robot, things, whole)
    steps = FEWEST_STEPS
    while steps < MOST_STEPS and horizon / steps > whole / FINE:
        steps *= 2

    def tell(judged: int, share: float) -> None:
        say(f"Proving poses and times of {robot.name}: {judged} boxes, {share:.1%} open")

    raster = PoseRaster.of(static.cells, POSE_CELLS)
    around = static.conditions.around
    cells = clear_cells(raster, around, things, clearance, horizon, steps, on_progress=tell)
    speed = float(np.linalg.norm(ends[1][:3] - ends[0][:3])) / whole
    about = {**static.about, "moving": [thing.name for thing in things]}
    return sets_in_time(cells, *ends, speed, about=about, say=say)


def _horizon(robot: Robot, things: Sequence[MovingObstacle], whole: float) -> float:
    """Until when poses are looked at [s]: for a while after all rests, or has left the frame.

    Proofs do not depend on it.
    """
    low, high = robot.reach()
    longest, last = LONGEST * whole, 0.0
    for thing in things:
        settled = thing.settled()
        until = settled if np.isfinite(settled) else longest
        times = np.linspace(0.0, until, LOOKS) if settled > 0.0 else np.zeros(0)
        near = [float(time) for time in times if _near(thing, float(time), low, high)]
        last = max([last, *near])
    forever = any(not np.isfinite(thing.settled()) for thing in things)
    return last if forever and last == longest else last + AFTER * whole


def _near(thing: MovingObstacle, time: float, low: Array, high: Array) -> bool:
    """True if some of it is in the frame."""
    return any(
        np.all(np.min(shape.points, axis=0) - shape.radius <= high)
        and np.all(low <= np.max(shape.points, axis=0) + shape.radius)
        for shape in thing.at(time)
    )
