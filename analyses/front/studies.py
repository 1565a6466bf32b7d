"""Studies, and the report on everything that was published."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.table import Table

from cdpr_drake.analyses.front.session import Session, asked_workers
from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reproduction.digest_pdf import DIGEST, write_digest
from cdpr_drake.analyses.reproduction.digest_story import digest_story
from cdpr_drake.analyses.reproduction.older import SUMMARY, read_older
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import ReportRow, report_rows
from cdpr_drake.analyses.reproduction.runner import RunSettings, earlier_words, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import (
    StudyState,
    check_folder,
    check_reproduction,
)
from cdpr_drake.analyses.studies.catalogue import (
    STUDIES,
    StudyEntry,
    StudyResult,
    entry_of,
    studies_that,
    write_study,
)
from cdpr_drake.analyses.studies.framework.study import Study
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.analyses.sweeps.earlier_runs import check_earlier
from cdpr_drake.analyses.sweeps.workers import check_scheduler
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class StudyRun(Summarized):
    """What a study found.

    Attributes:
        name: Of the study.
        result: Its own result, with more than is here.
        folder: Where it was written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
    """

    name: str
    result: StudyResult
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before the end."""
        return self.result.interrupted

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, as `cdpr study --json` prints it."""
        return self.result.as_dict()

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return self.result.tables()

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws its figures, by name; of a study that is all tables none."""
        drawings = getattr(self.result, "drawings", None)
        return {} if drawings is None else drawings()

    def plot(self, name: str | None = None) -> Figure:
        """A figure of the study.

        Args:
            name: Of `drawings`; None: the first.

        Raises:
            CdprError: There is no such figure, or none at all.
        """
        drawings = self.drawings()
        if not drawings:
            raise CdprError(
                f"study {self.name}: has no figures, or nothing to draw; see its tables"
            )
        if name is not None and name not in drawings:
            raise CdprError(f"name: {name!r} is unknown; {closest(name, drawings)}")
        return drawings[next(iter(drawings)) if name is None else name]()

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: how many of its statements hold, its tables and figures."""
        judged = self.as_dict().get("statements") or []
        held = Counter(one["verdict"] for one in judged if "verdict" in one)
        words = ", ".join(f"{count} {verdict}" for verdict, count in held.items())
        titles = [str(table.title) for table in self.tables() if table.title]
        return f"Study {self.name}" + ", interrupted" * self.interrupted, [
            ("statements", words or "none judged"),
            *(("table", title) for title in titles[:4]),
            ("figures", ", ".join(self.drawings()) or "none"),
            ("folder", "none" if self.folder is None else str(self.folder)),
        ]


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


def studies() -> tuple[str, ...]:
    """Names of the studies, as `run_study` takes them."""
    return tuple(STUDIES)


def run_study(
    name: str | Study,
    folder: Path | str | None = None,
    quick: bool = False,
    *,
    seeds: int | None = None,
    recipe: str | None = None,
    workers: int | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    runs_from: Path | str | None = None,
    session: Session | None = None,
) -> StudyRun:
    """Runs a study.

    Args:
        name: A name of `studies()`, or a Study of your own.
        folder: Where results.json and figures are written; None: nowhere. Many studies continue
            there where they were stopped.
        quick: A short form, to see that it works.
        seeds: Runs of each configuration, of studies that repeat; None: as the study does.
        recipe: Another recipe alone, of studies that have some; None: the study.
        workers: Processes, or the address of a Dask scheduler; None: one for each
            processor, started where more than ten seconds of work are left.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        runs_from: Results folder of the same study by an earlier version of the code: runs of cases
            that are asked for alike are taken over, which the results say; None: all are computed.
        session: Who follows the study and may stop it; None: nobody.

    Raises:
        CdprError: There is no such study, it does not repeat, or has not this recipe.
        OutputFolderError: The folder holds other things, or cannot be written, or `runs_from` is
            no folder of this study in this form.
    """
    earlier = None if runs_from is None else Path(runs_from)
    told = session or Session()
    if isinstance(name, str):
        entry = chosen_studies([name])[name]
    else:
        entry, name = entry_of(name), name.name
    count, scheduler = asked_workers(workers)
    if scheduler is not None:
        check_scheduler(scheduler)
    if seeds is not None and not entry.repeats:
        able = studies_that(lambda other: other.repeats)
        raise CdprError(f"seeds: accepted with {able}, not with {name}")
    if earlier is not None:
        if folder is None:
            raise CdprError("runs_from: accepted with a folder")
        check_earlier(earlier, {"quick": quick} if recipe else {"study": name, "quick": quick})
    entry = _by_recipe(name, entry, recipe)

    def run(where: Path | None) -> StudyResult:
        with told.computing():
            return entry.run(
                quick,
                StudySession(where, told.progress, told.stop, count, seeds, scheduler, earlier),
            )

    if folder is None:
        return StudyRun(name, run(None))
    with continued_folder(Path(folder), overwrite) as results:
        told.opened(results)
        result = run(results.path)
        with told.doing("Writing results"):
            failed = write_study(result, results.path, formats)
            results.unfinished = result.interrupted
            where = results.publish()
    if words := earlier_words(result):
        told.say(f"{name}: {words}")
    return StudyRun(name, result, where, failed)


def _by_recipe(name: str, entry: StudyEntry, recipe: str | None) -> StudyEntry:
    """The study, or that of another recipe of it.

    Raises:
        CdprError: It has no recipes, or not this one.
    """
    if recipe is None:
        return entry
    if not entry.recipes:
        able = studies_that(lambda other: bool(other.recipes))
        raise CdprError(f"recipe: accepted with {able}, not with {name}")
    if recipe not in entry.recipes:
        raise CdprError(f"recipe: {recipe!r} is unknown; {closest(recipe, entry.recipes)}")
    return replace(entry, run=entry.recipes[recipe])


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
    return {name: STUDIES[name] for name in STUDIES if name in names}


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
