"""What one panel of a figure of a case study shows: paths, errors, deviations, bars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.visualization.curves import draw_curve, path_rows, phase_of
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style
from cdpr_drake.analyses.visualization.path_figures import set_box
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, DESIRED, IDEAL, PLATFORM, SOLID, Look, nth_look

COMMON = ("straight line", "desired", "measured path")
"""Labels of what belongs to all configurations; they come last in a legend."""

POINTS = 4
"""Points of an object whose paths are drawn."""


class Labelled(Protocol):
    """What has a name and words for a legend, as a configuration."""

    @property
    def name(self) -> str:
        """Key in the results."""

    @property
    def label(self) -> str:
        """Words for legends."""


Shown = Sequence[tuple[Labelled, Run, Look]]
"""What a panel shows: configurations, the first run of each, how it looks in all figures."""


@dataclass(frozen=True)
class Scene:
    """What a panel draws from.

    Attributes:
        shown: Its configurations with their first runs.
        runs: All runs of the study.
    """

    shown: Shown
    runs: Runs


Draw = Callable[[Any, Scene], None]
"""Fills axes."""


def draw_image_paths(axes: Any, scene: Scene) -> None:
    """Paths of the object's centre in the image, beside the straight lines."""
    for number, (one, run, look) in enumerate(scene.shown):
        draw_path(axes, run["image_path"], look, one.label)
        _image_line(axes, run, number == 0)
    _image_frame(axes, scene.shown[0][1])


def draw_corner_paths(axes: Any, scene: Scene) -> None:
    """Paths of the object's four points in the image: where they start, end and should end.

    Raises:
        MissingRuns: The object has not four points.
    """
    _, run, _ = scene.shown[0]
    if "corner_paths" not in run.columns():
        raise MissingRuns("an object with four points")
    paths, goals = run["corner_paths"], run["corner_goals"]
    for k in range(POINTS):
        look = nth_look(k)
        draw_path(axes, paths[:, k], look, f"point {k + 1}")
        axes.plot(*paths[-1, k], "x", color=look.color, markersize=7, label=_once(k, "end"))
        axes.plot(*goals[k], DESIRED.marker, color=DESIRED.color, markersize=10,
                  markerfacecolor="none", label=_once(k, "desired"))  # fmt: skip
    _image_frame(axes, run)


def corners_at(time: float) -> Draw:
    """What draws the outline of a square object in the image at a time [s]."""

    def draw(axes: Any, scene: Scene) -> None:
        _, run, _ = scene.shown[0]
        row = int(np.argmin(np.abs(run["image_time"] - time)))
        corners = run["corner_paths"][row]
        axes.plot(*corners[[*range(POINTS), 0]].T, color=PLATFORM.color, linestyle=SOLID,
                  label="tag")  # fmt: skip
        axes.plot(*corners[0], "o", color=PLATFORM.color, label="its first corner")
        _image_frame(axes, run)
        axes.axhline(np.mean(axes.get_ylim()), **line_style(IDEAL), linewidth=0.7)
        axes.axvline(np.mean(axes.get_xlim()), **line_style(IDEAL), linewidth=0.7)

    return draw


def draw_image_deviation(axes: Any, scene: Scene) -> None:
    """Distances of the object's centre from its straight line in the image over time; where it
    moves, from the desired point."""
    for number, (one, run, look) in enumerate(scene.shown):
        draw_curve(
            axes, run["image_time"], _off(run, "image"), look, one.label,
            phase=phase_of(number, len(scene.shown)),
        )  # fmt: skip
    axes.set(xlabel="time [s]", ylabel=f"distance from {_goal(scene)} [px]", ylim=(0, None))


def draw_camera_paths(axes: Any, scene: Scene) -> None:
    """Paths of the camera in space, 3D axes, beside the straight lines."""
    points = []
    for number, (one, run, look) in enumerate(scene.shown):
        draw_path(axes, run["camera_path"], look, one.label)
        line = line_style(IDEAL) | {"linewidth": 1.0}
        if _has_line(run):
            axes.plot(*run["camera_line"].T, **line, label=_once(number, "straight line"))
        axes.plot(
            *run["camera_line"][1:].T, DESIRED.marker, color=DESIRED.color, markersize=10,
            label=_once(number, "desired"),
        )  # fmt: skip
        points += [run["camera_path"], run["camera_line"]]
    fit_box(axes, np.vstack(points))


def draw_camera_deviation(axes: Any, scene: Scene) -> None:
    """Distances of the camera from its straight line in space over time; behind an object that
    moves, from the desired point."""
    for number, (one, run, look) in enumerate(scene.shown):
        draw_curve(
            axes, run["time"], _off(run, "camera"), look, one.label,
            scale=1e3, phase=phase_of(number, len(scene.shown)),
        )  # fmt: skip
    axes.set(xlabel="time [s]", ylabel=f"distance from {_goal(scene)} [mm]", ylim=(0, None))


def _has_line(run: Run) -> bool:
    """Whether a run has straight lines to follow: not behind an object that moves."""
    return run["image_max_px"] is not None


def _off(run: Run, of: str) -> Array:
    """How far "image" or "camera" is off its straight line over time, or off the desired point."""
    if _has_line(run):
        return np.asarray(run[f"{of}_deviation"])
    return np.asarray(np.linalg.norm(run[f"{of}_path"] - run[f"{of}_line"][1], axis=1))


def _goal(scene: Scene) -> str:
    """What `_off` is from, in words."""
    return f"the {'straight line' if _has_line(scene.shown[0][1]) else 'desired point'}"


def draw_platform_paths(axes: Any, scene: Scene) -> None:
    """Paths of the platform in space, 3D axes."""
    for one, run, look in scene.shown:
        draw_path(axes, run["platform_path"], look, one.label)
    fit_box(axes, np.vstack([run["platform_path"] for _, run, _ in scene.shown]))


def draw_platform_from_above(axes: Any, scene: Scene) -> None:
    """Paths of the platform as seen from above."""
    for one, run, look in scene.shown:
        draw_path(axes, run["platform_path"][:, :2], look, one.label)
    axes.set(xlabel="x in W [m]", ylabel="y in W [m]")
    axes.set_aspect("equal", adjustable="datalim")


def draw_estimated_paths(axes: Any, scene: Scene) -> None:
    """Estimated paths of the platform in space beside the true one of the first run, 3D axes."""
    true = scene.shown[0][1]["platform_path"]
    axes.plot(*true[path_rows(true)].T, color=PLATFORM.color, linestyle=SOLID, linewidth=4.0,
              alpha=0.35, label="measured path")  # fmt: skip
    for one, run, look in scene.shown:
        draw_path(axes, run["estimate_path"], look, one.label)
    points = [run["estimate_path"] for _, run, _ in scene.shown]
    fit_box(axes, np.vstack([true, *points]))


def draw_estimate_distance(axes: Any, scene: Scene) -> None:
    """How far the estimated place of the platform is off over time."""
    _over_time(axes, scene, "estimate_distance", 1e3)
    axes.set(xlabel="time [s]", ylabel="distance of the estimate [mm]", ylim=(0, None))


def draw_estimate_angle(axes: Any, scene: Scene) -> None:
    """By how much the estimated orientation of the platform is off over time."""
    _over_time(axes, scene, "estimate_angle", 180.0 / np.pi)
    axes.set(xlabel="time [s]", ylabel="angle of the estimate [deg]", ylim=(0, None))


def draw_positions(axes: Any, scene: Scene) -> None:
    """True and estimated place of the platform over time, by coordinate."""
    run = scene.shown[0][1]
    for k, axis in enumerate("xyz"):
        look = nth_look(k)
        true, estimated = run["platform_path"][:, k], run["estimate_path"][:, k]
        draw_curve(axes, run["time"], true, Look(look.color), f"{axis}, measured")
        draw_curve(axes, run["time"], estimated, Look("#303030", ":", look.marker),
                   f"{axis}, estimated", phase=phase_of(k, 3), linewidth=1.6)  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="position of the platform [m]")


def draw_errors(axes: Any, scene: Scene) -> None:
    """Components of the feature error over time, of one configuration."""
    _, run, _ = scene.shown[0]
    names = [feature_words(name) for name in run["features"]]
    _components(axes, run["time"], run["error"], names, 1.0)
    units = dict.fromkeys(name.rpartition("[")[2].rstrip("]") for name in names)
    axes.set_ylabel(f"feature error [{', '.join(units)}]")


def draw_velocities(axes: Any, scene: Scene) -> None:
    """Velocities of all cables over time, of one configuration."""
    _, run, _ = scene.shown[0]
    names = [cable.name for cable in load_robot(run["summary"]["robot"]).cables]
    _components(axes, run["time"], run["cable_velocities"], names, 1e3)
    axes.set_ylabel("cable velocity [mm/s]")


def draw_taut(axes: Any, scene: Scene) -> None:
    """Numbers of cables that pull over time."""
    for number, (one, run, look) in enumerate(scene.shown):
        times = run["stability_time"]
        draw_curve(axes, times, run["taut_cables"].astype(float), look, one.label,
                   phase=phase_of(number, len(scene.shown)), drawstyle="steps-post")  # fmt: skip
    axes.axhline(6.0, **line_style(BOUND), label="six hold the platform")
    axes.set(xlabel="time [s]", ylabel="cables that pull [-]", ylim=(None, 8.4))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def draw_stable(axes: Any, scene: Scene) -> None:
    """Whether the criterion of stability holds over time; curves a little apart."""
    for number, (one, run, look) in enumerate(scene.shown):
        margin = run["stability_margin"]
        holds = (np.nan_to_num(margin, nan=-1.0) > 0.0).astype(float)
        draw_curve(axes, run["stability_time"], holds - 0.06 * number, look, one.label,
                   phase=phase_of(number, len(scene.shown)), drawstyle="steps-post")  # fmt: skip
    axes.set_yticks([0.0, 1.0], ["does not hold", "holds"])
    axes.set(xlabel="time [s]", ylim=(-0.25, 1.25))


def draw_final_places(axes: Any, scene: Scene) -> None:
    """Where the camera of each run ends as seen from above, against where it should."""
    for one, _, look in scene.shown:
        for number, run in enumerate(scene.runs(configuration=one.name)):
            end, goal = map(pose_from_row, run["camera_ends"])
            away = 1e3 * (end.translation() - goal.translation())
            turn = end.rotation().matrix()[:2, 0]
            axes.quiver(*away[:2], *turn, angles="xy", color=look.color, width=0.006, scale=9.0)
            axes.plot(
                *away[:2], look.marker, color=look.color, markerfacecolor="white", markersize=8,
                label=_once(number, "end of a run, with its x axis"),
            )  # fmt: skip
    axes.plot(0.0, 0.0, DESIRED.marker, color=DESIRED.color, markersize=14, label="desired")
    axes.set(xlabel="x from the goal [mm]", ylabel="y from the goal [mm]")
    axes.margins(0.3)  # for the arrows, of which the limits know the feet only
    axes.set_aspect("equal", adjustable="datalim")


Value = Callable[[Run], float | None]
"""A number of a run, in the unit of the bars' axis; None where it has none."""


def metric(name: str, factor: float = 1.0) -> Value:
    """A metric of a run, see `METRICS`, times a factor."""

    def value(run: Run) -> float | None:
        found = run[name]
        return None if found is None else factor * found

    return value


def trace(name: str, of: Callable[[Array], Any], factor: float = 1.0) -> Value:
    """What is reckoned of a trace, times a factor."""
    return lambda run: factor * float(of(run[name]))


def last(values: Array) -> float:
    """The last one."""
    return float(values[-1])


def bars(label: str, values: dict[str, Value], letters: bool = False) -> Draw:
    """What draws bars: means over the runs, with their range as whiskers.

    Args:
        label: Of the axis.
        values: By their words, drawn side by side.
        letters: Whether configurations are lettered A, B, ...
    """

    def draw(axes: Any, scene: Scene) -> None:
        width = 0.8 / len(values)
        for k, (words, value) in enumerate(values.items()):
            for place, (one, _, _) in enumerate(scene.shown):
                found = [
                    n for run in scene.runs(configuration=one.name) if (n := value(run)) is not None
                ]
                if not found:
                    continue
                mean = float(np.mean(found))
                whiskers = np.maximum([[mean - min(found)], [max(found) - mean]], 0.0)
                axes.bar(
                    place + (k + 0.5) * width - 0.4, mean, width, yerr=whiskers, capsize=3,
                    label=_once(place, words), **bar_style(nth_look(4 * k)),
                )  # fmt: skip
        names = [
            f"{chr(ord('A') + k)}: {one.label}" if letters else one.label
            for k, (one, _, _) in enumerate(scene.shown)
        ]
        axes.set_xticks(range(len(names)), names, rotation=35, ha="right", fontsize=9)
        axes.set_ylabel(label)
        axes.grid(visible=False, axis="x")

    return draw


def draw_path(axes: Any, points: Array, look: Look, label: str) -> None:
    """A path in the image or in space, with its symbol where it starts."""
    shown = points[path_rows(points)]
    axes.plot(
        *shown.T, **line_style(look), label=label,
        marker=look.marker, markevery=[0], markerfacecolor="white", markersize=6.0,
    )  # fmt: skip


def fit_box(axes: Any, points: Array) -> None:
    """Makes 3D axes show points, shape (n, 3), in true proportions; no edge is shorter than half
    of the longest, so that the numbers on it can be read, and no point is on a face."""
    low, high = points.min(axis=0), points.max(axis=0)
    edges = 1.08 * np.maximum(high - low, 0.5 * max(float(np.max(high - low)), 1e-3))
    middle = (low + high) / 2.0
    set_box(axes, middle - edges / 2.0, middle + edges / 2.0)
    axes.set_box_aspect(edges, zoom=0.85)


def feature_words(name: str) -> str:
    """Name of a feature with its unit, as `rx [rad]`; those of the image have none."""
    words, _, unit = name.partition("_")
    return f"{words} [{unit}]" if unit in ("rad", "m") else f"{name} [-]"


def sorted_legend(panels: Sequence[Any]) -> tuple[list[Any], list[str]]:
    """Handles and labels of some axes, each label once: what belongs to all comes last."""
    found: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        for handle, label in zip(handles, labels, strict=True):
            found.setdefault(label, handle)
    order = sorted(found, key=lambda label: label in COMMON)
    return [found[label] for label in order], order


def legend_below(figure: Any, handles: list[Any], labels: list[str]) -> None:
    """A legend under the panels, in as many columns as the figure has room for."""
    columns = 4
    legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    while columns > 1 and legend.get_window_extent().width > figure.bbox.width:
        legend.remove()
        columns -= 1
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def _image_line(axes: Any, run: Run, first: bool) -> None:
    if _has_line(run):
        line = line_style(IDEAL) | {"linewidth": 1.0, "zorder": 0}
        axes.plot(*run["image_line"].T, **line, label="straight line" if first else None)
    axes.plot(
        *run["image_line"][1], DESIRED.marker, color=DESIRED.color, markersize=12, zorder=5,
        label="desired" if first else None,
    )  # fmt: skip


def _image_frame(axes: Any, run: Run) -> None:
    width, height = run["image_size"]
    axes.set(
        xlim=(0.0, width),
        ylim=(height, 0.0),
        xlabel="u [px of an image 1600 px wide]",
        ylabel="v [px]",
        aspect="equal",
    )


def _over_time(axes: Any, scene: Scene, name: str, factor: float) -> None:
    for number, (one, run, look) in enumerate(scene.shown):
        draw_curve(
            axes, run["time"], run[name], look, one.label,
            scale=factor, phase=phase_of(number, len(scene.shown)),
        )  # fmt: skip


def _components(
    axes: Any, times: Array, values: Array, names: Sequence[str], factor: float
) -> None:
    for k, name in enumerate(names):
        draw_curve(
            axes, times, values[:, k], nth_look(k), name,
            scale=factor, phase=phase_of(k, len(names)), linewidth=1.0, markersize=4.0,
        )  # fmt: skip
    axes.set_xlabel("time [s]")


def _once(number: int, label: str) -> str | None:
    """A label for the first of many, so that it is in the legend once."""
    return label if number == 0 else None
