"""Rest to rest by input shaping in the study: what swings, and how much is left of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.input_shaping import plan_shaped_rest, simulate_swing
from cdpr_drake.analyses.planning.rest_to_rest import example_robot
from cdpr_drake.analyses.planning.shooting import plan_shot_rest
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.input_shaping import SHAPERS
from cdpr_drake.systems.robots.settings import CableSettings

WATCH = 2.0
"""How long the platform is looked at after the command [s]."""

FOUR = (0, 2, 4, 6)
"""Cables of the suspended robot that are left of its eight."""


def _four_cables() -> Robot:
    robot = load_robot("acrobot_large")
    robot.cables = [robot.cables[k] for k in FOUR]
    return robot


@dataclass(frozen=True)
class SwingMotion:
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


MOTIONS = (
    SwingMotion(
        "planar, cables of rubber", example_robot, (-0.1, 0.05, 0.3), (0.15, -0.05, 0.3), 0.45,
        (10.0, 60.0),
    ),
    SwingMotion(
        "planar, its true cables", lambda: load_robot("planar"), (0.0, 0.0, 0.3), (0.005, 0.0, 0.3),
        0.03, (10.0, 60.0),
    ),
    SwingMotion(
        "acrobot_large on four of eight cables", _four_cables, (-0.1, 0.0, 0.2), (0.1, 0.0, 0.2),
        0.5,
    ),
)  # fmt: skip

OFF = (0.9, 1.1)
"""Shares of the stiffness that was planned with, on which motions are looked at, too."""

SHOTS: dict[str, tuple[float, ...]] = {"shooting": (1.0,), "robust shooting": (OFF[0], 1.0, OFF[1])}
"""Multiple shooting: on which stiffnesses the motion shall end at rest."""

LONGER = (1.0, 1.25, 1.5, 2.0)
"""Durations that multiple shooting tries until there is a motion, over that of the case."""


def run_swing(number: int) -> dict[str, Any]:
    """Plans and simulates a motion with every shaper, by multiple shooting, and without.

    Args:
        number: In `MOTIONS`.

    Returns:
        slowest_hz: least frequency of the platform at rest, of start, middle and goal; way_m: of
        Po; left_m: by shaper, by name of `SHOTS`, and "none", the largest distance of Po after the
        command ended; off_m: the same on cables whose stiffness is off, see `OFF`; end_times_s:
        when it ended; refused: by name of `SHOTS`, why there is no such motion; slow_m: largest
        distance after a motion that is not shaped and takes as long as the one that ZVD shapes.

    Raises:
        PlanningError: The motion cannot be wound.
    """
    case = MOTIONS[number]
    robot, ends = case.robot(), (RigidTransform(case.start), RigidTransform(case.goal))
    motions, refused = {}, {}
    for kind in (None, *SHAPERS):
        motion = plan_shaped_rest(robot, *ends, case.duration, kind, bounds=case.bounds)
        motions[kind or "none"] = motion
    for name, ratios in SHOTS.items():
        for share in LONGER:
            try:
                motions[name] = plan_shot_rest(
                    robot, *ends, share * case.duration, bounds=case.bounds, ratios=ratios
                )
            except PlanningError as problem:
                refused[name] = str(problem)
                continue
            refused.pop(name, None)
            break
    end_times = {name: one.end_time for name, one in motions.items()}
    slow = plan_shaped_rest(robot, *ends, end_times["ZVD"], None, bounds=case.bounds)
    way = motion.goal.X_WP.translation() - motion.start.X_WP.translation()
    wrong = [CableSettings(stiffness_ratio=ratio) for ratio in OFF]
    return {
        "slowest_hz": np.min(motion.frequencies),
        "way_m": np.linalg.norm(way),
        "left_m": {name: simulate_swing(one, WATCH).left() for name, one in motions.items()},
        "off_m": {
            name: max(simulate_swing(one, WATCH, cables).left() for cables in wrong)
            for name, one in motions.items()
        },
        "end_times_s": end_times,
        "refused": refused,
        "slow_m": simulate_swing(slow, WATCH).left(),
    }
