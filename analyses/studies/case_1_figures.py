"""Figures 2.2 to 2.17 of the servoing thesis, as case I draws them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.studies.servo_figures import (
    DEG,
    IMAGE,
    IMAGE_AWAY,
    PLACE_ERROR,
    TURN_ERROR,
    Panel,
    components,
    corners_at,
    draw_estimated_paths,
    draw_positions,
    largest_and_mean,
    layout,
    paths,
)
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.palette import nth_look

Drawing = Callable[..., Figure]

REACHED = (10.0, 15.0)
"""When the plan of section 2.3.1 is at its second and third pose [s]."""

PICTURED = {"a": 0.0, "b": REACHED[0], "c": REACHED[1], "d": 25.0}
"""Times of the images of figure 2.3 [s]."""

PLATFORM = paths("platform_path")


def names(prefix: str, keys: str = "1234567") -> tuple[str, ...]:
    """Names of configurations."""
    return tuple(f"{prefix}_{key}" for key in keys)


def estimate_errors(
    of: tuple[str, ...], letter: str, times: tuple[float, ...] = ()
) -> tuple[Panel, ...]:
    """Errors of the estimated position and rotation."""
    return (
        Panel(PLACE_ERROR, of, "error of the estimated position", letter, times=times),
        Panel(TURN_ERROR, of, "error of the estimated rotation", letter, times=times),
    )


def comparison(number: str, words: str, of: tuple[str, ...], platform: bool = True) -> Drawing:
    """Figures 2.4, 2.6, 2.8 and 2.10, the last without the path of the platform."""
    image = (
        Panel(IMAGE, of, "path of the tag's centre in the image", "a"),
        Panel(IMAGE_AWAY, of, "distance from its straight line", "b"),
    )
    path = (Panel(PLATFORM, of, "path of the platform in W", "c", space=True),) if platform else ()
    errors = estimate_errors(of, "d" if platform else "c")
    title = f"Figure {number}: {words}, first run by each estimator"
    return layout(title, (image, (*path, *errors)))


def quality(number: str, words: str, of: tuple[str, ...]) -> Drawing:
    """Figures 2.5, 2.7, 2.9 and 2.11: largest and mean distances."""
    image = largest_and_mean("distance in the image [px]", "image", "px")
    position = largest_and_mean("error [mm]", "estimate", "m", 1e3)
    rotation = largest_and_mean("error [deg]", "estimate", "rad", DEG)
    return layout(f"Figure {number}: {words}, mean and range over the runs", (
        (Panel(image, of, "tag's centre from its straight line", "a"),),
        (Panel(position, of, "position", "b"), Panel(rotation, of, "rotation", "b")),
    ))  # fmt: skip


def goal_errors(rows: Frame) -> dict[str, Frame]:
    """Runs to the same goal by controller.

    Raises:
        NothingToDraw: One of the controllers was not run.
    """
    runs = {
        "open loop": rows[rows["configuration"] == "g_blind"],
        "PBVS": rows[rows["configuration"].isin(names("g", "123456"))],
    }
    if not all(map(len, runs.values())):
        raise NothingToDraw
    return runs


def accuracy_figure(rows: Frame, labels: Mapping[str, str]) -> Figure:
    """Figure 2.14: bars of the errors at the goal, means with their range."""
    title = "Accuracy at the same goal, as figure 2.14; mean and range"
    figure, panels = new_figure(1, 2, (11.0, 5.5), title)
    for axes, name, label, factor in zip(
        panels, ("position_error_m", "rotation_error_rad"), ("position [mm]", "rotation [deg]"),
        (1e3, DEG), strict=True,
    ):  # fmt: skip
        runs = goal_errors(rows)
        for place, mine in enumerate(runs.values()):
            values = factor * mine[name].to_numpy(float)
            mean, low, high = np.mean(values), np.min(values), np.max(values)
            axes.bar(
                place, mean, 0.6, yerr=[[mean - low], [high - mean]], capsize=6,
                **bar_style(nth_look(place)),
            )  # fmt: skip
            word = "run" if len(values) == 1 else "runs"
            axes.text(place, high, f" {len(values)} {word}", ha="center", va="bottom")
        axes.set_xticks(range(len(runs)), list(runs))
        axes.set_ylabel(f"true error at the end, {label}")
        axes.margins(y=0.12)  # for the words on the whiskers
        axes.grid(visible=False, axis="x")
    return figure


OPEN, MOVING = names("o"), names("m", "14567")
SETS = {
    "ACROBOT, static object": names("a", "1234567m"),
    "ACROBOT, first pose wrong": names("ap"),
    "CAROCA, static object": names("c"),
    "CAROCA, first pose wrong": names("cp"),
}
"""Configurations of figures 2.4 to 2.11, two figures each."""

FIGURES = {
    "figure_2_2": layout("Figure 2.2: without servoing, estimates beside the measured path", (
        (Panel(draw_estimated_paths, OPEN, "path of the platform", "a", space=True),),
        estimate_errors(OPEN, "b", REACHED),
    )),
    "figure_2_3": layout("Figure 2.3: outline of the tag in the image, without servoing", [
        [Panel(corners_at(PICTURED[k]), ("o_1",), f"t = {PICTURED[k]:g} s", k) for k in line]
        for line in ("ab", "cd")
    ]),
    **{
        f"figure_2_{2 * k + 4}": comparison(f"2.{2 * k + 4}", words, of, platform=k < 3)
        for k, (words, of) in enumerate(SETS.items())
    },
    **{
        f"figure_2_{2 * k + 5}": quality(f"2.{2 * k + 5}", words, of)
        for k, (words, of) in enumerate(SETS.items())
    },
    "figure_2_12": layout("Figure 2.12: CAROCA, first pose wrong, Est. 7", (
        (Panel(draw_positions, ("cp_7",), "estimated and measured position", "a"),
         Panel(components("cable_velocities", 1e3), ("cp_7",), "cable velocities", "b")),
    )),
    "figure_2_16": layout("Figure 2.16: behind a moving object", (
        (Panel(PLATFORM, MOVING, "path of the platform", "a", space=True),
         Panel(paths("platform_path", flat=True), MOVING, "path from above", "b")),
        estimate_errors(MOVING, "c"),
    )),
    "figure_2_17": layout(
        "Figure 2.17: behind a moving object, estimated and measured position",
        [
            [Panel(draw_positions, (f"m_{key}",), letter=letter) for key, letter in line]
            for line in (("4a", "5b"), ("6c", "7d"), ("1e",))
        ],
        height=0.8,
    ),
    "accuracy_at_goal": accuracy_figure,
}  # fmt: skip
"""By the name of the file."""
