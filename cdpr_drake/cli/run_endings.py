"""How runs end: what was kept, what is missing, and the exit code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from rich.console import Console

from cdpr_drake.analyses.reporting.left_folders import KeptFiles, holds_log
from cdpr_drake.analyses.reporting.output_folder import ResultsFolder, shown_path
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.cli.process import INCOMPLETE, INTERRUPTED, StopRequest


def report_recovered(console: Console, results: ResultsFolder) -> None:
    """Says where results of killed runs went that nobody had seen yet."""
    for folder in results.recovered:
        where = shown_path(folder)
        words = f"Found finished results of a run that was killed; they are in {where}"
        if holds_log(folder):
            words = (
                f"Found what a run had simulated that was killed; it is in {where}; cdpr simulate "
                f"--finish {where} makes log, summary and figures of it, --continue goes on"
            )
        console.print(
            words,
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip


NAMED = 3
"""So many files that are kept are named."""


def report_kept_files(console: Console, kept: Iterable[KeptFiles]) -> None:
    """Says which files of a folder whose results were replaced are not of this program, and where
    they are."""
    for names, folder in kept:
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        console.print(
            f"Kept in {shown_path(folder)}: {', '.join(names[:NAMED])}{more}: not written by cdpr "
            "as far as is known, or changed since",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip


def report_failures(
    console: Console, failed: Mapping[str, str], folder: Path, stop: StopRequest | None
) -> int:
    """Names what could not be written, one line each; returns the exit code."""
    for name, why in failed.items():
        console.print(
            f"cdpr: {folder / name}: not written: {why}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
    if failed:
        console.print(f"The data is complete in {folder}", markup=False, highlight=False)
    if stop is not None and stop.asked:
        return INTERRUPTED
    return INCOMPLETE if failed else 0


class SayContinued:
    """Says once, of work of which earlier sessions left some in the folder, that it goes on."""

    def __init__(self, console: Console, folder: Path) -> None:
        """To a console, before anything was said."""
        self._console, self._folder, self._said = console, folder, False

    def __call__(self, progress: WorkProgress) -> None:
        """Says so where there is something, the first time."""
        if not progress.found or self._said:
            return
        self._said = True
        words = f"{self._folder}: complete already, nothing was computed"
        if progress.found != progress.total:
            words = (
                f"Continuing in {self._folder}: {progress.found:.0f} of {progress.total:.0f} "
                f"{progress.items} were there already"
            )
        self._console.print(words)
