"""Studies: one is chosen, run and written."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from cdpr_drake.analyses.front.session import Session, asked_workers
from cdpr_drake.analyses.front.verb import verb
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reproduction.runner import earlier_words
from cdpr_drake.analyses.studies.catalogue import (
    STUDIES,
    StudyEntry,
    StudyResult,
    entry_of,
    studies_that,
    write_study,
)
from cdpr_drake.analyses.studies.framework.study import Study
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


def studies() -> tuple[str, ...]:
    """Names of the studies, as `run_study` takes them."""
    return tuple(STUDIES)


@verb()
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
