"""What a calibration says: numbers for JSON, tables, figures, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.calibration.calibrated_robots import calibrated_robot
from cdpr_drake.analyses.calibration.calibration_task import Calibration
from cdpr_drake.analyses.calibration.fit_verdict import MISFIT_FACTOR
from cdpr_drake.analyses.calibration.log_fit import LogFit
from cdpr_drake.analyses.calibration.row_figure import row_figure
from cdpr_drake.analyses.frame.figures import bars, new_figure
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.parameters import GROUPS
from cdpr_drake.calibration.result import Outlier
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.palette import nth_look

RESULTS = "results.json"
"""File of a results folder: all numbers."""

SIGNED = 0.2
"""Negative correlations that are larger bear a sign in the figure."""

MOST_OUTLIERS = 10
"""Outliers that the terminal names; results.json has all."""


def calibration_dict(
    calibration: Calibration, more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Everything for JSON, and more that belongs to it."""
    result, task = calibration.result, calibration.task
    model = result.model
    _, left = calibrated_robot(task.robot, result, calibration.mount)
    return {
        "robot": task.robot.name,
        "log": str(calibration.log.path),
        "status": result.status,
        "misfit": list(calibration.misfit),
        "misfit_factor": MISFIT_FACTOR,
        "groups": [_group_row(group) for group in calibration.groups],
        "robust_cost": finite(result.robust_cost),
        "largest_residuals": [residual_row(one) for one in result.largest],
        "ties": [
            {
                "row": tie.pose + 1,
                "X_WP": pose_row(tie.X_WP).tolist(),
                "distance_m": tie.distance,
                "angle_rad": tie.angle,
                "cost_more": tie.more,
            }
            for tie in calibration.ties
        ],
        "unknown": list(task.unknown),
        "priors": dict(task.priors),
        "sigmas": {key: value for key, value in vars(task.sigmas).items() if value is not None},
        "poses": calibration.log.count,
        "chi_square": finite(result.chi_square),
        "degrees_of_freedom": result.degrees,
        "residuals_over_sigma": finite(result.spread()),
        "residuals": {
            kind: {
                "count": fit.count,
                "rms_sigmas": fit.rms,
                "largest_sigmas": fit.largest,
                "dropped": fit.dropped,
            }
            for kind, fit in result.residuals.items()
        },
        "gauge": list(result.gauge),
        "frames_hardly_told": list(result.loose),
        "known_from_priors_alone": list(result.prior_only),
        "parameters": [
            {"name": name, "unit": unit, "change": float(value), "std": finite(float(std))}
            for name, unit, value, std in zip(
                result.names, result.units, result.values, result.std, strict=True
            )
        ],
        "length_offsets_m": model.length_offset.tolist(),
        "length_scales": model.length_scale.tolist(),
        "swivel_offsets_rad": model.swivel_offset.tolist(),
        "tracker_X_WK": pose_row(model.X_WK).tolist(),
        "marker_X_PM": pose_row(model.X_PM).tolist(),
        "camera_X_PC": pose_row(model.X_PC).tolist(),
        "tags_X_WT": {str(tag): pose_row(X).tolist() for tag, X in model.tags.items()},
        "poses_X_WP": [pose_row(X).tolist() for X in result.stations.poses()],
        "covariance": result.covariance.tolist(),
        "correlation": result.correlation.tolist(),
        "outliers": [
            {"pose": one.pose, "what": one.what, "residual": one.residual, "sigmas": one.sigmas}
            for one in result.outliers
        ],
        "remarks": [*calibration.remarks, *left],
        "steps": result.steps,
        "seconds": result.seconds,
        "versions": package_versions(),
        **_new_keys(calibration),
        **(more or {}),
    }


def _new_keys(calibration: Calibration) -> dict[str, Any]:
    """What belongs to some calibrations only, for JSON."""
    result, task, names = calibration.result, calibration.task, calibration.result.names
    model, added = result.model, dict[str, Any]()
    if any("drum_radius" in name for name in names):
        added["drum_radii_m"] = [
            (task.robot.winch.drum_radius if cable.drum_radius is None else cable.drum_radius)
            + model.common_drum_radius + float(change)
            for cable, change in zip(task.robot.cables, model.drum_radius, strict=True)
        ]  # fmt: skip
    if any(name.startswith("tilt_zero") for name in names):
        added["tilt_zeros_rad"] = model.tilt_zero.tolist()
    if "clock" in names:
        added["tracker_late_s"] = model.clock
    if task.zero is not None:
        added["zero_X_WP"] = pose_row(task.zero).tolist()
    if task.bounds:
        added["bounds"] = dict(task.bounds)
        added["at_bounds"] = dict(result.at_bounds)
    if calibration.held is not None:
        added["held_out"] = calibration.held.as_dict()
    return added


def _group_row(group: GroupFault) -> dict[str, Any]:
    """A group of measurements that does not agree, for JSON; rows count from 1."""
    return {
        "test": group.test, "measurement": group.quantity,
        "rows": [row + 1 for row in group.rows], "size": finite(group.size),
        "std": finite(group.std), "probability": group.probability,
        "poses_move_deviations": finite(group.moves), "misfit": group.counts,
        "words": group.words,
    }  # fmt: skip


def residual_row(one: Outlier) -> dict[str, Any]:
    """A measurement that does not fit, for JSON; rows count from 1."""
    return {
        "row": one.pose + 1, "measurement": one.what, "residual": one.residual, "unit": one.unit,
        "sigmas": one.sigmas,
    }  # fmt: skip


def _tables(calibration: Calibration, remarks: Sequence[str]) -> list[Table]:
    """Fit, parameters by group, what cannot be told, outliers."""
    result = calibration.result
    fit = new_table(
        f"{calibration.task.robot.name}: {result.status}, {calibration.log.count} poses, residuals "
        f"{result.spread():.2f} sigmas",
        ("measured",),
        ("numbers", "rms [sigmas]", "largest [sigmas]", "dropped"),
    )
    for kind, one in result.residuals.items():
        fit.add_row(kind, str(one.count), f"{one.rms:.2f}", f"{one.largest:.2f}", str(one.dropped))
    tables = [fit]
    if calibration.misfit:
        tables.append(_misfit_table(calibration))
    groups = new_table(
        "Parameters", ("group", "unit"), ("change, rms", "std, median", "std, largest")
    )
    for group, unit, values, std in grouped(calibration):
        groups.add_row(
            group, unit, f"{np.sqrt(np.mean(values**2)):.3g}", f"{np.median(std):.2g}",
            f"{np.max(std):.2g}",
        )  # fmt: skip
    tables.append(groups)
    said = [("frames are not told", words) for words in result.gauge]
    said += [("frames are hardly told", words) for words in result.loose]
    said += [("from the prior alone", words) for words in result.prior_only]
    if calibration.held is not None:
        said.append(("held out", calibration.held.words()))
    said += [("remark", words) for words in remarks]
    if said:
        notes = new_table("To know", ("what", "which"), ())
        for what, words in said:
            notes.add_row(what, words)
        tables.append(notes)
    if result.outliers:
        title = f"Outliers, {len(result.outliers)}, which did not count"
        outliers = new_table(title, ("row", "measurement"), ("off by", "sigmas"))
        for out in result.outliers[:MOST_OUTLIERS]:
            outliers.add_row(
                str(out.pose + 1), out.what, f"{out.residual:.4g} {out.unit}", f"{out.sigmas:.3g}"
            )
        tables.append(outliers)
    if calibration.ties:
        title = f"Other poses of rows that fit as well, {len(calibration.ties)}"
        ties = new_table(title, ("row",), ("away [mm]", "turned [deg]", "cost more"))
        for tie in calibration.ties[:MOST_OUTLIERS]:
            ties.add_row(
                str(tie.pose + 1), f"{1e3 * tie.distance:.3g}", f"{np.degrees(tie.angle):.3g}",
                f"{tie.more:.2g}",
            )  # fmt: skip
        tables.append(ties)
    return tables


def _misfit_table(calibration: Calibration) -> Table:
    """Why it is no fit, and the largest residuals."""
    why = [words for words in calibration.misfit if not words.startswith("largest: ")]
    title = "Does not fit: " + "; ".join(why)
    table = new_table(title, ("row", "measurement"), ("off by", "sigmas"))
    for one in calibration.result.largest:
        table.add_row(
            str(one.pose + 1), one.what, f"{one.residual:.4g} {one.unit}", f"{one.sigmas:.3g}"
        )
    return table


def grouped(calibration: Calibration) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    """Group, unit, changes and standard deviations of the unknown parameters."""
    result = calibration.result
    rows = []
    for key, group in GROUPS.items():
        for unit in dict.fromkeys(group.units):
            mine = [
                k
                for k, name in enumerate(result.names)
                if group.single in name.split(".") and result.units[k] == unit
                and (group.owner == "tag") == name.startswith("tag")
            ]  # fmt: skip
            if mine:
                rows.append((key, unit, result.values[mine], result.std[mine]))
    return rows


def calibration_drawings(calibration: Calibration) -> dict[str, Callable[[], Figure]]:
    """What draws the figures, by name: how measurements fit and what was found; correlations."""
    drawings: dict[str, Callable[[], Figure]] = {
        "calibration": partial(_fit_figure, calibration),
        "correlation": partial(_correlation_figure, calibration),
    }
    motion = calibration.task.robot.motion_type()
    if calibration.held is not None or not (motion.is_free or motion.is_horizontal_body):
        drawings["rows"] = partial(row_figure, calibration)
    return drawings


def _fit_figure(calibration: Calibration) -> Figure:
    """Residuals over sigma by kind, and changes beside standard deviations."""
    result = calibration.result
    name = f"Calibration of {calibration.task.robot.name}"
    title = "\n".join([f"{name}: does not fit what was measured", *calibration.misfit[:1]])
    title = title if calibration.misfit else name
    figure, axes = new_figure(1, 2, (13.0, 5.0), title)
    kinds = [kind for kind, fit in result.residuals.items() if fit.count + fit.dropped]
    fits = [result.residuals[kind] for kind in kinds]
    labels = [
        f"{kind}\n{fit.dropped} of {fit.count + fit.dropped} dropped" if fit.dropped else kind
        for kind, fit in zip(kinds, fits, strict=True)
    ]
    heights = {"rms": [fit.rms for fit in fits], "largest": [fit.largest for fit in fits]}
    bars(axes[0], labels, heights)
    axes[0].axhline(1.0, color="#202020", linestyle="--", linewidth=1.0)
    axes[0].set(ylabel="residual over its sigma [-]", title="how measurements fit")
    axes[0].legend()
    groups = grouped(calibration)
    names = [f"{group.replace('_', ' ')} [{unit}]" for group, unit, _, _ in groups]
    spreads = {
        "change, rms": [np.sqrt(np.mean(values**2)) for _, _, values, _ in groups],
        "standard deviation, median": [np.median(std) for _, _, _, std in groups],
    }
    shown = {label: _above_zero(values) for label, values in spreads.items()}
    bars(axes[1], names, shown, (nth_look(2), nth_look(3)), rotation=25, ha="right")
    axes[1].set_yscale("log")
    low, high = axes[1].get_ylim()  # whole decades, so that a bar's height says something
    axes[1].set_ylim(10.0 ** np.floor(np.log10(low)), 10.0 ** np.ceil(np.log10(high)))
    axes[1].set(title="what was found", ylabel="in the unit that is named below")
    axes[1].legend()
    return figure


def _above_zero(values: Sequence[float]) -> Array:
    """What a logarithmic axis shows; the rest is NaN."""
    heights = np.array(values, float)
    return np.where(np.isfinite(heights) & (heights > 0.0), heights, np.nan)


def _correlation_figure(calibration: Calibration) -> Figure:
    result = calibration.result
    size = max(5.0, min(14.0, 0.09 * len(result.names) + 3.0))
    matrix, plane = new_figure(1, 1, (size + 1.0, size), "Correlation of the unknown parameters")
    shown = plane.imshow(result.correlation, cmap="PuOr", vmin=-1.0, vmax=1.0)
    plane.grid(False)
    # In grey both signs look alike: negative ones bear their sign.
    rows, columns = np.nonzero(result.correlation < -SIGNED)
    plane.scatter(columns, rows, marker="_", color="black", s=20, linewidths=1.0)
    every = max(1, len(result.names) // 40)
    ticks = np.arange(0, len(result.names), every)
    plane.set_xticks(ticks, [result.names[k] for k in ticks], rotation=90, fontsize=7)
    plane.set_yticks(ticks, [result.names[k] for k in ticks], fontsize=7)
    matrix.colorbar(shown, ax=plane, label="correlation [-], - where it is negative", shrink=0.8)
    return matrix


def calibration_fit(
    calibration: Calibration, more: Mapping[str, Any] | None = None, tables: Sequence[Table] = ()
) -> LogFit:
    """What is told of a calibration, with more numbers and tables."""
    robot, _ = calibrated_robot(calibration.task.robot, calibration.result, calibration.mount)
    numbers = calibration_dict(calibration, more)
    shown = (*_tables(calibration, numbers["remarks"]), *tables)
    drawings = calibration_drawings(calibration)
    return LogFit(robot, RESULTS, numbers, shown, drawings, not calibration.misfit)
