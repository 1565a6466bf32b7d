"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.pictures import DEFAULT_FORMATS, line_style, new_figure, save_figures
from cdpr_drake.analyses.reporting import (
    ALONE,
    Statement,
    StudySession,
    WorkProgress,
    code_version,
    finite,
    new_table,
    package_versions,
    statement_table,
    write_json,
)
from cdpr_drake.analyses.studies.pick_and_place.statements import (
    ANGLE,
    DISTANCE,
    handling_statements,
    result_words,
    within,
)
from cdpr_drake.analyses.studies.pick_and_place.trials import (
    COLUMNS,
    CONDITIONS,
    ONE_CAMERA,
    HandlingTrial,
    column,
    placed,
)
from cdpr_drake.analyses.sweeps import run_study_sweep
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, look_of
from cdpr_drake.systems.cameras import PROJECTED, RENDERED

SEEDS, QUICK_SEEDS = 20, 1
ONE_CAMERA_SEEDS = 5
"""Runs with one camera, which all end the same way."""


@dataclass(frozen=True, eq=False)
class PickAndPlaceStudy:
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        seeds: Runs of each condition with two cameras.
        found: Arrays of what is finished, by condition.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    seeds: int
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.progress.done < self.progress.total

    @property
    def camera(self) -> str:
        """Kind of the cameras: projected in the quick form."""
        return PROJECTED if self.quick else RENDERED

    def statements(self) -> list[Statement]:
        """What had to be shown, and whether it was."""
        return handling_statements(self.found, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: arguments, versions, runs, statements."""
        told = {
            "study": "pick-and-place",
            "quick": self.quick,
            "camera": self.camera,
            "interrupted": self.interrupted,
            "items": {
                "done": self.progress.done,
                "of": self.progress.total,
                "by_earlier_sessions": self.progress.found,
            },
            "versions": package_versions(),
            "seeds": self.seeds,
            "conditions": {name: list(CONDITIONS[name]) for name in self.found},
            "within": {"distance_m": DISTANCE, "angle_rad": ANGLE},
            "columns": list(COLUMNS),
            "runs": {name: arrays["runs"].tolist() for name, arrays in self.found.items()},
            "statements": [statement.as_dict() for statement in self.statements()],
        }
        cleaned: dict[str, Any] = finite(told)
        return cleaned

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = new_table(
            f"Picking and placing, {self.camera} cameras: box against goal",
            ("the goal's tag",),
            ("within", "median [mm]", "largest [mm]", "largest [deg]", "time [s]", "unseen [s]"),
        )
        for name, arrays in self.found.items():
            runs = arrays["runs"]
            done = runs[placed(runs)]
            cells = ["-"] * 3
            if len(done):
                distance, angle = column(done, "distance_m"), column(done, "angle_rad")
                cells = [
                    f"{1e3 * np.median(distance):.3f}", f"{1e3 * np.max(distance):.3f}",
                    f"{np.degrees(np.max(angle)):.3f}",
                ]  # fmt: skip
            table.add_row(
                name, f"{int(np.sum(within(runs)))} of {len(runs)}", *cells,
                f"{np.mean(column(runs, 'time_s')):.1f}",
                f"{np.mean(column(runs, 'unseen_s')):.1f}",
            )  # fmt: skip
        return [table, statement_table("Pick and place", self.statements())]

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> None:
        """Writes `results.json` and the figure into a folder that exists."""
        write_json(folder / "results.json", self.as_dict())
        if self.found:
            save_figures({"set_down": set_down_figure(self)}, folder, formats)


def set_down_figure(study: PickAndPlaceStudy) -> Figure:
    """Errors of the box over seeds, and where it lies beside the goal."""
    title = f"Where the box is set down, {study.camera} cameras"
    figure, axes = new_figure(1, 3, (15.0, 5.2), title)
    for name, arrays in study.found.items():
        runs, look = arrays["runs"], look_of(name, tuple(CONDITIONS))
        seeds, done = np.arange(len(runs)), placed(runs)
        dots = {"linestyle": "none", "marker": look.marker, "color": look.color}
        label = f"{name}: {result_words(runs).partition(';')[0]}"
        axes[0].plot(seeds[done], 1e3 * column(runs, "distance_m")[done], label=label, **dots)
        axes[1].plot(seeds[done], np.degrees(column(runs, "angle_rad")[done]), **dots)
        axes[2].plot(
            1e3 * column(runs, "offset_x_m")[done], 1e3 * column(runs, "offset_y_m")[done], **dots
        )
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    reach = 1e3 * DISTANCE
    axes[0].axhline(reach, label="accepted", **line_style(BOUND))
    axes[1].axhline(float(np.degrees(ANGLE)), **line_style(BOUND))
    axes[2].plot(reach * np.cos(turn), reach * np.sin(turn), **line_style(BOUND))
    axes[0].set(xlabel="seed", ylabel="distance from the goal [mm]", ylim=(0.0, None))
    axes[1].set(xlabel="seed", ylabel="angle from the goal [deg]", ylim=(0.0, None))
    axes[2].set(xlabel="x in G [mm]", ylabel="y in G [mm]", aspect="equal")
    axes[0].legend(loc="upper right", fontsize=8)
    return figure


def study_pick_and_place(quick: bool = False, session: StudySession = ALONE) -> PickAndPlaceStudy:
    """Runs the study; each run is an item of a sweep.

    Args:
        quick: One seed of each condition, by projected cameras.
        session: How it is run, and over how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        RenderingError: EGL is missing.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    camera = PROJECTED if quick else RENDERED
    tasks = {
        name: (
            HandlingTrial(name, camera),
            min(seeds, ONE_CAMERA_SEEDS) if name == ONE_CAMERA else seeds,
        )
        for name in CONDITIONS
    }
    arguments = {
        "cdpr_drake": code_version(),
        "study": "pick-and-place",
        "quick": quick,
        "seeds": seeds,
        "tasks": {name: {**asdict(task), "runs": count} for name, (task, count) in tasks.items()},
    }
    result = run_study_sweep(dict(tasks), 1, "runs", arguments, session)
    return PickAndPlaceStudy(quick, seeds, result.finished, result.progress)
