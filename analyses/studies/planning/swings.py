"""Rest to rest by input shaping in the study: what swings, and how much is left of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.trajectories import example_robot, plan_shaped_rest, simulate_swing
from cdpr_drake.models import Robot, load_robot
from cdpr_drake.planning import SHAPERS

WATCH = 2.0
"""How long the platform is looked at after the command [s]."""

FOUR = (0, 2, 4, 6)
"""Cables of the suspended robot that are left of its eight."""


def _four_cables() -> Robot:
    robot = load_robot("acrobot_large")
    robot.cables = [robot.cables[k] for k in FOUR]
    return robot


@dataclass(frozen=True)
class SwingCase:
    """A motion from rest to rest.

    Attributes:
        name: What swings.
        robot: Makes the robot.
        start: Po at the start [m].
        goal: Po at the goal [m].
        duration: Of the law of time before it is shaped [s].
        bounds: Smallest and largest tension along the way; None: the robot's [N].
    """

    name: str
    robot: Callable[[], Robot]
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    duration: float
    bounds: tuple[float, float] | None = None


CASES = (
    SwingCase(
        "planar, cables of rubber", example_robot, (-0.1, 0.05, 0.3), (0.15, -0.05, 0.3), 0.45,
        (10.0, 60.0),
    ),
    SwingCase(
        "planar, its true cables", lambda: load_robot("planar"), (0.0, 0.0, 0.3), (0.005, 0.0, 0.3),
        0.03, (10.0, 60.0),
    ),
    SwingCase(
        "acrobot_large on four of eight cables", _four_cables, (-0.1, 0.0, 0.2), (0.1, 0.0, 0.2),
        0.5,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class SwingResult:
    """What was left of a motion's swing.

    Attributes:
        name: Of the case.
        slowest: Least frequency of the platform at rest, of start, middle and goal [Hz].
        way: Of Po [m].
        left: By shaper, and "none": largest distance of Po after the command ended [m].
        end_times: By the same, when it ended [s].
        slow: Largest distance after a motion that is not shaped and takes as long as the one that
            ZVD shapes [m].
    """

    name: str
    slowest: float
    way: float
    left: dict[str, float]
    end_times: dict[str, float]
    slow: float

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def run_swing(case: SwingCase) -> SwingResult:
    """Plans and simulates a case with every shaper, and without.

    Raises:
        PlanningError: The motion cannot be wound.
    """
    robot, ends = case.robot(), (RigidTransform(case.start), RigidTransform(case.goal))
    left, end_times = {}, {}
    for kind in (None, *SHAPERS):
        motion = plan_shaped_rest(robot, *ends, case.duration, kind, bounds=case.bounds)
        name = kind or "none"
        left[name], end_times[name] = simulate_swing(motion, WATCH).left(), motion.end_time
    slow = plan_shaped_rest(robot, *ends, end_times["ZVD"], None, bounds=case.bounds)
    way = motion.goal.X_WP.translation() - motion.start.X_WP.translation()
    return SwingResult(
        name=case.name, slowest=float(np.min(motion.frequencies)), way=float(np.linalg.norm(way)),
        left=left, end_times=end_times, slow=simulate_swing(slow, WATCH).left(),
    )  # fmt: skip
