"""Figures of case studies, as the servoing thesis draws them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.simulation.stability_files import draw_steps
from cdpr_drake.analyses.studies.framework.cable_figures import QUANTITIES, cable_panels
from cdpr_drake.analyses.studies.framework.case_definition import (
    CaseStudy,
    Configuration,
    group_suffix,
)
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
from cdpr_drake.analyses.studies.framework.case_run import CaseRun, CaseRuns
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of, shade
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    bare_figure,
    line_style,
    new_figure,
)
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, LOST, Look, nth_look


def case_drawings(case: CaseStudy, runs: Sequence[CaseRun]) -> dict[str, Callable[[], Figure]]:
    """What draws the figures of every experiment of a case study, and those in the published
    layout, by name; raises NothingToDraw where runs for it are missing."""
    drawings: dict[str, Callable[[], Figure]] = {}
    for group, configurations in case.groups().items():
        names = {c.name for c in configurations}
        mine = [run for run in runs if run.job.configuration in names]
        about = f"{case.title} ({case.name})"
        title = f"{about}\n{group}" if group else about
        for name, draw in _group_drawings(title, configurations, mine):
            drawings[f"{name}{group_suffix(group)}"] = partial(_drawn, draw)
    found = CaseRuns(runs)
    published: dict[str, Callable[[CaseRuns], Figure]] = {
        name: partial(layout.figure, partial(shown_of, case, found))
        for name, layout in case.layouts.items()
    }
    for name, draw_found in (published | dict(case.drawings)).items():
        drawings[name] = partial(_drawn_of_runs, draw_found, found)
    return drawings


def _drawn(draw: Callable[[], Figure | None]) -> Figure:
    """A figure; NothingToDraw where there is none."""
    figure = draw()
    if figure is None:
        raise NothingToDraw
    return figure


def _drawn_of_runs(draw: Callable[[CaseRuns], Figure], runs: CaseRuns) -> Figure:
    """A figure of runs; NothingToDraw where some that it needs are missing (KeyError)."""
    try:
        return draw(runs)
    except KeyError as problem:
        raise NothingToDraw from problem


def shown_of(case: CaseStudy, runs: CaseRuns, names: Sequence[str]) -> Shown:
    """Those of some configurations that were run, with their first projected run and the look
    that they have in their experiment's figures."""
    looks = {
        c.name: (c, nth_look(number))
        for group in case.groups().values()
        for number, c in enumerate(group)
    }
    return [(looks[n][0], runs.of(n)[0], looks[n][1]) for n in names if runs.has(n)]


def _group_drawings(
    title: str, configurations: Sequence[Configuration], runs: Sequence[CaseRun]
) -> Iterator[tuple[str, Callable[[], Figure | None]]]:
    """What draws the figures of one experiment, by name; None where there is nothing to show.

    Projected runs come before rendered ones.
    """
    shown: list[tuple[Configuration, CaseRun, Look]] = []
    for number, configuration in enumerate(configurations):
        mine = [run for run in runs if run.job.configuration == configuration.name]
        mine.sort(key=lambda run: run.job.rendered)
        if mine:
            shown.append((configuration, mine[0], nth_look(number)))
    if not shown:
        return
    found = CaseRuns(runs)
    yield "image_paths", partial(image_figure, title, shown, found)
    yield "camera_paths", partial(camera_figure, title, shown, found)
    yield "pose_estimates", partial(estimate_figure, title, shown)
    for name, quantity, label, factor in (
        ("errors", "error", "feature error [units in the legend]", 1.0),
        ("cable_velocities", "cable_velocities", "cable velocity [mm/s]", 1e3),
    ):
        yield name, partial(small_multiples, title, shown, quantity, label, factor)
    for name in QUANTITIES:
        yield name, partial(cable_panels, title, shown, name)
    if all("jacobian_rank" in run.traces for _, run, _ in shown):
        yield "stability", partial(stability_multiples, title, shown)
    for name, bars in (("deviations", _DEVIATIONS), ("estimates", _ESTIMATES)):
        yield name, partial(bar_figure, title, configurations, runs, bars)


def image_figure(title: str, shown: Shown, runs: CaseRuns) -> Figure:
    """Paths of the object's centre in the image, and their distance from the straight line."""
    figure, (image, deviation) = new_figure(
        1, 2, (14.0, 6.5), f"Path of the object's centre in the image\n{title}"
    )
    scene = Scene(shown, runs)
    draw_image_paths(image, scene)
    draw_image_deviation(deviation, scene)
    legend_below(figure, *sorted_legend([image]))
    return figure


def camera_figure(title: str, shown: Shown, runs: CaseRuns) -> Figure:
    """Paths of the camera in space, and their distance from the straight line."""
    figure = bare_figure((14.0, 7.0), f"Path of the camera, Co, in the world frame W\n{title}")
    space: Any = figure.add_subplot(1, 2, 1, projection="3d")
    deviation = figure.add_subplot(1, 2, 2)
    scene = Scene(shown, runs)
    draw_camera_paths(space, scene)
    draw_camera_deviation(deviation, scene)
    legend_below(figure, *sorted_legend([space]))
    return figure


def estimate_figure(title: str, shown: Shown) -> Figure:
    """Errors of the platform's pose estimate over time."""
    figure, (distance, angle) = new_figure(
        1, 2, (14.0, 6.0), f"Estimated pose of the platform against the true one\n{title}"
    )
    for number, (configuration, run, look) in enumerate(shown):
        traces, phase = run.traces, phase_of(number, len(shown))
        for axes, name, scale, label in (
            (distance, "estimate_distance", 1e3, configuration.label),
            (angle, "estimate_angle", 180.0 / np.pi, None),
        ):
            draw_curve(axes, traces["time"], traces[name], look, label, scale=scale, phase=phase)
    distance.set(xlabel="time [s]", ylabel="distance [mm]", ylim=(0, None))
    angle.set(xlabel="time [s]", ylabel="angle [deg]", ylim=(0, None))
    legend_below(figure, *distance.get_legend_handles_labels())
    return figure


def small_multiples(title: str, shown: Shown, quantity: str, label: str, factor: float) -> Figure:
    """One small picture a configuration, one curve a component."""
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    size = (max(4.2 * columns + 1.5, 8.0), 3.0 * rows + 1.4)
    words = f"{label[0].upper()}{label[1:].partition(' [')[0]}"
    figure = bare_figure(size, f"{words}\n{title}")
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    legend: dict[str, Any] = {}
    for axes, (configuration, run, _) in zip(grid.flat, shown, strict=False):
        traces = run.traces
        values = traces[quantity]
        count = values.shape[1]
        if quantity == "error":
            names = [feature_words(name) for name in run.features]
        else:
            names = [cable.name for cable in load_robot(run.summary["robot"]).cables]
        for k, name in enumerate(names):
            draw_curve(
                axes, traces["time"], values[:, k], nth_look(k), name,
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


def stability_multiples(title: str, shown: Shown) -> Figure:
    """Cables that pull over time, one small picture a configuration; thick, red and hatched where
    their Jacobian has lost rank (servoing thesis, figure 5.18)."""
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    size = (max(4.2 * columns, 8.0), 2.4 * rows + 1.4)
    figure = bare_figure(size, f"Cables that pull; red: the platform is underactuated\n{title}")
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axes, (configuration, run, _) in zip(grid.flat, shown, strict=False):
        traces, planar = (
            run.traces,
            load_robot(run.summary["robot"]).motion_type().is_horizontal_body,
        )
        times, freedom = traces["stability_time"], 3 if planar else 6
        lost = traces["jacobian_rank"] < freedom
        shade(axes, times, lost, None, LOST)
        draw_steps(axes, times, traces["taut_cables"], lost)
        axes.axhline(freedom, **line_style(BOUND))
        axes.set_title(configuration.label, fontsize=10)
        axes.set(xlim=(times[0], times[-1]), ylim=(-0.2, None))
        axes.grid(alpha=0.3)
    for axes in grid.flat[len(shown) :]:
        axes.remove()
    for axes in grid.flat[max(len(shown) - columns, 0) : len(shown)]:
        axes.set_xlabel("time [s]")
    for axes in grid[:, 0]:
        axes.set_ylabel("cables that pull [-]")
    return figure


_DEVIATIONS = (
    ("image_max_px", "image, largest [px]", 1.0),
    ("image_mean_px", "image, mean [px]", 1.0),
    ("camera_max_m", "camera, largest [mm]", 1e3),
    ("camera_mean_m", "camera, mean [mm]", 1e3),
)
_ESTIMATES = (
    ("estimate_max_m", "pose estimate, largest error [mm]", 1e3),
    ("estimate_max_rad", "pose estimate, largest error [deg]", 180.0 / np.pi),
)


def bar_figure(
    title: str,
    configurations: Sequence[Configuration],
    runs: Sequence[CaseRun],
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
    return figure


def _values(configuration: Configuration, runs: Sequence[CaseRun], metric: str) -> list[float]:
    """A metric of the projected runs of a configuration, where it has one."""
    values = [
        run.metrics[metric]
        for run in runs
        if run.job.configuration == configuration.name and not run.job.rendered
    ]
    return [value for value in values if value is not None]
