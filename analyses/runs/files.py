"""Writes what a visual servo did: summary, log, effective scenario, figures, replay, video."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.pictures import write_replay
from cdpr_drake.analyses.reporting import write_json, write_log, write_scenario
from cdpr_drake.analyses.runs.camera_video import write_video
from cdpr_drake.analyses.runs.figures import write_figures
from cdpr_drake.analyses.runs.summary import summarize
from cdpr_drake.analyses.runs.visual_servo_run import RunResult


def write_run(
    folder: Path,
    result: RunResult,
    video: bool = False,
    on_step: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Writes everything that a run leaves into an existing folder; returns the summary.

    Args:
        folder: Where to.
        result: The run.
        video: Whether to render `camera.mp4` too.
        on_step: Called with the name of each file that is about to be written.
    """
    say = on_step or (lambda name: None)
    servo = result.servo
    summary = summarize(result)
    say("log")
    cables = [cable.name for cable in servo.robot.cables]
    write_log(folder, result.log, cables, servo.feature_names)
    write_scenario(folder / "scenario.yaml", servo.scenario)
    say("figures")
    write_figures(folder, result)
    say("replay.html")
    write_replay(folder / "replay.html", servo.robot, result.log, servo.scenario)
    if video:
        say("camera.mp4")
        write_video(folder / "camera.mp4", result)
    write_json(folder / "summary.json", summary)
    return summary
