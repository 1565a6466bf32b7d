"""The stability criterion along a run that was made, with the cables that were slack left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.visual_servo_run import RunResult
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry import PLANAR_ROWS, cable_jacobian
from cdpr_drake.spatial import pose_from_row
from cdpr_drake.stability import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.systems.diagrams import LoopServo, VisualServo
from cdpr_drake.systems.servos import ideal_sighting

MOST_ROWS = 2000
"""Rows of a log that are judged at most; of longer ones, some in equal distances."""


@dataclass(frozen=True, eq=False)
class StabilityAlong:
    """Cables that pull, and whether the servo was stable, along a run.

    Attributes:
        time: Shape (n,) [s].
        taut: Number of cables that pull, shape (n,).
        rank: Rank of the Jacobian with their rows only, shape (n,).
        margin: Smallest eigenvalue of the symmetric part of Pi, shape (n,); zero where the rank is
            less than the platform's degrees of freedom, NaN where the features leave a motion free
            or a cable cannot run.
        freedom: Degrees of freedom of the platform.
    """

    time: Array
    taut: Array
    rank: Array
    margin: Array
    freedom: int

    def underactuated_time(self) -> float:
        """Time with less taut cables than hold the platform [s]."""
        return float(np.sum(np.diff(self.time) * (self.rank[:-1] < self.freedom)))

    def unstable_time(self) -> float:
        """Time without a positive margin, as far as it is known [s]."""
        return float(np.sum(np.diff(self.time) * (self.margin[:-1] <= 0.0)))


def stability_at(
    servo: VisualServo | LoopServo,
    X_WP: RigidTransform,
    X_estimated: RigidTransform,
    taut: np.ndarray,
    time: float = 0.0,
) -> tuple[int, float]:
    """Rank of the Jacobian and margin of Pi at a moment of a servo, with the taut cables only.

    Truth and belief see the same object, as in the thesis: between them stand the platform's pose,
    the points of the cables, and the camera on the platform.

    Args:
        servo: The servo, with what is believed of the robot.
        X_WP: True pose of the platform.
        X_estimated: Its estimate.
        taut: Which cables pull, shape (m,) bool.
        time: Time, for a target that moves [s].

    Returns:
        The rank, and the smallest eigenvalue of the symmetric part of Pi; 0 if the rank is less
        than the platform's degrees of freedom, NaN where the features leave a motion free.

    Raises:
        CableGeometryError: A cable cannot run.

    Source: servoing thesis 5.3.1, (3.1), (3.8).
    """
    scenario, believed = servo.scenario, servo.believed
    true = scenario.cables.cable_set(servo.robot)
    planar = believed.is_planar()
    J = cable_jacobian(X_WP, true)[taut]
    if planar:
        J = J[:, list(PLANAR_ROWS)]
    freedom = 3 if planar else 6
    rank = int(np.linalg.matrix_rank(J)) if len(J) else 0
    features = servo.controller.tasks[-1].features
    if features.rank < freedom:
        return rank, float("nan")
    if rank < freedom:
        return rank, 0.0
    _, L = features.evaluate(ideal_sighting(servo.target, servo.X_CO(X_WP, time)))
    cables = believed.cables
    if not scenario.controller.pulleys:
        cables = cables.without_pulleys()
    Pi = stability_matrix(
        ModelAtPose(X_WP, true, servo.mounting.X_BC, np.array(L)),
        ModelAtPose(X_estimated, cables, believed.X_PC, np.array(L)),
        local=len(L) > freedom,
        taut=taut,
        planar=planar,
    )
    return rank, stability_margin(Pi)


def stability_along(result: RunResult, threshold: float | None = None) -> StabilityAlong:
    """Cables that pull and the stability criterion along a run, from its log.

    Args:
        result: The run.
        threshold: Tension above which a cable pulls [N]; None: as the log's "slack" says.
    """
    log, servo = result.log, result.servo
    count = len(log["time"])
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).astype(int))
    slack = log["slack"][rows] > 0.0 if threshold is None else log["tensions"][rows] < threshold
    times, true, estimated = (log[name][rows] for name in ("time", "X_WP", "X_WP_estimated"))
    rank, margin = np.zeros(len(rows)), np.full(len(rows), np.nan)
    for k, time in enumerate(times):
        try:
            rank[k], margin[k] = stability_at(
                servo, pose_from_row(true[k]), pose_from_row(estimated[k]), ~slack[k], float(time)
            )
        except CableGeometryError:  # of a run that diverged
            continue
    freedom = 3 if servo.believed.is_planar() else 6
    return StabilityAlong(times, np.sum(~slack, axis=1).astype(float), rank, margin, freedom)
