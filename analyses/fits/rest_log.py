"""A recorder's log for a calibration by balance: a row for each time that the robot rested."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.fits.setup import CalibrationTask
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.rest_rows import RestRows, rows_at_rest

UNITS = {"lengths": "m", "angles": "rad", "swivels": "rad", "tilts": "rad", "tensions": "N"}
"""What may scatter at rest, and its unit."""


def at_rest(task: CalibrationTask) -> CalibrationTask:
    """The task with means over rows at rest, if balance counts.

    Rows in motion are used by nothing then. A log without times, or with a row for each pose, stays
    as it is. If a motion was recorded that never rests, and nobody says that it does, balance is
    left out. Remarks of the log say all of that.
    """
    log = task.log
    if log.time is None or not task.rests:
        return task
    turns = [table for table in (log.swivels, log.tilts) if table is not None]
    counted = [table for table in (log.lengths, log.angles) if table is not None]
    counted += [np.hstack([np.sin(table), np.cos(table)]) for table in turns]
    rest = rows_at_rest(log.time, counted, log.tensions)
    if rest.groups:
        return replace(task, log=_means(log, rest))
    if rest.is_motion and task.rest is None:
        words = "the log is of a motion that never rests: balance of forces is not used"
        return replace(task, rest=False, log=replace(log, remarks=(*log.remarks, words)))
    return task


def _means(log: Measurements, rest: RestRows) -> Measurements:
    """A log with a row for each group."""
    parts: dict[str, Any] = {}
    scatter: list[str] = []
    for name in ("lengths", "angles", "swivels", "tensions", "torques", "tilts", "points"):
        table = getattr(log, name)
        if table is None:
            continue
        parts[name], std = rest.means(table)
        if name in ("swivels", "tilts"):  # no jump by a turn enters
            sin, cos = (rest.means(f(table))[0] for f in (np.sin, np.cos))
            parts[name] = np.arctan2(sin, cos)
        if name in UNITS and np.isfinite(std).any():
            scatter.append(f"{name} {np.nanmax(std):.2g} {UNITS[name]}")
    assert log.time is not None
    if log.poses is not None:
        parts["poses"] = [_mean_pose(log.poses[rows]) for rows in rest.groups]
    corners = {
        tag: rest.means(uv.reshape(log.count, 8))[0].reshape(-1, 4, 2)
        for tag, uv in log.corners.items()
    }
    moving, unsteady = int(rest.moving.sum()), int(rest.unsteady.sum())
    words = (
        f"{log.count - moving - unsteady} of {log.count} rows are at rest, in {len(rest.groups)} "
        "groups, of which each counts as one row with its means: rows "
        f"{', '.join(f'{rows.start + 1} to {rows.stop}' for rows in rest.groups)}; largest "
        f"deviations in a group: {', '.join(scatter)}; left out: {moving} rows in which a length "
        f"or an angle changes, {unsteady} in which readings scatter"
    )
    return replace(
        log, count=len(rest.groups), time=rest.means(log.time[:, None])[0][:, 0],
        corners=corners, remarks=(*log.remarks, words), **parts,
    )  # fmt: skip


def _mean_pose(poses: list[RigidTransform | None]) -> RigidTransform | None:
    """Mean of poses; None where there are none."""
    seen = [X for X in poses if X is not None]
    if not seen:
        return None
    R: Array = np.mean([X.rotation().matrix() for X in seen], axis=0)
    p = np.mean([X.translation() for X in seen], axis=0)
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
