"""The studies that `cdpr study` knows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from rich.table import Table

from cdpr_drake.analyses.case_studies import run_case_study
from cdpr_drake.analyses.reporting import StudySession
from cdpr_drake.analyses.studies.calibration import study_calibration
from cdpr_drake.analyses.studies.cases import CASE_STUDIES
from cdpr_drake.analyses.studies.closed_loops import study_closed_loop
from cdpr_drake.analyses.studies.control_stability import study_control_stability
from cdpr_drake.analyses.studies.design import study_design
from cdpr_drake.analyses.studies.engines import study_engines
from cdpr_drake.analyses.studies.mobile_robot import study_mobile_robot
from cdpr_drake.analyses.studies.planning import study_planning
from cdpr_drake.analyses.studies.stability_ranges import study_stability_ranges
from cdpr_drake.analyses.studies.tension_cases import TENSION_CASES
from cdpr_drake.analyses.studies.tension_methods import study_tension_methods
from cdpr_drake.analyses.studies.workspaces import study_workspaces
from cdpr_drake.stability import SCHEMES


class StudyResult(Protocol):
    """What a study returns."""

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""

    def tables(self) -> list[Table]:
        """Tables for the terminal."""

    def write(self, folder: Path, formats: Sequence[str] = ...) -> None:
        """Writes numbers, and figures in these formats, into a folder that exists."""


class Study(Protocol):
    """What runs a study."""

    def __call__(self, quick: bool, session: StudySession) -> StudyResult:
        """Runs it."""


@dataclass(frozen=True)
class StudyEntry:
    """A study and how it uses its folder.

    Attributes:
        run: What runs it.
        continues: Whether it works in its folder from the start, by `run_study_sweep`, and
            continues when it is run again; otherwise the folder appears at the end.
        spreads: Whether workers of a cluster can do its work.
        repeats: Whether it repeats runs over as many seeds as its session says.
    """

    run: Study
    continues: bool = False
    spreads: bool = True
    repeats: bool = False


STUDIES: dict[str, StudyEntry] = {
    "tension-methods": StudyEntry(study_tension_methods, spreads=False),
    "stability-closed-loop": StudyEntry(study_closed_loop, continues=True),
    **{
        f"stability-closed-loop-{scheme}": StudyEntry(
            partial(study_closed_loop, scheme=scheme), continues=True
        )
        for scheme in SCHEMES
        if scheme != "pbvs"
    },
    "control-stability": StudyEntry(study_control_stability, continues=True),
    "stability-ranges": StudyEntry(study_stability_ranges, continues=True),
    "workspaces": StudyEntry(study_workspaces, continues=True),
    "design": StudyEntry(study_design, continues=True),
    "engines": StudyEntry(study_engines, continues=True),
    "planning": StudyEntry(study_planning, continues=True),
    "mobile-robot": StudyEntry(study_mobile_robot, continues=True, repeats=True),
    "calibration": StudyEntry(study_calibration, continues=True, repeats=True),
    **{
        case.name: StudyEntry(partial(run_case_study, case), continues=True, repeats=True)
        for case in (*CASE_STUDIES, *TENSION_CASES)
    },
}
"""Studies by name, in the order in which the command line lists them."""


def studies_that(able: Callable[[StudyEntry], bool]) -> str:
    """Names of the studies of which something is so, in words; cases are a family."""
    names = [name for name, entry in STUDIES.items() if able(entry)]
    cases = [name for name in STUDIES if name.startswith("case-")]
    if cases and all(name in names for name in cases):
        names = [*(name for name in names if name not in cases), "case-*"]
    *most, last = names or ["no study"]
    return f"{', '.join(most)} and {last}" if most else last
