"""Whether a calibration fits its measurements, why not, and what should be known of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from cdpr_drake.analyses.fits.fit import MISFIT_FACTOR
from cdpr_drake.analyses.fits.setup import CalibrationTask, Setup
from cdpr_drake.analyses.fits.starts import BestFit, Tie, upside_down
from cdpr_drake.analyses.logs.columns import (
    ANGLES,
    QUATERNION,
    RPY,
    TAIT,
    TENSIONS,
    TIME,
    TORQUES,
    TURN,
)
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.result import CalibrationResult, Fit
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.robot_schema import Robot

MOST_LEFT_OUT, FEWEST_LEFT_OUT = 0.3, 4
"""Outliers over the degrees of freedom that remain; of more, and of so many at least, the search
chose what it fits."""

MOST_DROPPED, FEWEST_DROPPED = 1.0 / 3.0, 3
"""A kind of measurement of which a larger share, and so many at least, do not fit is not what it is
taken for."""

MOST_OF_ONE, FEWEST_OF_ONE = 0.5, 4
"""One sensor of which a larger share does not fit, of so many readings at least, is remarked."""

BY_CHANCE, NOTICED = 1e-3, 0.5
"""Residuals that are larger than sigmas say with a smaller probability enlarge deviations, and so
do errors that move poses by more of their deviations."""

MOST_OUTLYING = 0.1
"""Outliers are many if they are a larger share of what was measured beyond what is unknown."""

LEAST_SHARE, MOST_SHARE = 0.03, 0.25
"""Offsets over lengths between which they are more likely factors: lengths that change less than
they are long hardly tell one from the other, and drums' radii are known worse than zeros."""

MOST_SUSPECTS = 3
"""Sensors that are tried one by one, and exchanged in pairs."""

MOST_TRIED = 60
"""Rows by which signs are tried; of a longer log so many of its rows, as a sign holds in all."""

MOST_ROWS_SHOWN = 10
"""Rows that a sentence names."""

HINTS = {
    "lengths": "sign, unit or zero?",
    "swivel angles": "sign or zero?",
    "tensions": "sign or unit?",
    "inclination": "sign, unit or axes?",
    "tracked poses": "frame, unit or clock?",
    "tracked positions": "frame, unit or clock?",
    "motor angles": "sign, gear or drum?",
    "tag corners": "order of corners, or the tag's size?",
    "equilibrium": "did the platform rest, and is its mass right?",
}
"""What to look at first if measurements of a kind do not fit."""

SIGNED = {
    "swivel angles": "swivels",
    "lengths": "lengths",
    "motor angles": "angles",
    "tensions": "tensions",
    "inclination": "tilts",
}
"""Fields of a log whose sign may be wrong, by the kind of measurement; all but tilts by cable."""

TILTS = ("roll", "pitch", "yaw")


Refitted = Callable[[CalibrationTask], BestFit]
"""Calibrates anew, from one start."""

Trial = tuple[str, CalibrationTask]
"""What is changed of a task, in words, and the task."""


def misfits(result: CalibrationResult, groups: Sequence[GroupFault] = ()) -> tuple[str, ...]:
    """Reasons why a result does not fit the measurements, in words; empty if it does."""
    why = [_reason(group) for group in groups if group.counts]
    if result.degrees > 0 and result.spread() > MISFIT_FACTOR:
        why.append(
            f"residuals are {result.spread():.3g} sigmas, root mean square; accepted: at most "
            f"{MISFIT_FACTOR:g}"
        )
    for kind, fit in result.residuals.items():
        if is_thrown_out(fit):
            whole = fit.count + fit.dropped
            why.append(f"{fit.dropped} of {whole} {kind} do not fit: {HINTS.get(kind, '')}")
    left_out = len(result.outliers)
    many = left_out >= FEWEST_LEFT_OUT and left_out > MOST_LEFT_OUT * result.degrees
    if result.degrees > 0 and many:
        why.append(
            f"{left_out} readings were left out beside {result.degrees} degrees of freedom; "
            f"accepted: at most {MOST_LEFT_OUT:g} of these"
        )
    if why:
        worst = result.largest[0]
        why.append(
            f"largest: row {worst.pose + 1}, {worst.what}, off by {worst.residual:.4g} "
            f"{worst.unit}, {abs(worst.sigmas):.3g} sigmas"
        )
    return tuple(why)


def _reason(group: GroupFault) -> str:
    """Why a group is no fit, in words; with what to look at first if readings were lost."""
    if group.test != "dropped":
        return group.words
    return f"{group.words}: {HINTS.get(group.kind, '')}"


def is_thrown_out(fit: Fit) -> bool:
    """True if so much of a kind of measurement was dropped that it is not what it is taken for."""
    whole = fit.count + fit.dropped
    return fit.dropped >= FEWEST_DROPPED and fit.dropped > MOST_DROPPED * whole


def impossible_poses(
    robot: Robot, result: CalibrationResult, up: Array
) -> tuple[list[str], list[str]]:
    """That poses are upside down or far outside: reasons why that is no fit, and remarks.

    A pose with no more readings than unknown coordinates may be found in several places, by chance
    in one upside down. It tells nothing of the robot, and its sensors are not to blame, unless most
    poses are upside down.

    Args:
        robot: The robot.
        result: Its calibration.
        up: The platform's z axis in W at a pose known upright, shape (3,).
    """
    misfit = []
    outside = far_outside(robot, result)
    if outside.any():
        misfit.append(
            f"the platform is out of the frame by more than its size in {np.sum(outside)} of "
            f"{len(outside)} rows: sign, unit or zero of a sensor?"
        )
    over = upside_down(result, up)
    alone = (result.surplus <= 0) & (np.mean(over) <= 0.5)
    wrong = int(np.sum(over & ~alone))
    if wrong:
        misfit.append(
            f"the platform is upside down against its home, or its start, in {wrong} of "
            f"{len(over)} rows: sign or zero of a sensor?"
        )
    return misfit, [
        f"row {row + 1}: the pose found is upside down; it has no more readings than unknown "
        "coordinates, so that several poses fit, and it tells nothing of the robot"
        for row in np.flatnonzero(over & alone)
    ]


def far_outside(robot: Robot, result: CalibrationResult) -> npt.NDArray[np.bool_]:
    """Flags of poses that are farther out of the robot's frame, and of its exit points as fitted,
    than these are large, shape (k,)."""
    exits = result.model.cables.p_WA
    lower = np.minimum(robot.frame.lower, exits.min(axis=1))
    upper = np.maximum(robot.frame.upper, exits.max(axis=1))
    size = float(np.max(upper - lower))
    p = result.stations.p
    return np.asarray(np.any((p < lower - size) | (p > upper + size), axis=1))


def with_enlarged_deviations(
    result: CalibrationResult, groups: Sequence[GroupFault]
) -> tuple[CalibrationResult, tuple[str, ...]]:
    """The same with deviations that hold what residuals say beyond sigmas, and in words why.

    All grow by the scatter of the data if that is more than sigmas say: the root of squares of
    residuals over sigma per degree of freedom, with 16 of each outlier, since those that were cut
    off would make it too small. Those of poses hold the largest of the errors that are certain and
    make no misfit; in a row in which it is open which readings are right, any may be off by as much
    as what was thrown out. Source: the variance of unit weight after adjustment, and its global
    test; Baarda, A testing procedure for use in geodetic networks, 1968.
    """
    remarks = []
    degrees = result.degrees + len(result.outliers)
    squares = max(result.robust_cost, result.chi_square)
    if result.degrees > 0 and chi2.sf(squares, degrees) < BY_CHANCE:
        scale = float(np.sqrt(squares / degrees))
        result = replace(
            result, std=scale * result.std, pose_std=scale * result.pose_std,
            covariance=scale**2 * result.covariance, information=result.information / scale**2,
        )  # fmt: skip
        remarks.append(
            f"residuals are {scale:.3g} times what sigmas say; standard deviations are enlarged by "
            "as much, unless something that was not asked for is off"
        )
    moves = max((group.moves for group in groups if not group.counts), default=0.0)
    if NOTICED < moves < np.inf:
        scale = float(np.hypot(1.0, moves))
        result = replace(result, pose_std=scale * result.pose_std)
        remarks.append(
            f"standard deviations of poses are {scale:.3g} times larger for these errors"
        )
    undecided = {row for group in groups if group.test == "rows" for row in group.rows}
    by_row = np.ones(len(result.pose_std))
    for outlier in result.outliers:
        if outlier.pose in undecided:
            by_row[outlier.pose] = max(by_row[outlier.pose], abs(outlier.sigmas))
    return replace(result, pose_std=by_row[:, None] * result.pose_std), tuple(remarks)


def doubts(setup: Setup, best: BestFit, enlarged: Sequence[str]) -> list[str]:
    """What should be known of a fit, in words; with remarks on deviations that were enlarged."""
    result, up = best.result, setup.first.rotation().matrix()[:, 2]
    odd = impossible_poses(setup.task.robot, result, up)[1]
    remarks = [*setup.task.log.remarks, *unused_columns(setup)]
    for group in best.groups:
        if not group.counts:
            moves = f"; poses would move by {group.moves:.2g} of their deviations without that"
            remarks.append(group.words + (moves if np.isfinite(group.moves) else ""))
    remarks += [*enlarged, *_likely_scales(setup, result), *bad_sensors(result)]
    remarks += [*many_outliers(result, best.minima), *odd]
    remarks += [
        f"{name} is held at its bound, {value:.6g}; standard deviations are those of the others "
        "while it stays there"
        for name, value in result.at_bounds.items()
    ]
    if best.flipped_costs_less > 0.0:
        remarks.append(
            f"a platform upside down would cost {best.flipped_costs_less:.3g} less, which was not "
            "taken: its start is upright"
        )
    if best.ties:
        remarks.append(_tied(best.ties))
    return remarks


def _likely_scales(setup: Setup, result: CalibrationResult) -> tuple[str, ...]:
    """That offsets of lengths are more likely factors, in words."""
    lengths, names = setup.lengths, result.names
    if lengths is None or setup.zeroed:  # counts from zero have such offsets in any case
        return ()
    scales = []
    for k, cable in enumerate(setup.task.robot.cables):
        offset, mean = float(result.model.length_offset[k]), float(np.nanmean(lengths[:, k]))
        unknown = f"{cable.name}.length_offset" in names
        other = f"{cable.name}.length_scale" in names
        if unknown and not other and LEAST_SHARE < abs(offset) / max(mean, 1e-9) < MOST_SHARE:
            scales.append(
                f"{cable.name} {1e3 * offset:.0f} mm, as a factor of {1 + offset / mean:.3f}"
            )
    if not scales:
        return ()
    return (
        f"length offsets are {100 * LEAST_SHARE:.0f} % of the lengths or more, and more likely "
        f"scales, from a drum's radius or a unit: {'; '.join(scales)}; see length_scales",
    )


def bad_sensors(result: CalibrationResult) -> tuple[str, ...]:
    """Single sensors most of whose readings do not fit, in words."""
    dropped = Counter((outlier.kind, outlier.what) for outlier in result.outliers)
    return tuple(
        f"{count} of {result.readings[what]} readings of {what} do not fit: {HINTS.get(kind, '')}"
        for (kind, what), count in dropped.items()
        if result.readings[what] >= FEWEST_OF_ONE and count > MOST_OF_ONE * result.readings[what]
    )


def many_outliers(result: CalibrationResult, minima: int) -> tuple[str, ...]:
    """That another minimum may fit better, in words: more outliers than a right one has."""
    count = len(result.outliers)
    if result.degrees <= 0 or count <= MOST_OUTLYING * result.degrees:
        return ()
    ends = f"; starts ended in {minima} minima, of which this is the best" if minima > 1 else ""
    return (
        f"{count} outliers beside {result.degrees} degrees of freedom are many: another minimum "
        f"may fit better, from a start nearer to the truth{ends}",
    )


def unused_columns(setup: Setup) -> tuple[str, ...]:
    """Columns of the log that were read and of which nothing was made, in words."""
    log, headers = setup.task.log, setup.task.log.headers
    rotations = [kind for kind in (QUATERNION, TAIT, TURN, RPY) if kind in headers]
    first = rotations if log.poses is not None else sorted(rotations, key=lambda k: k != RPY)
    why = {TORQUES: "a calibration has no use of motor torques"}
    for kind in first[1:]:
        why[kind] = f"{headers[first[0]][0]} and the like tell the rotation"
    if log.lengths is not None:
        why[ANGLES] = "there are cable lengths"
    if (log.poses is None and setup.points is None) or setup.lengths is None:
        why[TIME] = "without a tracker and lengths no clock is checked"
    if not setup.task.rests:
        why[TENSIONS] = "the platform is not said to rest; strain of cables alone"
    return tuple(
        f"not used: {', '.join(headers[kind])}: {words}"
        for kind, words in why.items()
        if kind in headers
    )


def _tied(ties: tuple[Tie, ...]) -> str:
    """That there are two places of a row, in words."""
    rows = list(dict.fromkeys(str(tie.pose + 1) for tie in ties))
    names = ", ".join(rows[:MOST_ROWS_SHOWN])
    if len(rows) > MOST_ROWS_SHOWN:
        names += f" and {len(rows) - MOST_ROWS_SHOWN} more"
    far = max(tie.distance for tie in ties)
    return (
        f"row{'s' if len(rows) > 1 else ''} {names}: found another pose that fits as well "
        f"within noise, up to {1e3 * far:.3g} mm away"
    )


def turned_sensors(task: CalibrationTask, best: BestFit, refitted: Refitted) -> tuple[str, ...]:
    """What would fit otherwise, in words: sensors of which much was thrown out, tried anew.

    Single sensors come first: with the sign turned, or two of them exchanged. Then come kinds of
    measurement of which much was thrown out, or all of them, and each cable of these. A sign is the
    wrong one if, with it turned, the fit throws out no third of the kind and the whole costs less;
    if only one sensor's is, the whole must fit then. A tilt is tried from other zeros, too. The
    first that fits is the answer. If rows do not agree no sensor is to blame.

    Args:
        task: The task.
        best: Its best fit, which is none.
        refitted: Calibrates anew.
    """
    if task.log.count > MOST_TRIED:
        task = _fewer_rows(task)
        try:
            best = refitted(task)
        except CalibrationError:
            return turned_where_lost(task, refitted)
    result, groups = best.result, best.groups
    gone = [group for group in groups if group.test == "dropped"]
    most = max((group.size for group in gone), default=0.0)
    lost = [g.quantity.removeprefix("readings of ") for g in gone if 2.0 * g.size >= most]
    suspects = [kind for kind, fit in result.residuals.items() if is_thrown_out(fit)]
    if not lost and not suspects and any(_is_clear(group) for group in groups):
        return ()
    single = _first_that_fits(_single_sensors(task, lost), refitted)
    if single:
        return single
    kinds = suspects or ([] if lost else list(result.residuals))
    for kind, field in SIGNED.items():
        if kind not in kinds or getattr(task.log, field) is None:
            continue
        trials = [("with the sign turned", _with_sign(task, field))]
        if kind == "inclination" and "tilt_zeros" not in task.unknown:
            unknown = (*task.unknown, "tilt_zeros")
            trials.append(("from other zeros, see tilt_zeros", replace(task, unknown=unknown)))
        for how, again in _fits_of(trials, refitted):
            fit = again.result.residuals[kind]
            if again.result.robust_cost < result.robust_cost and not is_thrown_out(fit):
                return (f"{fit.count} of {fit.count + fit.dropped} {kind} fit {how}",)
    return () if lost else _first_that_fits(_turned_cables(task, kinds), refitted)


def turned_where_lost(task: CalibrationTask, refitted: Refitted) -> tuple[str, ...]:
    """As `turned_sensors`, of a task of which no start leads anywhere."""
    task = _fewer_rows(task)
    for kind, field in SIGNED.items():
        if getattr(task.log, field) is None:
            continue
        for how, again in _fits_of([("the sign turned", _with_sign(task, field))], refitted):
            fit = again.result.residuals.get(kind)
            if fit is not None and not misfits(again.result, again.groups):
                return (f"{fit.count} of {fit.count + fit.dropped} {kind} fit with {how}",)
    return _first_that_fits(_turned_cables(task, list(SIGNED)), refitted)


def _fewer_rows(task: CalibrationTask) -> CalibrationTask:
    """A task with `MOST_TRIED` rows of a longer log, evenly apart."""
    if task.log.count <= MOST_TRIED:
        return task
    rows = np.linspace(0, task.log.count - 1, MOST_TRIED).astype(np.intp)
    return replace(task, log=task.log.only(rows))


def _is_clear(group: GroupFault) -> bool:
    """True if a group says by itself what is wrong: rows, or a factor that is no sign."""
    if group.test == "rows":
        return group.counts
    return group.counts and group.test in ("factor", "split", "row factors") and group.size > 0.0


def _fits_of(trials: Iterable[Trial], refitted: Refitted) -> Iterator[tuple[str, BestFit]]:
    """Trials that lead anywhere, as they are asked for."""
    for words, trial in trials:
        with suppress(CalibrationError):
            yield words, refitted(trial)


def _first_that_fits(trials: Iterable[Trial], refitted: Refitted) -> tuple[str, ...]:
    """The words of the first trial that fits as a whole."""
    for words, again in _fits_of(trials, refitted):
        if not misfits(again.result, again.groups):
            return (f"all fits with {words}",)
    return ()


def _with_sign(task: CalibrationTask, field: str, column: int | None = None) -> CalibrationTask:
    """A task with the sign of a field of its log turned, or of one column."""
    values = getattr(task.log, field).copy()
    values[:, slice(None) if column is None else column] *= -1.0
    return _with_values(task, field, values)


def _with_values(task: CalibrationTask, field: str, values: Array) -> CalibrationTask:
    changes: dict[str, Any] = {field: values}
    return replace(task, log=replace(task.log, **changes))


def _single_sensors(task: CalibrationTask, lost: Sequence[str]) -> Iterator[Trial]:
    """Sensors by their names in words, as "roll" or "length of C1": turned, two exchanged."""
    columns: dict[str, tuple[str, str, int]] = {}
    for kind, field in SIGNED.items():
        names = TILTS if field == "tilts" else [cable.name for cable in task.robot.cables]
        for k, name in enumerate(names):
            what = name if field == "tilts" else f"{kind.removesuffix('s')} of {name}"
            columns[what] = (kind, field, k)
    suspects = [what for what in lost if what in columns]
    if len(suspects) > MOST_SUSPECTS:  # no single sensor is to blame
        return
    for what in suspects:
        kind, field, k = columns[what]
        name = what if field == "tilts" else f"the {kind} of {what.rpartition(' of ')[2]}"
        yield f"the sign of {name} turned", _with_sign(task, field, k)
    for what, other in combinations(suspects, 2):
        (kind, field, k), (other_kind, _, n) = columns[what], columns[other]
        values = getattr(task.log, field)
        if kind == other_kind and values is not None and field != "tilts":
            values = values.copy()
            values[:, [k, n]] = values[:, [n, k]]
            yield f"{what} and {other} exchanged", _with_values(task, field, values)


def _turned_cables(task: CalibrationTask, kinds: Sequence[str]) -> Iterator[Trial]:
    """Each cable's sensor of some kinds with its sign turned."""
    for kind in kinds:
        field = SIGNED.get(kind, "tilts")
        if field != "tilts" and getattr(task.log, field) is not None:
            for k, cable in enumerate(task.robot.cables):
                words = f"the sign of the {kind} of {cable.name} turned"
                yield words, _with_sign(task, field, k)
