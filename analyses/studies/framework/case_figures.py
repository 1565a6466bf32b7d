"""Figures of case studies, as the servoing thesis draws them."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.simulation.stability_files import draw_steps
from cdpr_drake.analyses.studies.framework.cable_figures import QUANTITIES, cable_panels
from cdpr_drake.analyses.studies.framework.case_definition import (
    EVERY_GROUP,
    Configuration,
    Plan,
    group_suffix,
)
from cdpr_drake.analyses.studies.framework.case_layouts import Layout
from cdpr_drake.analyses.studies.framework.case_panels import (
    Scene,
    Shown,
    draw_camera_deviation,
    draw_camera_paths,
    draw_image_deviation,
    draw_image_paths,
    feature_words,
    legend_below,
    sorted_legend,
)
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import FigureMaker
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of, shade
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    bare_figure,
    line_style,
    new_figure,
)
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, LOST, nth_look


def case_figures(plan: Plan) -> dict[str, FigureMaker]:
    """What draws the figures of every experiment of a study, and those in the published layout, by
    the name of the file; MissingRuns where runs for it are missing."""
    names = [*EVERY_GROUP, *((*QUANTITIES, "stability") if plan.stability is not None else ())]
    drawn: dict[str, FigureMaker] = {
        f"{name}{group_suffix(group)}": partial(group_figure, plan, group, name)
        for group in plan.groups()
        for name in names
    }
    return drawn | {
        name: partial(layout_figure, plan, layout) for name, layout in plan.layouts.items()
    }


def layout_figure(plan: Plan, layout: Layout, runs: Runs) -> Figure:
    """A figure in the published layout."""
    return layout.figure(partial(shown_of, plan, runs), runs)


def shown_of(plan: Plan, runs: Runs, names: Sequence[str]) -> Shown:
    """Those of some configurations that were run, with their first run and the look that they have
    in their experiment's figures; looks by their order where two of them, of two experiments, have
    the same."""
    looks = {
        c.name: (c, nth_look(number))
        for group in plan.groups().values()
        for number, c in enumerate(group)
    }
    there = [name for name in names if runs.has(configuration=name)]
    own = [looks[name][1] for name in there]
    if len(set(own)) < len(own):
        own = [nth_look(number) for number in range(len(there))]
    return [
        (looks[name][0], runs(configuration=name).rows[0], look)
        for name, look in zip(there, own, strict=True)
    ]


def group_figure(plan: Plan, group: str, name: str, runs: Runs) -> Figure:
    """A figure of one experiment.

    Args:
        plan: Of the study.
        group: The experiment.
        name: Of `EVERY_GROUP` or `QUANTITIES`, or "stability".
        runs: With projected images.

    Raises:
        MissingRuns: None of the experiment was run, or runs have not that quantity.
        NothingToDraw: Bars of what no run measures.
    """
    configurations = plan.groups()[group]
    shown = shown_of(plan, runs, [c.name for c in configurations])
    if not shown:
        raise MissingRuns(f"figure {name}")
    about = f"{plan.title} ({plan.name})"
    title = f"{about}\n{group}" if group else about
    lap = plan.laps_s.get(group)
    if lap is not None and name in ("image_paths", "camera_paths", *MULTIPLES):
        title += f", the first {DRAWN_LAPS * lap:g} s"
        shown = [(c, begin_of(run, DRAWN_LAPS * lap), look) for c, run, look in shown]
    if name in ("image_paths", "camera_paths"):
        draw = image_figure if name == "image_paths" else camera_figure
        return draw(title, shown, runs)
    if name == "pose_estimates":
        return estimate_figure(title, shown, lap)
    if name in MULTIPLES:
        return small_multiples(title, shown, *MULTIPLES[name])
    if name == "stability":
        if not all("jacobian_rank" in run.columns() for _, run, _ in shown):
            raise MissingRuns("jacobian_rank")
        return stability_multiples(title, shown)
    if name in BARS:
        bars = bar_figure(title, configurations, runs, BARS[name])
        if bars is None:  # every experiment of all studies is tried with all bars
            raise NothingToDraw
        return bars
    panels = cable_panels(title, shown, name)
    if panels is None:
        raise MissingRuns(f"figure {name}")
    return panels


DRAWN_LAPS = 2
"""So many laps are drawn of runs behind an object that runs in laps."""


def begin_of(run: Run, seconds: float) -> Run:
    """The first seconds of a run, of the traces that figures of paths and `MULTIPLES` draw."""
    cut: dict[str, Any] = {}
    for clock, names in (
        ("time", ("camera_path", "camera_deviation", "error", "cable_velocities")),
        ("image_time", ("image_path", "image_deviation")),
    ):
        rows = run[clock] <= seconds
        cut |= {name: run[name][rows] for name in (clock, *names)}
    return replace(run, measured=ChainMap(cut, run.measured))  # type: ignore[arg-type]


MULTIPLES = {
    "errors": ("error", "feature error [units in the legend]", 1.0),
    "cable_velocities": ("cable_velocities", "cable velocity [mm/s]", 1e3),
}
"""Figures with a small picture a configuration: column, label, factor."""


NOT_MEASURED = "not measured in this run"
"""In a panel whose quantity a run has not, such as features without a camera."""

FLAT = 0.2
"""Panels have scales of their own where curves of one would fill less of a common one."""


def image_figure(title: str, shown: Shown, runs: Runs) -> Figure:
    """Paths of the object's centre in the image, and their distance from the straight line."""
    figure, (image, deviation) = new_figure(
        1, 2, (14.0, 6.5), f"Path of the object's centre in the image\n{title}"
    )
    scene = Scene(shown, runs)
    draw_image_paths(image, scene)
    draw_image_deviation(deviation, scene)
    legend_below(figure, *sorted_legend([image]))
    return figure


def camera_figure(title: str, shown: Shown, runs: Runs) -> Figure:
    """Paths of the camera in space, and their distance from the straight line."""
    figure = bare_figure((14.0, 7.0), f"Path of the camera, Co, in the world frame W\n{title}")
    space: Any = figure.add_subplot(1, 2, 1, projection="3d")
    deviation = figure.add_subplot(1, 2, 2)
    scene = Scene(shown, runs)
    draw_camera_paths(space, scene)
    draw_camera_deviation(deviation, scene)
    legend_below(figure, *sorted_legend([space]))
    return figure


def estimate_figure(title: str, shown: Shown, lap: float | None = None) -> Figure:
    """Errors of the platform's pose estimate over time; with the time of a lap [s] the largest of
    each."""
    words = "Estimated pose of the platform against the true one"
    if lap is not None:
        words += f", largest error in each lap of {lap:g} s"
    figure, (distance, angle) = new_figure(1, 2, (14.0, 6.0), f"{words}\n{title}")
    for number, (configuration, run, look) in enumerate(shown):
        phase = phase_of(number, len(shown))
        for axes, name, scale, label in (
            (distance, "estimate_distance", 1e3, configuration.label),
            (angle, "estimate_angle", 180.0 / np.pi, None),
        ):
            times, values = run["time"], run[name]
            if lap is not None:
                times, values = largest_of_each(times, values, lap)
            draw_curve(axes, times, values, look, label, scale=scale, phase=phase)
    distance.set(xlabel="time [s]", ylabel="distance [mm]", ylim=(0, None))
    angle.set(xlabel="time [s]", ylabel="angle [deg]", ylim=(0, None))
    legend_below(figure, *distance.get_legend_handles_labels())
    return figure


def largest_of_each(times: Array, values: Array, lap: float) -> tuple[Array, Array]:
    """Middle of each lap [s] and the largest value in it, shape (k,); times, values: (n,)."""
    laps = np.floor((times - times[0]) / lap + LAP_ROUNDING).astype(int)
    starts = np.flatnonzero(np.diff(laps, prepend=-1))
    ends = np.append(starts[1:], len(times)) - 1
    return (times[starts] + times[ends]) / 2.0, np.maximum.reduceat(values, starts)


LAP_ROUNDING = 1e-6
"""Share of a lap that sums of time steps may be short of it."""


def small_multiples(title: str, shown: Shown, quantity: str, label: str, factor: float) -> Figure:
    """One small picture a configuration, one curve a component."""
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    size = (max(4.2 * columns + 1.5, 8.0), 3.0 * rows + 1.4)
    words = f"{label[0].upper()}{label[1:].partition(' [')[0]}"
    figure = bare_figure(size, f"{words}\n{title}")
    same = _on_one_scale([run[quantity] for _, run, _ in shown])
    grid = figure.subplots(rows, columns, squeeze=False, sharey=same)
    legend: dict[str, Any] = {}
    for axes, (configuration, run, _) in zip(grid.flat, shown, strict=False):
        values = run[quantity]
        count = values.shape[1]
        if not np.any(np.isfinite(values)):
            axes.text(0.5, 0.5, NOT_MEASURED, transform=axes.transAxes, ha="center", va="center")
            axes.set_xticks([])
        if quantity == "error":
            names = [feature_words(name) for name in run["features"]]
        else:
            names = [cable.name for cable in load_robot(run["summary"]["robot"]).cables]
        for k, name in enumerate(names):
            draw_curve(
                axes, run["time"], values[:, k], nth_look(k), name,
                scale=factor, phase=phase_of(k, count), linewidth=1.0, markersize=4.0,
            )  # fmt: skip
        handles, labels = axes.get_legend_handles_labels()
        legend |= dict(zip(labels, handles, strict=True))
        axes.set_title(configuration.label, fontsize=10)
        axes.grid(alpha=0.3)
    for axes in grid.flat[len(shown) :]:
        axes.remove()
    for axes in grid.flat[max(len(shown) - columns, 0) : len(shown)]:
        axes.set_xlabel("time [s]")
        axes.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel(label)
    figure.legend(legend.values(), legend.keys(), loc="outside right center")
    return figure


def _on_one_scale(curves: Sequence[Array]) -> bool:
    """Whether curves of all configurations can be read on one scale."""
    found = [float(np.ptp(c[np.isfinite(c)])) for c in curves if np.any(np.isfinite(c))]
    return not found or min(found) >= FLAT * max(found)


def stability_multiples(title: str, shown: Shown) -> Figure:
    """Cables that pull over time, one small picture a configuration; thick, red and hatched where
    their Jacobian has lost rank (servoing thesis, figure 5.18)."""
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    size = (max(4.2 * columns, 8.0), 2.4 * rows + 1.4)
    figure = bare_figure(size, f"Cables that pull; hatched: too few to hold the platform\n{title}")
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    most = 0
    for axes, (configuration, run, _) in zip(grid.flat, shown, strict=False):
        robot = load_robot(run["summary"]["robot"])
        times, freedom = run["stability_time"], 3 if robot.motion_type().is_horizontal_body else 6
        most = max(most, len(robot.cables))
        lost = run["jacobian_rank"] < freedom
        shade(axes, times, lost, None, LOST)
        draw_steps(axes, times, run["taut_cables"], lost)
        axes.axhline(freedom, **line_style(BOUND))
        axes.set_title(configuration.label, fontsize=10)
        axes.set(xlim=(times[0], times[-1]), ylim=(-0.2, most + 0.4))
        axes.grid(alpha=0.3)
    for axes in grid.flat[len(shown) :]:
        axes.remove()
    for axes in grid.flat[max(len(shown) - columns, 0) : len(shown)]:
        axes.set_xlabel("time [s]")
    for axes in grid[:, 0]:
        axes.set_ylabel("cables that pull [-]")
    return figure


BARS = {
    "deviations": (
        ("image_max_px", "image, largest [px]", 1.0),
        ("image_mean_px", "image, mean [px]", 1.0),
        ("camera_max_m", "camera, largest [mm]", 1e3),
        ("camera_mean_m", "camera, mean [mm]", 1e3),
    ),
    "estimates": (
        ("estimate_max_m", "pose estimate, largest error [mm]", 1e3),
        ("estimate_max_rad", "pose estimate, largest error [deg]", 180.0 / np.pi),
    ),
}
"""Figures with bars: metrics, labels, factors."""

LEAST_BARS = 4
"""There is room for so many bars, so that one alone does not fill its axes."""


def bar_figure(
    title: str,
    configurations: Sequence[Configuration],
    runs: Runs,
    bars: Sequence[tuple[str, str, float]],
) -> Figure | None:
    """Means over the repetitions, with their range as whiskers; None where nothing was measured."""
    found = [bar for bar in bars if any(_values(c, runs, bar[0]) for c in configurations)]
    if not found:
        return None
    columns = min(2, len(found))
    rows = -(-len(found) // columns)
    figure = bare_figure(
        (14.0, 1.3 + 3.8 * rows), f"Mean and range over the runs with projected images\n{title}"
    )
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat[len(found) :]:
        axes.remove()
    for axes, (metric, label, factor) in zip(grid.flat, found, strict=False):
        names: list[str] = []
        for number, configuration in enumerate(configurations):
            values = factor * np.array(_values(configuration, runs, metric))
            if len(values) == 0:
                continue
            mean = float(values.mean())
            whiskers = np.maximum([[mean - values.min()], [values.max() - mean]], 0.0)
            axes.bar(len(names), mean, yerr=whiskers, capsize=4, **bar_style(nth_look(number)))
            names.append(configuration.label)
        axes.set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=9)
        axes.set_ylabel(label)
        axes.grid(visible=False, axis="x")
        room = max(len(names), LEAST_BARS) / 2.0  # on both sides of the middle
        middle = (len(names) - 1) / 2.0
        axes.set_xlim(middle - room - 0.1, middle + room + 0.1)
    return figure


def _values(configuration: Configuration, runs: Runs, metric: str) -> list[float]:
    """A metric of the runs of a configuration, where they have one."""
    if not runs.has(configuration=configuration.name):
        return []
    values = runs(configuration=configuration.name).list(metric)
    return [value for value in values if value is not None]
