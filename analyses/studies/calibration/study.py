"""`cdpr study calibration`: kinds of simulated calibrations, each over seeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Table
from scipy.stats import chi2

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.calibration import trials
from cdpr_drake.analyses.studies.calibration.servo import CHANGES, SCENARIO, straightness
from cdpr_drake.analyses.studies.calibration.statements import (
    ANCHORS_WITHIN,
    CAMERA,
    CHECKS,
    EXITS_WITHIN,
    HALF_SIZE,
    SERVO,
    START,
    TRACKER,
)
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import BOUND, nth_look

SEEDS, QUICK_SEEDS = 100, 2
MOST = {HALF_SIZE: 20, SERVO: 5}
"""Seeds that are repeated at half the size, and whose calibrated robots are servoed with; one of
each in the quick form."""


def cases(form: Form) -> Iterator[Case]:
    """The kinds of trials."""
    for kind in (CAMERA, HALF_SIZE, SERVO, TRACKER, START):
        most = 1 if form.quick and kind in MOST else MOST.get(kind)
        yield Case(name=kind, keys={"kind": kind}, most=most)


def measure(case: Case, seed: int) -> dict[str, Any]:
    """One trial.

    Returns:
        camera: exit_points_m, anchor_points_m: errors; chi-square of the errors over their
        covariance with frames moved along arcs, and straight, with its degrees of freedom;
        chi-square of the residuals and its. half: chi-square of the errors along arcs and
        straight; then with all noise and all that is off half as large. tracker:
        errors_over_bound: Cramer-Rao's, shape (48,). start: distance_m, angle_deg: of the start
        that winches and tensions found; distance_std_m, angle_std_deg: what was told of them.
        servo: straightness_m: largest distance from the straight line, by robot believed in.
    """
    return {CAMERA: _camera, HALF_SIZE: _half, SERVO: _servo, TRACKER: _tracker, START: _start}[
        case.keys["kind"]
    ](seed)


def _camera(seed: int) -> dict[str, Any]:
    trial = trials.camera_trial(seed)
    exits, anchors = trial.point_errors()
    along, straight = trial.normalized_squares()
    return {
        "exit_points_m": exits,
        "anchor_points_m": anchors,
        "errors_chi_square": along,
        "errors_chi_square_straight": straight,
        "errors_degrees": len(trial.errors()),
        "residuals_chi_square": trial.result.chi_square,
        "residuals_degrees": trial.result.degrees,
    }


def _half(seed: int) -> dict[str, Any]:
    row = {}
    for name, size in (("whole", 1.0), ("half", trials.HALF)):
        along, straight = trials.camera_trial(seed, size).normalized_squares()
        row |= {f"{name}_chi_square": along, f"{name}_chi_square_straight": straight}
    return row


def _tracker(seed: int) -> dict[str, Any]:
    errors, bound = trials.tracker_trial(seed)
    return {"errors_over_bound": errors / bound}


def _start(seed: int) -> dict[str, Any]:
    distance, angle, place, turn = trials.start_trial(seed)
    return {
        "distance_m": distance,
        "angle_deg": np.degrees(angle),
        "distance_std_m": place,
        "angle_std_deg": np.degrees(turn),
    }


def _servo(seed: int) -> dict[str, Any]:
    return {"straightness_m": straightness(trials.camera_trial(seed))}


def parameters(form: Form) -> Mapping[str, Any]:
    """All that the numbers depend on but the seeds."""
    names = [name for name in dir(trials) if name.isupper()]
    told = {name: getattr(trials, name) for name in names}
    return told | {"scenario": SCENARIO, "changes": CHANGES}


def table(runs: Runs) -> Table:
    """Errors over seeds."""
    made = new_table("Calibrations", ("by",), ("seeds", "median", "largest", "unit"))
    for name, kind, column, scale, unit in (
        ("camera, exit points", CAMERA, "exit_points_m", 1e3, "mm"),
        ("camera, anchor points", CAMERA, "anchor_points_m", 1e3, "mm"),
        ("winches, start", START, "distance_m", 1e3, "mm"),
        ("winches, start", START, "angle_deg", 1.0, "deg"),
    ):
        if runs.has(kind=kind):
            values = scale * runs(kind=kind)[column]
            numbers = f"{np.median(values):.3f}", f"{np.max(values):.3f}"
            made.add_row(name, str(len(values)), *numbers, unit)
    return made


def figure(runs: Runs) -> Figure:
    """Errors of points, chi-square beside its distribution, errors over their bounds."""
    drawn, axes = new_figure(1, 3, (16.0, 5.0), "Calibration over seeds")
    if runs.has(kind=CAMERA):
        _draw_camera(axes[0], axes[1], runs(kind=CAMERA))
    axes[0].set(xlabel="seeds, sorted", ylabel="error, rms [mm]", title="by the camera alone")
    axes[1].set(xlabel="errors over covariance, squared [-]", ylabel="share of seeds",
                title="covariance")  # fmt: skip
    if runs.has(kind=TRACKER):
        ratios = runs(kind=TRACKER)["errors_over_bound"]
        each = np.sqrt(np.mean(np.square(ratios), axis=0))
        axes[2].plot(np.sort(each), marker="o", label="coordinates", **line_style(nth_look(2)))
        axes[2].axhline(1.0, label="Cramer-Rao bound", **line_style(BOUND))
    axes[2].set(xlabel="coordinates, sorted", ylabel="rms error over its bound [-]",
                title="by a tracker: Cramer-Rao")  # fmt: skip
    for one in axes:
        if one.get_legend_handles_labels()[0]:
            one.legend()
    return drawn


def _draw_camera(errors: Axes, shares: Axes, runs: Runs) -> None:
    limits = {"exit": EXITS_WITHIN, "anchor": ANCHORS_WITHIN}
    for k, (name, limit) in enumerate(limits.items()):
        look, label = nth_look(k), f"{name} points"
        values = np.sort(1e3 * runs[f"{name}_points_m"])
        errors.plot(values, label=label, marker="osv"[k], **line_style(look))
        errors.axhline(
            1e3 * limit, color=look.color, linestyle=(":", "-.")[k],
            label=f"{label}: {1e3 * limit:g} mm",
        )  # fmt: skip
    degrees, values = runs.rows[0]["errors_degrees"], np.sort(runs["errors_chi_square"])
    share = (np.arange(len(values)) + 0.5) / len(values)
    shares.plot(values, share, marker="o", label="found", **line_style(nth_look(0)))
    low, high = chi2.ppf([0.001, 0.999], degrees)
    x = np.linspace(float(low), float(high), 200)
    shares.plot(x, chi2.cdf(x, degrees), label="chi-square", **line_style(BOUND))


STUDY = Study(
    name="calibration",
    title="Calibration by camera, tracker and winches beside the Cramer-Rao bound",
    cases=cases,
    measure=measure,
    seeds=(SEEDS, QUICK_SEEDS),
    checks=CHECKS,
    tables=[table],
    figures={"calibration": figure},
    parameters=parameters,
    unit="trials",
)
