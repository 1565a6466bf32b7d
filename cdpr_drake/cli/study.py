"""`cdpr study` and `cdpr reproduce`: runs a study, or all, and writes numbers and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import free_folder, shown_path
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.words import (
    Formats,
    Names,
    OutFolder,
    RunsFrom,
    Workers,
    one_of,
    whole,
)
from cdpr_drake.analyses.reporting.tables import frame_table
from cdpr_drake.analyses.studies.report import print_pdf
from cdpr_drake.analyses.studies.report import reproduce as reproduce_all
from cdpr_drake.analyses.studies.study import MOST_SEEDS, STUDIES, Form, arguments_of, run_study
from cdpr_drake.cli.process import INCOMPLETE, INTERRUPTED, STUDY_FAILED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Following = Annotated[Follow, Parameter(parse=False)]


@dataclass(frozen=True, repr=False, kw_only=True)
class Answer(Result):
    """What a command shows of a result that is no `Result` itself.

    Attributes:
        numbers: For JSON.
        printed: Tables of rich, and words.
        words: Sentences on what was missing or stopped.
        code: Exit code.
        failed: Of each file that could not be written, its path and why.
        drawing: Draws it, if it can be drawn.
    """

    numbers: Any
    printed: Sequence[Any] = ()
    words: Sequence[str] = ()
    code: int = 0
    failed: Mapping[str, str] = field(default_factory=dict)
    drawing: Callable[[], Figure] | None = None

    def as_dict(self) -> Any:
        """For JSON."""
        return self.numbers

    def tables(self) -> Sequence[Table]:
        """None that are made of words."""
        return ()

    def lines(self) -> Sequence[str]:
        """Words among what is printed."""
        return [item for item in self.printed if isinstance(item, str)]

    def notes(self) -> Sequence[str]:
        """On what was missing or stopped."""
        return self.words

    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws it."""
        return {} if self.drawing is None else {"result": self.drawing}

    @property
    def exit_code(self) -> int:
        """As the command has it."""
        return self.code

    def show(self, console: Any) -> None:
        """Prints tables and words in their order."""
        for item in self.printed:
            console.print(item, soft_wrap=isinstance(item, str), highlight=False)


def failures(failed: Mapping[str, str], folder: Path | None) -> dict[str, str]:
    """Paths of files that could not be written, and why."""
    return {str(name if folder is None else folder / name): why for name, why in failed.items()}


def study(
    name: Annotated[str, one_of(STUDIES)], /, *, out: OutFolder = None, quick: bool = False,
    seeds: Annotated[int | None, whole(1, MOST_SEEDS)] = None, workers: Workers = None,
    overwrite: bool = False, formats: Formats = ("png",), runs_from: RunsFrom = None,
    recipe: str = "", follow: Following = NOBODY,
) -> Answer:  # fmt: skip
    """Runs a study and writes results.json, tables and figures; Ctrl-C keeps what is finished.

    Run again with the same --out, it continues where it was stopped or killed.

    Args:
        name: Which study.
        out: Results folder; default: one below studies/.
        quick: A short form, to see that it works.
        seeds: How often what depends on chance is measured.
        workers: Processes, or a Dask scheduler whose workers compute, tcp://host:port; default: one
            for each processor, for long work.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
        runs_from: Results folder by an earlier version of the code, whose runs of the same cases
            are taken over; the results say so.
        recipe: Another recipe for the same rows, for studies that have some.
        follow: Who follows.
    """
    usual = Path("studies") / "-".join(filter(None, (name, recipe)))
    folder = out or free_folder(usual, arguments_of(name, Form(quick, seeds, recipe)))
    result = run_study(
        name, folder, quick, seeds=seeds, recipe=recipe, workers=workers, overwrite=overwrite,
        formats=formats, runs_from=runs_from, follow=follow,
    )  # fmt: skip
    tables = [frame_table(title, table) for title, table in result.tables().items()]
    answer = Answer(
        numbers=result.as_dict(), printed=[*tables, f"results: {folder}"],
        words=[f"cdpr: failed: {words}" for words in result.failed.values()],
        code=STUDY_FAILED if result.failed else 0, failed=failures(result.undrawn, folder),
        drawing=result.plot,
    )  # fmt: skip
    if result.stopped:
        words = f"Interrupted; the same command with --out {folder} goes on"
        return replace(answer, code=INTERRUPTED, words=(*answer.words, words))
    return answer


def reproduce(
    *, out: OutFolder = None, quick: bool = False, only: Names | None = None,
    workers: Workers = None, overwrite: bool = False, formats: Formats = ("png",),
    runs_from: RunsFrom = None, against: Path | None = None, pdf: bool = False,
    follow: Following = NOBODY,
) -> Answer:  # fmt: skip
    """Runs every study and writes one page on what sources print beside what is found.

    All studies take hours in their full forms. Finished studies run again only if the code has
    changed. The same command continues an interrupted one. A study that fails does not stop the
    others.

    Args:
        out: Results folder; default: reproduction or reproduction-quick.
        quick: Studies in their short forms, in a quarter of an hour.
        only: Some studies alone, by name, such as case-9,stability-ranges.
        workers: Processes, or a Dask scheduler whose workers compute, tcp://host:port; default: one
            for each processor, for long work.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
        runs_from: Results folder by an earlier version of the code, whose runs of the same cases
            are taken over; the results say so.
        against: Folder of an older report: the new one says which verdicts changed.
        pdf: Print the report into a PDF, too, by a browser of this machine.
        follow: Who follows.
    """
    folder = out or Path("reproduction-quick" if quick else "reproduction")
    chosen = None if only is None else [name for name in only if name]
    report = reproduce_all(
        folder, quick, chosen, workers=workers, overwrite=overwrite, formats=formats,
        runs_from=runs_from, against=against, follow=follow,
    )  # fmt: skip
    unprinted = pdf and print_pdf(report.page) is None
    words = [f"cdpr: study failed: {name}: {why}" for name, why in report.failed.items()]
    code = STUDY_FAILED if report.failed else INCOMPLETE if unprinted else 0
    if unprinted:
        words.append("cdpr: --pdf: no browser here prints; open the page in one and print it")
    if report.left:
        words.append(f"Interrupted; left: {', '.join(report.left)}; the same command goes on")
        code = INTERRUPTED
    table: Any = frame_table(
        "What sources print, beside what is found", report.counts().reset_index()
    )
    return Answer(
        numbers=report.as_dict(), printed=[table, f"report: {shown_path(report.page)}"],
        words=words, code=code, failed=failures(report.undrawn, folder),
    )  # fmt: skip
