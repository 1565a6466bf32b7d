"""The stability criterion along a run that was made, with the cables that were slack left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.pan_tilt_settings import CameraPanTilt
from cdpr_drake.systems.diagrams.pan_tilt import LOGGED_ENCODERS, LOGGED_JOINTS, turned_mounting
from cdpr_drake.systems.diagrams.servo_models import LoopServo
from cdpr_drake.systems.diagrams.servo_watches import criterion_of, servo_criterion
from cdpr_drake.systems.diagrams.visual_servo import VisualServo
from cdpr_drake.systems.monitoring.stability_watch import ServoCriterion
from cdpr_drake.systems.robots.cable_forces import simulated_cables

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

    def least_margin(self) -> float | None:
        """Least margin, where any is known."""
        known = self.margin[np.isfinite(self.margin)]
        return float(np.min(known)) if len(known) else None

    def unstable_time(self) -> float:
        """Time without a positive margin, as far as it is known [s]."""
        return float(np.sum(np.diff(self.time) * (self.margin[:-1] <= 0.0)))


def run_criterion(servo: VisualServo | LoopServo) -> ServoCriterion:
    """The stability criterion of a run's servo."""
    if isinstance(servo, LoopServo):
        scenario = servo.scenario
        model = scenario.cables.model_of(servo.robot)
        cables = simulated_cables(scenario.cables.cable_set(servo.robot), model)
        return servo_criterion(servo, cables, scenario.controller.pulleys)
    return criterion_of(servo, servo.scenario.controller.pulleys)


def turned_criterion(
    criterion: ServoCriterion, mounting: CameraMounting, settings: CameraPanTilt, joints: Array
) -> ServoCriterion:
    """The criterion while a camera's joints are at angles and their encoders read others.

    The servo goes by what the camera would see at rest, reckoned with the encoders: that is what a
    camera at rest sees whose mounting is off by what the encoders are wrong.

    Args:
        criterion: Of the camera at rest.
        mounting: Its mounting, both angles zero.
        settings: The joints.
        joints: True angles, and those of the encoders, shape (2, 2) [rad].
    """
    true, told = (turned_mounting(mounting, settings, angles).X_BC for angles in joints)
    off = mounting.X_BC.inverse() @ true @ told.inverse() @ mounting.X_BC
    sees = criterion.sees
    return replace(
        criterion,
        camera=criterion.camera @ off,
        sees=lambda X_WP, time: off.inverse() @ sees(X_WP, time),
    )


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
    criterion, turns = run_criterion(servo), servo.scenario.camera.pan_tilt
    times, true, estimated = (log[name][rows] for name in ("time", "X_WP", "X_WP_estimated"))
    rank, margin = np.zeros(len(rows)), np.full(len(rows), np.nan)
    for k, time in enumerate(times):
        at = criterion
        if turns is not None:
            angles = np.array([log[name][rows[k]] for name in (LOGGED_JOINTS, LOGGED_ENCODERS)])
            at = turned_criterion(criterion, servo.mounting, turns, angles)
        try:
            rank[k], margin[k] = at.at(
                pose_from_row(true[k]), pose_from_row(estimated[k]), ~slack[k], float(time)
            )
        except CableGeometryError:  # of a run that diverged
            continue
    taut = np.sum(~slack, axis=1).astype(float)
    return StabilityAlong(times, taut, rank, margin, criterion.freedom)


def logged_stability(result: RunResult) -> StabilityAlong | None:
    """The same from the signals of a scenario's section `stability`; None where none are."""
    log = result.log
    if "stability_margin" not in log:
        return None
    taut, rank, margin = (
        log[name][:, 0] for name in ("taut_cables", "jacobian_rank", "stability_margin")
    )
    freedom = run_criterion(result.servo).freedom
    return StabilityAlong(log["time"], taut, rank, margin, freedom)


def stability_of_run(result: RunResult) -> StabilityAlong | None:
    """Stability along a run: as it was logged, else, with tension management, which is about that,
    reckoned from its poses; else None, as to reckon it takes longer than many a run."""
    logged = logged_stability(result)
    if logged is None and result.servo.scenario.tension_management is not None:
        return stability_along(result)
    return logged
