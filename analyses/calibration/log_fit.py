"""What calibrations and identifications make of a log alike: winches, clock, robot file, report."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError, IdentificationError
from cdpr_drake.identification.result import IdentificationResult
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.time_shift import WORSE

LATE = 0.25
"""A clock is off by more than this share of the time between rows."""


def fitted_robot(
    robot: Robot, done: str, result: CalibrationResult | IdentificationResult, **changes: Any
) -> Robot:
    """A robot with what was found, and words of it among what its file assumes.

    Args:
        robot: As it was believed.
        done: What was done with it, as "Calibrated".
        result: What was found.
        changes: Its new fields.
    """
    words = f"{done}: {result.status}, {len(result.names)} parameters."
    return replace(robot, **changes, assumptions=f"{robot.assumptions} {words}".strip())


def wound_lengths(robot: Robot, log: CalibrationLog) -> Array | None:
    """Unstrained lengths as the winches count them, or as their motors' angles say, shape (k, m)
    [m]; None: the log has neither."""
    if log.lengths is None and log.angles is not None:
        return robot.drum().paid_out(log.angles)
    return log.lengths


def refuse_late_tracker(
    log: CalibrationLog, against: str, found: tuple[float, float], step: float,
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    """Refuses a tracker that is out of sync.

    Args:
        log: The log with its poses.
        against: What they were compared with.
        found: By how much they are late [s], and how many times better they fit with that shift.
        step: Time between rows [s].
        error: What is raised.

    Raises:
        CalibrationError: It is, or an IdentificationError; says by how much.
    """
    shift, better = found
    if better > WORSE and abs(shift) > LATE * step:
        late = "late" if shift > 0.0 else "early"
        raise error(
            f"{log.path}: tracker: found it {abs(shift):.4g} s {late} against the {against}, "
            f"which fit {better:.2g} times better with that shift; accepted: the same clock, or "
            f"tracker_late {shift:.4g}"
        )
