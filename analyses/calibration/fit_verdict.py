"""Whether what was found fits what was measured, and what of the log nothing was made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from cdpr_drake.analyses.calibration.calibration_request import Prepared
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
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.result import CalibrationResult, Fit

MISFIT = "misfit"
"""Status of a result that does not fit what was measured."""

MOST_LEFT_OUT, FEWEST_LEFT_OUT = 0.3, 4
"""Outliers over the degrees of freedom that remain; of more, and of so many at least, the search
chose what it fits."""

MISFIT_FACTOR = 3.0
"""Residuals of so many sigmas, root mean square, are no fit."""

MOST_DROPPED = 1.0 / 3.0
"""A kind of measurement of which a larger share does not fit is not what it is taken for."""

FEWEST_DROPPED = 3
"""So many have to be dropped for that."""

MOST_OF_ONE, FEWEST_OF_ONE = 0.5, 4
"""One sensor of which a larger share does not fit, of so many readings at least, is remarked."""

BY_CHANCE, NOTICED = 1e-3, 0.5
"""Residuals that are larger than sigmas say with a smaller probability enlarge deviations, and so
do errors that move poses by more of their deviations."""

MOST_OUTLYING = 0.1
"""Outliers are many where they are a larger share of what was measured beyond what is unknown."""

LEAST_SHARE, MOST_SHARE = 0.03, 0.25
"""Offsets over lengths between which they are more likely factors."""

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
"""What to look at first where measurements of a kind do not fit."""


def misfits(result: CalibrationResult, groups: Sequence[GroupFault] = ()) -> tuple[str, ...]:
    """Why a result does not fit what was measured, in words; empty where it does.

    Args:
        result: What was found.
        groups: Groups of its measurements that do not agree.
    """
    why = [_reason(group) for group in groups if group.counts]
    if result.degrees > 0 and result.spread() > MISFIT_FACTOR:
        why.append(
            f"residuals are {result.spread():.3g} sigmas, root mean square; accepted: at most "
            f"{MISFIT_FACTOR:g}"
        )
    for kind, fit in result.residuals.items():
        whole = fit.count + fit.dropped
        if is_thrown_out(fit):
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


def with_enlarged_deviations(
    result: CalibrationResult, groups: Sequence[GroupFault]
) -> tuple[CalibrationResult, tuple[str, ...]]:
    """The same with deviations that hold what residuals say beyond sigmas, and in words why.

    All grow by the scatter of the data where that is more than sigmas say: the root of squares of
    residuals over sigma per degree of freedom, with 16 of each outlier, since those that were cut
    off would make it too small. Those of poses hold the largest of the errors that are certain and
    make no misfit; in a row where it is open which readings are right, any may be off by as much as
    what was thrown out. Source: the variance of unit weight after adjustment, and its global test;
    Baarda, A testing procedure for use in geodetic networks, 1968.
    """
    told = []
    degrees = result.degrees + len(result.outliers)
    squares = max(result.robust_cost, result.chi_square)
    if result.degrees > 0 and chi2.sf(squares, degrees) < BY_CHANCE:
        scale = float(np.sqrt(squares / degrees))
        result = replace(
            result, std=scale * result.std, pose_std=scale * result.pose_std,
            covariance=scale**2 * result.covariance, information=result.information / scale**2,
        )  # fmt: skip
        told.append(
            f"residuals are {scale:.3g} times what sigmas say; standard deviations are enlarged by "
            "as much, unless something that was not asked for is off"
        )
    moves = max((group.moves for group in groups if not group.counts), default=0.0)
    if NOTICED < moves < np.inf:
        scale = float(np.hypot(1.0, moves))
        result = replace(result, pose_std=scale * result.pose_std)
        told.append(f"standard deviations of poses are {scale:.3g} times larger for these errors")
    undecided = {row for group in groups if group.test == "rows" for row in group.rows}
    by_row = np.ones(len(result.pose_std))
    for outlier in result.outliers:
        if outlier.pose in undecided:
            by_row[outlier.pose] = max(by_row[outlier.pose], abs(outlier.sigmas))
    result = replace(result, pose_std=by_row[:, None] * result.pose_std)
    return result, tuple(told)


def _reason(group: GroupFault) -> str:
    """Why a group is no fit, in words; with what to look at first where readings were lost."""
    if group.test != "dropped":
        return group.words
    return f"{group.words}: {HINTS.get(group.kind, '')}"


def remarked_groups(groups: Sequence[GroupFault]) -> tuple[str, ...]:
    """Groups that do not agree with the others and yet make no misfit, in words."""
    return tuple(
        f"{group.words}; poses would move by {group.moves:.2g} of their deviations without that"
        if np.isfinite(group.moves)
        else group.words
        for group in groups
        if not group.counts
    )


def likely_scales(result: CalibrationResult, prepared: Prepared) -> tuple[str, ...]:
    """That offsets of lengths are more likely factors, in words.

    Lengths of a cable that change less than they are long tell an offset from a factor hardly, and
    drums' radii are known worse than zeros: an offset of 3 % of a cable is remarked. Counts that
    begin at another length than the cable has, as those from zero, have offsets of that kind and
    are left out.
    """
    lengths, names = prepared.lengths, result.names
    if lengths is None or prepared.is_zeroed():
        return ()
    told = []
    for k, cable in enumerate(prepared.task.robot.cables):
        offset, mean = float(result.model.length_offset[k]), float(np.nanmean(lengths[:, k]))
        unknown = f"{cable.name}.length_offset" in names
        other = f"{cable.name}.length_scale" in names
        if unknown and not other and LEAST_SHARE < abs(offset) / max(mean, 1e-9) < MOST_SHARE:
            told.append(
                f"{cable.name} {1e3 * offset:.0f} mm, as a factor of {1 + offset / mean:.3f}"
            )
    if not told:
        return ()
    return (
        f"length offsets are {100 * LEAST_SHARE:.0f} % of the lengths or more, and more likely "
        f"scales, from a drum's radius or a unit: {'; '.join(told)}; see length_scales",
    )


def is_thrown_out(fit: Fit) -> bool:
    """Whether so much of a kind of measurement was dropped that it is not what it is taken for."""
    whole = fit.count + fit.dropped
    return fit.dropped >= FEWEST_DROPPED and fit.dropped > MOST_DROPPED * whole


def bad_sensors(result: CalibrationResult) -> tuple[str, ...]:
    """Single sensors most of whose readings do not fit, in words."""
    dropped = Counter((one.kind, one.what) for one in result.outliers)
    return tuple(
        f"{count} of {result.readings[what]} readings of {what} do not fit: {HINTS.get(kind, '')}"
        for (kind, what), count in dropped.items()
        if result.readings[what] >= FEWEST_OF_ONE and count > MOST_OF_ONE * result.readings[what]
    )


def doubts(result: CalibrationResult, minima: int) -> tuple[str, ...]:
    """That another minimum may fit better, in words: more outliers than a right one has."""
    count = len(result.outliers)
    if result.degrees <= 0 or count <= MOST_OUTLYING * result.degrees:
        return ()
    ends = f"; starts ended in {minima} minima, of which this is the best" if minima > 1 else ""
    return (
        f"{count} outliers beside {result.degrees} degrees of freedom are many: another minimum "
        f"may fit better, from a start nearer to the truth{ends}",
    )


def unused_columns(prepared: Prepared) -> tuple[str, ...]:
    """Columns of the log that were read and of which nothing was made, in words."""
    log, headers = prepared.log, prepared.log.headers
    rotations = [kind for kind in (QUATERNION, TAIT, TURN, RPY) if kind in headers]
    first = rotations if log.poses is not None else sorted(rotations, key=lambda k: k != RPY)
    why = {TORQUES: "a calibration has no use of motor torques"}
    for kind in first[1:]:
        why[kind] = f"{headers[first[0]][0]} and the like tell the rotation"
    if log.lengths is not None:
        why[ANGLES] = "there are cable lengths"
    if (log.poses is None and prepared.points is None) or prepared.lengths is None:
        why[TIME] = "without a tracker and lengths no clock is checked"
    if not prepared.rest:
        why[TENSIONS] = "the platform is not said to rest; strain of cables alone"
    return tuple(
        f"not used: {', '.join(headers[kind])}: {words}"
        for kind, words in why.items()
        if kind in headers
    )
