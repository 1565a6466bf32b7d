"""What repeated runs of one scenario leave: table, JSON, CSV, figure."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.table import Table

from cdpr_drake.analyses.frame.figures import (
    draw_curve,
    figure_writers,
    line_style,
    new_figure,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.provenance import package_versions, write_run_inputs
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.simulation.monte_carlo import ManyRuns
from cdpr_drake.analyses.simulation.monte_carlo_store import RunRecord
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import DESIRED, IDEAL, OTHER_OUTCOME, OUTCOMES, Look
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

DEGREES = 180.0 / np.pi

METRICS: dict[str, tuple[str, float]] = {
    "final_position_error_m": ("final position error [mm]", 1e3),
    "final_rotation_error_rad": ("final rotation error [deg]", DEGREES),
    "image_deviation_px.max": ("from the line in the image, largest [px]", 1.0),
    "image_deviation_px.mean": ("from the line in the image, mean [px]", 1.0),
    "camera_deviation_m.max": ("from the line in space, largest [mm]", 1e3),
    "camera_deviation_m.mean": ("from the line in space, mean [mm]", 1e3),
    "pose_estimate_error_m.max": ("pose estimate, largest error [mm]", 1e3),
    "pose_estimate_error_m.mean": ("pose estimate, mean error [mm]", 1e3),
    "pose_estimate_error_rad.max": ("pose estimate, largest error [deg]", DEGREES),
    "sim_time_s": ("time [s]", 1.0),
    "slack_cable_seconds": ("slack [cable seconds]", 1.0),
}
"""What is reported of repeated runs: key of the summary, words with the unit, factor to it."""


def write_repetitions(
    folder: Path, scenario: Scenario, runs: ManyRuns, robot: Robot
) -> dict[str, Any]:
    """Writes the data that repeated runs leave into an existing folder; returns the summary.

    Args:
        folder: Where to.
        scenario: The scenario that was repeated.
        runs: What came out.
        robot: Its robot.
    """
    summary = repetition_summary(scenario, runs)
    write_run_inputs(folder, scenario, robot)
    with (
        whole_file(folder / "runs.csv") as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(["seed", "outcome", *METRICS])
        values = [runs.values(metric) for metric in METRICS]
        for row, record in enumerate(runs.records):
            numbers = [column[row] for column in values]
            writer.writerow([record.seed, record.summary["outcome"], *numbers])
    write_json(folder / "summary.json", summary)
    return summary


def repetition_pictures(
    scenario: Scenario, runs: ManyRuns, formats: Sequence[str] = DEFAULT_FORMATS
) -> Pictures:
    """What draws the figure of repeated runs; nothing where no run was finished."""
    if not runs.records:
        return {}
    drawn = {"repetitions": lambda: repetition_figure(scenario, runs)}
    return dict(figure_writers(drawn, formats))


def repetition_summary(scenario: Scenario, runs: ManyRuns) -> dict[str, Any]:
    """The numbers of repeated runs; keys and units as README lists them."""
    reached = runs.repeatability()
    summary: dict[str, Any] = {
        "scenario": scenario.name,
        "seeds": [record.seed for record in runs.records],
        "wanted": runs.wanted,
        "interrupted": runs.interrupted,
        "lost_seeds": list(runs.lost),
        "outcomes": dict(Counter(record.summary["outcome"] for record in runs.records)),
        "engines": dict(Counter(record.summary["engine"] for record in runs.records)),
        "loops": dict(Counter(record.summary["loop"] for record in runs.records)),
        "wall_time_s": runs.wall_time,
        "statistics": {metric: statistics(runs.values(metric)) for metric in METRICS},
        "repeatability": None
        if reached is None
        else {
            "runs": reached.count,
            "accuracy_m": reached.accuracy,
            "accuracy_rad": reached.rotation_accuracy,
            "repeatability_m": reached.repeatability,
            "repeatability_rad": reached.rotation_repeatability,
            "iso_9283_rp_m": reached.iso_9283,
        },
        "runs": [record.summary for record in runs.records],
        "versions": package_versions(),
    }
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def statistics(values: np.ndarray) -> dict[str, float | None]:
    """Mean, largest, smallest and sample standard deviation of the values that are numbers."""
    numbers = values[np.isfinite(values)]
    if len(numbers) == 0:
        return {"mean": None, "max": None, "min": None, "std": None}
    return {
        "mean": float(np.mean(numbers)),
        "max": float(np.max(numbers)),
        "min": float(np.min(numbers)),
        "std": float(np.std(numbers, ddof=1)) if len(numbers) > 1 else None,
    }


def repetition_table(summary: dict[str, Any]) -> Table:
    """The summary for a terminal."""
    counts = ", ".join(f"{count} {name}" for name, count in summary["outcomes"].items())
    table = Table(title=f"{summary['scenario']}: {counts or 'no run finished'}")
    table.add_column("over runs")
    for heading in ("mean", "max", "std"):
        table.add_column(heading, justify="right")
    for metric, (words, factor) in METRICS.items():
        found = summary["statistics"][metric]
        table.add_row(
            words, *(_words(found[heading], factor) for heading in ("mean", "max", "std"))
        )
    reached = summary["repeatability"]
    if reached is not None:
        table.add_section()
        for words, key, factor in (
            ("accuracy [mm]", "accuracy_m", 1e3),
            ("accuracy [deg]", "accuracy_rad", DEGREES),
            ("repeatability [mm]", "repeatability_m", 1e3),
            ("repeatability [deg]", "repeatability_rad", DEGREES),
            ("repeatability, ISO 9283 [mm]", "iso_9283_rp_m", 1e3),
        ):
            table.add_row(words, _words(reached[key], factor), "", "")
    return table


def _words(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.3f}"


def repetition_figure(scenario: Scenario, runs: ManyRuns) -> Figure:
    """Paths in the image of all runs, and where they ended; coloured by outcome.

    Where no run ever saw the target, only where they ended.
    """
    title = (
        f"Repeated runs: paths in the image and last poses\n{scenario.title}\n"
        f"({scenario.name}, {len(runs.records)} runs)"
    )
    seen = [r for r in runs.records if len(r.traces.get("image_path", ()))]
    figure, panels = new_figure(1, 3 if seen else 1, (17.0 if seen else 7.0, 6.3), title)
    ends = panels[-1] if seen else panels
    if seen:
        image, deviation, _ = panels
        for number, record in enumerate(seen):
            traces, look = record.traces, _look(record.summary["outcome"])
            path = traces["image_path"]
            faint: dict[str, Any] = {"alpha": 0.5, "linewidth": 1.0}
            label = "a run's path" if number == 0 else None
            image.plot(*path[path_rows(path)].T, label=label, **line_style(look), **faint)
            image.plot(
                *traces["image_line"].T, **line_style(IDEAL), linewidth=1.0,
                label="straight line" if number == 0 else None,
            )  # fmt: skip
        image.invert_yaxis()
        image.set(xlabel="u [px of an image 1600 px wide]", ylabel="v [px]", aspect="equal")
        image.legend(loc="best")
        for outcome in dict.fromkeys(str(record.summary["outcome"]) for record in seen):
            some = [record for record in seen if record.summary["outcome"] == outcome]
            _draw_deviations(deviation, some, _look(outcome), outcome.replace("_", " "))
        deviation.legend(loc="best")
        deviation.set(
            xlabel="time [s]", ylabel="distance from the straight line [px]", ylim=(0.0, None)
        )
    points = 1e3 * np.array([pose_from_row(r.end).translation() for r in runs.records])
    outcomes = [str(record.summary["outcome"]) for record in runs.records]
    for outcome in dict.fromkeys(outcomes):
        chosen = np.array([each == outcome for each in outcomes])
        look, words = _look(outcome), outcome.replace("_", " ")
        label = f"{words}, {np.sum(chosen)} of {len(outcomes)}"
        ends.plot(*points[chosen, :2].T, look.marker, color=look.color, alpha=0.7, label=label)
    ends.plot(
        0.0, 0.0, DESIRED.marker, color=DESIRED.color, markersize=14, label="desired", zorder=1
    )
    ends.set(
        xlabel="x of the last pose [mm]",
        ylabel="y of the last pose [mm]",
        aspect="equal",
    )
    ends.set_title("last poses in the frame of the desired pose", fontsize=11)
    ends.xaxis.set_major_locator(MaxNLocator(5))
    ends.margins(0.15)
    ends.legend(loc="best")
    return figure


def _draw_deviations(axes: Any, records: Sequence[RunRecord], look: Look, words: str) -> None:
    """Median over runs of the distance from their straight lines over time, in their range."""
    traces = [(r.traces["image_time"], r.traces["image_deviation"]) for r in records]
    times = max((time for time, _ in traces), key=lambda time: float(time[-1]))
    values = np.array([np.interp(times, t, d, np.nan, np.nan) for t, d in traces])
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    axes.fill_between(
        times, low, high, color=look.color, alpha=0.25, linewidth=0.0, label=f"{words}, range"
    )
    draw_curve(
        axes, times, np.nanmedian(values, axis=0), Look(look.color, look.dash), f"{words}, median"
    )


def _look(outcome: str) -> Look:
    return OUTCOMES.get(outcome, OTHER_OUTCOME)
