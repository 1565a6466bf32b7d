"""Figures of the study of tension methods."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    OTHER_ROBOT,
    THESIS_GAINS,
    THESIS_ROBOT,
)
from cdpr_drake.analyses.studies.tension_methods.trial import Applied, label_of
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

LEGEND_DISTANCE = 5.0
"""From the axes to a legend below them, for numbers and label between [font sizes of the legend]:
a length, so that axes of any height keep it."""

LEAST_DRAWN_ERROR = 1e-9
"""Smaller errors are drawn as this, on a logarithmic axis [mm]."""

DASHES = {Applied.HELD: SOLID, Applied.CUT: DOTTED, Applied.PUSHED: DASHED}
"""Dashes by what is done with tensions out of bounds."""

GAINS = tuple(sorted({100.0, *(gain for gains in THESIS_GAINS.values() for gain in gains)}))
"""All gains Kp of the study, each with its colour and marker in all figures [1/s^2]."""

ROBOTS = (THESIS_ROBOT, OTHER_ROBOT)


def error_figure(experiment: str, all_runs: Runs) -> Figure:
    """Position errors over time of the runs of one experiment, a panel per method."""
    runs = all_runs(experiment=experiment)
    methods = dict(runs.by("method"))
    gains = sorted({*GAINS, *runs.list("kp_per_s2")})
    figure, panels = _panels(len(methods), f"Position error, {_title(experiment)}")
    for axes, (method, some) in zip(panels, methods.items(), strict=True):
        fell = []
        for run in some:
            name = f"Kp {run['kp_per_s2']:g}, {run['applied']}"
            if run["lost"]:
                fell.append(f"{name} fell at {run['end_time_s']:.2f} s")
            if run["lost"] and run["end_time_s"] < SHORT * run["wanted_duration_s"]:
                continue
            number = gains.index(run["kp_per_s2"])
            seen = nth_look(number)
            draw_curve(
                axes,
                run["times_s"],
                np.maximum(1e3 * run["errors_m"], LEAST_DRAWN_ERROR),
                Look(seen.color, DASHES[run["applied"]], seen.marker),
                name,
                phase=phase_of(number, len(gains)),
                markersize=4.0,
            )
        axes.set(yscale="log", xlim=(0.0, runs.largest("wanted_duration_s")))
        axes.set_title(method_words(method), fontsize=11)
        axes.legend(
            handles=list(axes.lines),
            title="\n".join("; ".join(fell[k : k + 2]) for k in range(0, len(fell), 2)),
            title_fontsize=7,
            fontsize=7,
            ncols=2,
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            borderaxespad=LEGEND_DISTANCE,  # below the axes, where no curve runs
        )
    low = min(axes.get_ylim()[0] for axes in panels)
    high = max(axes.get_ylim()[1] for axes in panels)
    for axes in panels:
        axes.set_ylim(low, high)
    _name_axes(panels, "error [mm]")
    return figure


def tension_figure(experiment: str, all_runs: Runs) -> Figure:
    """Tensions of all cables over time, a panel per run of one experiment that stays up.

    Of each method with its treatment of bounds, the lowest and the highest gain.
    """
    runs = all_runs(experiment=experiment)
    # Where some stay up, these say more than those that fall.
    up = runs(lost=False)
    shown = _lowest_and_highest(up if len(up) else runs)
    figure, panels = _panels(len(shown), f"Tensions, {_title(experiment)}")
    for axes, run in zip(panels, shown, strict=True):
        robot = load_robot(run["robot"])
        for cable, each in enumerate(robot.cables):
            draw_curve(
                axes, run["times_s"], run["tensions_n"][:, cable], nth_look(cable), each.name,
                phase=phase_of(cable, len(robot.cables)), linewidth=1.0, markersize=4.0,
            )  # fmt: skip
        axes.set_title(method_words(label_of(run)), fontsize=10)
        low, high = robot.tension_limits()
        style = line_style(BOUND) | {"linewidth": 1.0, "zorder": 1}
        axes.axhline(low, label=f"lower bound {low:g} N", **style)
        if high <= NEAR * float(np.max(run["tensions_n"], initial=0.0)):
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


def _lowest_and_highest(runs: Runs) -> list[Run]:
    """Of the runs that differ in their gains only, those of the lowest and the highest."""
    chosen = []
    for _, group in runs.by("method", "applied"):
        ordered = sorted(group, key=lambda run: run["kp_per_s2"])
        chosen += ordered[:1] + ordered[1:][-1:]
    return chosen


def coverage_figure(coverage: Iterable[Run]) -> Figure:
    """Share of the feasible poses that each method solves, and its time for one; see `cover`."""
    coverage = list(coverage)
    robots = list(dict.fromkeys(row["robot"] for row in coverage))
    methods = list(dict.fromkeys(row["method"] for row in coverage))
    figure, (left, right) = new_figure(1, 2, (12.0, 6.5), "Coverage and speed of tension methods")
    height = 0.8 / len(robots)
    for k, robot in enumerate(robots):
        rows = {row["method"]: row for row in coverage if row["robot"] == robot}
        some = [name for name in methods if name in rows]
        places = np.array([methods.index(name) + (k + 0.5) * height - 0.4 for name in some])
        shares = [100.0 * rows[name]["share"] for name in some]
        label = f"{robot}, {rows[some[0]]['feasible']} of {rows[some[0]]['poses']} poses feasible"
        style = bar_style(look_of(robot, sorted({*ROBOTS, *robots})))
        bars = left.barh(places, shares, height, label=label, **style)
        left.bar_label(bars, [f"{share:.0f}" for share in shares], padding=2, fontsize=8)
        times = [rows[name]["kernel_us"] for name in some]
        right.barh(places, times, height, label=robot, **style)
    left.set(xlabel="feasible poses solved [%]", xlim=(0.0, 112.0))
    right.set(xlabel="one pose in a batch, on one core [us]")
    left.set_yticks(range(len(methods)), [method_words(name) for name in methods])
    right.set_yticks(range(len(methods)), [])
    for axes in (left, right):
        axes.invert_yaxis()
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09))
    return figure


def _title(experiment: str) -> str:
    return f"experiment '{experiment}'\n{EXPERIMENTS[experiment].rstrip(chr(46))}"


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
