"""From a log and what is asked to what was found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask, prepare
from cdpr_drake.analyses.calibration.fit_programs import start_points
from cdpr_drake.analyses.calibration.fit_starts import Tie, best_of_starts
from cdpr_drake.analyses.calibration.fit_verdict import (
    MISFIT,
    bad_sensors,
    doubts,
    misfits,
    unused_columns,
)
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.calibration.tracker import check_clock, with_tracker
from cdpr_drake.calibration.result import CalibrationResult

REMARKED = 2.0
"""A fit that is worse than this many sigmas is remarked."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a log told of a robot.

    Attributes:
        task: What was asked.
        log: The log.
        result: What was found.
        mount: The camera's mounting, if there are images.
        remarks: What should be known of it, in words.
        misfit: Why it is no fit, in words; empty where it is one.
        ties: Poses that fit as well elsewhere.
    """

    task: CalibrationTask
    log: CalibrationLog
    result: CalibrationResult
    mount: str | None
    remarks: tuple[str, ...]
    misfit: tuple[str, ...] = ()
    ties: tuple[Tie, ...] = ()


def calibrate(
    task: CalibrationTask, log: CalibrationLog, say: Callable[[str], None] = lambda words: None
) -> Calibration:
    """Calibrates a robot.

    The result's status is "misfit" where it does not fit what was measured, see `misfits`.

    Args:
        task: What is asked.
        log: What was measured.
        say: Told what is done now.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
    """
    say("Looking for where the poses were")
    prepared = prepare(task, log)
    if log.poses is not None and prepared.tracked is None:
        prepared = with_tracker(prepared, start_points(prepared, [prepared.first])[0].poses)
    check_clock(prepared)
    found = best_of_starts(prepared, say)
    result = found.result
    misfit = misfits(result)
    if misfit:
        result = replace(result, status=MISFIT)
    remarks = [*log.remarks, *unused_columns(prepared)]
    if result.degrees > 0 and result.spread() > REMARKED:
        remarks.append(
            f"residuals are {result.spread():.3g} times what sigmas say; standard deviations are "
            "as much too small, or something that was not asked for is off"
        )
    remarks += [*bad_sensors(result), *doubts(result, found.minima)]
    if found.ties:
        remarks.append(_tied(found.ties))
    return Calibration(task, log, result, prepared.mount, tuple(remarks), misfit, found.ties)


def _tied(ties: tuple[Tie, ...]) -> str:
    """That there are two places of a row, in words."""
    tied = list(dict.fromkeys(tie.pose + 1 for tie in ties))
    rows = ", ".join(str(row) for row in tied[:10])
    more = f" and {len(tied) - 10} more" if len(tied) > 10 else ""
    far = max(ties, key=lambda tie: tie.distance)
    return (
        f"row{'s' if len(tied) > 1 else ''} {rows}{more}: found another pose that fits as well "
        f"within noise, up to {1e3 * far.distance:.3g} mm away"
    )
