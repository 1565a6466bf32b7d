"""Rows of a log that a calibration was not fitted on, and how well it predicts them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibration_request import Prepared
from cdpr_drake.analyses.calibration.fit_programs import add_winches, guessed_tensions
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.pose_search import robust_poses
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.sensor_terms import Course
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_error

EACH = "each"
"""In the place of rows: every tracked row once, the calibration repeated without it."""

NEAR = 2
"""Fitted rows before and behind a held one whose poses its search begins at."""


class HeldRow(NamedTuple):
    """A row that was predicted.

    Attributes:
        row: Number of it, from 0.
        X_WP: Where what the robot measures of itself puts the platform [m].
        distance: From there to what the tracker told [m].
        angle: By how much the tracker's word is turned [rad]; NaN where it tells no rotation.
    """

    row: int
    X_WP: RigidTransform
    distance: float
    angle: float


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Rows that were compared with a fit on others.

    Attributes:
        rows: The rows, in the order of the log.
        fitted: Numbers of the rows that were fitted, from 0; empty: each was held out once.
    """

    rows: tuple[HeldRow, ...]
    fitted: tuple[int, ...]

    def as_dict(self) -> dict[str, Any]:
        """For JSON; rows count from 1."""
        distances = np.array([row.distance for row in self.rows])
        angles = np.array([row.angle for row in self.rows])
        turned = bool(np.isfinite(angles).all())
        return {
            "compared_rows": [row.row + 1 for row in self.rows],
            "fitted_rows": [k + 1 for k in self.fitted],
            "each_held_out_once": not self.fitted,
            "distance_m": distances.tolist(),
            "distance_median_m": float(np.median(distances)),
            "distance_rms_m": float(np.sqrt(np.mean(distances**2))),
            "distance_largest_m": float(np.max(distances)),
            "angle_rad": angles.tolist() if turned else None,
        }

    def words(self) -> str:
        """In one line."""
        distances = 1e3 * np.array([row.distance for row in self.rows])
        on = f"{len(self.fitted)} others" if self.fitted else "all others, each in turn"
        return (
            f"{len(self.rows)} rows were not fitted but predicted by a fit on {on}: "
            f"{np.median(distances):.3g} mm off in the median, "
            f"{np.sqrt(np.mean(distances**2)):.3g} mm rms, {np.max(distances):.3g} mm at most"
        )


def held_groups(words: str | int, log: CalibrationLog, zeroed: bool) -> list[npt.NDArray[np.intp]]:
    """Which rows are held out, from 0, one group for each fit.

    Args:
        words: A number of tracked rows, spread over the log; rows as 100-160,200, from 1; or
            `EACH`.
        log: The log.
        zeroed: Whether cables count from zero at a known pose; else from the log's first row, which
            has to be fitted.

    Raises:
        CalibrationError: There are no such rows, the tracker told nothing there, or too few remain.
    """
    tracked = tracked_rows(log)
    if not zeroed:
        tracked = tracked[tracked > 0]
    if not len(tracked):
        raise CalibrationError(f"hold_out: found no tracked row in {log.path} to compare with")
    text = str(words).strip()
    if text == EACH:
        return [np.array([k]) for k in tracked]
    if re.fullmatch(r"\d+", text) and 0 < int(text) < len(tracked):
        spread = np.linspace(0, len(tracked) - 1, int(text) + 2)[1:-1]
        return [tracked[np.unique(np.round(spread).astype(int))]]
    chosen: set[int] = set()
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d+)(?:\s*-\s*(\d+))?\s*", part)
        if not found or ("-" not in text and "," not in text):
            raise CalibrationError(
                f"hold_out: found {words!r}; accepted: fewer than the {len(tracked)} tracked rows, "
                f"rows as 100-160,200, or {EACH}"
            )
        chosen |= set(range(int(found[1]) - 1, int(found[2] or found[1])))
    rows = np.array(sorted(chosen & set(tracked.tolist())), dtype=np.intp)
    if not len(rows) or len(rows) == len(tracked):
        raise CalibrationError(
            f"hold_out: found {len(rows)} of {len(tracked)} tracked rows in {words!r}; accepted: "
            "some of them, not all" + ("" if zeroed else ", and not the first row of the log")
        )
    return [rows]


def tracked_rows(log: CalibrationLog) -> npt.NDArray[np.intp]:
    """Rows in which a tracker told a pose or a position, from 0."""
    if log.points is not None:
        return np.flatnonzero(np.isfinite(log.points).all(axis=1))
    return np.array([k for k, X in enumerate(log.poses or []) if X is not None], dtype=np.intp)


def predicted(
    prepared: Prepared,
    result: CalibrationResult,
    fitted: Sequence[int],
    rows: npt.NDArray[np.intp],
    say: Callable[[str], None] = lambda words: None,
) -> tuple[HeldRow, ...]:
    """Poses of rows by what the robot measures of itself, beside what the tracker told.

    Args:
        prepared: The whole log.
        result: What was found from other rows.
        fitted: Numbers of these, in the order of the result's poses.
        rows: The rows that are predicted.
        say: Told what is done now.
    """
    say("Predicting rows that were held out")
    count, freedom = prepared.log.count, prepared.freedom
    order = np.asarray(fitted)
    begins, of = [], []
    for n, row in enumerate(rows):
        near = np.argsort(np.abs(order - row), kind="stable")[: 2 * NEAR]
        begins += near.tolist()
        of += [n] * len(near)
    whole = np.array(of)
    program = CalibrationProgram(result.model, [prepared.first] * count, (), motion=freedom.motion)
    tensions = None
    if prepared.rest:
        tensions = guessed_tensions(prepared, [prepared.first] * count)
    add_winches(prepared, program, tensions)
    here = result.stations.only(np.array(begins))
    t = None if tensions is None else tensions[rows[whole]]
    at = Point(result.model, Stations(here.R, here.p, t), program.layout)
    ends = robust_poses(
        [term.only(rows[whole]) for term in program.terms], at, freedom=freedom,
        outliers=prepared.task.outliers,
    )  # fmt: skip
    poses, told = ends.stations.poses(), told_points(prepared, result)
    held = []
    for n, row in enumerate(rows.tolist()):
        mine = np.flatnonzero(whole == n)
        X = poses[int(mine[np.argmin(ends.costs[mine])])]
        marker = X @ result.model.X_PM
        angle = float("nan")
        if prepared.log.poses is not None:
            seen = prepared.log.poses[row]
            assert seen is not None
            angle = pose_error(marker, result.model.X_WK @ seen)[1]
        held.append(HeldRow(row, X, float(np.linalg.norm(marker.translation() - told[row])), angle))
    return tuple(held)


def told_points(prepared: Prepared, result: CalibrationResult) -> Array:
    """Where the tracker saw its marker in W, by its frame and clock, shape (k, 3) [m]."""
    log, X_WK = prepared.log, result.model.X_WK
    if prepared.points is None:
        assert log.poses is not None
        nothing = np.full(3, np.nan)
        points = np.array([nothing if X is None else X.translation() for X in log.poses])
    elif result.model.clock != 0.0 and log.time is not None:
        points = Course.of(log.time, prepared.points).at(result.model.clock)[0]
    else:
        points = prepared.points
    return np.asarray(points @ X_WK.rotation().matrix().T + X_WK.translation())
