"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.table import Table

from cdpr_drake.analyses.case_studies import SeededStudy
from cdpr_drake.analyses.pictures import line_style, new_figure
from cdpr_drake.analyses.reporting import ALONE, StudySession, new_table, package_versions
from cdpr_drake.analyses.studies.pick_and_place.statements import (
    ANGLE,
    DISTANCE,
    JUDGES,
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
from cdpr_drake.analyses.sweeps import SweepTask
from cdpr_drake.palette import BOUND, look_of
from cdpr_drake.systems.cameras import PROJECTED, RENDERED

SEEDS, QUICK_SEEDS = 20, 1
ONE_CAMERA_SEEDS = 5
"""Runs with one camera, which all end the same way."""


@dataclass(frozen=True, eq=False)
class PickAndPlaceStudy(SeededStudy):
    """What the study found; `seeds` are runs of each condition with two cameras."""

    name = "pick-and-place"
    judges = JUDGES
    stated = "Pick and place"

    @property
    def camera(self) -> str:
        """Kind of the cameras: projected in the quick form."""
        return PROJECTED if self.quick else RENDERED

    def about(self) -> dict[str, Any]:
        """What comes first in `as_dict`."""
        return {**super().about(), "camera": self.camera}

    def details(self) -> dict[str, Any]:
        """Arguments, versions, runs."""
        return {
            "items": self.progress.counts(),
            "versions": package_versions(),
            "seeds": self.seeds,
            "conditions": {name: list(CONDITIONS[name]) for name in self.found},
            "within": {"distance_m": DISTANCE, "angle_rad": ANGLE},
            "columns": list(COLUMNS),
            "runs": {name: arrays["runs"].tolist() for name, arrays in self.found.items()},
        }

    def number_tables(self) -> list[Table]:
        """Box against goal, by condition."""
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
        return [table]

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """The figure `set_down`."""
        return {"set_down": partial(set_down_figure, self)} if self.found else {}


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
    for one in axes[:2]:
        one.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
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
    tasks: dict[str, tuple[SweepTask, int]] = {
        name: (
            HandlingTrial(name, camera),
            min(seeds, ONE_CAMERA_SEEDS) if name == ONE_CAMERA else seeds,
        )
        for name in CONDITIONS
    }
    return PickAndPlaceStudy.run(tasks, quick, seeds, session)
