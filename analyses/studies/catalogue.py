"""The studies that `cdpr study` knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from rich.table import Table

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import names_of_checks
from cdpr_drake.analyses.studies import (
    closed_loops,
    control_stability,
    design,
    engines,
    fusion,
    identification,
    mobile_robot,
    pick_and_place,
    scenarios,
    schemes,
    stability_ranges,
    stability_shapes,
    tagless,
    tension_methods,
    worked_examples,
    workspaces,
)
from cdpr_drake.analyses.studies.calibration.study import STUDY as CALIBRATION
from cdpr_drake.analyses.studies.case_studies import CASE_STUDIES
from cdpr_drake.analyses.studies.framework.case_definition import Plan, PublishedNumber
from cdpr_drake.analyses.studies.framework.study import Study as FramedStudy
from cdpr_drake.analyses.studies.planning.study import STUDY as PLANNING
from cdpr_drake.analyses.studies.published.recipe_variants import RECIPES
from cdpr_drake.analyses.studies.tension_cases import TENSION_CASES


class StudyResult(Protocol):
    """What a study returns."""

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""

    def tables(self) -> list[Table]:
        """Tables for the terminal."""

    def write(self, folder: Path, formats: Sequence[str] = ...) -> Mapping[str, str] | None:
        """Writes numbers, and after them figures in these formats, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line; None where
            there is none.
        """


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
        repeats: Whether it repeats runs over as many seeds as its session says.
        judges: Names of the statements that it can judge, as its results have them.
        numbers: Printed numbers that it puts beside its own.
        figures: Names of the figures that it can write, without endings.
        recipes: Other recipes by name, each a study of its own, of which only some ask.
    """

    run: Study
    continues: bool = False
    repeats: bool = False
    judges: tuple[str, ...] = ()
    numbers: tuple[PublishedNumber, ...] = ()
    figures: tuple[str, ...] = ()
    recipes: Mapping[str, Study] = field(default_factory=dict)


def entry_of(study: FramedStudy) -> StudyEntry:
    """The entry of a study in the frame."""
    return StudyEntry(
        study,
        continues=True,
        repeats=study.seeds is not None,
        judges=study.names_of_checks(),
        numbers=study.cases.published() if isinstance(study.cases, Plan) else (),
        figures=tuple(study.figures),
    )


STUDIES: dict[str, StudyEntry] = {
    "tension-methods": entry_of(tension_methods.STUDY),
    "worked-examples": entry_of(worked_examples.STUDY),
    **{study.name: entry_of(study) for study in closed_loops.STUDIES},
    "control-stability": replace(
        entry_of(control_stability.STUDY),
        recipes={name: partial(control_stability.study_recipe, recipe=name) for name in RECIPES},
    ),
    "stability-recipes": StudyEntry(
        control_stability.study_recipes,
        continues=True,
        judges=names_of_checks(control_stability.RECIPE_CHECKS),
    ),
    "stability-ranges": entry_of(stability_ranges.STUDY),
    "stability-shapes": entry_of(stability_shapes.STUDY),
    "workspaces": entry_of(workspaces.STUDY),
    "design": entry_of(design.STUDY),
    "engines": entry_of(engines.STUDY),
    "scenarios": entry_of(scenarios.STUDY),
    "planning": entry_of(PLANNING),
    "mobile-robot": entry_of(mobile_robot.STUDY),
    "pick-and-place": entry_of(pick_and_place.STUDY),
    "fusion": entry_of(fusion.STUDY),
    "schemes": entry_of(schemes.STUDY),
    "tagless": entry_of(tagless.STUDY),
    "calibration": entry_of(CALIBRATION),
    "identification": entry_of(identification.STUDY),
    **{study.name: entry_of(study) for study in (*CASE_STUDIES, *TENSION_CASES)},
}
"""Studies by name, in the order in which the command line lists them."""

RESULTS = "results.json"
"""A study's numbers."""


def write_study(result: StudyResult, folder: Path, formats: Sequence[str]) -> dict[str, str]:
    """Writes a study; what fails once its numbers are written is named, and they are kept.

    Returns:
        Of each figure that could not be written, the file and why, in one line.

    Raises:
        Whatever kept the numbers from being written: those of an earlier session that are there
        do not stand for them.
    """
    earlier = _written(folder)
    try:
        return dict(result.write(folder, formats) or {})
    except Exception as problem:
        if _written(folder) in (None, earlier):
            raise
        return {"figures": (str(problem) or type(problem).__name__).splitlines()[0][:300]}


def _written(folder: Path) -> tuple[int, int] | None:
    """Tells one writing of a study's numbers from another; None where there are none."""
    try:
        found = (folder / RESULTS).stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def studies_that(able: Callable[[StudyEntry], bool]) -> str:
    """Names of the studies of which something is so, in words; cases are a family."""
    names = [name for name, entry in STUDIES.items() if able(entry)]
    cases = [name for name in STUDIES if name.startswith("case-")]
    if cases and all(name in names for name in cases):
        names = [*(name for name in names if name not in cases), "case-*"]
    *most, last = names or ["no study"]
    return f"{', '.join(most)} and {last}" if most else last
