"""Predictive control in the study: a quintic motion that is too fast for the cables."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.predictive_tensions import PredictiveTensions
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

ROBOT, LIMITS = "acrobot_large", (1.0, 60.0)
START, GOAL = (0.0, 0.0, 0.2), (0.15, -0.1, 0.4)

SLOW, FAST = 1.5, 0.45
"""Times of the motion: one that the cables can give, one that they cannot [s]."""

HORIZONS = (5, 10, 20)
"""Steps ahead."""

COMPUTED_TORQUE, PREDICTIVE = "computed torque", "predictive"
RATES = {COMPUTED_TORQUE: 1000.0, PREDICTIVE: 100.0}
"""Steps of control per second [Hz]."""

GAINS = TaskGains(stiffness=100.0, damping=20.0)

PAUSE, REST = 0.1, 0.5
"""Rest before and after [s]."""


def track_quintic(duration: float, steps: int) -> dict[str, Any]:
    """A quintic motion tracked by computed torque (0 steps) or by predictive control.

    Args:
        duration: Of the motion [s].
        steps: Ahead.

    Returns:
        rms_m, largest_m: distance of Po from the motion; failures: steps of control at which no
        tensions within the limits were found.
    """
    robot = load_robot(ROBOT)
    motion = PoseTrajectory((RigidTransform(START), RigidTransform(GOAL)), (duration,), PAUSE)
    rate = RATES[PREDICTIVE if steps else COMPUTED_TORQUE]
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=motion, gains=GAINS, limits=LIMITS, rate=rate,
            rule=StepRule(method="runge_kutta3", max_step=1e-3),
            distributor=PredictiveTensions(motion, steps) if steps else TensionDistributor,
        ),
        log_rate=200.0,
    )  # fmt: skip
    simulator = Simulator(control.diagram, control.make_context())
    simulator.AdvanceTo(PAUSE + duration + REST)
    log = control.read_log(simulator.get_context())
    apart, _ = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    return {
        "rms_m": np.sqrt(np.mean(apart**2)),
        "largest_m": np.max(apart),
        "failures": int(log["failures"][-1, 0]),
    }
