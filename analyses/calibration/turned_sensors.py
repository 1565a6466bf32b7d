"""Whether measurements that do not fit would with the sign turned, or from another zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask
from cdpr_drake.analyses.calibration.fit_verdict import is_thrown_out, misfits
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.robot_schema import Robot

TRIED = {
    "swivel angles": "swivels",
    "lengths": "lengths",
    "motor angles": "angles",
    "tensions": "tensions",
    "inclination": "tilts",
}
"""Fields of a log by the kind of measurement."""

BY_CABLE = ("swivels", "lengths", "angles", "tensions")
"""Fields with a column a cable, each of which may be turned by itself."""

Refit = Callable[[CalibrationTask, CalibrationLog], CalibrationResult]


def turned_sensors(
    task: CalibrationTask, log: CalibrationLog, result: CalibrationResult, refit: Refit
) -> tuple[str, ...]:
    """What would fit otherwise, in words: kinds of which much was thrown out, else all, tried anew.

    A sign is the wrong one where, with it turned, the fit throws out no third of the kind and the
    whole costs less; where only one cable's is, the whole must fit then. A tilt is tried from other
    zeros, too. The first that fits is told.

    Args:
        task: What was asked.
        log: What was measured.
        result: What was found, which is no fit.
        refit: Calibrates anew.
    """
    suspects = [kind for kind, fit in result.residuals.items() if is_thrown_out(fit)]
    for kind, field in TRIED.items():
        values = getattr(log, field)
        if kind not in (suspects or result.residuals) or values is None:
            continue
        trials = [("with the sign turned", task, replace(log, **{field: -values}))]
        if kind == "inclination" and "tilt_zeros" not in task.unknown:
            unknown = (*task.unknown, "tilt_zeros")
            trials.append(("from other zeros, see tilt_zeros", replace(task, unknown=unknown), log))
        for how, other_task, other_log in trials:
            try:
                found = refit(other_task, other_log)
            except CalibrationError:
                continue
            again = found.residuals[kind]
            better = found.robust_cost < result.robust_cost
            if better and not is_thrown_out(again):
                whole = again.count + again.dropped
                return (f"{again.count} of {whole} {kind} fit {how}",)
    return _one_cable(task, log, suspects or list(result.residuals), refit)


def turned_where_lost(task: CalibrationTask, log: CalibrationLog, refit: Refit) -> tuple[str, ...]:
    """As `turned_sensors`, where no start leads anywhere.

    Args:
        task: What was asked.
        log: What was measured.
        refit: Calibrates anew.
    """
    for kind, field in TRIED.items():
        values = getattr(log, field)
        if values is None:
            continue
        try:
            found = refit(task, replace(log, **{field: -values}))
        except CalibrationError:
            continue
        fit = found.residuals.get(kind)
        if fit is not None and not misfits(found):
            return (f"{fit.count} of {fit.count + fit.dropped} {kind} fit with the sign turned",)
    return _one_cable(task, log, list(TRIED), refit)


def _one_cable(
    task: CalibrationTask, log: CalibrationLog, kinds: list[str], refit: Refit
) -> tuple[str, ...]:
    """In words the one cable with whose sign turned all fits.

    Args:
        task: What was asked.
        log: What was measured.
        kinds: Kinds of measurement that may be turned.
        refit: Calibrates anew.
    """
    for kind, name, other in _turned_cables(task, log, kinds):
        try:
            found = refit(task, other)
        except CalibrationError:
            continue
        if kind in found.residuals and not misfits(found):
            return (f"all fits with the sign of the {kind} of {name} turned",)
    return ()


def _turned_cables(
    task: CalibrationTask, log: CalibrationLog, kinds: list[str]
) -> Iterator[tuple[str, str, CalibrationLog]]:
    """Kind, cable, and the log with its sign turned."""
    for kind in kinds:
        field = TRIED.get(kind, "")
        values = getattr(log, field, None) if field in BY_CABLE else None
        if values is None:
            continue
        for k, cable in enumerate(task.robot.cables):
            turned = values.copy()
            turned[:, k] *= -1.0
            yield kind, cable.name, replace(log, **{field: turned})


def far_outside(robot: Robot, result: CalibrationResult) -> npt.NDArray[np.bool_]:
    """Which poses are farther out of the robot's frame than that is large, shape (k,)."""
    lower, upper = np.asarray(robot.frame.lower, float), np.asarray(robot.frame.upper, float)
    size = float(np.max(upper - lower))
    p = result.stations.p
    return np.asarray(np.any((p < lower - size) | (p > upper + size), axis=1))


def upside_down(result: CalibrationResult, up: Array) -> npt.NDArray[np.bool_]:
    """Which poses have the platform's z axis against that of a pose known upright, shape (k,)."""
    return np.asarray(result.stations.R[:, :, 2] @ up < 0.0)


def flipped(result: CalibrationResult, up: Array) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """That poses were found upside down: why that is no fit, and what is only to be remarked.

    A pose with no more readings than unknown coordinates may be found in several places, by chance
    in one upside down. It tells nothing of the robot, and its sensors are not to blame, unless most
    poses are upside down.

    Args:
        result: What was found.
        up: The platform's z axis in W at a pose known upright, shape (3,).
    """
    over = upside_down(result, up)
    alone = (result.surplus <= 0) & (np.mean(over) <= 0.5)
    wrong = int(np.sum(over & ~alone))
    misfit = (
        f"the platform is upside down against its home, or its start, in {wrong} of {len(over)} "
        "rows: sign or zero of a sensor?"
    )
    remarks = tuple(
        f"row {row + 1}: the pose found is upside down; it has no more readings than unknown "
        "coordinates, so that several poses fit, and it tells nothing of the robot"
        for row in np.flatnonzero(over & alone)
    )
    return (misfit,) if wrong else (), remarks
