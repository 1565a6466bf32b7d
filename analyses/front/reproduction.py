"""The report on everything that was published, by all studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.front.studies import chosen_studies
from cdpr_drake.analyses.front.verb import verb
from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reproduction.digest_pdf import DIGEST, write_digest
from cdpr_drake.analyses.reproduction.digest_story import digest_story
from cdpr_drake.analyses.reproduction.older import SUMMARY, read_older
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import ReportRow, report_rows
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import (
    StudyState,
    check_folder,
    check_reproduction,
)
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class StudyOfMany(NamedTuple):
    """How far a reproduction is.

    Attributes:
        name: The study that runs.
        number: How many came before it.
        of: How many there are.
        progress: Where it stands; None: it begins.
    """

    name: str
    number: int
    of: int
    progress: WorkProgress | None


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction(Summarized):
    """The report on what was published beside what is found.

    Attributes:
        quick: Whether studies were run in their short forms.
        rows: The report, a row for each statement, number or figure.
        states: How far each study is, by name.
        page: The report as a page.
        left: Studies that were not begun, or stopped.
        digest: Its digest of about twelve pages; None where it could not be written.
        failed: Of each file of the report that could not be written, and is not the page, why.
    """

    quick: bool
    rows: Sequence[ReportRow]
    states: Mapping[str, StudyState]
    page: Path
    left: tuple[str, ...] = ()
    digest: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

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

    def plot(self) -> Figure:
        """How many items of each chapter came out how."""
        from cdpr_drake.analyses.reproduction.scorecard import scorecard_figure

        return scorecard_figure(Scorecard.of(self.rows), published_registers(), self.quick)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        card = Scorecard.of(self.rows)
        total = card.total_facts()
        counts = ", ".join(f"{count} {verdict}" for verdict, count in total.items())
        failed = [name for name, state in self.states.items() if state.status == "failed"]
        return f"Reproduction by {len(self.states)} studies", [
            ("facts", counts or "none"),
            ("failed", ", ".join(failed) or "none"),
            ("report", str(self.page)),
            ("digest", str(self.digest or f"not written: {'; '.join(self.failed.values())}")),
        ]


@verb()
def reproduce(
    folder: Path | str,
    quick: bool = False,
    only: Sequence[str] | None = None,
    *,
    workers: int | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    runs_from: Path | str | None = None,
    beside: Path | str | None = None,
    session: Session | None = None,
) -> Reproduction:
    """Runs every study, and writes one report on all that was published beside what is found.

    A study that is finished by the same code is not run again; what was stopped continues. A
    digest as PDF is written after the page, by reportlab (extra `report`); where that is not
    installed, or fails, the rest is there all the same.

    Args:
        folder: Where studies and report are written.
        quick: Studies in their short forms.
        only: Names of some studies alone; None: all.
        workers: Processes; None: one for each
            processor, started where more than ten seconds of work are left.
        overwrite: Whether other results in the folder may be replaced.
        formats: Endings of the files of figures; png, which the report shows, is always there.
        runs_from: Folder of a reproduction by an earlier version of the code: its runs are taken
            over where a study's cases are asked for alike, which the report says; None: all are
            computed.
        beside: Folder of an older reproduction, or its summary.json, whose counts the report shows
            beside its own; None: none.
        session: Who follows it, told of a `StudyOfMany`, and may stop it; None: nobody.

    Raises:
        CdprError: A study is unknown.
        OutputFolderError: The folder holds other things, or cannot be written; or there is no
            older report where one is named.
    """
    chosen, told = chosen_studies(only), session or Session()
    # Before anything is written: it may be the report that stands in the same folder.
    older = None if beside is None else read_older(Path(beside))

    def tell(name: str, number: int, progress: WorkProgress | None) -> None:
        told.progress(StudyOfMany(name, number, len(chosen), progress))

    wanted = tuple(dict.fromkeys(("png", *formats)))
    before = None if runs_from is None else Path(runs_from)
    if before is not None:
        check_reproduction(before, quick)
    settings = RunSettings(quick, workers, tell, told.say, told.stop, wanted, before)
    with continued_folder(Path(folder), overwrite) as results:
        check_folder(results.path, quick)
        told.opened(results)
        with told.computing():
            states = run_studies(chosen, results.path, settings)
        with told.doing("Writing the report"):
            registers = published_registers()
            rows = report_rows(registers, results.path, chosen, states)
            found = Reproduction(quick, rows, states, results.path)
            write_json(results.path / SUMMARY, found.as_dict())  # before the page, which is larger
            page = write_report(results.path, registers, rows, states, quick, older)

            def digest(path: Path) -> None:
                story = digest_story(results.path, registers, rows, states, quick, older)
                write_digest(path, story)

            failed = write_pictures(results.path, {DIGEST: digest})
            left = tuple(n for n in chosen if n not in states or states[n].unfinished)
            results.unfinished = bool(left)
    where = None if failed else results.path / DIGEST
    return replace(found, page=page, left=left, digest=where, failed=failed)
