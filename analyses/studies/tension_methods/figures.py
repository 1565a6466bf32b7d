"""Figures of the study of tension methods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.tension_methods.coverage import MethodCoverage
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    OTHER_ROBOT,
    THESIS_GAINS,
    THESIS_ROBOT,
)
from cdpr_drake.analyses.studies.tension_methods.gain_figures import gain_figures, gains_name
from cdpr_drake.analyses.studies.tension_methods.trial import Applied, TrialResult
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, DASHED, DOTTED, SOLID, Look, look_of, nth_look

COLUMNS = 3
"""Panels side by side."""

NEAR = 1.5
"""An upper bound is drawn where it is at most so many times the largest tension."""

SHORT = 0.05
"""The curve of a run that fell within this share of its duration would not be seen."""

LEAST_DRAWN_ERROR = 1e-9
"""Smaller errors are drawn as this, on a logarithmic axis [mm]."""

DASHES = {Applied.HELD: SOLID, Applied.CUT: DOTTED, Applied.PUSHED: DASHED}
"""Dashes by what is done with tensions out of bounds."""

GAINS = tuple(sorted({100.0, *(gain for gains in THESIS_GAINS.values() for gain in gains)}))
"""All gains Kp of the study, each with its colour and marker in all figures [1/s^2]."""

ROBOTS = (THESIS_ROBOT, OTHER_ROBOT)

FIGURES = (
    *(f"{name}_{what}" for name in EXPERIMENTS for what in ("errors", "tensions")),
    *map(gains_name, THESIS_GAINS),
    "coverage",
)
"""Names of all figures that the study can write."""


def study_drawings(
    runs: Sequence[TrialResult], coverage: Sequence[MethodCoverage]
) -> dict[str, Callable[[], Figure]]:
    """What draws the figures that the results suffice for, by name."""
    drawings: dict[str, Callable[[], Figure]] = {}
    for name in EXPERIMENTS:
        some = [run for run in runs if run.spec.experiment == name]
        if some:
            drawings[f"{name}_errors"] = partial(error_figure, some)
            drawings[f"{name}_tensions"] = partial(tension_figure, some)
    drawings |= gain_figures(runs)
    if coverage:
        drawings["coverage"] = partial(coverage_figure, coverage)
    return drawings


def error_figure(runs: Sequence[TrialResult]) -> Figure:
    """Position errors over time of the runs of one experiment, a panel per method."""
    methods = list(dict.fromkeys(run.spec.method for run in runs))
    gains = sorted({*GAINS, *(run.spec.stiffness for run in runs)})
    figure, panels = _panels(len(methods), f"Position error, {_title(runs)}")
    for axes, method in zip(panels, methods, strict=True):
        fell = []
        for run in (run for run in runs if run.spec.method == method):
            name = f"Kp {run.spec.stiffness:g}, {run.spec.applied}"
            if run.lost:
                fell.append(f"{name} fell at {run.end_time:.2f} s")
            if run.lost and run.end_time < SHORT * run.spec.duration:
                continue
            number = gains.index(run.spec.stiffness)
            seen = nth_look(number)
            draw_curve(
                axes,
                run.times,
                np.maximum(1e3 * run.errors, LEAST_DRAWN_ERROR),
                Look(seen.color, DASHES[run.spec.applied], seen.marker),
                name,
                phase=phase_of(number, len(gains)),
                markersize=4.0,
            )
        axes.set(yscale="log", xlim=(0.0, max(run.spec.duration for run in runs)))
        axes.set_title(method_words(method), fontsize=11)
        axes.legend(
            handles=list(axes.lines),
            title="\n".join("; ".join(fell[k : k + 2]) for k in range(0, len(fell), 2)),
            title_fontsize=7,
            fontsize=7,
            ncols=2,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.24),  # below the axes, where no curve runs
        )
    low = min(axes.get_ylim()[0] for axes in panels)
    high = max(axes.get_ylim()[1] for axes in panels)
    for axes in panels:
        axes.set_ylim(low, high)
    _name_axes(panels, "error [mm]")
    return figure


def tension_figure(runs: Sequence[TrialResult]) -> Figure:
    """Tensions of all cables over time, a panel per run of one experiment that stays up.

    Of each method with its treatment of bounds, the lowest and the highest gain.
    """
    # Where some stay up, these say more than those that fall.
    shown = _lowest_and_highest([run for run in runs if not run.lost] or list(runs))
    figure, panels = _panels(len(shown), f"Tensions, {_title(runs)}")
    for axes, run in zip(panels, shown, strict=True):
        robot = load_robot(run.spec.robot)
        for cable, each in enumerate(robot.cables):
            draw_curve(
                axes, run.times, run.tensions[:, cable], nth_look(cable), each.name,
                phase=phase_of(cable, len(robot.cables)), linewidth=1.0, markersize=4.0,
            )  # fmt: skip
        axes.set_title(method_words(run.spec.label), fontsize=10)
        low, high = robot.tension_limits()
        style = line_style(BOUND) | {"linewidth": 1.0, "zorder": 1}
        axes.axhline(low, label=f"lower bound {low:g} N", **style)
        if high <= NEAR * float(np.max(run.tensions, initial=0.0)):
            axes.axhline(high, label=f"upper bound {high:g} N", **style)
    _name_axes(panels, "tension [N]")
    legend = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(legend.values(), legend.keys(), loc="outside lower center", ncols=5)
    return figure


def method_words(name: str) -> str:
    """A method's name in words."""
    return name.replace("_", " ")


def _lowest_and_highest(runs: Sequence[TrialResult]) -> list[TrialResult]:
    """Of the runs that differ in their gains only, those of the lowest and the highest."""
    groups: dict[tuple[str, Applied], list[TrialResult]] = {}
    for run in runs:
        groups.setdefault((run.spec.method, run.spec.applied), []).append(run)
    chosen = []
    for group in groups.values():
        group.sort(key=lambda run: run.spec.stiffness)
        chosen += group[:1] + group[1:][-1:]
    return chosen


def coverage_figure(coverage: Sequence[MethodCoverage]) -> Figure:
    """Share of the feasible poses that each method solves, and its time for one."""
    robots = list(dict.fromkeys(row.robot for row in coverage))
    methods = list(dict.fromkeys(row.method for row in coverage))
    figure, (left, right) = new_figure(1, 2, (12.0, 6.5), "Coverage and speed of tension methods")
    height = 0.8 / len(robots)
    for k, robot in enumerate(robots):
        rows = {row.method: row for row in coverage if row.robot == robot}
        some = [name for name in methods if name in rows]
        places = np.array([methods.index(name) + (k + 0.5) * height - 0.4 for name in some])
        shares = [100.0 * rows[name].share for name in some]
        label = f"{robot}, {rows[some[0]].feasible} of {rows[some[0]].poses} poses feasible"
        style = bar_style(look_of(robot, sorted({*ROBOTS, *robots})))
        bars = left.barh(places, shares, height, label=label, **style)
        left.bar_label(bars, [f"{share:.0f}" for share in shares], padding=2, fontsize=8)
        times = [rows[name].kernel_microseconds for name in some]
        right.barh(places, times, height, label=robot, **style)
    left.set(xlabel="feasible poses solved [%]", xlim=(0.0, 112.0))
    right.set(xlabel="one pose in a batch, on one core [us]")
    left.set_yticks(range(len(methods)), [method_words(name) for name in methods])
    right.set_yticks(range(len(methods)), [])
    for axes in (left, right):
        axes.invert_yaxis()
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09))
    return figure


def _title(runs: Sequence[TrialResult]) -> str:
    name = runs[0].spec.experiment
    return f"experiment '{name}'\n{EXPERIMENTS[name].rstrip(chr(46))}"


def _panels(count: int, title: str) -> tuple[Figure, list[Axes]]:
    """Panels in rows; those that are too many are taken away."""
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure, grid = new_figure(rows, columns, (max(4.2 * columns, 9.0), 1.2 + 3.2 * rows), title)
    panels: list[Axes] = list(np.ravel(grid))
    for axes in panels[count:]:
        axes.remove()
    return figure, panels[:count]


def _name_axes(panels: Sequence[Axes], ylabel: str) -> None:
    columns = min(COLUMNS, len(panels))
    for k, axes in enumerate(panels):
        if k % columns == 0:
            axes.set_ylabel(ylabel)
        if k + columns >= len(panels):
            axes.set_xlabel("time [s]")
