"""What an identification says: numbers for JSON, tables, figures, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.calibration.identification_task import Identification
from cdpr_drake.analyses.calibration.identified_robots import identified_robot
from cdpr_drake.analyses.calibration.log_fit import LogFit
from cdpr_drake.analyses.frame.figures import bar_style, line_style, new_figure
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR
from cdpr_drake.palette import BOUND, nth_look

RESULTS = "identification.json"
"""File of a results folder: all numbers."""

NO_TRUTH = "no true value"
"""Stands in the row of a parameter that has none to be compared to."""

AXES = (
    "moment x [N m]", "moment y [N m]", "moment z [N m]", "force x [N]", "force y [N]",
    "force z [N]",
)  # fmt: skip


def true_values(identification: Identification, truth: DynamicModel) -> dict[str, float]:
    """The identified parameters as they truly are, by name; offsets are not known."""
    model, found = identification.result.model, {}
    single = {
        "stiffness": truth.stiffness, "retardation_time": truth.retardation,
        "coulomb": truth.coulomb, "viscous": truth.viscous, "static": truth.static,
    }  # fmt: skip
    for name in identification.result.names:
        owner, _, what = name.partition(".")
        if name == "mass":
            found[name] = truth.mass
        elif owner == "center_of_mass":
            found[name] = float(truth.center_of_mass["xyz".index(what)])
        elif owner == "inertia":
            found[name] = float(truth.inertia[("xx", "yy", "zz", "xy", "xz", "yz").index(what)])
        elif what in single:
            found[name] = float(single[what][0 if owner == "all" else model.names.index(owner)])
    return found


def identification_dict(
    identification: Identification,
    more: Mapping[str, Any] | None = None,
    truth: DynamicModel | None = None,
) -> dict[str, Any]:
    """Everything for JSON, and more that belongs to it."""
    result, task = identification.result, identification.task
    _, left = identified_robot(task.robot, result)
    true = {} if truth is None else true_values(identification, truth)
    validated = identification.validated
    return {
        "robot": task.robot.name,
        "log": str(identification.fitted.log.path),
        "validation_log": None if validated is None else str(validated.log.path),
        "status": result.status,
        "solver": result.solver,
        "unknown": list(task.unknown),
        "common": list(task.common),
        "priors": dict(task.priors),
        "pulleys": task.pulleys,
        "bandwidth_hz": identification.bandwidth,
        "rows": identification.fitted.log.count,
        "samples": identification.fitted.samples.count,
        "noise": {
            "tensions_n": identification.fitted.samples.sigma_tensions.tolist(),
            "turn_rad": identification.fitted.samples.sigma_turn,
            "place_m": identification.fitted.samples.sigma_place,
            "lengths_m": task.sigma_lengths,
        },
        "parameters": [
            {"name": name, "unit": unit, "value": float(value), "std": finite(float(std)),
             "before": float(before)} | ({"true": true[name]} if name in true else {})
            for name, unit, value, std, before in zip(
                result.names, result.units, result.values, result.std, result.before, strict=True
            )
        ],
        "friction_of_winches": [
            {"winch": name, "coulomb_nm": c, "static_nm": s, "viscous_nms": v}
            for name, c, s, v in zip(
                result.model.names, result.model.coulomb.tolist(), result.model.static.tolist(),
                result.model.viscous.tolist(), strict=True,
            )
        ],
        "covariance": finite(result.covariance.tolist()),
        "correlation": finite(result.correlation.tolist()),
        "condition": finite(result.condition),
        "chi_square": finite(result.chi_square),
        "degrees_of_freedom": result.degrees,
        "residuals_over_sigma": finite(result.spread),
        "misfit_factor": MISFIT_FACTOR,
        "pose_error_m": result.pose_error,
        "largest_residuals": [
            {
                "time_s": one.time, "equation": one.equation, "value": one.value,
                "unit": one.unit, "sigmas": one.sigmas,
            }
            for one in result.largest
        ],
        "terms": {
            name: {"equations": fit.count, "rms_sigmas": fit.rms} | fit.misfit
            for name, fit in result.terms.items()
        },
        "fitted_log": identification.fitted.misfit,
        "log_not_fitted": None if validated is None else validated.misfit,
        "bounds": list(result.active),
        "equations_weighted_down": result.outliers,
        "remarks": [*identification.remarks, *left],
        "steps": result.steps,
        "wall_time_s": result.wall_time,
        "versions": package_versions(),
    } | dict(more or {})  # fmt: skip


def _tables(
    identification: Identification, truth: DynamicModel | None, remarks: Sequence[str]
) -> list[Table]:
    """Parameters, what is not explained, the largest residuals, remarks."""
    result = identification.result
    true = {} if truth is None else true_values(identification, truth)
    names = ("before", "found", "std. error", *(["true"] if true else []), "unit")
    title = (
        f"Identification of {identification.task.robot.name}: {result.status}, residuals "
        f"{result.spread:.2f} sigma, condition {result.condition:.0f}"
    )
    table = new_table(title, ("parameter",), names)
    for name, unit, value, std, before in zip(
        result.names, result.units, result.values, result.std, result.before, strict=True
    ):
        numbers = [f"{before:.5g}", f"{value:.5g}", f"{std:.2g}"]
        if true:
            numbers.append(f"{true[name]:.5g}" if name in true else "")
        table.add_row(name, *numbers, unit)
    logs = new_table(
        "What is not explained, rms", ("log", "quantity"), ("believed before", "identified")
    )
    for words, one in (
        ("fitted", identification.fitted), ("not fitted", identification.validated),
    ):  # fmt: skip
        if one is None:
            continue
        for what in one.misfit["identified"]:
            values = [one.misfit[who][what] for who in ("believed", "identified")]
            logs.add_row(words, what, *(f"{value:.4g}" for value in values))
    tables = [table, logs]
    if result.status == MISFIT:
        most = new_table(
            f"Largest residuals: more than {MISFIT_FACTOR:g} sigma in the mean is no fit",
            ("time [s]", "equation"), ("not explained", "unit", "sigma beside the others"),
        )  # fmt: skip
        for off in result.largest:
            most.add_row(
                f"{off.time:.3f}", off.equation, f"{off.value:.4g}", off.unit, f"{off.sigmas:.1f}"
            )
        tables.append(most)
    if remarks:
        notes = new_table("To know", ("remark",), ())
        for words in remarks:
            notes.add_row(words)
        tables.append(notes)
    return tables


def identification_drawings(
    identification: Identification, truth: DynamicModel | None = None
) -> dict[str, Callable[[], Figure]]:
    """What draws the figures, by name: wrenches on the log that was not fitted, and parameters
    with their errors."""
    return {
        "validation": partial(_wrench_figure, identification),
        "parameters": partial(_parameter_figure, identification, truth),
    }


def _wrench_figure(identification: Identification) -> Figure:
    shown = identification.validated or identification.fitted
    words = "not fitted" if identification.validated else "fitted: no other log was given"
    title = f"Wrench of the cables on the platform of {identification.task.robot.name}\n({words})"
    figure, axes = new_figure(2, 3, (15.0, 8.0), title)
    for k, ax in enumerate(np.ravel(axes)):
        time = shown.samples.time
        ax.plot(time, shown.samples.wrench[:, k], label="measured", **line_style(nth_look(0)))
        ax.plot(time, shown.predicted[0][:, k], label="identified", **line_style(nth_look(1)))
        ax.plot(time, shown.predicted[1][:, k], label="believed before", **line_style(nth_look(2)))
        ax.set(xlabel="time [s]", ylabel=AXES[k])
    np.ravel(axes)[0].legend()
    return figure


def _parameter_figure(identification: Identification, truth: DynamicModel | None) -> Figure:
    result = identification.result
    true = {} if truth is None else true_values(identification, truth)
    count = len(result.names)
    parameters, ax = new_figure(
        1, 1, (10.5, max(4.0, 0.28 * count + 1.5)),
        "Identified parameters over their standard error",
    )  # fmt: skip
    places, std = np.arange(count)[::-1], np.maximum(result.std, 1e-300)
    if true:
        known = [k for k, name in enumerate(result.names) if name in true]
        off = [(result.values[k] - true[result.names[k]]) / std[k] for k in known]
        ax.barh(places[known], off, 0.7, label="found less true", **bar_style(nth_look(1)))
        for x in (-2.0, 2.0):
            ax.axvline(x, **line_style(BOUND))
        ax.set(xlabel="error over its standard error [-]; dashed: 2")
        for k in set(range(count)) - set(known):
            ax.annotate(
                NO_TRUTH, (0.0, places[k]), (4.0, 0.0), textcoords="offset points", va="center",
                fontsize=8, color="0.35",
            )  # fmt: skip
    else:
        changed = (result.values - result.before) / std
        ax.barh(places, changed, 0.7, label="found less before", **bar_style(nth_look(1)))
        ax.set_xscale("symlog", linthresh=2.0)
        ax.set(xlabel="change over its standard error [-]")
    labels = [
        f"{name} = {value:.4g} ± {error:.2g} {unit}"
        for name, value, error, unit in zip(
            result.names, result.values, result.std, result.units, strict=True
        )
    ]
    ax.set_yticks(places, labels, fontsize=8)
    ax.set_ylim(-1.0, count)
    parameters.legend(loc="outside lower right")
    return parameters


def identification_fit(
    identification: Identification,
    more: Mapping[str, Any] | None = None,
    truth: DynamicModel | None = None,
) -> LogFit:
    """What is told of an identification, with more numbers, beside the truth where it is known."""
    robot, _ = identified_robot(identification.task.robot, identification.result)
    numbers = identification_dict(identification, more, truth)
    tables = _tables(identification, truth, numbers["remarks"])
    drawings = identification_drawings(identification, truth)
    fits = identification.result.status != MISFIT
    return LogFit(robot, RESULTS, numbers, tables, drawings, fits)
