"""Many runs of visual servos: a record of each, statistics, table and figure."""

from __future__ import annotations

import csv
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from cyclopts import Parameter
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import (
    draw_curve,
    figure_writers,
    line_style,
    new_figure,
)
from cdpr_drake.analyses.frame.folder import Folder, load_arrays, results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.frame.result import STOPPED, Result, Table
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    OutFolder,
    Overrides,
    ScenarioWord,
    Seeds,
    Switch,
    Workers,
)
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.runs.scenarios import scenario_with
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.simulate import Camera, say_remarks
from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.pose_accuracy import repeatability
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.palette import DESIRED, IDEAL, OTHER_OUTCOME, OUTCOMES, Look
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.systems.diagrams.load import read_inputs
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO, Scenario

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
"""Numbers of all runs with statistics: key of the summary, words with the unit, factor to it."""

REACHED = {
    "accuracy_m": ("accuracy [mm]", 1e3),
    "accuracy_rad": ("accuracy [deg]", DEGREES),
    "repeatability_m": ("repeatability [mm]", 1e3),
    "repeatability_rad": ("repeatability [deg]", DEGREES),
    "iso_9283_rp_m": ("repeatability, ISO 9283 [mm]", 1e3),
}
"""Numbers of the poses that were reached: as of `METRICS`."""

SEEDS = "seeds"
"""Folder of the records in a results folder, a file a seed."""

MOST_NAMED = 10
"""Seeds of runs that failed are named at the end, up to this number."""


@dataclass(frozen=True, eq=False)
class Record:
    """What is kept of a run.

    Attributes:
        index: Its number among the runs.
        seed: Its seed.
        summary: Its summary, as `summary.json` of a single run.
        end: Last true pose of the platform in the frame of the desired one, as `pose_row`.
        traces: Arrays for figures, see `ServoRun.traces`; may be empty.
    """

    index: int
    seed: int
    summary: dict[str, Any]
    end: Array
    traces: dict[str, Array]

    def save(self, folder: Folder) -> None:
        """Writes it into a results folder; raises OutputFolderError if that is not possible."""
        words = np.frombuffer(json.dumps(self.summary).encode(), np.uint8)
        traces = {f"trace.{name}": values for name, values in self.traces.items()}
        arrays: dict[str, Any] = {"summary": words, "end": self.end, **traces}
        folder.write_arrays(f"{SEEDS}/{self.seed}.npz", arrays)

    @classmethod
    def load(cls, folder: Path, index: int, seed: int) -> Self | None:
        """Reads what `save` wrote; None if it is not there or damaged."""
        arrays = load_arrays(folder / SEEDS / f"{seed}.npz")
        if arrays is None:
            return None
        summary, end = load_json(arrays.pop("summary").tobytes()), arrays.pop("end")
        traces = {name.removeprefix("trace."): values for name, values in arrays.items()}
        return cls(index, seed, summary, end, traces)


@dataclass(frozen=True, eq=False, repr=False)
class Repetition(Result):
    """Runs of visual servos, mostly of one scenario over seeds.

    Attributes:
        scenarios: The scenarios, one for each run.
        records: Runs that ended, in the order of the scenarios.
        wall_time: Time of all runs together [s].
        lost: Words on runs that failed, for instance as memory ran out, by their numbers.
        folder: The results folder; None: nothing is kept.
        failed: Files that could not be written, and why.
    """

    scenarios: Sequence[Scenario]
    records: Sequence[Record]
    wall_time: float
    lost: Mapping[int, str] = field(default_factory=dict)
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """True if some runs were not begun."""
        return len(self.records) + len(self.lost) < len(self.scenarios)

    @property
    def exit_code(self) -> int:
        """Of a command that ends with it: 130 interrupted, 3 if runs failed."""
        return STOPPED if self.interrupted else 3 if self.lost else 0

    def values(self, metric: str) -> Array:
        """A number of all summaries, such as "image_deviation_px.max"; NaN where a run has none."""
        values = [entries(record.summary)[metric] for record in self.records]
        return np.array([np.nan if value is None else value for value in values], float)

    def as_dict(self) -> dict[str, Any]:
        """Statistics and all summaries, as `summary.json` has them."""
        summaries = [record.summary for record in self.records]
        ends = [pose_from_row(r.end) for r in self.records if r.summary["outcome"] == "converged"]
        reached = repeatability(ends, RigidTransform()) if ends else None
        counts = {
            f"{key}s": dict(Counter(summary[key] for summary in summaries))
            for key in ("outcome", "engine", "loop")
        }
        numbers: dict[str, Any] = finite({
            "scenario": self.scenarios[0].name,
            "seeds": [record.seed for record in self.records],
            "wanted": len(self.scenarios),
            "interrupted": self.interrupted,
            "lost_seeds": [self.scenarios[index].seed for index in sorted(self.lost)],
            **counts,
            "wall_time_s": self.wall_time,
            "statistics": {metric: statistics(self.values(metric)) for metric in METRICS},
            "repeatability": None if reached is None else {
                "runs": reached.count,
                "accuracy_m": reached.accuracy,
                "accuracy_rad": reached.rotation_accuracy,
                "repeatability_m": reached.repeatability,
                "repeatability_rad": reached.rotation_repeatability,
                "iso_9283_rp_m": reached.iso_9283,
            },
            "runs": summaries,
            "versions": package_versions(),
        })  # fmt: skip
        return numbers

    def columns(self) -> dict[str, Array]:
        """A row a run: its number, its seed, and the numbers and words of its summary.

        An entry inside another has its path as name, as `image_deviation_px.max`. Lists are left
        out.
        """
        rows = [entries(record.summary) for record in self.records]
        names = dict.fromkeys(name for row in rows for name in row if name != "seed")
        columns = {
            "index": np.array([record.index for record in self.records], int),
            "seed": np.array([record.seed for record in self.records], int),
        }
        for name in names:
            values = [row.get(name) for row in rows]
            empty, kind = ("", str) if any(isinstance(v, str) for v in values) else (np.nan, float)
            columns[name] = np.array([empty if value is None else value for value in values], kind)
        return columns

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame."""
        import pandas as pd  # some half a second, which few need

        return pd.DataFrame(self.columns())

    def write_table(self, path: Path) -> None:
        """Writes the columns in the format of the path's ending: .csv, .npz, .mat or .parquet.

        Raises:
            OutputFormatError: Another ending, or Parquet without pyarrow.
        """
        write_columns(path, self.columns())

    def tables(self) -> list[Table]:
        """Statistics of all runs, and how well the desired pose was reached."""
        numbers = self.as_dict()
        counts = ", ".join(f"{count} {name}" for name, count in numbers["outcomes"].items())
        rows = [
            (words, *(_words(numbers["statistics"][key][name], factor) for name in _STATISTICS))
            for key, (words, factor) in METRICS.items()
        ]
        tables = [Table(
            f"{numbers['scenario']}: {counts or 'no run finished'}",
            ("over runs", *_STATISTICS), rows,
        )]  # fmt: skip
        if (reached := numbers["repeatability"]) is not None:
            words = [(words, _words(reached[key], f)) for key, (words, f) in REACHED.items()]
            tables.append(Table(f"poses of {reached['runs']} converged runs", rows=words))
        return tables

    def lines(self) -> list[str]:
        """Time and folder."""
        return [f"{self.wall_time:.1f} s; results: {self.folder or 'none'}"]

    def notes(self) -> list[str]:
        """Runs that failed or were not begun."""
        lines = []
        if self.lost:
            seeds = [str(self.scenarios[index].seed) for index in sorted(self.lost)]
            shown = ", ".join([*seeds[:MOST_NAMED], *(["..."] if seeds[MOST_NAMED:] else [])])
            lines.append(f"cdpr: {len(seeds)} of {len(self.scenarios)} runs failed: seed {shown}")
        if self.interrupted:
            kept = "" if self.folder is None else f" are in {self.folder}"
            count = f"{len(self.records)} of {len(self.scenarios)} runs{kept}"
            lines.append(f"Interrupted; {count}; the same command goes on")
        return lines

    def write(self, folder: Folder) -> None:
        """Writes `runs.csv` and `summary.json`.

        Raises:
            OutputFolderError: They cannot be written.
        """
        with folder.file("runs.csv") as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["seed", "outcome", *METRICS])
            columns = [self.values(metric) for metric in METRICS]
            for row, record in enumerate(self.records):
                numbers = [column[row] for column in columns]
                writer.writerow([record.seed, record.summary["outcome"], *numbers])
        folder.write_json("summary.json", self.as_dict())

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Paths and ends of the runs; none if no run ended."""
        return {"repetitions": self._figure} if self.records else {}

    def _figure(self) -> Figure:
        """Paths in the image, their deviations, and the last poses, coloured by outcome.

        Only the last poses if no run ever saw the target.
        """
        scenario, records = self.scenarios[0], self.records
        title = "Repeated runs: paths in the image and last poses"
        title += f"\n{scenario.title}\n({scenario.name}, {len(records)} runs)"
        visible = [record for record in records if len(record.traces.get("image_path", ()))]
        size = (17.0, 6.3) if visible else (7.0, 6.3)
        figure, panels = new_figure(1, 3 if visible else 1, size, title)
        if visible:
            _draw_paths(panels[0], visible)
            _draw_deviations(panels[1], visible)
        _draw_ends(panels[-1] if visible else panels, records)
        return figure


_STATISTICS = ("mean", "max", "std")


def _words(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.3f}"


def _look(outcome: str) -> Look:
    return OUTCOMES.get(outcome, OTHER_OUTCOME)


def _by_outcome(records: Sequence[Record]) -> dict[str, list[Record]]:
    groups: dict[str, list[Record]] = {}
    for record in records:
        groups.setdefault(record.summary["outcome"], []).append(record)
    return groups


def _draw_paths(panel: Any, records: Sequence[Record]) -> None:
    for number, record in enumerate(records):
        path, look = record.traces["image_path"], line_style(_look(record.summary["outcome"]))
        labels = ("a run's path", "straight line") if number == 0 else (None, None)
        rows, line = path_rows(path), record.traces["image_line"]
        panel.plot(*path[rows].T, label=labels[0], **look, alpha=0.5, linewidth=1.0)
        panel.plot(*line.T, **line_style(IDEAL), linewidth=1.0, label=labels[1])
    panel.invert_yaxis()
    panel.set(xlabel="u [px of an image 1600 px wide]", ylabel="v [px]", aspect="equal")
    panel.legend(loc="best")


def _draw_deviations(panel: Any, records: Sequence[Record]) -> None:
    """Median and range over runs of the distance from their straight lines, by outcome."""
    for outcome, group in _by_outcome(records).items():
        look, words = _look(outcome), outcome.replace("_", " ")
        curves = [(r.traces["image_time"], r.traces["image_deviation"]) for r in group]
        times = max((time for time, _ in curves), key=lambda time: float(time[-1]))
        values = np.array([np.interp(times, t, d, np.nan, np.nan) for t, d in curves])
        low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
        faint: dict[str, Any] = {"color": look.color, "alpha": 0.25, "linewidth": 0.0}
        panel.fill_between(times, low, high, label=f"{words}, range", **faint)
        median, plain = np.nanmedian(values, axis=0), Look(look.color, look.dash)
        draw_curve(panel, times, median, plain, f"{words}, median")
    panel.legend(loc="best")
    panel.set(xlabel="time [s]", ylabel="distance from the straight line [px]", ylim=(0.0, None))


def _draw_ends(panel: Any, records: Sequence[Record]) -> None:
    for outcome, group in _by_outcome(records).items():
        points = 1e3 * np.array([pose_from_row(record.end).translation() for record in group])
        look, words = _look(outcome), outcome.replace("_", " ")
        label = f"{words}, {len(group)} of {len(records)}"
        panel.plot(*points[:, :2].T, look.marker, color=look.color, alpha=0.7, label=label)
    panel.plot(
        0.0, 0.0, DESIRED.marker, color=DESIRED.color, markersize=14, label="desired", zorder=1
    )
    panel.set(xlabel="x of the last pose [mm]", ylabel="y of the last pose [mm]", aspect="equal")
    panel.set_title("last poses in the frame of the desired pose", fontsize=11)
    panel.xaxis.set_major_locator(MaxNLocator(5))
    panel.margins(0.15)
    panel.legend(loc="best")


def entries(summary: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Numbers, words and None of a summary, by their path in it; lists are left out."""
    flat: dict[str, Any] = {}
    for key, value in summary.items():
        if isinstance(value, dict):
            flat |= entries(value, f"{prefix}{key}.")
        elif not isinstance(value, list | tuple):
            flat[f"{prefix}{key}"] = value
    return flat


def statistics(values: Array) -> dict[str, float | None]:
    """Mean, largest, smallest and sample standard deviation of the finite values."""
    numbers = values[np.isfinite(values)]
    if len(numbers) == 0:
        return dict.fromkeys(("mean", "max", "min", "std"))
    deviation = float(np.std(numbers, ddof=1)) if len(numbers) > 1 else None
    extremes = {"max": float(np.max(numbers)), "min": float(np.min(numbers))}
    return {"mean": float(np.mean(numbers)), **extremes, "std": deviation}


def with_seeds(scenario: Scenario, seeds: Sequence[int]) -> list[Scenario]:
    """The scenario once for each seed."""
    return [replace(scenario, seed=seed) for seed in seeds]


@verb()
def run_many(
    scenarios: Sequence[Scenario], workers: int | str | None = None, *, traces: bool = False,
    folder: Folder | None = None, follow: Follow = NOBODY,
    remarks: Callable[[], None] = lambda: None,
) -> Repetition:  # fmt: skip
    """Simulates visual servos, each until its outcome is known or its duration is over.

    A run's noise and random model errors depend on the seed of its scenario only, not on the
    worker. A run that raises, or whose process dies, is named in the result; the others go on.

    Args:
        scenarios: At least one; `with_seeds` makes them of one scenario.
        workers: Processes, or a Dask scheduler; see `finished_jobs`.
        traces: True to keep the arrays that figures need.
        folder: Open results folder for runs of one scenario: a run whose record is there is not
            repeated.
        follow: Who follows.
        remarks: Called when the first run has ended, so that a refusal of the workers is alone.

    Raises:
        CdprError: No scenario can be built.
        SweepError: As `finished_jobs`.
        OutputFolderError: A record cannot be written.
    """
    for scenario in {scenario.robot: scenario for scenario in scenarios}.values():
        read_inputs(scenario)
    began, records, lost = time.perf_counter(), dict[int, Record](), dict[int, str]()
    if folder is not None:
        for index, scenario in enumerate(scenarios):
            if (record := Record.load(folder.path, index, scenario.seed)) is not None:
                records[index] = record
    jobs = [pair for pair in enumerate(scenarios) if pair[0] not in records]
    count, problems = Count(follow, len(scenarios), len(records)), list[Exception]()
    ended = finished_jobs(
        partial(_record, traces=traces), jobs, workers, stop=follow.stop, say=follow.say,
        name="run",
    )  # fmt: skip
    first = list(islice(ended, 1))
    remarks()
    for finished in chain(first, ended):
        index, scenario = jobs[finished.number]
        if finished.problem is not None:
            problems.append(finished.problem)
            lost[index] = f"seed {scenario.seed}: {finished.words()}"
            follow.say(lost[index])
            count.add(1.0, f"seed {scenario.seed} failed")
        elif (record := finished.result) is not None:
            if folder is not None:
                record.save(folder)
            records[index] = record
            count.add(1.0, f"seed {record.seed} {record.summary['outcome']}")
    if len(problems) == len(scenarios):
        raise problems[0]
    ordered = tuple(records[index] for index in sorted(records))
    return Repetition(scenarios, ordered, time.perf_counter() - began, lost)


def _record(job: tuple[int, Scenario], traces: bool) -> Record:
    """A run, in whatever process."""
    index, scenario = job
    run = ServoRun(scenario).simulate()
    desired = run.built.desired_platform_pose(float(run.log["time"][-1]))
    end = pose_row(desired.inverse() @ pose_from_row(run.log["X_WP"][-1]))
    return Record(index, scenario.seed, run.as_dict(), end, run.traces() if traces else {})


@verb()
def repeat_run(
    scenario: ScenarioWord = DEFAULT_SCENARIO, overrides: Overrides = (), *, seeds: Seeds,
    workers: Workers = None, folder: OutFolder = None, camera: Camera = None,
    duration: float | None = None, log_rate: float | None = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Repetition:  # fmt: skip
    """Repeats a visual servo over seeds, and writes statistics, a table and a figure.

    Each run is kept as it ends. The same command goes on after an interruption, and takes more
    seeds later.

    Args:
        scenario: Scenario of a visual servo by name, path of a YAML file, or folder of a run.
        overrides: Key and value of the scenario, such as perturbations.anchor_points=0.005.
        seeds: Seeds, as 0:20 (0 to 19) or 3,5,8.
        workers: Processes, or a Dask scheduler; default: one for each processor, for long work.
        folder: Results folder; default: one below runs/ by scenario and settings; in Python nothing
            is kept.
        camera: Images of a renderer, or the target's corners by projection.
        duration: Longest simulated time of each run [s].
        log_rate: Rows of the log per second [Hz].
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figure in the folder.
        follow: Who follows.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its kind is no visual servo.
        CdprError: It cannot be built: robot, camera or initial pose.
        SweepError: The cluster cannot be used.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = scenario_with(scenario, overrides, camera=camera, duration=duration, log_rate=log_rate)
    if not isinstance(loaded, Scenario):
        raise ScenarioError(f"seeds: found with a {loaded.kind}; accepted: visual servos")
    if not seeds or len(set(seeds)) < len(seeds):
        raise ScenarioError(f"seeds: found {list(seeds)}; accepted: different numbers, at least 1")
    loaded, note = set_loop(loaded, True)
    run = ServoRun(loaded)
    follow.doing(f"{loaded.name}: building the diagram")
    warnings = run.check()
    arguments = run.arguments()
    del arguments["scenario"]["seed"]
    below = None if follow.results is None else follow.results.parent / "runs"
    with results_folder(loaded.name, arguments, folder, overwrite, below, True) as results:
        runs = run_many(
            with_seeds(loaded, seeds), workers, traces=True, folder=results, follow=follow,
            remarks=partial(say_remarks, note, warnings, follow),
        )  # fmt: skip
        if results is None:
            return runs
        runs = replace(runs, folder=results.path)
        with results.files() as stage:
            run.write_inputs(stage)
        runs.write(results)
        runs.failed.update(results.write_all(figure_writers(runs.figures(), formats)))
        if not runs.interrupted:
            results.complete()
    return runs
