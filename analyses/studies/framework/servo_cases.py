"""A servo of a robot without errors of its model, and what verdicts on stability need of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.studies.framework.servo_models import (
    Perturbation,
    PerturbedServo,
    perturbed_servo,
)
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds, vector_size
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


@dataclass(frozen=True, kw_only=True, eq=False)
class ServoCase:
    """A servo and the same for verdicts.

    Attributes:
        servo: Without errors of its model.
        case: The same for the verdicts; it knows no pulleys.
        bounds: What limits the errors, of the robot's workspace by default.
        box: Lower and upper corner of where Po may start, shape (3,) each [m].
    """

    servo: PerturbedServo
    case: StabilityCase
    bounds: PerturbationBounds
    box: tuple[Array, Array]


def servo_case(scenario: Scenario, lowest: float) -> ServoCase:
    """The servo of a scenario with a robot that ships.

    Args:
        scenario: The task of the servo.
        lowest: Least height of Po at the start [m].
    """
    robot = load_robot(scenario.robot)
    defaults = workspace_defaults(robot, scenario.robot)
    none = Perturbation.from_vector(np.zeros(vector_size(len(robot.cables))))
    servo = perturbed_servo(scenario, none)
    return ServoCase(
        servo=servo,
        case=StabilityCase(
            robot.cable_set().without_pulleys(),
            scenario.controller.scheme,
            X_PC=servo.X_PC,
            target=FixedObject(servo.X_WO, scenario.desired.transform()),
            lever="object",
        ),
        bounds=defaults.bounds,
        box=(np.maximum(defaults.lower, [-np.inf, -np.inf, lowest]), defaults.upper),
    )
