"""Figures of a replayed log: residuals by cable, and distances of positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Box

from cdpr_drake.analyses.frame.figures import draw_curve, figure_writers, panels, phase_of, styled
from cdpr_drake.analyses.logs.followed_log import FollowedLog
from cdpr_drake.analyses.logs.log_replay import LogReplay
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import ShownThing, Surroundings
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look

MODEL_COLOR = (0.9, 0.6, 0.0, 0.45)
"""Of the platform as the model has it for the measured lengths."""


def residual_figure(replay: LogReplay, followed: FollowedLog | None = None) -> Figure:
    """Residuals of lengths and tensions by cable, distances of positions, over time."""
    moments = replay.robot.motion_type().num_turns
    forces: Array = np.linalg.norm(replay.unbalanced[:, moments:], axis=1)

    def by_cable(residuals: Array) -> dict[str, tuple[Array, Array]]:
        cables = zip(replay.robot.cables, residuals.T, strict=True)
        return {cable.name: (replay.time, row) for cable, row in cables}

    distances = {"model by lengths": (replay.time, 1e3 * replay.distances)}
    if followed is not None:
        distances["simulated"] = (followed.time, 1e3 * followed.distances)
    residuals = {
        "length, measured\nminus model [mm]": by_cable(1e3 * replay.length_residuals),
        "tension, measured\nminus model [N]": by_cable(replay.tensions - replay.predicted_tensions),
        "distance from the\nmeasured position [mm]": distances,
        "force left by\ntensions, weight [N]": {"at rest": (replay.time, forces)},
    }
    finite = {
        label: {name: row for name, row in rows.items() if np.isfinite(row[1]).any()}
        for label, rows in residuals.items()
    }
    shown = {label: rows for label, rows in finite.items() if rows}
    size = (9.0, 1.2 + 2.2 * max(len(shown), 1))
    title = f"{replay.log.path.name} beside {replay.robot.name}"
    figure, all_axes = panels(len(shown), 1, size, title)
    with styled():
        for axes, (label, rows) in zip(all_axes, shown.items(), strict=False):
            for k, (name, (times, values)) in enumerate(rows.items()):
                phase = phase_of(k, len(rows))
                draw_curve(axes, times, values, nth_look(k), name, phase=phase)
            axes.set_ylabel(label)
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        all_axes[-1].set_xlabel("time [s]" if replay.log.time is not None else "row")
    return figure


def replay_pictures(
    replay: LogReplay, followed: FollowedLog | None, formats: tuple[str, ...]
) -> dict[str, Callable[..., object]]:
    """What writes the figures and the replay page, by the names of the files."""
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
