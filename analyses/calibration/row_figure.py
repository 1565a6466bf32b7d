"""Residuals row by row, and what was found of each parameter with its deviation, as a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.calibration.calibration_task import Calibration
from cdpr_drake.analyses.frame.figures import new_figure
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.palette import nth_look

MOST_SHOWN = 30
"""Parameters that the figure has room for."""

UNITS = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "s": (1e3, "ms"), "-": (1e3, "1e-3")}
"""Factor and unit in which parameters are drawn."""


def row_figure(calibration: Calibration) -> Figure:
    """Residuals over sigma of each row by kind; changes of lengths with standard deviations."""
    result = calibration.result
    figure, axes = new_figure(
        1, 2, (13.0, 5.0), f"Calibration of {calibration.task.robot.name}, row by row"
    )
    numbers = np.arange(1, result.stations.count + 1)
    held = calibration.held
    if held is not None and held.fitted:
        numbers = np.asarray(held.fitted) + 1
    for n, (kind, values) in enumerate(result.by_row.items()):
        look = nth_look(n)
        seen = np.isfinite(values)
        axes[0].plot(
            numbers[seen], values[seen], linestyle="none", marker=look.marker, color=look.color,
            markersize=4.0, label=kind,
        )  # fmt: skip
    axes[0].axhline(1.0, color="#202020", linestyle="--", linewidth=1.0)
    axes[0].set(
        xlabel="row of the log", ylabel="residuals over their sigma, rms [-]",
        title="how each row fits",
    )  # fmt: skip
    axes[0].set_ylim(bottom=0.0)
    axes[0].legend()
    names, changes, stds = _changes(result)
    places = np.arange(len(names))
    axes[1].errorbar(
        changes, places, xerr=stds, fmt="o", color=nth_look(2).color, capsize=3.0, markersize=4.0,
        label="change, and one standard deviation",
    )  # fmt: skip
    axes[1].axvline(0.0, color="#202020", linewidth=0.8)
    axes[1].set_yticks(places, names, fontsize=7)
    axes[1].invert_yaxis()
    axes[1].set(xlabel="change, in the unit that is named", title="what was found")
    axes[1].legend()
    return figure


def _changes(result: CalibrationResult) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names with units, changes and deviations of the first parameters, in units to read."""
    names, changes, stds = [], [], []
    rows = zip(result.names, result.units, result.values, result.std, strict=True)
    for name, unit, value, std in list(rows)[:MOST_SHOWN]:
        factor, shown = UNITS.get(unit, (1.0, unit))
        names.append(f"{name} [{shown}]")
        changes.append(factor * value)
        stds.append(factor * std if np.isfinite(std) else 0.0)
    return names, np.array(changes), np.array(stds)
