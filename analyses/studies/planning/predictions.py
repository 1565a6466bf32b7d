"""Predictive control in the study: a quintic motion that is too fast for the cables."""

from __future__ import annotations

from dataclasses import asdict, dataclass
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

RATES = {"computed torque": 1000.0, "predictive": 100.0}
"""Steps of control per second [Hz]."""

GAINS = TaskGains(stiffness=100.0, damping=20.0)

PAUSE, REST = 0.1, 0.5
"""Rest before and after [s]."""


@dataclass(frozen=True)
class TrackResult:
    """How a controller tracked a motion.

    Attributes:
        controller: Which one.
        steps: Ahead; 0 for computed torque.
        duration: Of the motion [s].
        rms: Root mean square distance of Po from the motion [m].
        largest: Largest distance [m].
        failures: Steps of control at which no tensions within the limits were found.
    """

    controller: str
    steps: int
    duration: float
    rms: float
    largest: float
    failures: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def track_quintic(duration: float, steps: int) -> TrackResult:
    """A quintic motion tracked by computed torque (0 steps) or by predictive control."""
    robot = load_robot(ROBOT)
    motion = PoseTrajectory((RigidTransform(START), RigidTransform(GOAL)), (duration,), PAUSE)
    name = "predictive" if steps else "computed torque"
    rate = RATES[name]
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
    return TrackResult(
        name, steps, duration, float(np.sqrt(np.mean(apart**2))), float(np.max(apart)),
        int(log["failures"][-1, 0]),
    )  # fmt: skip
