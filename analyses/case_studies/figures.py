"""Figures of case studies, as the servoing thesis draws them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.case_studies.cable_figures import QUANTITIES, cable_panels
from cdpr_drake.analyses.case_studies.definition import CaseStudy, Configuration
from cdpr_drake.analyses.case_studies.run import CaseRun, CaseRuns
from cdpr_drake.analyses.pictures import (
    DEFAULT_FORMATS,
    bar_style,
    bare_figure,
    draw_curve,
    line_style,
    new_figure,
    path_rows,
    phase_of,
    save_figures,
    set_box,
    shade,
)
from cdpr_drake.analyses.reporting import judged
from cdpr_drake.analyses.runs import draw_steps
from cdpr_drake.arrays import Array
from cdpr_drake.models import load_robot
from cdpr_drake.palette import BOUND, DESIRED, IDEAL, LOST, Look, nth_look

Shown = list[tuple[Configuration, CaseRun, Look]]
"""What a figure shows: configurations, the first run of each, how it looks in all figures."""


def write_case_figures(
    folder: Path,
    case: CaseStudy,
    runs: Sequence[CaseRun],
    formats: Sequence[str] = DEFAULT_FORMATS,
) -> list[Path]:
    """Draws the figures of every experiment of a case study; returns their files."""
    files = []
    for group, configurations in case.groups().items():
        names = {c.name for c in configurations}
        mine = [run for run in runs if run.job.configuration in names]
        about = f"{case.title} ({case.name})"
        title = f"{about}\n{group}" if group else about
        suffix = f"_{group.lower().replace(' ', '_')}" if group else ""
        for name, figure in _group_figures(title, configurations, mine):
            files += save_figures({f"{name}{suffix}": figure}, folder, formats)
    for drawn in judged(case.drawings, CaseRuns(runs)):
        files += save_figures(dict(drawn), folder, formats)
    return files


def _group_figures(
    title: str, configurations: Sequence[Configuration], runs: Sequence[CaseRun]
) -> Iterator[tuple[str, Figure]]:
    """Figures of one experiment, by name; projected runs come before rendered ones."""
    shown: Shown = []
    for number, configuration in enumerate(configurations):
        mine = [run for run in runs if run.job.configuration == configuration.name]
        mine.sort(key=lambda run: run.job.rendered)
        if mine:
            shown.append((configuration, mine[0], nth_look(number)))
    if not shown:
        return
    yield "image_paths", image_figure(title, shown)
    yield "camera_paths", camera_figure(title, shown)
    yield "pose_estimates", estimate_figure(title, shown)
    yield (
        "errors",
        small_multiples(title, shown, "error", "feature error [units in the legend]", 1.0),
    )
    yield (
        "cable_velocities",
        small_multiples(title, shown, "cable_velocities", "cable velocity [mm/s]", 1e3),
    )
    for name in QUANTITIES:
        panels = cable_panels(title, shown, name)
        if panels is not None:
            yield name, panels
    if all("jacobian_rank" in run.traces for _, run, _ in shown):
        yield "stability", stability_multiples(title, shown)
    for name, bars in (("deviations", _DEVIATIONS), ("estimates", _ESTIMATES)):
        figure = bar_figure(title, configurations, runs, bars)
        if figure is not None:
            yield name, figure


def image_figure(title: str, shown: Shown) -> Figure:
    """Paths of the object's centre in the image, and their distance from the straight line."""
    figure, (image, deviation) = new_figure(
        1, 2, (14.0, 6.5), f"Path of the object's centre in the image\n{title}"
    )
    for number, (configuration, run, look) in enumerate(shown):
        traces, phase = run.traces, phase_of(number, len(shown))
        path = traces["image_path"]
        _draw_path(image, path, look, configuration.label)
        draw_curve(deviation, traces["image_time"], traces["image_deviation"], look, phase=phase)
        line = line_style(IDEAL) | {"linewidth": 1.0, "zorder": 0}
        image.plot(*traces["image_line"].T, **line, label=_once(number, "straight line"))
        image.plot(
            *traces["image_line"][1], DESIRED.marker, color=DESIRED.color, markersize=12, zorder=5,
            label=_once(number, "desired"),
        )  # fmt: skip
    width, height = shown[0][1].traces["image_size"]
    image.set(
        xlim=(0.0, width),
        ylim=(height, 0.0),
        xlabel="u [px of an image 1600 px wide]",
        ylabel="v [px]",
        aspect="equal",
    )
    deviation.set(xlabel="time [s]", ylabel="distance from the straight line [px]", ylim=(0, None))
    _legend_below(figure, *_sorted_legend(image))
    return figure


def camera_figure(title: str, shown: Shown) -> Figure:
    """Paths of the camera in space, and their distance from the straight line."""
    figure = bare_figure((14.0, 7.0), f"Path of the camera, Co, in the world frame W\n{title}")
    space: Any = figure.add_subplot(1, 2, 1, projection="3d")
    deviation = figure.add_subplot(1, 2, 2)
    for number, (configuration, run, look) in enumerate(shown):
        traces = run.traces
        _draw_path(space, traces["camera_path"], look, configuration.label)
        draw_curve(
            deviation, traces["time"], traces["camera_deviation"], look,
            scale=1e3, phase=phase_of(number, len(shown)),
        )  # fmt: skip
        line = line_style(IDEAL) | {"linewidth": 1.0}
        space.plot(*traces["camera_line"].T, **line, label=_once(number, "straight line"))
    points = np.vstack([run.traces["camera_path"] for _, run, _ in shown])
    low, high = points.min(axis=0), points.max(axis=0)
    # No edge shorter than half of the longest, so that the numbers on it can be read.
    edges = np.maximum(high - low, 0.5 * max(float(np.max(high - low)), 1e-3))
    middle = (low + high) / 2.0
    set_box(space, middle - edges / 2.0, middle + edges / 2.0)
    space.set_box_aspect(edges, zoom=0.85)
    deviation.set(xlabel="time [s]", ylabel="distance from the straight line [mm]", ylim=(0, None))
    _legend_below(figure, *_sorted_legend(space))
    return figure


def _legend_below(figure: Figure, handles: list[Any], labels: list[str]) -> None:
    """A legend under the panels, in as many columns as the figure has room for."""
    columns = 4
    legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    while columns > 1 and legend.get_window_extent().width > figure.bbox.width:
        legend.remove()
        columns -= 1
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def _sorted_legend(axes: Any) -> tuple[list[Any], list[str]]:
    """Handles and labels: the configurations first, then what belongs to all of them."""
    common = ("straight line", "desired")
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda k: labels[k] in common)
    return [handles[k] for k in order], [labels[k] for k in order]


def _once(number: int, label: str) -> str | None:
    """A label for the first of many, so that it is in the legend once."""
    return label if number == 0 else None


def _draw_path(axes: Any, points: Array, look: Look, label: str) -> None:
    """A path in the image or in space, with its symbol where it starts."""
    shown = points[path_rows(points)]
    axes.plot(
        *shown.T, **line_style(look), label=label,
        marker=look.marker, markevery=[0], markerfacecolor="white", markersize=6.0,
    )  # fmt: skip


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
    _legend_below(figure, *distance.get_legend_handles_labels())
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


def feature_words(name: str) -> str:
    """Name of a feature with its unit, as `rx [rad]`; those of the image have none."""
    words, _, unit = name.partition("_")
    return f"{words} [{unit}]" if unit in ("rad", "m") else f"{name} [-]"


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
