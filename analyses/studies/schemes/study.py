"""Runs the study, and what it leaves: numbers, tables, a figure."""

from __future__ import annotations

import warnings
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
from cdpr_drake.analyses.studies.schemes import trials
from cdpr_drake.analyses.studies.schemes.statements import (
    CHECKS,
    FREE,
    ROBOT,
    TURN,
    column,
    task_name,
)
from cdpr_drake.analyses.studies.schemes.trials import (
    COLUMNS,
    PERIOD,
    TURNS,
    VARIANTS,
    FreeTask,
    RobotTask,
    TurnTask,
    free_starts,
    robot_starts,
)
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.palette import nth_look

STARTS, QUICK_STARTS = 100, 8
"""Drawn starts of a free camera and of ACROBOT, each."""

DRAWN = {"ibvs", "pbvs-line", "partitioned", "partitioned, turned", "switching"}
"""Schemes in the panels over turns; pbvs and 2.5d do there what pbvs-line does."""


@dataclass(frozen=True, eq=False)
class SchemesStudy(SeededStudy):
    """What the study found, by `task_name`; `seeds` are drawn starts."""

    name = "schemes"
    judges = CHECKS
    stated = "What is said of them"

    def details(self) -> dict[str, Any]:
        """Parameters, versions, starts, numbers of all runs."""
        return {
            "parameters": constants_of(trials, str, int, float, tuple, dict),
            "free_starts": [pose_row(X_CO).tolist() for X_CO in free_starts(self.seeds)],
            "robot_starts": robot_starts(self.seeds),
            "versions": package_versions(),
            **self.runs_dict(COLUMNS),
        }

    def number_tables(self) -> list[Table]:
        """How the runs ended, by what was run and scheme."""
        tables = []
        for what in (TURN, FREE, ROBOT):
            table = new_table(
                f"{what}: medians of those that arrived, worst of all", ("scheme",),
                ("runs", "arrived", "lost", "time [s]", "image path [px]", "worst retreat [m]",
                 "switched", "share of bound"),
            )  # fmt: skip
            for variant in self._finished(what):
                runs = np.asarray(self.found[task_name(what, variant)]["runs"])
                arrived, lost, time, path, retreat, switches, share, _ = runs.T
                table.add_row(
                    variant, f"{len(runs)}", f"{np.sum(arrived):.0f}", f"{np.sum(lost):.0f}",
                    f"{_median(time):.2f}", f"{_median(path):.0f}", f"{np.max(retreat):.3g}",
                    "" if np.all(np.isnan(switches)) else f"{np.sum(switches > 0.0)}",
                    "" if np.all(np.isnan(share)) else f"{np.nanmax(share):.3f}",
                )  # fmt: skip
            if table.row_count:
                tables.append(table)
        return tables

    def _finished(self, what: str) -> list[str]:
        """Variants that were run."""
        return [variant for variant in VARIANTS if task_name(what, variant) in self.found]

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """The figure `schemes`."""
        return {"schemes": self._figure} if self.found else {}

    def _figure(self) -> Figure:
        figure, axes = new_figure(2, 2, (14.0, 10.0), "Schemes of visual servoing")
        self._draw_retreats(axes[0, 0])
        self._draw_turn(axes[0, 1])
        for axis, what in ((axes[1, 0], FREE), (axes[1, 1], ROBOT)):
            self._draw_failures(axis, what)
        return figure

    def _draw_retreats(self, axis: Axes) -> None:
        """How far the camera retreats on a turn, by its angle."""
        for k, variant in enumerate(VARIANTS):
            if variant in DRAWN and variant in self._finished(TURN):
                retreat = np.maximum(column(self.found, TURN, variant, "retreat_m"), NOTHING)
                look = nth_look(k)
                axis.semilogy(TURNS[: len(retreat)], retreat, label=variant, **line_style(look),
                              marker=look.marker, markersize=4)  # fmt: skip
        axis.set(xlabel="turn about the optical axis [deg]",
                 ylabel=f"retreat [m]; {NOTHING:g} is none",
                 title="How much farther than start and goal the camera goes")  # fmt: skip
        if axis.get_legend_handles_labels()[0]:
            axis.legend()

    def _draw_turn(self, axis: Axes) -> None:
        """Depth over time on the largest turn."""
        for k, variant in enumerate(VARIANTS):
            if variant in DRAWN and variant in self._finished(TURN):
                depths = np.asarray(self.found[task_name(TURN, variant)]["depths"])[-1]
                times = PERIOD * np.arange(len(depths))
                axis.semilogy(times, depths, label=variant, **line_style(nth_look(k)))
        axis.set(xlabel="time [s]", ylabel="depth of the dots [m]", ylim=(0.03, 10.0),
                 title=f"A turn by {TURNS[-1]} deg")  # fmt: skip

    def _draw_failures(self, axis: Axes, what: str) -> None:
        """Shares of runs that lost the target or did not arrive, side by side."""
        names = self._finished(what)
        for place, variant in enumerate(names):
            arrived, lost = (
                column(self.found, what, variant, name) for name in ("arrived", "lost")
            )
            gone, short = 100.0 * np.mean(lost), 100.0 * np.mean((arrived == 0.0) & (lost == 0.0))
            look = nth_look(VARIANTS_AT[variant])
            axis.bar(place, gone, color=look.color, edgecolor="black")
            axis.bar(place, short, bottom=gone, color="white", edgecolor="black", hatch="//")
            axis.annotate(f"{gone:.0f} + {short:.0f}", (place, gone + short), ha="center",
                          va="bottom")  # fmt: skip
        axis.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor")
        axis.set(ylabel="runs [%]", title=f"{what}: target lost (full) + not there (hatched)")
        axis.set_ylim(0.0, max(5.0, 1.2 * axis.get_ylim()[1]))


NOTHING = 1e-5
"""Retreat that is drawn where there is none, or less [m]."""

VARIANTS_AT = {variant: k for k, variant in enumerate(VARIANTS)}
"""Place of each, which is that of its look."""


def _median(values: Array) -> float:
    with warnings.catch_warnings():  # none arrived
        warnings.simplefilter("ignore", RuntimeWarning)
        return float(np.nanmedian(values))


def study_schemes(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> SchemesStudy:
    """Runs the study; each run is an item of a sweep.

    Args:
        quick: Fewer drawn starts.
        session: How it is run, and from how many starts.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_STARTS if quick else STARTS)
    kinds: dict[str, tuple[type[TurnTask | FreeTask | RobotTask], int]] = {
        TURN: (TurnTask, len(TURNS)), FREE: (FreeTask, seeds), ROBOT: (RobotTask, seeds),
    }  # fmt: skip
    chosen: dict[str, tuple[SweepTask, int]] = {
        task_name(what, variant): (make(variant), count)
        for what, (make, count) in kinds.items()
        for variant in VARIANTS
    }
    return SchemesStudy.run(chosen, quick, seeds, session)
