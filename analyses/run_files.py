"""Writes what a run did: summary, log, effective scenario, figures, replay, video."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.camera_video import write_video
from cdpr_drake.analyses.replay import write_replay
from cdpr_drake.analyses.run import RunResult
from cdpr_drake.analyses.run_figures import write_figures
from cdpr_drake.analyses.run_summary import summarize
from cdpr_drake.arrays import Array
from cdpr_drake.systems import Scenario

_POSE = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
_TWIST = ("wx_rad_s", "wy_rad_s", "wz_rad_s", "vx_m_s", "vy_m_s", "vz_m_s")
_ERROR = ("rx_rad", "ry_rad", "rz_rad", "x_m", "y_m", "z_m")
_CORNERS = tuple(f"{axis}{corner}_px" for corner in range(4) for axis in "uv")
_PER_CABLE = {
    "cable_velocities": "m_s",
    "tensions": "n",
    "lengths": "m",
    "unstrained_lengths": "m",
    "slack": "flag",
}


def column_names(log: dict[str, Array], cables: list[str]) -> list[str]:
    """Names of the columns of `log.csv`, each ending in its unit."""
    names = ["time_s"]
    for quantity, values in log.items():
        if quantity == "time":
            continue
        if quantity in _PER_CABLE:
            parts = tuple(f"{cable}_{_PER_CABLE[quantity]}" for cable in cables)
        elif quantity.startswith("X_"):
            parts = _POSE
        else:
            parts = {
                "corners_px": _CORNERS,
                "error": _ERROR,
                "platform_velocity": _TWIST,
                "found": ("flag",),
                "gain": ("per_s",),
            }[quantity]
        assert len(parts) == values.shape[1]
        names += [f"{quantity}.{part}" for part in parts]
    return names


def write_log(folder: Path, log: dict[str, Array], cables: list[str]) -> None:
    """Writes `log.npz` (one array per quantity) and `log.csv` (one column per number)."""
    np.savez_compressed(folder / "log.npz", allow_pickle=False, **log)
    table = np.column_stack(list(log.values()))
    with (folder / "log.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(column_names(log, cables))
        writer.writerows(table.tolist())


def write_scenario(path: Path, scenario: Scenario) -> None:
    """Writes the scenario as it was run, overrides included, so that it can be run again."""
    path.write_text(yaml_dump_typed(scenario), encoding="utf-8")


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
    write_log(folder, result.log, [cable.name for cable in servo.robot.cables])
    write_scenario(folder / "scenario.yaml", servo.scenario)
    say("figures")
    write_figures(folder, result)
    say("replay.html")
    write_replay(folder / "replay.html", result)
    if video:
        say("camera.mp4")
        write_video(folder / "camera.mp4", result)
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return summary
