"""Figures of studies of a visual servo, as the servoing thesis draws them.

A panel is filled by a function of axes and the runs that it shows: label, row, look, and all rows
of the configuration. A printed figure is rows of panels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import lcm
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.frame.figures import (
    bar_style,
    bare_figure,
    draw_curve,
    line_style,
    phase_of,
    shade,
    styled,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.runs.stability import draw_steps
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.analyses.visualization.path_figures import set_box
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, DESIRED, IDEAL, LOST, PLATFORM, SOLID, Look, nth_look

DEG = 180.0 / np.pi
COMMON = ("straight line", "desired", "measured path")
"""Labels of what belongs to all configurations; they come last in a legend."""


class Shown(NamedTuple):
    """A configuration in a panel: its words, its first run, its look, and all its rows."""

    label: str
    run: Mapping[str, Any]
    look: Look
    rows: Frame

    def __contains__(self, name: object) -> bool:
        return name in self.run["arrays"]

    def curve(self, name: str) -> Array:
        """A curve of the first run."""
        return np.asarray(self.run["arrays"][name])


Draw = Callable[[Any, Sequence[Shown]], None]
Curves = Mapping[str, Array]


def shown_of(
    rows: Frame, names: Sequence[str], labels: Mapping[str, str], looks: Sequence[int] | None = None
) -> list[Shown]:
    """Those of some configurations that were run."""
    found = []
    for k, name in enumerate(names):
        mine = rows[rows["configuration"] == name]
        if len(mine):
            look = nth_look(looks[k] if looks else k)
            found.append(Shown(labels[name], mine.iloc[0].to_dict(), look, mine))
    if not found:
        raise NothingToDraw
    return found


def has_line(one: Shown) -> bool:
    """Whether a run has straight lines to follow: not behind an object that moves."""
    value = one.run["image_max_px"]
    return value is not None and not np.isnan(value)


def deviation(of: str) -> Callable[[Shown], Array]:
    """How far "image" or "camera" is off its straight line, or off the desired point."""

    def value(one: Shown) -> Array:
        if has_line(one):
            return one.curve(f"{of}_deviation")
        return np.asarray(
            np.linalg.norm(one.curve(f"{of}_path") - one.curve(f"{of}_line")[1], axis=1)
        )

    return value


def over_time(
    label: str, value: str | Callable[[Shown], Array], factor: float = 1.0, *, clock: str = "time",
    **options: Any,
) -> Draw:  # fmt: skip
    """What draws a curve of each configuration over time."""

    def draw(axes: Any, shown: Sequence[Shown]) -> None:
        for k, one in enumerate(shown):
            values = one.curve(value) if isinstance(value, str) else value(one)
            draw_curve(axes, one.curve(clock), values, one.look, one.label, scale=factor,
                       phase=phase_of(k, len(shown)), **options)  # fmt: skip
        goal = "the straight line" if has_line(shown[0]) else "the desired point"
        axes.set(xlabel="time [s]", ylabel=label.replace("GOAL", goal))
        if not options:
            axes.set_ylim(0, None)

    return draw


def components(value: str, factor: float = 1.0) -> Draw:
    """What draws a curve for each component of a quantity of one configuration: features with their
    units, or cables."""

    def draw(axes: Any, shown: Sequence[Shown]) -> None:
        one, label = shown[0], "cable velocity [mm/s]"
        if value == "error":
            parts = [name.partition("_") for name in one.run["features"]]
            names = [
                f"{a} [{unit}]" if unit in ("rad", "m") else f"{a}{_}{unit} [-]"
                for a, _, unit in parts
            ]
            units = dict.fromkeys(name.rpartition("[")[2].rstrip("]") for name in names)
            label = f"feature error [{', '.join(units)}]"
        else:
            names = [cable.name for cable in load_robot(one.run["summary"]["robot"]).cables]
        for k, name in enumerate(names):
            draw_curve(axes, one.curve("time"), one.curve(value)[:, k], nth_look(k), name,
                       scale=factor, phase=phase_of(k, len(names)), linewidth=1.0,
                       markersize=4.0)  # fmt: skip
        axes.set(xlabel="time [s]", ylabel=label)

    return draw


def path(axes: Any, points: Array, look: Look, label: str) -> None:
    """A path in the image or in space, with its symbol where it starts."""
    style = {"marker": look.marker, "markevery": [0], "markerfacecolor": "white", "markersize": 6.0}
    axes.plot(*points[path_rows(points)].T, **line_style(look), label=label, **style)


def fit_box(axes: Any, points: Array) -> None:
    """Makes 3D axes show points, shape (n, 3), in true proportions; no edge is shorter than half of
    the longest, so that numbers on it can be read."""
    low, high = points.min(axis=0), points.max(axis=0)
    edges = 1.08 * np.maximum(high - low, 0.5 * max(float(np.max(high - low)), 1e-3))
    middle = (low + high) / 2.0
    set_box(axes, middle - edges / 2.0, middle + edges / 2.0)
    axes.set_box_aspect(edges, zoom=0.85)


def paths(value: str, line: str = "", flat: bool = False) -> Draw:
    """What draws paths in the image (2D), in space (3D), or in space from above (`flat`)."""

    def draw(axes: Any, shown: Sequence[Shown]) -> None:
        points = []
        for one in shown:
            mine = one.curve(value)[:, : 2 if flat else None]
            path(axes, mine, one.look, one.label)
            points.append(mine)
            if line:
                goal, style = one.curve(line), line_style(IDEAL) | {"linewidth": 1.0, "zorder": 0}
                if has_line(one):
                    axes.plot(*goal.T, **style, label="straight line")
                axes.plot(*goal[1:2].T, DESIRED.marker, color=DESIRED.color, markersize=11,
                          zorder=5, label="desired")  # fmt: skip
                points.append(goal)
        if hasattr(axes, "get_zlim"):
            fit_box(axes, np.vstack(points))
        elif flat:
            axes.set(xlabel="x in W [m]", ylabel="y in W [m]")
            axes.set_aspect("equal", adjustable="datalim")
        else:
            image_frame(axes, shown[0])

    return draw


def image_frame(axes: Any, one: Shown) -> None:
    """Axes of an image."""
    width, height = one.curve("image_size")
    axes.set(xlim=(0.0, width), ylim=(height, 0.0), xlabel="u [px of an image 1600 px wide]",
             ylabel="v [px]", aspect="equal")  # fmt: skip


def draw_corner_paths(axes: Any, shown: Sequence[Shown]) -> None:
    """Paths of an object's four points in the image: where they start, end and should end."""
    if "corner_paths" not in shown[0]:
        raise NothingToDraw
    corners, goals = shown[0].curve("corner_paths"), shown[0].curve("corner_goals")
    for k in range(4):
        look = nth_look(k)
        path(axes, corners[:, k], look, f"point {k + 1}")
        axes.plot(*corners[-1, k], "x", color=look.color, markersize=7, label="end")
        axes.plot(*goals[k], DESIRED.marker, color=DESIRED.color, markersize=10,
                  markerfacecolor="none", label="desired")  # fmt: skip
    image_frame(axes, shown[0])


def corners_at(time: float) -> Draw:
    """What draws the outline of a square object in the image at a time [s]."""

    def draw(axes: Any, shown: Sequence[Shown]) -> None:
        row = int(np.argmin(np.abs(shown[0].curve("image_time") - time)))
        corners = shown[0].curve("corner_paths")[row]
        axes.plot(*corners[[0, 1, 2, 3, 0]].T, color=PLATFORM.color, linestyle=SOLID, label="tag")
        axes.plot(*corners[0], "o", color=PLATFORM.color, label="its first corner")
        image_frame(axes, shown[0])
        axes.axhline(np.mean(axes.get_ylim()), **line_style(IDEAL), linewidth=0.7)
        axes.axvline(np.mean(axes.get_xlim()), **line_style(IDEAL), linewidth=0.7)

    return draw


def draw_estimated_paths(axes: Any, shown: Sequence[Shown]) -> None:
    """Estimated paths of the platform in space beside the true one of the first run, 3D axes."""
    true = shown[0].curve("platform_path")
    axes.plot(*true[path_rows(true)].T, color=PLATFORM.color, linestyle=SOLID, linewidth=4.0,
              alpha=0.35, label="measured path")  # fmt: skip
    for one in shown:
        path(axes, one.curve("estimate_path"), one.look, one.label)
    fit_box(axes, np.vstack([true, *(one.curve("estimate_path") for one in shown)]))


def draw_positions(axes: Any, shown: Sequence[Shown]) -> None:
    """True and estimated place of the platform over time, by coordinate."""
    for k, axis in enumerate("xyz"):
        look = nth_look(k)
        for curve, words, style, width in (
            ("platform_path", "measured", Look(look.color), 1.4),
            ("estimate_path", "estimated", Look("#303030", ":", look.marker), 1.6),
        ):
            draw_curve(axes, shown[0].curve("time"), shown[0].curve(curve)[:, k], style,
                       f"{axis}, {words}", phase=phase_of(k, 3), linewidth=width)  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="position of the platform [m]")


def draw_taut(axes: Any, shown: Sequence[Shown]) -> None:
    """Numbers of cables that pull over time."""
    draw = over_time("cables that pull [-]", lambda one: one.curve("taut_cables").astype(float),
                     clock="stability_time", drawstyle="steps-post")  # fmt: skip
    draw(axes, shown)
    axes.axhline(6.0, **line_style(BOUND), label="six hold the platform")
    axes.set_ylim(None, 8.4)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def draw_stable(axes: Any, shown: Sequence[Shown]) -> None:
    """Whether the criterion of stability holds over time; curves a little apart."""
    for k, one in enumerate(shown):
        holds = (np.nan_to_num(one.curve("stability_margin"), nan=-1.0) > 0.0).astype(float)
        draw_curve(axes, one.curve("stability_time"), holds - 0.06 * k, one.look, one.label,
                   phase=phase_of(k, len(shown)), drawstyle="steps-post")  # fmt: skip
    axes.set_yticks([0.0, 1.0], ["does not hold", "holds"])
    axes.set(xlabel="time [s]", ylim=(-0.25, 1.25))


def draw_final_places(axes: Any, shown: Sequence[Shown]) -> None:
    """Where the camera of each run ends as seen from above, against where it should."""
    for one in shown:
        for arrays in one.rows["arrays"]:
            end, goal = map(pose_from_row, arrays["camera_ends"])
            away = 1e3 * (end.translation() - goal.translation())
            turn = end.rotation().matrix()[:2, 0]
            axes.quiver(*away[:2], *turn, angles="xy", color=one.look.color, width=0.006, scale=9.0)
            axes.plot(*away[:2], one.look.marker, color=one.look.color, markerfacecolor="white",
                      markersize=8, label="end of a run, with its x axis")  # fmt: skip
    axes.plot(0.0, 0.0, DESIRED.marker, color=DESIRED.color, markersize=14, label="desired")
    axes.set(xlabel="x from the goal [mm]", ylabel="y from the goal [mm]")
    axes.margins(0.3)  # for the arrows, of which the limits know the feet only
    axes.set_aspect("equal", adjustable="datalim")


def bars(
    label: str, values: Mapping[str, Callable[[Mapping[str, Any]], Any]], letters: bool = False
) -> Draw:
    """What draws bars: means over the runs, with their range as whiskers."""

    def draw(axes: Any, shown: Sequence[Shown]) -> None:
        width, several = 0.8 / len(values), len(values) > 1
        for k, (words, value) in enumerate(values.items()):
            for place, one in enumerate(shown):
                some = np.array([value(row) for row in one.rows.to_dict("records")], float)
                if not len(some := some[~np.isnan(some)]):
                    continue
                mean = float(some.mean())
                whiskers = np.maximum([[mean - some.min()], [some.max() - mean]], 0.0)
                look = nth_look(4 * k) if several or letters else one.look
                axes.bar(place + (k + 0.5) * width - 0.4, mean, width, yerr=whiskers, capsize=3,
                         label=words if several else None, **bar_style(look))  # fmt: skip
        names = [
            f"{chr(ord('A') + k)}: {one.label}" if letters else one.label
            for k, one in enumerate(shown)
        ]
        axes.set_xticks(range(len(names)), names, rotation=35, ha="right", fontsize=9)
        axes.set(
            ylabel=label,
            xlim=(min(-0.6, len(names) / 2 - 2.6), max(len(names) - 0.4, len(names) / 2 + 1.6)),
        )
        axes.grid(visible=False, axis="x")

    return draw


def column(name: str, factor: float = 1.0) -> Callable[[Mapping[str, Any]], float]:
    """A number of a row, times a factor."""
    return lambda row: factor * (np.nan if row[name] is None else row[name])


def last(name: str, factor: float = 1.0) -> Callable[[Mapping[str, Any]], float]:
    """The last number of a curve, times a factor."""
    return lambda row: factor * float(row["arrays"][name][-1])


def largest_and_mean(
    label: str, quantity: str, unit: str, factor: float = 1.0, letters: bool = False
) -> Draw:
    """What draws bars of a quantity's largest and mean values."""
    columns = {"largest": f"{quantity}_max_{unit}", "mean": f"{quantity}_mean_{unit}"}
    return bars(label, {words: column(name, factor) for words, name in columns.items()}, letters)


@dataclass(frozen=True)
class Panel:
    """A panel of a printed figure; `space`: 3D axes; `times`: moments that are marked [s]."""

    draw: Draw
    of: tuple[str, ...]
    words: str = ""
    letter: str = ""
    space: bool = False
    times: tuple[float, ...] = ()


def layout(
    title: str, lines: Sequence[Sequence[Panel]], height: float = 1.0
) -> Callable[..., Figure]:
    """What draws a printed figure; panels of which nothing was run are left out."""

    def draw(rows: Frame, labels: Mapping[str, str]) -> Figure:
        there = set(rows["configuration"])
        kept = [[p for p in line if there & set(p.of)] for line in lines]
        if not (kept := [line for line in kept if line]):
            raise NothingToDraw
        width = max(map(len, kept))
        size = (max(6.6 * width, 8.0), height * 5.0 * len(kept) + 1.6)
        drawn, columns = bare_figure(size, title), lcm(*map(len, kept))
        panels = []
        with styled():
            grid = drawn.add_gridspec(len(kept), columns)
            for number, line in enumerate(kept):
                step = columns // len(line)
                for place, panel in enumerate(line):
                    where = grid[number, place * step : (place + 1) * step]
                    axes: Any = drawn.add_subplot(where, projection="3d" if panel.space else None)
                    shown = shown_of(rows, panel.of, labels)
                    panel.draw(axes, shown)
                    for time in panel.times:
                        axes.axvline(time, color="#303030", linestyle=":", linewidth=1.2)
                    words = panel.words or shown[0].label
                    axes.set_title(
                        f"({panel.letter}) {words}" if panel.letter else words, fontsize=11
                    )
                    panels.append(axes)
        legend_below(drawn, panels)
        return drawn

    return draw


IMAGE, CAMERA = paths("image_path", "image_line"), paths("camera_path", "camera_line")
IMAGE_AWAY = over_time("distance from GOAL [px]", deviation("image"), clock="image_time")
CAMERA_AWAY = over_time("distance from GOAL [mm]", deviation("camera"), 1e3)
PLACE_ERROR = over_time("distance of the estimate [mm]", "estimate_distance", 1e3)
TURN_ERROR = over_time("angle of the estimate [deg]", "estimate_angle", DEG)


def ends_layout(number: str, of: tuple[str, ...]) -> Callable[..., Figure]:
    """How far the estimate is off at the end, figures 5.17 and 5.26."""
    position = bars("error [mm]", {"at the end": last("estimate_distance", 1e3)})
    rotation = bars("error [deg]", {"at the end": last("estimate_angle", DEG)})
    return layout(
        f"Figure {number}: error of the estimated pose at the end, mean and range over runs",
        [[Panel(position, of, "position"), Panel(rotation, of, "rotation")]],
    )


def paths_layout(title: str, of: tuple[str, ...]) -> Callable[..., Figure]:
    """Paths in the image and in space, each beside its distance from the straight line: (a) to (d),
    as figures 3.39, 4.3 to 4.5, 4.7 and 5.24 of the servoing thesis."""
    return layout(title, (
        (Panel(IMAGE, of, "path of the object's centre in the image", "a"),
         Panel(IMAGE_AWAY, of, "distance from its straight line", "b")),
        (Panel(CAMERA, of, "path of the camera", "c", space=True),
         Panel(CAMERA_AWAY, of, "distance from its straight line", "d")),
    ))  # fmt: skip


def each(draw: Draw, of: Sequence[str], columns: int = 3) -> list[list[Panel]]:
    """Rows of panels, one a configuration, lettered (a), (b), ..."""
    panels = [Panel(draw, (name,), letter=chr(ord("a") + k)) for k, name in enumerate(of)]
    return [panels[k : k + columns] for k in range(0, len(panels), columns)]


def tiles(
    count: int, columns: int, size: tuple[float, float], title: str, sharex: bool = False
) -> tuple[Figure, list[Any]]:
    """A figure of so many panels, and these: so many side by side, each of a size [inch]."""
    lines = -(-count // columns)
    drawn = bare_figure((max(size[0] * columns, 8.0), size[1] * lines + 1.4), title)
    grid = list(drawn.subplots(lines, columns, squeeze=False, sharex=sharex).flat)
    for number, axes in enumerate(grid):
        axes.grid(alpha=0.3)
        if number >= count:
            axes.remove()
    return drawn, grid[:count]


QUANTITIES = {
    "cable_lengths": ("unstrained_lengths", "cable length [m]", 1.0),
    "cable_tensions": ("measured_tensions", "tension [N]", 1.0),
    "velocities": ("cable_velocities", "cable velocity [mm/s]", 1e3),
}
"""Figures with a panel for each cable: curve, label, factor."""


def cable_layout(
    title: str, quantity: str, of: Sequence[str], rows: Frame, labels: Mapping[str, str]
) -> Figure:
    """A panel for each cable, a curve for each configuration, as figures 5.11 to 5.13 and 5.25."""
    name, label, factor = QUANTITIES[quantity]
    shown = shown_of(rows, of, labels)
    if any(name not in one for one in shown):
        raise NothingToDraw
    known = [one.curve("tension_thresholds")[-1] for one in shown if "tension_thresholds" in one]
    cables = load_robot(shown[0].run["summary"]["robot"]).cables
    drawn, panels = tiles(len(cables), 2, (7.0, 2.8), title, sharex=True)
    for k, (axes, cable) in enumerate(zip(panels, cables, strict=True)):

        def of_cable(one: Shown, k: int = k) -> Array:
            return np.asarray(one.curve(name)[:, k])

        over_time(label, of_cable, factor, linewidth=1.0, markersize=4.0)(axes, shown)
        if quantity == "cable_tensions" and known:
            axes.axhline(known[0][k], **line_style(BOUND), label="threshold")
        axes.set_title(cable.name, fontsize=10)
        axes.label_outer()
    legend_below(drawn, panels[:1])
    return drawn


def small_multiples(
    title: str, draw: Draw, size: tuple[float, float], of: Sequence[str], rows: Frame,
    labels: Mapping[str, str],
) -> Figure:  # fmt: skip
    """One small picture for each configuration."""
    shown = shown_of(rows, of, labels)
    drawn, panels = tiles(len(shown), min(len(shown), 4), size, title)
    for axes, one in zip(panels, shown, strict=True):
        draw(axes, [one])
        axes.set_title(one.label, fontsize=10)
    legend_below(drawn, panels)
    return drawn


def draw_rank(axes: Any, shown: Sequence[Shown]) -> None:
    """Cables that pull over time; hatched where their Jacobian has lost rank (figure 5.18)."""
    one = shown[0]
    robot = load_robot(one.run["summary"]["robot"])
    freedom = 3 if robot.motion_type().is_horizontal_body else 6
    times, lost = one.curve("stability_time"), one.curve("jacobian_rank") < freedom
    shade(axes, times, lost, None, LOST)
    draw_steps(axes, times, one.curve("taut_cables"), lost)
    axes.axhline(freedom, **line_style(BOUND))
    axes.set(xlim=(times[0], times[-1]), ylim=(-0.2, len(robot.cables) + 0.4),
             xlabel="time [s]", ylabel="cables that pull [-]")  # fmt: skip


def group_figures(
    about: str, groups: Mapping[str, Mapping[str, str]], stability: bool, laps: Mapping[str, float]
) -> dict[str, Callable[..., Figure]]:
    """Figures of every experiment, by the name of the file.

    Behind an object that runs in laps curves over all of them would be a dark band: figures show
    the first two laps, or the largest error in each; `laps` has the time of one [s] by experiment.
    """
    found: dict[str, Callable[..., Figure]] = {}
    for group, names in groups.items():
        of, lap = tuple(names), laps.get(group)
        title = f"{about}\n{group}" if group else about
        early = title if lap is None else f"{title}, the first {2.0 * lap:g} s"
        in_laps = "" if lap is None else f", largest error in each lap of {lap:g} s"
        means = f"Mean and range over the runs with projected images\n{title}"

        def bar(name: str, words: str, factor: float = 1.0, of: tuple[str, ...] = of) -> Panel:
            return Panel(bars(words, {words: column(name, factor)}), of, words.partition(" [")[0])

        drawn: dict[str, Callable[..., Figure]] = {
            "image_paths": layout(f"Path of the object's centre in the image\n{early}", [
                [Panel(IMAGE, of, "path"), Panel(IMAGE_AWAY, of, "distance")],
            ]),
            "camera_paths": layout(f"Path of the camera, Co, in the world frame W\n{early}", [
                [Panel(CAMERA, of, "path", space=True), Panel(CAMERA_AWAY, of, "distance")],
            ]),
            "pose_estimates": layout(
                f"Estimated pose of the platform against the true one{in_laps}\n{title}",
                [[Panel(PLACE_ERROR, of, "place"), Panel(TURN_ERROR, of, "rotation")]],
            ),
            "deviations": layout(means, [
                [bar("image_max_px", "image, largest [px]"),
                 bar("image_mean_px", "image, mean [px]")],
                [bar("camera_max_m", "camera, largest [mm]", 1e3),
                 bar("camera_mean_m", "camera, mean [mm]", 1e3)],
            ]),
            "estimates": layout(means, [
                [bar("estimate_max_m", "pose estimate, largest error [mm]", 1e3),
                 bar("estimate_max_rad", "pose estimate, largest error [deg]", DEG)],
            ]),
        }  # fmt: skip
        multiples = {
            "errors": ("Feature error", components("error"), 3.0),
            "cable_velocities": ("Cable velocity", components("cable_velocities", 1e3), 3.0),
        }
        if stability:
            words = "Cables that pull; hatched: too few to hold the platform"
            multiples["stability"] = words, draw_rank, 2.4
            for name in ("cable_lengths", "cable_tensions"):
                words = f"{name.replace('_', ' ').capitalize()}, cable by cable\n{title}"
                drawn[name] = partial(cable_layout, words, name, of)
        for name, (words, draw, height) in multiples.items():
            drawn[name] = partial(small_multiples, f"{words}\n{early}", draw, (4.6, height), of)
        if lap is not None:
            del drawn["deviations"]  # behind an object that moves there is no straight line
            for name in ("image_paths", "camera_paths", "errors", "cable_velocities"):
                drawn[name] = of_first_runs(drawn[name], partial(beginning, seconds=2.0 * lap))
            drawn["pose_estimates"] = of_first_runs(
                drawn["pose_estimates"], partial(largest_by_lap, lap=lap)
            )
        end = f"_{group.lower().replace(' ', '_')}" if group else ""
        found |= {f"{name}{end}": draw for name, draw in drawn.items()}
    return found


def of_first_runs(
    draw: Callable[..., Figure], change: Callable[[Curves], Curves]
) -> Callable[..., Figure]:
    """What draws first runs with changed curves."""

    def draw_changed(rows: Frame, labels: Mapping[str, str]) -> Figure:
        first = rows.groupby("configuration", sort=False).head(1)
        return draw(first.assign(arrays=[change(curves) for curves in first["arrays"]]), labels)

    return draw_changed


CLOCKS = {
    "time": ("camera_path", "camera_deviation", "error", "cable_velocities"),
    "image_time": ("image_path", "image_deviation"),
}
"""Curves by their times."""


def beginning(curves: Curves, seconds: float) -> Curves:
    """Curves of `CLOCKS` until a time [s]."""
    cut: dict[str, Array] = {}
    for clock, names in CLOCKS.items():
        early = curves[clock] <= seconds
        cut |= {name: curves[name][early] for name in (clock, *names)}
    return {**curves, **cut}


def largest_by_lap(curves: Curves, lap: float) -> Curves:
    """The estimate's largest error in each lap of a time [s], at the middle of the lap."""
    times = curves["time"]
    numbers = np.floor((times - times[0]) / lap + 1e-6).astype(int)  # for sums of time steps
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    ends = np.append(starts[1:], len(times)) - 1
    largest = {
        name: np.maximum.reduceat(curves[name], starts)
        for name in ("estimate_distance", "estimate_angle")
    }
    return {**curves, **largest, "time": (times[starts] + times[ends]) / 2.0}


def legend_below(drawn: Any, panels: Sequence[Any]) -> None:
    """A legend of what some axes show, each label once, in as many columns as there is room for."""
    found: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    order = sorted(found, key=lambda label: label in COMMON)
    if not order:
        return
    for columns in (4, 3, 2, 1):
        legend = drawn.legend(
            [found[n] for n in order], order, loc="outside lower center", ncols=columns
        )
        if columns == 1 or legend.get_window_extent().width <= drawn.bbox.width:
            return
        legend.remove()
