"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.seeded_study import SeededStudy, constants_of
from cdpr_drake.analyses.studies.tagless import trials
from cdpr_drake.analyses.studies.tagless.statements import CHECKS, medians, runs_of, task_name
from cdpr_drake.analyses.studies.tagless.trials import (
    COLUMNS,
    RATE,
    SCHEMES,
    TARGETS,
    ApproachTask,
    is_lost,
    starts,
)
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import nth_look

STARTS, QUICK_STARTS = 20, 1
OTHER_STARTS = 5
"""Starts of the schemes beside pose-based servoing."""

QUICK_SCHEMES = SCHEMES[:1]


@dataclass(frozen=True, eq=False)
class TaglessStudy(SeededStudy):
    """What the study found, by `task_name`; `seeds` are starts of the first scheme."""

    name = "tagless"
    judges = CHECKS

    def details(self) -> dict[str, Any]:
        """Parameters, versions, starts, numbers of all runs."""
        drawn = starts(self.seeds)
        return {
            "parameters": constants_of(trials, str, int, float, tuple),
            "starts": [[place.tolist(), angles.tolist()] for place, angles in drawn],
            "versions": package_versions(),
            **self.runs_dict(COLUMNS),
        }

    def number_tables(self) -> list[Table]:
        """Where the platform came to rest, by scheme and target."""
        if not self.found:
            return []
        table = new_table(
            "Where the platform came to rest, ground truth",
            ("scheme", "target"),
            ("runs", "lost", "median [mm]", "worst [mm]", "median [deg]", "worst [deg]",
             "images without"),
        )  # fmt: skip
        for scheme, target in self._finished():
            runs = runs_of(self.found, scheme, target)
            lost, middle = is_lost(runs), medians(runs)
            worst = np.max(runs[:, :2], axis=0)
            blind = np.sum(runs[:, COLUMNS.index("without_target")])
            table.add_row(
                scheme, target, f"{len(runs)}", f"{np.sum(lost)}", f"{1e3 * middle[0]:.4f}",
                f"{1e3 * worst[0]:.4f}", f"{middle[1]:.4f}", f"{worst[1]:.4f}", f"{blind:.0f}",
            )  # fmt: skip
        return [table]

    def _finished(self) -> list[tuple[str, str]]:
        """Schemes and targets that were run."""
        pairs = [(scheme, target) for scheme in SCHEMES for target in TARGETS]
        return [pair for pair in pairs if task_name(*pair) in self.found]

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """The figure `tagless`."""
        return {"tagless": self._figure} if self.found else {}

    def _figure(self) -> Figure:
        figure, axes = new_figure(1, 3, (16.0, 5.0), "Textured squares beside a tag")
        self._draw_approach(axes[0])
        for axis, column, scale, unit in ((axes[1], 0, 1e3, "mm"), (axes[2], 1, 1.0, "deg")):
            self._draw_ends(axis, column, scale)
            axis.set(ylabel=f"final {'distance' if column == 0 else 'angle'} [{unit}]",
                     yscale="log", title="each start, and medians")  # fmt: skip
        return figure

    def _draw_approach(self, axis: Axes) -> None:
        """Distances over time, medians of all starts of pose-based servoing; a run that ended
        early, as its target was lost, counts as far away."""
        for k, target in enumerate(TARGETS):
            arrays = self.found.get(task_name(SCHEMES[0], target))
            if arrays is not None:
                known = np.nan_to_num(arrays["distance"], nan=np.inf)
                distance = 1e3 * np.median(known, axis=0)
                times = np.arange(len(distance)) / RATE
                axis.semilogy(times, distance, label=target, **line_style(nth_look(k)))
        axis.set(xlabel="time [s]", ylabel="distance to the goal [mm]",
                 title=f"{SCHEMES[0]}, medians of all starts")  # fmt: skip
        if axis.get_legend_handles_labels()[0]:
            axis.legend()

    def _draw_ends(self, axis: Axes, column: int, scale: float) -> None:
        """Final errors of all runs, side by side."""
        pairs = self._finished()
        for place, (scheme, target) in enumerate(pairs):
            runs, look = runs_of(self.found, scheme, target), nth_look(TARGETS.index(target))
            ends = scale * runs[:, column]
            spread = place + np.linspace(-0.25, 0.25, len(ends)) if len(ends) > 1 else [place]
            axis.plot(spread, ends, look.marker, color=look.color, markersize=4)
            axis.plot([place - 0.35, place + 0.35], [scale * medians(runs)[column]] * 2,
                      color=look.color)  # fmt: skip
        axis.set_xticks(
            range(len(pairs)), [f"{scheme} {target}" for scheme, target in pairs],
            rotation=60, ha="right", rotation_mode="anchor",
        )  # fmt: skip


def study_tagless(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> TaglessStudy:
    """Runs the study; each run is an item of a sweep.

    Args:
        quick: One start by pose-based servoing, to see that everything works.
        session: How it is run, and from how many starts.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        RenderingError: EGL is missing.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_STARTS if quick else STARTS)
    others = min(OTHER_STARTS, seeds)
    chosen: dict[str, tuple[SweepTask, int]] = {
        task_name(scheme, target): (
            ApproachTask(scheme, target),
            seeds if scheme == SCHEMES[0] else others,
        )
        for scheme in (QUICK_SCHEMES if quick else SCHEMES)
        for target in TARGETS
    }
    return TaglessStudy.run(chosen, quick, seeds, session)
