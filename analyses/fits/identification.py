"""A robot's dynamics from a log of a motion: the verb `identify`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.fits.dynamics import (
    UNKNOWN,
    Identification,
    IdentificationTask,
    fit_dynamics,
    identified_robot,
)
from cdpr_drake.analyses.fits.fit import (
    Fit,
    Groups,
    Priors,
    Unknown,
    group_names,
    kept_fit,
    log_of,
    notes_table,
)
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    RobotWord,
    Switch,
)
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR
from cdpr_drake.models.robot_loader import as_robot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_TRUTH = "no true value"
"""Stands in the row of a parameter that has none to be compared to."""

AXES = (
    "moment x [N m]", "moment y [N m]", "moment z [N m]", "force x [N]", "force y [N]",
    "force z [N]",
)  # fmt: skip


@verb()
def identify(
    robot: RobotWord, log: InputFile, *, validate: InputFile = None, unknown: Groups = UNKNOWN,
    common: Groups = (), priors: Priors = None, bandwidth: float | None = None,
    sigma_lengths: float = 5e-5, pulleys: bool = True,
    tracker_late: float | None = None, keep_outliers: Switch = False, folder: OutFolder = None,
    overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Finds a robot's dynamics in a log of a motion.

    A row of LOG is an instant, as in the log.csv of cdpr simulate. Columns: time_s; the pose by a
    tracker, x_m, y_m, z_m with qw, qx, qy, qz or angles; C1_tension_n ...; for stiffness and
    damping what winches count, C1_length_m or C1_motor_angle_rad; for friction also
    C1_motor_torque_nm. Cables go by name or number, units by ending; of true and measured values
    the measured ones are read.

    The exit code is 2 if the log cannot tell what is unknown, and 6 if residuals are more than 3
    times what noise says: status misfit, with the largest by time and equation.

    Args:
        robot: Robot by name or file, as it is believed.
        log: Log, text with columns.
        validate: Log of another motion, to predict and not to fit.
        unknown: Groups of parameters: mass, center_of_mass, inertia, stiffness, damping, friction,
            static_friction.
        common: Groups with one value for all cables or winches.
        priors: Standard deviations known beforehand, as mass=0.1,inertia=0.01.
        bandwidth: Bandwidth of the smoothing [Hz]; default: 8, less for slow logs.
        sigma_lengths: Standard deviation of the lengths that winches count, errors of the geometry
            included [m].
        pulleys: Cables run over pulleys.
        tracker_late: Delay of the tracker's poses [s]; default: none, which is checked.
        keep_outliers: Count every equation as it is.
        folder: Results folder with robot.yaml, which scenarios take as
            perturbations.believed_robot, results.json and figures; default: runs/identify-ROBOT; in
            Python nothing is kept.
        overwrite: Replace results in the folder.
        formats: Formats of the figures.
        follow: Who follows the work.

    Raises:
        IdentificationError: A log does not hold, or does not tell, what is unknown; names it.
        DataFileError: A file cannot be read.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = as_robot(robot, "identify")
    fitted = log_of(loaded, log, tracker_late)
    other = None if validate is None else log_of(loaded, validate, tracker_late)
    task = IdentificationTask(
        robot=loaded, unknown=group_names(unknown), common=group_names(common),
        priors=dict(priors or {}), sigma_lengths=sigma_lengths, pulleys=pulleys,
        outliers=not keep_outliers, check_clock=tracker_late is None,
    )  # fmt: skip
    arguments = {
        **vars(task), "verb": "identify", "log": fitted, "validate": other, "bandwidth": bandwidth,
    }  # fmt: skip

    def work() -> Fit:
        return identification_fit(fit_dynamics(task, fitted, other, follow.doing, bandwidth))

    return kept_fit(f"identify-{loaded.name}", arguments, work, folder, overwrite, formats, follow)


def identification_fit(identification: Identification, truth: DynamicModel | None = None) -> Fit:
    """The fit of an identification, beside the true robot's dynamics if it was simulated."""
    result, task = identification.result, identification.task
    fitted, validated = identification.fitted, identification.validated
    robot, left = identified_robot(task.robot, result)
    unknowns = tuple(
        Unknown(name, unit, float(std), value=float(value), before=float(before),
                true=None if truth is None else true_value(name, truth))
        for name, unit, value, std, before in zip(
            result.names, result.units, result.values, result.std, result.before, strict=True
        )
    )  # fmt: skip
    model, remarks = result.model, (*identification.remarks, *left)
    largest = [
        {"time_s": residual.time, "equation": residual.equation, "value": residual.value,
         "unit": residual.unit, "sigmas": residual.sigmas}
        for residual in result.largest
    ]  # fmt: skip
    residuals = {
        name: {"equations": term.count, "rms_sigmas": term.rms} | term.misfit
        for name, term in result.terms.items()
    }
    return Fit(
        title=f"Identification of {task.robot.name}", model=robot, status=result.status,
        unknowns=unknowns, spread=result.spread, residuals=residuals, remarks=remarks,
        covariance=result.covariance,
        held_out=None if validated is None else validated.misfit,
        details={
            "robot": task.robot.name, "log": str(fitted.log.path),
            "validation_log": None if validated is None else str(validated.log.path),
            "solver": result.solver, "unknown": list(task.unknown), "common": list(task.common),
            "priors": dict(task.priors), "pulleys": task.pulleys,
            "bandwidth_hz": identification.bandwidth, "rows": fitted.log.count,
            "samples": fitted.samples.count,
            "noise": {
                "tensions_n": fitted.samples.sigma_tensions.tolist(),
                "turn_rad": fitted.samples.sigma_turn, "place_m": fitted.samples.sigma_place,
                "lengths_m": task.sigma_lengths,
            },
            "friction_of_winches": [
                {"winch": name, "coulomb_nm": c, "static_nm": s, "viscous_nms": v}
                for name, c, s, v in zip(
                    model.names, model.coulomb.tolist(), model.static.tolist(),
                    model.viscous.tolist(), strict=True,
                )
            ],
            "condition": finite(result.condition), "chi_square": finite(result.chi_square),
            "degrees_of_freedom": result.degrees, "pose_error_m": result.pose_error,
            "largest_residuals": largest, "terms": residuals, "fitted_log": fitted.misfit,
            "log_not_fitted": None if validated is None else validated.misfit,
            "bounds": list(result.active), "equations_weighted_down": result.outliers,
            "steps": result.steps, "wall_time_s": result.wall_time,
        },
        shown=(*_tables(identification, unknowns), *notes_table(remarks)),
        drawings={
            "validation": lambda: _wrench_figure(identification),
            "parameters": lambda: parameter_figure(unknowns, compared=truth is not None),
        },
        result=result, source=identification,
    )  # fmt: skip


def true_value(name: str, truth: DynamicModel) -> float | None:
    """A parameter of the true robot by its name; None for what belongs to a log, as offsets."""
    owner, _, kind = name.partition(".")
    if name == "mass":
        return truth.mass
    if owner == "center_of_mass":
        return float(truth.center_of_mass["xyz".index(kind)])
    if owner == "inertia":
        return float(truth.inertia[("xx", "yy", "zz", "xy", "xz", "yz").index(kind)])
    by_kind = {
        "stiffness": truth.stiffness, "retardation_time": truth.retardation,
        "coulomb": truth.coulomb, "viscous": truth.viscous, "static": truth.static,
    }  # fmt: skip
    if kind not in by_kind:
        return None
    return float(by_kind[kind][0 if owner == "all" else truth.names.index(owner)])


def _tables(identification: Identification, unknowns: Sequence[Unknown]) -> list[Table]:
    """Parameters, what is not explained, and of a misfit the largest residuals."""
    result = identification.result
    compared = any(unknown.true is not None for unknown in unknowns)

    def row(u: Unknown) -> list[str]:
        true = [] if not compared else ["" if u.true is None else f"{u.true:.5g}"]
        return [u.name, f"{u.before:.5g}", f"{u.value:.5g}", f"{u.std:.2g}", *true, u.unit]

    logs = [
        (words, kind, *(f"{log.misfit[who][kind]:.4g}" for who in ("believed", "identified")))
        for words, log in (
            ("fitted", identification.fitted), ("not fitted", identification.validated),
        ) if log is not None
        for kind in log.misfit["identified"]
    ]  # fmt: skip
    tables = [
        Table(
            f"Identification of {identification.task.robot.name}: {result.status}, residuals "
            f"{result.spread:.2f} sigma, condition {result.condition:.0f}",
            ("parameter", "before", "value", "std. error", *["true"] * compared, "unit"),
            list(map(row, unknowns)),
        ),
        Table("What is not explained, rms",
              ("log", "quantity", "believed before", "identified"), logs),
    ]  # fmt: skip
    if result.status == MISFIT:
        tables.append(Table(
            f"Largest residuals: more than {MISFIT_FACTOR:g} sigma in the mean is no fit",
            ("time [s]", "equation", "not explained", "unit", "sigma beside the others"),
            [(f"{r.time:.3f}", r.equation, f"{r.value:.4g}", r.unit, f"{r.sigmas:.1f}")
             for r in result.largest],
        ))  # fmt: skip
    return tables


def _wrench_figure(identification: Identification) -> Figure:
    """Wrenches on the log that was not fitted, or on the fitted one."""
    from cdpr_drake.analyses.frame.figures import line_style, new_figure
    from cdpr_drake.palette import nth_look

    motion = identification.validated or identification.fitted
    words = "not fitted" if identification.validated else "fitted: no other log was given"
    title = f"Wrench of the cables on the platform of {identification.task.robot.name}\n({words})"
    figure, axes = new_figure(2, 3, (15.0, 8.0), title)
    wrenches = {
        "measured": motion.samples.wrench, "identified": motion.predicted[0],
        "believed before": motion.predicted[1],
    }  # fmt: skip
    for k, panel in enumerate(np.ravel(axes)):
        for n, (label, wrench) in enumerate(wrenches.items()):
            panel.plot(motion.samples.time, wrench[:, k], label=label, **line_style(nth_look(n)))
        panel.set(xlabel="time [s]", ylabel=AXES[k])
    np.ravel(axes)[0].legend()
    return figure


def parameter_figure(unknowns: Sequence[Unknown], compared: bool) -> Figure:
    """Parameters over their standard errors: if compared, their true errors; else their changes."""
    from cdpr_drake.analyses.frame.figures import bar_style, line_style, new_figure
    from cdpr_drake.palette import BOUND, nth_look

    count = len(unknowns)
    figure, axes = new_figure(
        1, 1, (10.5, max(4.0, 0.28 * count + 1.5)),
        "Identified parameters over their standard error",
    )  # fmt: skip
    places = np.arange(count)[::-1]
    off = np.full(count, math.nan)
    for k, unknown in enumerate(unknowns):
        reference = unknown.true if compared else unknown.before
        if reference is None:
            axes.annotate(
                NO_TRUTH, (0.0, places[k]), (4.0, 0.0), textcoords="offset points", va="center",
                fontsize=8, color="0.35",
            )  # fmt: skip
        else:
            off[k] = ((unknown.value or 0.0) - reference) / max(unknown.std, 1e-300)
    known = np.isfinite(off)
    label = f"identified less {'true' if compared else 'before'}"
    axes.barh(places[known], off[known], 0.7, label=label, **bar_style(nth_look(1)))
    if compared:
        for x in (-2.0, 2.0):
            axes.axvline(x, **line_style(BOUND))
        axes.set(xlabel="error over its standard error [-]; dashed: 2")
    else:
        axes.set_xscale("symlog", linthresh=2.0)
        axes.set(xlabel="change over its standard error [-]")
    labels = [f"{u.name} = {u.value:.4g} ± {u.std:.2g} {u.unit}" for u in unknowns]
    axes.set_yticks(places, labels, fontsize=8)
    axes.set_ylim(-1.0, count)
    figure.legend(loc="outside lower right")
    return figure
