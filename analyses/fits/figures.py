"""Figures of calibrations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.analyses.frame.figures import bars, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.fits.fit import Fit

SIGNED = 0.2
"""Negative correlations that are larger bear a sign in the figure."""

MOST_SHOWN = 30
"""Parameters for which a figure has room."""

UNITS = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "s": (1e3, "ms"), "-": (1e3, "1e-3")}
"""Factor and unit in which parameters are drawn."""

Group = tuple[str, str, Array, Array]
"""Name of a group of parameters, unit, changes and standard deviations."""


def fit_figure(fit: Fit, groups: Sequence[Group]) -> Figure:
    """Residuals over sigma by kind, and changes beside standard deviations."""
    title = "\n".join([f"{fit.title}: does not fit what was measured", *fit.misfit[:1]])
    figure, axes = new_figure(1, 2, (13.0, 5.0), title if fit.misfit else fit.title)
    kinds = {kind: n for kind, n in fit.residuals.items() if n["count"] + n["dropped"]}
    labels = [
        f"{kind}\n{n['dropped']} of {n['count'] + n['dropped']} dropped" if n["dropped"] else kind
        for kind, n in kinds.items()
    ]
    heights = {
        "rms": [n["rms_sigmas"] for n in kinds.values()],
        "largest": [n["largest_sigmas"] for n in kinds.values()],
    }
    bars(axes[0], labels, heights)
    axes[0].axhline(1.0, color="#202020", linestyle="--", linewidth=1.0)
    axes[0].set(ylabel="residual over its sigma [-]", title="how measurements fit")
    axes[0].legend()
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


def correlation_figure(fit: Fit) -> Figure:
    """Correlation of the unknown parameters."""
    assert fit.correlation is not None
    names = [unknown.name for unknown in fit.unknowns]
    size = max(5.0, min(14.0, 0.09 * len(names) + 3.0))
    matrix, plane = new_figure(1, 1, (size + 1.0, size), "Correlation of the unknown parameters")
    matrix.set_layout_engine("compressed")  # the other one cuts names off beside a square
    shown = plane.imshow(fit.correlation, cmap="PuOr", vmin=-1.0, vmax=1.0)
    plane.grid(False)
    # In grey both signs look alike: negative ones bear their sign.
    rows, columns = np.nonzero(fit.correlation < -SIGNED)
    plane.scatter(columns, rows, marker="_", color="black", s=20, linewidths=1.0)
    ticks = np.arange(0, len(names), max(1, len(names) // 40))
    plane.set_xticks(ticks, [names[k] for k in ticks], rotation=90, fontsize=7)
    plane.set_yticks(ticks, [names[k] for k in ticks], fontsize=7)
    matrix.colorbar(shown, ax=plane, label="correlation [-], - where it is negative", shrink=0.8)
    return matrix


def row_figure(fit: Fit) -> Figure:
    """Residuals over sigma of each row by kind; changes with standard deviations."""
    result, held = fit.result, fit.held_out
    figure, axes = new_figure(1, 2, (13.0, 5.0), f"{fit.title}, row by row")
    numbers = np.arange(1, result.stations.count + 1)
    if held is not None and len(held.fitted):
        numbers = held.fitted + 1
    for n, (kind, values) in enumerate(result.by_row.items()):
        look, seen = nth_look(n), np.isfinite(values)
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
    _draw_changes(axes[1], fit)
    return figure


def _draw_changes(axes: Axes, fit: Fit) -> None:
    """Changes and deviations of the first parameters, in units to read."""
    shown = fit.unknowns[:MOST_SHOWN]
    units = [UNITS.get(unknown.unit, (1.0, unknown.unit)) for unknown in shown]
    factors, places = np.array([factor for factor, _ in units]), np.arange(len(shown))
    changes = factors * [unknown.change or 0.0 for unknown in shown]
    std = factors * [unknown.std if np.isfinite(unknown.std) else 0.0 for unknown in shown]
    axes.errorbar(
        changes, places, xerr=std, fmt="o", color=nth_look(2).color, capsize=3.0, markersize=4.0,
        label="change, and one standard deviation",
    )  # fmt: skip
    axes.axvline(0.0, color="#202020", linewidth=0.8)
    names = [f"{unknown.name} [{unit}]" for unknown, (_, unit) in zip(shown, units, strict=True)]
    axes.set_yticks(places, names, fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="change, in the unit that is named", title="what was found")
    axes.legend()
