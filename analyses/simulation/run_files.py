"""Writes what a visual servo did: first its data, then pictures of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.log_files import LogNames, write_json, write_log
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.camera_video import camera_view, write_video
from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.analyses.simulation.worlds import world_columns
from cdpr_drake.analyses.visualization.replay import write_replay

FILM = "camera.mp4"
"""What the camera saw, if that is wanted."""


def write_run_data(folder: Path, result: RunResult) -> dict[str, Any]:
    """Writes log, inputs and summary of a run into an existing folder; returns the summary."""
    servo = result.servo
    summary = summarize(result)
    write_log(folder, result.log, *servo_log_names(result))
    write_run_inputs(folder, servo.scenario, servo.robot)
    write_json(folder / "summary.json", summary)
    return summary


def servo_log_names(result: RunResult) -> LogNames:
    """Names for the log's columns."""
    servo = result.servo
    cables = [cable.name for cable in servo.robot.cables]
    return cables, servo.feature_names, world_columns(servo.scenario.world)


def run_pictures(
    result: RunResult, video: bool = False, formats: Sequence[str] = DEFAULT_FORMATS
) -> Pictures:
    """What draws figures, replay and, if wanted, the film of a run, by the names of their files."""
    servo = result.servo
    pictures = dict(run_figures(result, formats))
    if video:
        pictures[FILM] = lambda path: write_video(path, result)
    pictures["replay.html"] = lambda path: write_replay(
        path, servo.robot, result.log, servo.scenario, camera=(servo.mounting, servo.pinhole),
        # The film, which is written first, brings its images into the replay.
        view=camera_view(result, path.parent / FILM if video else None),
    )  # fmt: skip
    return pictures
