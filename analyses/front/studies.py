"""Studies, and the report on everything that was published."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder, results_folder
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import ReportRow, report_rows
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry, StudyResult, write_study
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized

SUMMARY = "summary.json"
"""All rows and counts of the report."""


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction(Summarized):
    """The report on what was published beside what is found.

    Attributes:
        quick: Whether studies were run in their short forms.
        rows: The report, a row for each statement, number or figure.
        states: How far each study is, by name.
        page: The report as a page.
    """

    quick: bool
    rows: Sequence[ReportRow]
    states: Mapping[str, StudyState]
    page: Path

    def as_dict(self) -> dict[str, Any]:
        """All rows and counts for JSON."""
        return {
            "quick": self.quick,
            "code": code_version(),
            "versions": package_versions(),
            "scorecard": Scorecard.of(self.rows).as_dict(),
            "studies": [state.as_dict() for state in self.states.values()],
            "items": [row.as_dict() for row in self.rows],
        }

    def unfinished(self, studies: Sequence[str]) -> list[str]:
        """Of these studies those that were not begun, or stopped."""
        return [name for name in studies if name not in self.states or self.states[name].unfinished]

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        card = Scorecard.of(self.rows)
        total = card.total()
        counts = ", ".join(f"{total[verdict]} {verdict}" for verdict in card.shown())
        failed = [name for name, state in self.states.items() if state.status == "failed"]
        return f"Reproduction by {len(self.states)} studies", [
            ("items", counts or "none"),
            ("failed", ", ".join(failed) or "none"),
            ("report", str(self.page)),
        ]


def studies() -> tuple[str, ...]:
    """Names of the studies, as `run_study` takes them."""
    return tuple(STUDIES)


def run_study(
    name: str,
    folder: Path | str | None = None,
    quick: bool = False,
    *,
    seeds: int | None = None,
    workers: int | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
) -> StudyResult:
    """Runs a study.

    Args:
        name: A name of `studies()`.
        folder: Where results.json and figures are written; None: nowhere. Many studies continue
            there where they were stopped.
        quick: A short form, to see that it works.
        seeds: Runs of each configuration, of studies that repeat; None: as the study does.
        workers: Processes; None: one for each processor.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.

    Returns:
        The study's result, with `as_dict`, `tables`, `write` and `interrupted`.

    Raises:
        CdprError: There is no such study, or it does not repeat.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    entry = chosen_studies([name])[name]
    if seeds is not None and not entry.repeats:
        raise CdprError(f"seeds: found with {name}, which does not repeat; accepted: None")
    if folder is None:
        return entry.run(quick, StudySession(workers=workers, seeds=seeds))
    prepared = continued_folder if entry.continues else results_folder
    with prepared(Path(folder), overwrite) as results:
        result = entry.run(quick, StudySession(results.path, workers=workers, seeds=seeds))
        write_study(result, results.path, formats)
        results.unfinished = result.interrupted
        results.publish()
    return result


def chosen_studies(names: Sequence[str] | None) -> dict[str, StudyEntry]:
    """Studies of these names in the order of the catalogue; None: all.

    Raises:
        CdprError: One is unknown, or none is named.
    """
    if names is None:
        return dict(STUDIES)
    for name in names:
        if name not in STUDIES:
            raise CdprError(f"study {name!r} is unknown; {closest(name, STUDIES)}")
    if not names:
        raise CdprError("studies: found none; accepted: names of studies")
    return {name: entry for name, entry in STUDIES.items() if name in names}


def reproduce(
    folder: Path | str,
    quick: bool = False,
    only: Sequence[str] | None = None,
    *,
    workers: int | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
) -> Reproduction:
    """Runs every study, and writes one report on all that was published beside what is found.

    A study that is finished by the same code is not run again; what was stopped continues.

    Args:
        folder: Where studies and report are written.
        quick: Studies in their short forms.
        only: Names of some studies alone; None: all.
        workers: Processes; None: one for each processor.
        overwrite: Whether other results in the folder may be replaced.
        formats: Endings of the files of figures; png, which the report shows, is always there.

    Raises:
        CdprError: A study is unknown.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    chosen = chosen_studies(only)
    settings = RunSettings(quick, workers, formats=tuple(dict.fromkeys(("png", *formats))))
    with continued_folder(Path(folder), overwrite) as results:
        check_folder(results.path, quick)
        states = run_studies(chosen, results.path, settings)
        found = write_reproduction(results.path, chosen, states, quick)
        results.unfinished = bool(found.unfinished(list(chosen)))
    return found


def write_reproduction(
    folder: Path, studies: Mapping[str, StudyEntry], states: dict[str, StudyState], quick: bool
) -> Reproduction:
    """Writes the report on studies that were run.

    Args:
        folder: Of the reproduction.
        studies: Those that were asked for.
        states: How far each is.
        quick: Whether they were run in their short forms.
    """
    registers = published_registers()
    rows = report_rows(registers, folder, studies, states)
    told = Reproduction(quick, rows, states, folder)
    write_json(folder / SUMMARY, told.as_dict())  # before the page, which is larger
    return Reproduction(quick, rows, states, write_report(folder, registers, rows, states, quick))
