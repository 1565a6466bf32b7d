"""Figures of a replayed log: residuals by cable, and distances of positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Box

from cdpr_drake.analyses.logs.followed_log import FollowedLog
from cdpr_drake.analyses.logs.log_replay import LogReplay
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import new_figure, styled
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import ShownThing, Surroundings
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look

MODEL_COLOR = (0.9, 0.6, 0.0, 0.45)
"""Of the platform as the model has it for the measured lengths."""


def residual_figure(replay: LogReplay, followed: FollowedLog | None = None) -> Figure:
    """Residuals of lengths and tensions by cable, distances of positions, over time."""
    names = [cable.name for cable in replay.robot.cables]
    panels: list[tuple[str, list[tuple[str, Array, Array]]]] = []

    def add(title: str, rows: list[tuple[str, Array, Array]]) -> None:
        kept = [row for row in rows if np.isfinite(row[2]).any()]
        if kept:
            panels.append((title, kept))

    time = replay.time
    add(
        "length, measured\nminus model [mm]",
        [(n, time, 1e3 * replay.length_residuals[:, k]) for k, n in enumerate(names)],
    )
    off = replay.tensions - replay.predicted_tensions
    add(
        "tension, measured\nminus model [N]",
        [(n, time, off[:, k]) for k, n in enumerate(names)],
    )
    apart = [("model by lengths", time, 1e3 * replay.distances)]
    if followed is not None:
        apart.append(("simulated", followed.time, 1e3 * followed.distances))
    add("distance from the\nmeasured position [mm]", apart)
    moments = replay.robot.motion_type().num_turns
    size: Array = np.linalg.norm(replay.unbalanced[:, moments:], axis=1)
    add("force left by\ntensions, weight [N]", [("at rest", time, size)])
    count = max(len(panels), 1)
    figure, all_axes = new_figure(
        count, 1, (9.0, 1.2 + 2.2 * count), f"{replay.log.path.name} beside {replay.robot.name}"
    )
    row_axes = np.atleast_1d(all_axes)
    with styled():
        for axes, (title, curves) in zip(row_axes, panels, strict=False):
            for k, (name, t, values) in enumerate(curves):
                phase = phase_of(k, len(curves))
                draw_curve(axes, t, values, nth_look(k), name, phase=phase)
            axes.set_ylabel(title)
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        row_axes[-1].set_xlabel("time [s]" if replay.log.time is not None else "row")
    return figure


def replay_pictures(
    replay: LogReplay, followed: FollowedLog | None, formats: tuple[str, ...]
) -> dict[str, Callable[..., object]]:
    """What writes the figures and the replay page, by the names of the files."""
    from cdpr_drake.analyses.visualization.figure_files import figure_writers

    pictures: dict[str, Callable[..., object]] = {
        **figure_writers({"residuals": lambda: residual_figure(replay, followed)}, formats)
    }
    robot, log = replay.robot, replay.picture_log()
    if len(log["time"]) > 1:
        size = np.maximum(np.asarray(robot.platform.size, float), 0.01)
        model = ShownThing(
            "model", Box(*(1.02 * size)), MODEL_COLOR, quantity="X_WP_by_lengths",
        )  # fmt: skip
        title = (
            f"{replay.log.path.name}: the measured run of {robot.name}; orange, where the model "
            "has the platform for the measured lengths"
        )
        pictures["replay.html"] = lambda path: write_replay(
            path, robot, log, around=Surroundings(things=(model,)), title=title
        )
    return pictures
