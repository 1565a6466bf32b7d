"""Runs the scenarios, and what it leaves: numbers, a table, a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import (
    Statement,
    evaluate_checks,
    new_table,
    statement_table,
)
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.scenarios.statements import CHECKS, Ending, endings
from cdpr_drake.analyses.studies.scenarios.task import COLUMNS, ScenarioRun
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.scenarios.files import scenario_names

FIGURES = ("endings",)
"""Names of the figures that it can write."""

LEAST_SHARE = 1e-4
"""Smaller shares of what is expected are drawn there."""

APART = 0.14
"""Half of what lies between a scenario's two errors, of the distance of scenarios."""


@dataclass(frozen=True, eq=False)
class ScenariosStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        found: Arrays of the scenarios that are finished, by name, see `ScenarioRun`.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    def statements(self) -> list[Statement]:
        """What had to be shown, and whether it was."""
        return evaluate_checks(CHECKS, self.found, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: of each scenario how it ended, and what its file expects."""
        told: dict[str, Any] = finite(
            {
                "study": "scenarios",
                "quick": self.quick,
                "interrupted": self.interrupted,
                "items": self.progress.counts(),
                "versions": package_versions(),
                "scenarios": {
                    one.name: {
                        **one.numbers,
                        "outcome": one.outcome,
                        "rendered": one.numbers["rendered"] == 1.0,
                        "whole": one.whole,
                        "message": one.message,
                        "expected": None if one.expected is None else asdict(one.expected),
                        "as_expected": one.ends_as_expected(),
                        "close_enough": one.is_close_enough()
                        if one.is_judged_by_errors()
                        else None,
                    }
                    for one in endings(self.found)
                },
                "statements": [statement.as_dict() for statement in self.statements()],
            }
        )
        return told

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = new_table(
            "Scenarios that ship" + (", in short" if self.quick else ""),
            ("scenario", "camera", "ends", "expected"),
            ("at [s]", "distance [mm]", "at most", "angle [deg]", "at most"),
        )
        for one in endings(self.found):
            table.add_row(*_row(one))
        statements = self.statements()
        last = [statement_table("What scenarios have to show", statements)] if statements else []
        return [table, *last]

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """The one figure."""
        return {"endings": lambda: ending_figure(endings(self.found), self.quick)}


def _row(one: Ending) -> list[str]:
    numbers, expected = one.numbers, one.expected
    wrong = "" if one.ends_as_expected() else " (!)"
    far = one.is_judged_by_errors() and not one.is_close_enough()
    return [
        one.name,
        "rendered" if numbers["rendered"] == 1.0 else "not rendered",
        ("cut" if one.is_cut else one.outcome.replace("_", " ")) + wrong,
        "-" if expected is None else expected.outcome.replace("_", " "),
        f"{numbers['time_s']:.2f}",
        f"{1e3 * numbers['distance_m']:.3f}" + (" (!)" if far else ""),
        "-" if expected is None else _most(expected.position, 1e3),
        f"{np.degrees(numbers['angle_rad']):.3f}",
        "-" if expected is None else _most(expected.rotation_deg),
    ]


def _most(value: float | None, scale: float = 1.0) -> str:
    return "-" if value is None else f"{scale * value:g}"


def ending_figure(told: list[Ending], quick: bool) -> Figure:
    """True errors at the end of each scenario as shares of what its file expects at most.

    Raises:
        NothingToDraw: No scenario is finished.
    """
    if not told:
        raise NothingToDraw
    figure, axes = new_figure(
        1, 1, (11.0, 1.6 + 0.24 * len(told)),
        "How scenarios end beside what their files expect" + (", short runs" if quick else ""),
    )  # fmt: skip
    panel, places = axes, np.arange(len(told))
    shares = np.maximum(np.array([one.shares() for one in told]), LEAST_SHARE)
    cut = np.array([one.is_cut for one in told])
    for column, label in enumerate(("distance", "angle")):
        look, apart = nth_look(column), APART * (2 * column - 1)
        style = {"marker": look.marker, "linestyle": "none", "color": look.color}
        panel.plot(shares[~cut, column], places[~cut] + apart, label=label, **style)
        panel.plot(
            shares[cut, column], places[cut] + apart, fillstyle="none",
            label=f"{label}, run cut short" if np.any(cut) else None, **style,
        )  # fmt: skip
    panel.axvline(1.0, color="#303030", linewidth=1.0, linestyle="--", label="largest expected")
    wrong = np.array([not one.ends_as_expected() for one in told])
    panel.plot(
        np.ones(int(wrong.sum())), places[wrong], marker="x", markersize=12, linestyle="none",
        color=nth_look(7).color, label="another outcome" if wrong.any() else None,
    )  # fmt: skip
    panel.set_xscale("log")
    panel.set_yticks(places, [_row_label(one) for one in told])
    panel.set_ylim(-1.0, len(told))
    panel.tick_params(axis="y", labelsize=8)
    panel.invert_yaxis()
    panel.set_xlabel("error at the end, per largest expected one [-]")
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _row_label(one: Ending) -> str:
    if one.is_cut:
        return f"{one.name}: cut at {one.numbers['time_s']:g} s"
    any_error = "" if one.is_judged_by_errors() else ", any error"
    return f"{one.name}: {one.outcome.replace('_', ' ')}{any_error}"


def study_scenarios(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> ScenariosStudy:
    """Runs every scenario that comes with the package; each is an item of a sweep.

    Args:
        quick: Projected targets, and what is long is cut.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    tasks = {name: (ScenarioRun(name, quick), 1) for name in scenario_names()}
    arguments = {
        "cdpr_drake": code_version(),
        "study": "scenarios",
        "quick": quick,
        "columns": list(COLUMNS),
        "scenarios": list(tasks),
    }
    result = run_study_sweep(tasks, 1, "scenarios", arguments, session)
    return ScenariosStudy(quick, result.finished, result.progress)
