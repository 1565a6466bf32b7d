"""Figures of case studies, as the servoing thesis draws them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.pictures import bare_figure, new_figure, save_figure
from cdpr_drake.analyses.studies.cases.definition import CaseStudy, Configuration
from cdpr_drake.analyses.studies.cases.run import CaseRun

Shown = list[tuple[Configuration, CaseRun, str]]
"""What a figure shows: configurations, the first run of each, its colour."""


def write_case_figures(folder: Path, case: CaseStudy, runs: Sequence[CaseRun]) -> list[Path]:
    """Draws the figures of every experiment of a case study; returns their files."""
    files = []
    for group, configurations in case.groups().items():
        names = {c.name for c in configurations}
        mine = [run for run in runs if run.job.configuration in names]
        title = f"{case.name}, {group}" if group else case.name
        suffix = f"_{group.lower().replace(' ', '_')}" if group else ""
        for name, figure in _group_figures(title, configurations, mine):
            files.append(save_figure(figure, folder / f"{name}{suffix}.png"))
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
            shown.append((configuration, mine[0], f"C{number % 10}"))
    if not shown:
        return
    yield "image_paths", image_figure(title, shown)
    yield "camera_paths", camera_figure(title, shown)
    yield "pose_estimates", estimate_figure(title, shown)
    yield (
        "errors",
        small_multiples(
            title, shown, "error", "feature error [rad, m, image at unit focal length]", 1.0
        ),
    )
    yield (
        "cable_velocities",
        small_multiples(title, shown, "cable_velocities", "cable velocity [mm/s]", 1e3),
    )
    yield "deviations", bar_figure(title, configurations, runs, _DEVIATIONS)
    yield "estimates", bar_figure(title, configurations, runs, _ESTIMATES)


def image_figure(title: str, shown: Shown) -> Figure:
    """Paths of the object's centre in the image, and their distance from the straight line."""
    figure, (image, deviation) = new_figure(1, 2, (14.0, 6.0), f"{title}: path in the image")
    for configuration, run, color in shown:
        traces = run.traces
        image.plot(*traces["image_path"].T, color=color, label=configuration.label)
        deviation.plot(traces["image_time"], traces["image_deviation"], color=color)
        image.plot(*traces["image_line"].T, "--", color="0.6", linewidth=1.0, zorder=0)
        image.plot(*traces["image_line"][1], "*", color="C3", markersize=12, zorder=5)
    width, height = shown[0][1].traces["image_size"]
    image.set(
        xlim=(0.0, width),
        ylim=(height, 0.0),
        xlabel="u [px of an image 1600 px wide]",
        ylabel="v [px]",
        aspect="equal",
    )
    deviation.set(xlabel="time [s]", ylabel="distance from the straight line [px]", ylim=(0, None))
    figure.legend(*image.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def camera_figure(title: str, shown: Shown) -> Figure:
    """Paths of the camera in space, and their distance from the straight line."""
    figure = bare_figure((14.0, 6.5), f"{title}: path of the camera")
    space: Any = figure.add_subplot(1, 2, 1, projection="3d")
    deviation = figure.add_subplot(1, 2, 2)
    for configuration, run, color in shown:
        traces = run.traces
        space.plot(*traces["camera_path"].T, color=color, label=configuration.label)
        deviation.plot(traces["time"], 1e3 * traces["camera_deviation"], color=color)
        space.plot(*traces["camera_line"].T, "--", color="0.6", linewidth=1.0)
    space.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    points = np.vstack([run.traces["camera_path"] for _, run, _ in shown])
    low, high = points.min(axis=0), points.max(axis=0)
    # No edge shorter than half of the longest, so that the numbers on it can be read.
    edges = np.maximum(high - low, 0.5 * max(float(np.max(high - low)), 1e-3))
    middle = (low + high) / 2.0
    space.set(
        xlim=(middle[0] - edges[0] / 2.0, middle[0] + edges[0] / 2.0),
        ylim=(middle[1] - edges[1] / 2.0, middle[1] + edges[1] / 2.0),
        zlim=(middle[2] - edges[2] / 2.0, middle[2] + edges[2] / 2.0),
    )
    space.set_box_aspect(edges, zoom=0.85)
    for axis in (space.xaxis, space.yaxis, space.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    deviation.set(xlabel="time [s]", ylabel="distance from the straight line [mm]", ylim=(0, None))
    figure.legend(*space.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def estimate_figure(title: str, shown: Shown) -> Figure:
    """Errors of the platform's pose estimate over time."""
    figure, (distance, angle) = new_figure(
        1, 2, (14.0, 5.5), f"{title}: pose estimate against the true pose"
    )
    for configuration, run, color in shown:
        traces = run.traces
        distance.plot(
            traces["time"],
            1e3 * traces["estimate_distance"],
            color=color,
            label=configuration.label,
        )
        angle.plot(traces["time"], np.degrees(traces["estimate_angle"]), color=color)
    distance.set(xlabel="time [s]", ylabel="distance [mm]", ylim=(0, None))
    angle.set(xlabel="time [s]", ylabel="angle [deg]", ylim=(0, None))
    figure.legend(*distance.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


_ERROR = "feature error [rad, m, image at unit focal length]"


def small_multiples(title: str, shown: Shown, quantity: str, label: str, factor: float) -> Figure:
    """One small picture a configuration, one curve a component."""
    columns = min(len(shown), 4)
    rows = -(-len(shown) // columns)
    size = (4.2 * columns + 1.0, 3.0 * rows + 1.0)
    figure = bare_figure(size, f"{title}: {label}")
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axes, (configuration, run, _) in zip(grid.flat, shown, strict=False):
        traces = run.traces
        values = factor * traces[quantity]
        names = run.features if quantity == "error" else _cable_names(values.shape[1])
        for k, name in enumerate(names):
            axes.plot(traces["time"], values[:, k], linewidth=1.0, color=f"C{k}", label=name)
        axes.set_title(configuration.label, fontsize=10)
        axes.grid(alpha=0.3)
    for axes in grid.flat[len(shown) :]:
        axes.set_axis_off()
    for axes in grid.flat[max(len(shown) - columns, 0) : len(shown)]:
        axes.set_xlabel("time [s]")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside right center")
    return figure


def _cable_names(count: int) -> tuple[str, ...]:
    return tuple(f"cable {k + 1}" for k in range(count))


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
) -> Figure:
    """Means over the repetitions, with their range as whiskers."""
    columns = 2
    rows = len(bars) // columns
    figure = bare_figure((14.0, 1.0 + 3.6 * rows), f"{title}: mean and range over the runs")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, (metric, label, factor) in zip(grid.flat, bars, strict=True):
        names, means, whiskers = [], [], []
        for configuration in configurations:
            values = np.array(
                [
                    run.metrics[metric]
                    for run in runs
                    if run.job.configuration == configuration.name
                    and not run.job.rendered
                    and run.metrics[metric] is not None
                ],
                float,
            )
            if len(values) == 0:
                continue
            names.append(configuration.label)
            means.append(factor * values.mean())
            whiskers.append(
                factor * np.array([values.mean() - values.min(), values.max() - values.mean()])
            )
        if not names:
            axes.set_axis_off()
            continue
        axes.bar(
            range(len(names)),
            means,
            yerr=np.maximum(np.array(whiskers).T, 0.0),
            capsize=4,
            color=[f"C{k % 10}" for k in range(len(names))],
        )
        axes.set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=9)
        axes.set_ylabel(label)
        axes.grid(axis="y", alpha=0.3)
    return figure
