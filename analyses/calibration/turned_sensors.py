"""Whether measurements that do not fit would with the sign turned, or from another zero."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask
from cdpr_drake.analyses.calibration.fit_verdict import is_thrown_out, misfits
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.fit_groups import GroupFault
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

MOST_TRIED = 60
"""Rows by which signs are tried: of a longer log so many, since a sign holds in all of its rows."""

TILTS = ("roll", "pitch", "yaw")


class Refit(NamedTuple):
    """What was found of a log that was changed.

    Attributes:
        result: It.
        groups: Groups of measurements that do not agree.
    """

    result: CalibrationResult
    groups: tuple[GroupFault, ...]

    @property
    def fits(self) -> bool:
        """Whether it fits what was measured."""
        return not misfits(self.result, self.groups)


Refitted = Callable[[CalibrationTask, CalibrationLog], Refit]


def turned_sensors(
    task: CalibrationTask,
    log: CalibrationLog,
    result: CalibrationResult,
    groups: Sequence[GroupFault],
    refitted: Refitted,
) -> tuple[str, ...]:
    """What would fit otherwise, in words: sensors of which much was thrown out, tried anew.

    Single sensors come first: with the sign turned, or two of them exchanged. Then come kinds of
    measurement of which much was thrown out, or all of them, and each cable of these. A sign is the
    wrong one where, with it turned, the fit throws out no third of the kind and the whole costs
    less; where only one sensor's is, the whole must fit then. A tilt is tried from other zeros,
    too. The first that fits is told. Where rows do not agree no sensor is to blame.

    Args:
        task: What was asked.
        log: What was measured.
        result: What was found, which is no fit.
        groups: Groups of its measurements that do not agree.
        refitted: Calibrates anew, from one start.
    """
    if log.count > MOST_TRIED:
        log = _fewer(log)
        try:
            result, groups = refitted(task, log)
        except CalibrationError:
            return turned_where_lost(task, log, refitted)
    gone = [group for group in groups if group.test == "dropped"]
    most = max((group.size for group in gone), default=0.0)
    lost = [g.quantity.removeprefix("readings of ") for g in gone if 2.0 * g.size >= most]
    suspects = [kind for kind, fit in result.residuals.items() if is_thrown_out(fit)]
    if not lost and not suspects and any(_is_clear(group) for group in groups):
        return ()
    single = _first_that_fits(task, _single_sensors(task, log, lost), refitted)
    if single:
        return single
    tried = suspects or ([] if lost else list(result.residuals))
    for kind, field in TRIED.items():
        values = getattr(log, field)
        if kind not in tried or values is None:
            continue
        trials = [("with the sign turned", task, replace(log, **{field: -values}))]
        if kind == "inclination" and "tilt_zeros" not in task.unknown:
            unknown = (*task.unknown, "tilt_zeros")
            trials.append(("from other zeros, see tilt_zeros", replace(task, unknown=unknown), log))
        for how, other_task, other_log in trials:
            try:
                found = refitted(other_task, other_log).result
            except CalibrationError:
                continue
            again = found.residuals[kind]
            better = found.robust_cost < result.robust_cost
            if better and not is_thrown_out(again):
                whole = again.count + again.dropped
                return (f"{again.count} of {whole} {kind} fit {how}",)
    if lost:
        return ()
    return _first_that_fits(task, _turned_cables(task, log, tried), refitted)


def _fewer(log: CalibrationLog) -> CalibrationLog:
    """A log as it is, or of a long one `MOST_TRIED` rows, evenly apart."""
    if log.count <= MOST_TRIED:
        return log
    return log.only(np.linspace(0, log.count - 1, MOST_TRIED).astype(np.intp))


def _is_clear(group: GroupFault) -> bool:
    """Whether a group says by itself what is wrong: rows, or a factor that is no sign."""
    if group.test == "rows":
        return group.counts
    return group.counts and group.test in ("factor", "split", "row factors") and group.size > 0.0


def turned_where_lost(
    task: CalibrationTask, log: CalibrationLog, refitted: Refitted
) -> tuple[str, ...]:
    """As `turned_sensors`, where no start leads anywhere.

    Args:
        task: What was asked.
        log: What was measured.
        refitted: Calibrates anew, from one start.
    """
    log = _fewer(log)
    for kind, field in TRIED.items():
        values = getattr(log, field)
        if values is None:
            continue
        try:
            found = refitted(task, replace(log, **{field: -values}))
        except CalibrationError:
            continue
        fit = found.result.residuals.get(kind)
        if fit is not None and found.fits:
            return (f"{fit.count} of {fit.count + fit.dropped} {kind} fit with the sign turned",)
    return _first_that_fits(task, _turned_cables(task, log, list(TRIED)), refitted)


Trial = tuple[str, CalibrationLog]
"""What fits with it, in words, and a log that was changed."""


def _first_that_fits(
    task: CalibrationTask, trials: Iterable[Trial], refitted: Refitted
) -> tuple[str, ...]:
    """In words the first changed log that fits as a whole."""
    for words, other in trials:
        try:
            found = refitted(task, other)
        except CalibrationError:
            continue
        if found.fits:
            return (f"all fits with {words}",)
    return ()


def _single_sensors(
    task: CalibrationTask, log: CalibrationLog, lost: Sequence[str]
) -> Iterator[Trial]:
    """Sensors by their names in words, as "roll" or "length of C1": turned, two exchanged."""
    columns: dict[str, tuple[str, str, int]] = {}
    for kind, field in TRIED.items():
        names = TILTS if field == "tilts" else [cable.name for cable in task.robot.cables]
        for k, name in enumerate(names):
            what = name if field == "tilts" else f"{kind.removesuffix('s')} of {name}"
            columns[what] = (kind, field, k)
    known = [what for what in lost if what in columns]
    if len(known) > MOST_SUSPECTS:  # no single sensor is to blame
        return
    for what in known:
        kind, field, k = columns[what]
        name = what if field == "tilts" else what.rpartition(" of ")[2]
        words = f"the sign of {what}" if field == "tilts" else f"the sign of the {kind} of {name}"
        yield f"{words} turned", _with_column(log, field, k, -1.0)
    for what, other in combinations(known, 2):
        (kind, field, k), (other_kind, _, n) = columns[what], columns[other]
        values = getattr(log, field)
        if kind == other_kind and values is not None and field != "tilts":
            values = values.copy()
            values[:, [k, n]] = values[:, [n, k]]
            yield f"{what} and {other} exchanged", replace(log, **{field: values})


MOST_SUSPECTS = 3
"""Sensors that are tried one by one, and exchanged in pairs."""


def _with_column(log: CalibrationLog, field: str, k: int, factor: float) -> CalibrationLog:
    """A log with one column of a field times a factor."""
    values = getattr(log, field).copy()
    values[:, k] *= factor
    return replace(log, **{field: values})


def _turned_cables(task: CalibrationTask, log: CalibrationLog, kinds: list[str]) -> Iterator[Trial]:
    """Each cable's sensor of some kinds with its sign turned."""
    for kind in kinds:
        field = TRIED.get(kind, "")
        if field in BY_CABLE and getattr(log, field, None) is not None:
            for k, cable in enumerate(task.robot.cables):
                words = f"the sign of the {kind} of {cable.name} turned"
                yield words, _with_column(log, field, k, -1.0)


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
