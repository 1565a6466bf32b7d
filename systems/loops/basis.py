"""What all runs of a scenario over seeds have in common, computed once in a process."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.diagrams.servo_watches import make_monitor
from cdpr_drake.systems.diagrams.visual_servo import integration_step
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.monitoring.run_monitor import RunMonitor
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


@dataclass(frozen=True, eq=False)
class LoopBasis:
    """What does not depend on a scenario's seed.

    Attributes:
        robot: The robot.
        max_step: Integration step [s], but for sensors that read more often.
        resting: State of platform and winches at the start, shape (n,).
        model: What the servo is about, for a seed of 0.
        servo: Its block.
        monitor: What judges a run.
        motion: A motion of the robot; others are made like it.
    """

    robot: Robot
    max_step: float
    resting: Array
    model: ServoModel
    servo: FeatureServo
    monitor: RunMonitor
    motion: RobotMotion


def loop_basis(scenario: Scenario) -> LoopBasis:
    """The basis of a scenario; the same object for all its seeds, while the robot's file stays.

    Raises:
        RobotFileError: The robot's file is not accepted.
        InfeasibleTensionError: The initial pose cannot be held.
    """
    path = robot_file(scenario.robot)
    written = path.stat()
    common = pickle.dumps(replace(scenario, seed=0))
    return _basis(common, path, written.st_mtime_ns, written.st_size)


@lru_cache(maxsize=8)
def _basis(common: bytes, path: Path, changed: int, size: int) -> LoopBasis:
    scenario: Scenario = pickle.loads(common)
    robot = load_robot(scenario.robot)
    model = servo_model(scenario, robot)
    max_step = integration_step(scenario, model)
    motion = RobotMotion(robot, scenario, StepRule())
    wrong = scenario.perturbations
    X_WP = scenario.initial_pose.transform()
    resting = motion.resting(X_WP, wrong.slack, wrong.slack_at_rest)
    return LoopBasis(
        robot, max_step, resting, model, model.make_servo(scenario), make_monitor(scenario, model),
        motion,
    )  # fmt: skip
