"""Whether a design is better than the robot was, by numbers that the search does not know."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from cdpr_drake.analyses.design.goals import (
    GOALS,
    NEEDS_SPARE,
    GoalContext,
    can_close,
    share_of_stable_poses,
)
from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs.certified_workspace import box_search, certified_boxes
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count

RESISTING = ("wrench-feasible", "single-failure")
"""Kinds that the wrenches to resist belong to."""

BOXES = 200_000
"""Boxes that are judged for each robot."""


@dataclass(frozen=True)
class Confirmation:
    """A volume of the robot as it was and of the design, proven.

    Attributes:
        goal: Name of the goal.
        method: How it was proven.
        unit: Unit of the numbers.
        original: What is proven of the robot as it was.
        design: What is proven of the design.
        original_open: What is neither proven inside nor outside.
        design_open: The same of the design.
        finished: True if the proofs came to their end.
    """

    goal: str
    method: str
    unit: str
    original: float
    design: float
    original_open: float = 0.0
    design_open: float = 0.0
    finished: bool = True

    @property
    def gain(self) -> float | None:
        """What the design has more, relative to the original; None where that had nothing."""
        return self.design / self.original - 1.0 if self.original > 0.0 else None

    def as_dict(self) -> dict[str, Any]:
        """For JSON; a gain is sure if the design is better whatever is true of what is open."""
        sure = self.design > self.original + self.original_open
        return {**asdict(self), "gain": self.gain, "sure_whatever_is_open": sure}


def confirm(
    goal: str, original: str, design: str, judging: GoalContext, *, boxes: int = BOXES,
    follow: Follow = NOBODY,
) -> Confirmation | None:  # fmt: skip
    """Proves a volume of two robots; None where nothing of the kind is proven.

    Kinds of `cdpr workspace --certify` are proven for boxes of the whole frame, in the orientations
    of the search from the least to the largest angles. Control stability is proven pose by pose, on
    a grid between the points of the search's.

    Args:
        goal: Name of a goal.
        original: Name or path of the robot as it was.
        design: The same of the design.
        judging: Orientations and wrenches.
        boxes: Boxes that are judged for each.
        follow: Who follows; a stop ends the proofs with what is proven by then.

    Raises:
        CdprError: A robot cannot be asked.
    """
    robots = [load_robot(name) for name in (original, design)]
    if goal == "csw":
        grid = between(judging.grid)
        shares = [share_of_stable_poses(robot, replace(judging, grid=grid)) for robot in robots]
        points = " x ".join(str(n) for n in grid.shape[1:])
        words = f"poses of a grid of {points}, each held and proven stable"
        return Confirmation(goal, words, "share", shares[0], shares[1])
    kind = GOALS[goal].proven_as
    if not kind:
        return None
    inside, open_volumes, finished = [], [], True
    for robot in robots:
        if goal in NEEDS_SPARE and not can_close(robot):  # such a set of cables was chosen
            inside.append(0.0)
            open_volumes.append(0.0)
            continue
        follow.progress(Progress(f"proving {kind} of {robot.name}", 1.0, 1.0))
        about = pose_conditions(robot, required=judging.required if kind in RESISTING else None)
        search = box_search(robot, about, [kind], judging.grid.angles)
        proof = certified_boxes(search, boxes, should_stop=follow.stop)
        size = robot.frame.upper - robot.frame.lower
        volume = float(np.prod(size[:2] if robot.is_planar() else size))
        inside.append(proof.inside * volume)
        open_volumes.append(proof.open * volume)
        finished &= proof.finished
    unit = "m^2" if robots[0].is_planar() else "m^3"
    words = f"boxes of the frame proven inside, {boxes} judged"
    return Confirmation(
        goal, words, unit, inside[0], inside[1], open_volumes[0], open_volumes[1], finished
    )


def between(grid: WorkspaceGrid) -> WorkspaceGrid:
    """A grid over the same box with points between those of another, for an independent look."""
    counts = [1 if n == 1 else n + 1 for n in grid.shape[1:]]
    half = np.array([0.25 * (axis[1] - axis[0]) if len(axis) > 1 else 0.0 for axis in grid.axes])
    angles = [tuple(a) for a in grid.angles]
    return grid_by_count(grid.lower + half, grid.upper - half, counts, angles)
