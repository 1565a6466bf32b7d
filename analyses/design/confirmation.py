"""Whether a design is better than the robot was, by numbers that the search does not know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cdpr_drake.analyses.design.goals import GOALS, GoalContext, can_close, servo_stable
from cdpr_drake.analyses.workspaces.box_certificates import box_search, certified_boxes
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count

NEEDS_SPARE = ("wrench-closure", "single-failure")
"""Kinds without a pose where no cable is more than the degrees of freedom need."""

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
        finished: Whether the proofs came to their end.
    """

    goal: str
    method: str
    unit: str
    original: float
    design: float
    original_open: float
    design_open: float
    finished: bool

    @property
    def sure(self) -> bool:
        """Whether the design is better whatever is true of what is open."""
        return self.design > self.original + self.original_open

    @property
    def gain(self) -> float | None:
        """What the design has more, relative to the original; None where that had nothing."""
        return self.design / self.original - 1.0 if self.original > 0.0 else None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "goal": self.goal,
            "method": self.method,
            "unit": self.unit,
            "original": self.original,
            "design": self.design,
            "original_open": self.original_open,
            "design_open": self.design_open,
            "gain": self.gain,
            "sure_whatever_is_open": self.sure,
            "finished": self.finished,
        }


def confirm(
    goal: str,
    original: str,
    design: str,
    judging: GoalContext,
    *,
    boxes: int = BOXES,
    say: Callable[[str], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Confirmation | None:
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
        say: Told what is done.
        should_stop: Asked often; True ends the proofs with what is proven by then.

    Raises:
        CdprError: A robot cannot be asked.
    """
    if goal == "csw":
        return _confirm_stability(original, design, judging)
    kind = GOALS[goal].proven_as
    if not kind:
        return None
    volumes, opens, finished = [], [], True
    for name in (original, design):
        robot = load_robot(name)
        if kind in NEEDS_SPARE and not can_close(robot):  # such a set of cables was chosen
            volumes.append(0.0)
            opens.append(0.0)
            continue
        if say is not None:
            say(f"proving {kind} of {robot.name}")
        required = judging.required if kind in RESISTING else None
        about = pose_conditions(robot, required=required)
        search = box_search(robot, about, [kind], judging.grid.angles)
        proof = certified_boxes(search, boxes, should_stop=should_stop)
        size = robot.frame.upper - robot.frame.lower
        volume = float(np.prod(size[:2] if robot.is_planar() else size))
        volumes.append(proof.inside * volume)
        opens.append(proof.open * volume)
        finished &= proof.finished
    unit = "m^2" if load_robot(original).is_planar() else "m^3"
    words = f"boxes of the frame proven inside, {boxes} judged"
    return Confirmation(goal, words, unit, volumes[0], volumes[1], opens[0], opens[1], finished)


def _confirm_stability(original: str, design: str, judging: GoalContext) -> Confirmation:
    grid = between(judging.grid)
    shares = []
    for name in (original, design):
        stable = servo_stable(load_robot(name), replace(judging, grid=grid), "certified")
        shares.append(float(np.mean(stable)))
    points = " x ".join(str(n) for n in grid.shape[1:])
    words = f"poses of a grid of {points}, each held and proven stable"
    return Confirmation("csw", words, "share", shares[0], shares[1], 0.0, 0.0, True)


def between(grid: WorkspaceGrid) -> WorkspaceGrid:
    """A grid over the same box with points between those of another, for an independent look."""
    lower, upper = grid.lower, grid.upper
    counts = [1 if n == 1 else n + 1 for n in grid.shape[1:]]
    half = np.array([0.25 * (axis[1] - axis[0]) if len(axis) > 1 else 0.0 for axis in grid.axes])
    return grid_by_count(lower + half, upper - half, counts, [tuple(a) for a in grid.angles])
