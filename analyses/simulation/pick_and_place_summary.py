"""What a run of picking and placing came to, in numbers and in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.simulation.pick_and_place_run import PickAndPlaceRun
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.gripper import HOLDING
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Phase
from cdpr_drake.systems.robots.settings import model_words, simulated_model

NEEDED = {
    Phase.APPROACH: "found_object",
    Phase.DESCEND: "found_object",
    Phase.CARRY: "found_goal",
    Phase.LOWER: "found_goal",
}
"""The tag that a phase needs, by the quantity of the log that tells whether it is seen."""


def phase_spans(log: Any) -> dict[Phase, tuple[float, float]]:
    """When each phase that was begun began and ended [s], from "time" and "phase" of a log."""
    times, numbers = log["time"], np.asarray(log["phase"])
    spans = {}
    for number in np.unique(numbers[:, 0]).astype(int):
        rows = np.flatnonzero(numbers[:, 0] == number)
        last = rows[-1] + 1
        end = float(numbers[last, 1] if last < len(numbers) else times[-1])
        spans[Phase(int(number))] = (float(numbers[rows[0], 1]), end)
    return spans


def unseen(log: Any) -> Array:
    """Rows of a log at which the tag that the phase needs is not seen, shape (n,), bool."""
    numbers = np.asarray(log["phase"])[:, 0]
    missing = np.zeros(len(numbers), bool)
    for phase, name in NEEDED.items():
        missing |= (numbers == phase) & (np.asarray(log[name])[:, 0] == 0.0)
    return missing


def placed_error(run: PickAndPlaceRun) -> tuple[float, float]:
    """Distance [m] and angle [rad] of the box from its goal at the end."""
    return pose_error(run.built.X_WG, pose_from_row(run.log["X_WB"][-1]))


def summarize_pick_and_place(run: PickAndPlaceRun) -> dict[str, Any]:
    """The summary of a run, for `summary.json`."""
    log, scenario, built = run.log, run.scenario, run.built
    X_WB = pose_from_row(log["X_WB"][-1])
    distance, angle = placed_error(run)
    offset = (built.X_WG.inverse() @ X_WB).translation()
    placed = run.outcome == Outcome.COMPLETED
    grip, times = np.asarray(log["grip"]), np.asarray(log["time"])
    held = grip[:, 0] == HOLDING
    missing = unseen(log)
    spans = phase_spans(log)
    done = (Phase.DONE, Phase.FAILED)
    hidden = np.asarray(log["hidden"])[:, 0] if scenario.cover is not None else np.zeros(len(times))
    summary = {
        "scenario": scenario.name,
        "kind": scenario.kind,
        "robot": built.robot.name,
        "simulated": simulated_model(built.robot, scenario.cables, scenario.damping),
        "geometry": scenario.cables.geometry_words(built.robot),
        "camera": scenario.camera.kind,
        "seed": scenario.seed,
        **run.ending(),
        "set_down_error_m": distance if placed else None,
        "set_down_error_rad": angle if placed else None,
        "set_down_offset_m": offset.tolist() if placed else None,
        "box_from_goal_m": distance,
        "phases": {
            phase.word: {"began_s": begin, "duration_s": end - begin}
            for phase, (begin, end) in spans.items()
            if phase not in done
        },
        "views": {
            "losses": None if run.state is None else int(run.state.losses),
            "blind_s": None if run.state is None else run.state.blind_time,
            "unseen_s": float(np.mean(missing)) * float(times[-1]),
            "hidden_s": float(np.mean(hidden)) * float(times[-1]),
        },
        "grip": {
            "gap_m": float(grip[-1, 1]),
            "across_m": float(grip[-1, 2]),
            "tilt_rad": float(grip[-1, 3]),
            "largest_force_n": float(np.max(grip[:, 4])),
            "mean_load_n": float(np.mean(np.asarray(log["load"])[held, 0])) if held.any() else None,
        },
        "box": {
            "taken_from": {
                "position": built.X_WB.translation().tolist(),
                "expected": scenario.workpiece.pose.position.tolist(),
            },
            "goal": {
                "position": built.X_WG.translation().tolist(),
                "expected": scenario.goal.pose.position.tolist(),
            },
        },
        "tension_n": {
            "min": float(np.min(log["tensions"])), "max": float(np.max(log["tensions"]))
        },
        "integration_step_s": built.max_step,
        "versions": package_versions(),
    }  # fmt: skip
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def pick_and_place_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and words for the table at the end of a run."""
    error, views = summary["set_down_error_m"], summary["views"]
    if error is None:
        words = f"not set down; box {1e3 * summary['box_from_goal_m']:.1f} mm from the goal"
    else:
        angle = np.degrees(summary["set_down_error_rad"])
        words = f"{1e3 * error:.3f} mm, {angle:.3f} deg from the goal"
    times = ", ".join(
        f"{name} {span['duration_s']:.1f}" for name, span in summary["phases"].items()
    )
    seen = f"{views['unseen_s']:.2f} s without the tag that was needed"
    if views["hidden_s"] > 0.0:
        seen += f"; a tag was hidden for {views['hidden_s']:.2f} s"
    low, high = summary["tension_n"]["min"], summary["tension_n"]["max"]
    return [
        ("model", model_words(summary["simulated"])),
        ("set down", words),
        ("phases [s]", times),
        ("view", seen),
        ("tensions", f"{low:.2f} to {high:.2f} N"),
    ]
