"""From a log and what is asked to what was found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cdpr_drake.analyses.calibration.calibration_request import (
    CalibrationTask,
    Prepared,
    prepare,
)
from cdpr_drake.analyses.calibration.fit_programs import start_points
from cdpr_drake.analyses.calibration.fit_starts import MultiStartFit, Tie, best_of_starts
from cdpr_drake.analyses.calibration.fit_verdict import (
    MISFIT,
    bad_sensors,
    doubts,
    likely_scales,
    misfits,
    remarked_groups,
    unused_columns,
    with_enlarged_deviations,
)
from cdpr_drake.analyses.calibration.held_out import (
    EACH,
    HeldOut,
    HeldRow,
    held_groups,
    predicted,
)
from cdpr_drake.analyses.calibration.tracker import (
    check_clock,
    with_tracker,
    with_turned_tracker,
)
from cdpr_drake.analyses.calibration.turned_sensors import (
    Refit,
    far_outside,
    flipped,
    turned_sensors,
    turned_where_lost,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.fit_groups import GroupFault, group_faults
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError

LOST = ("pose ", "search: ", "start: ")
"""How errors begin that a sensor's sign may be the reason of."""


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
        held: Rows that were not fitted but predicted; None: all were fitted.
        groups: Groups of measurements that do not agree with the others.
    """

    task: CalibrationTask
    log: Measurements
    result: CalibrationResult
    mount: str | None
    remarks: tuple[str, ...]
    misfit: tuple[str, ...] = ()
    ties: tuple[Tie, ...] = ()
    held: HeldOut | None = None
    groups: tuple[GroupFault, ...] = ()


def calibrate(
    task: CalibrationTask, log: Measurements, say: Callable[[str], None] = lambda words: None
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
    if task.hold_out is not None:
        return _held_out(task, log, say)
    try:
        prepared, found = _fitted(task, log, say)
    except CalibrationError as problem:
        if str(problem).startswith(LOST):
            say("Looking for signs that are turned")
            turned = turned_where_lost(task, log, _refitted)
            if turned:
                raise CalibrationError(f"{problem}; {turned[0]}") from problem
        raise
    result = found.result
    groups = group_faults(found.problem, result)
    misfit = misfits(result, groups)
    up = prepared.first.rotation().matrix()[:, 2]
    over, undecided = flipped(result, up)
    misfit = (*over, *misfit)
    outside = far_outside(task.robot, result)
    if outside.any():
        misfit = (
            f"the platform is out of the frame by more than its size in {np.sum(outside)} of "
            f"{len(outside)} rows: sign, unit or zero of a sensor?", *misfit,
        )  # fmt: skip
    if misfit:
        say("Looking for signs that are turned")
        turned = turned_sensors(task, log, result, groups, _refitted)
        misfit = (*turned, *misfit)
    if misfit:
        result = replace(result, status=MISFIT)
    remarks = [*log.remarks, *unused_columns(prepared)]
    result, larger = with_enlarged_deviations(result, groups)
    remarks += [*remarked_groups(groups), *larger, *likely_scales(result, prepared)]
    remarks += [*bad_sensors(result), *doubts(result, found.minima), *undecided]
    remarks += [
        f"{name} is held at its bound, {value:.6g}; standard deviations are those of the others "
        "while it stays there"
        for name, value in result.at_bounds.items()
    ]
    if found.flipped_costs_less > 0.0:
        remarks.append(
            f"a platform upside down would cost {found.flipped_costs_less:.3g} less, which was not "
            "taken: its start is upright"
        )
    if found.ties:
        remarks.append(_tied(found.ties))
    return Calibration(
        task, log, result, prepared.mount, tuple(remarks), misfit, found.ties, None, groups
    )


def _quiet(words: str) -> None:
    """Says nothing."""


def _refitted(task: CalibrationTask, log: Measurements) -> Refit:
    """What one start finds, to try what may be wrong of a log; and groups that do not agree."""
    found = _fitted(task, log, _quiet, others=False)[1]
    return Refit(found.result, group_faults(found.problem, found.result))


def _fitted(
    task: CalibrationTask, log: Measurements, say: Callable[[str], None], others: bool = True
) -> tuple[Prepared, MultiStartFit]:
    """The log and task, checked, and the best of all starts, or of the believed one alone."""
    say("Looking for where the poses were")
    prepared = prepare(task, log)
    if log.poses is not None and prepared.tracked is None:
        prepared = with_tracker(prepared, start_points(prepared, [prepared.first])[0].poses)
    elif log.points is not None and prepared.freedom.motion.is_point and prepared.tracked is None:
        prepared = with_turned_tracker(prepared, start_points(prepared, [prepared.first])[0].poses)
    check_clock(prepared)
    return prepared, best_of_starts(prepared, say, others)


def _held_out(task: CalibrationTask, log: Measurements, say: Callable[[str], None]) -> Calibration:
    """A calibration on some rows, the others predicted; or on all, each held out once."""
    assert task.hold_out is not None
    words, plain = task.hold_out, replace(task, hold_out=None)
    whole = prepare(plain, log)
    rows: list[HeldRow] = []
    groups = held_groups(words, log, whole.is_zeroed() and task.zero is not None)
    for number, group in enumerate(groups):
        say(f"Calibrating without rows, {number + 1} of {len(groups)}")
        kept = np.setdiff1d(np.arange(log.count), group)
        found = calibrate(plain, log.only(kept))
        rows += predicted(whole, found.result, kept.tolist(), group)
    if len(groups) == 1 and str(words) != EACH:
        return replace(found, held=HeldOut(tuple(rows), tuple(kept.tolist())))
    return replace(calibrate(plain, log, say), held=HeldOut(tuple(rows), ()))


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
