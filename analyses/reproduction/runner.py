"""Runs studies one after the other, each on all cores; one that fails does not end the others."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.reporting.written_files import claim
from cdpr_drake.analyses.reproduction.states import (
    BEGUN,
    FAILED,
    FINISHED,
    STATES,
    STOPPED,
    StudyState,
    read_results,
    read_state,
    study_folder,
    write_state,
)
from cdpr_drake.analyses.studies.catalogue import StudyEntry, StudyResult, write_study
from cdpr_drake.analyses.sweeps.earlier_runs import EarlierRuns, check_earlier
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.errors import OutputFolderError


@dataclass(frozen=True)
class RunSettings:
    """How studies are run.

    Attributes:
        quick: Whether in their quick form.
        workers: Processes of each; None: one for each processor.
        formats: Endings of the files of each figure; the page shows those in PNG.
        runs_from: Folder of a reproduction whose runs are taken over; None: none.
        tell: Called with the study's name, how many are done, and where it stands.
        say: Called with a line when a study is taken over, run again, finished or failed.
        should_stop: Asked often; True ends what is running, and nothing more is begun.
    """

    quick: bool = False
    workers: int | None = None
    tell: Callable[[str, int, WorkProgress | None], None] = lambda *_: None
    say: Callable[[str], None] = lambda _: None
    should_stop: Callable[[], bool] = lambda: False
    formats: tuple[str, ...] = DEFAULT_FORMATS
    runs_from: Path | None = None


def run_studies(
    studies: Mapping[str, StudyEntry], folder: Path, settings: RunSettings
) -> dict[str, StudyState]:
    """Runs studies; one that is finished by the same code and in the same form is taken over.

    Args:
        studies: What to run, by name.
        folder: A reproduction's, see `check_folder`.
        settings: How.

    Returns:
        How far each is that was begun or taken over.
    """
    states: dict[str, StudyState] = {}
    for number, (name, entry) in enumerate(studies.items()):
        before = read_state(folder, name)
        if before is not None and _is_whole(before, folder, settings):
            states[name] = replace(before, taken_over=True, note="finished before; taken over")
            settings.say(f"{name}: finished before by the same code, taken over")
            continue
        if settings.should_stop():
            continue
        settings.tell(name, number, None)
        states[name] = _run(name, entry, before, folder, _counted(settings, number))
    return states


def _is_whole(state: StudyState, folder: Path, settings: RunSettings) -> bool:
    """Whether a state is that of results which need no more work."""
    return (
        state.status == FINISHED
        and not state.lacks_pictures
        and state.quick == settings.quick
        and state.code == code_version()
        and read_results(folder, state.study) is not None
        and _has_formats(study_folder(folder, state.study), settings.formats)
    )


def _has_formats(folder: Path, formats: Sequence[str]) -> bool:
    """Whether the figures of a study are there in all formats, as far as they are in one."""
    drawn = {path.stem for path in folder.glob("*.png")}
    return all((folder / f"{name}.{ending}").is_file() for name in drawn for ending in formats)


def _counted(settings: RunSettings, number: int) -> RunSettings:
    """Settings whose `tell` knows how many studies are done."""
    tell = settings.tell

    def told(name: str, _: int, progress: WorkProgress | None) -> None:
        tell(name, number, progress)

    return replace(settings, tell=told)


def _run(
    name: str, entry: StudyEntry, before: StudyState | None, folder: Path, settings: RunSettings
) -> StudyState:
    """Runs one study, and keeps how it ended."""
    changed = before is not None and (
        before.code != code_version() or before.quick != settings.quick
    )
    note = ""
    if before is not None and changed:
        note = "run again: the code has changed since it was " + (
            "finished" if before.status == FINISHED else "begun"
        )
    elif before is not None:
        note = f"continued: it was {before.status} before"
    if note:
        settings.say(f"{name}: {note}")
    earlier = 0.0 if before is None or changed else before.seconds
    state = StudyState(name, BEGUN, settings.quick, code_version(), earlier, note)
    write_state(folder, state)
    started = time.perf_counter()
    path = study_folder(folder, name)
    try:
        claim(path, ending="/")
        path.parent.mkdir(exist_ok=True)
        result, failed = _into_folder(name, entry, path, changed, settings)
        status = STOPPED if result.interrupted else FINISHED
        notes = "; ".join(part for part in (note, earlier_words(result)) if part)
        state = replace(state, status=status, error=failed, tables=_tables(result), note=notes)
    except KeyboardInterrupt as problem:  # the second one: what is under way is lost
        state = replace(state, status=STOPPED)
        for words in getattr(problem, "__notes__", ()):
            settings.say(f"{name}: {words}")
    except Exception as problem:
        words = (str(problem) or type(problem).__name__).splitlines()[0][:300]
        state = replace(state, status=FAILED, error=f"{type(problem).__name__}: {words}")
        trace = "".join(traceback.format_exception(problem))
        write_whole(folder / STATES / f"{name}.error.txt", trace)
    state = replace(state, seconds=earlier + time.perf_counter() - started)
    write_state(folder, state)
    settings.say(f"{name}: {state.status} after {state.seconds:.0f} s {state.error}".rstrip())
    return state


def _into_folder(
    name: str, entry: StudyEntry, path: Path, changed: bool, settings: RunSettings
) -> tuple[StudyResult, str]:
    """Runs a study in its folder; returns the result, and why figures are missing, if they are."""

    def told(progress: WorkProgress) -> None:
        settings.tell(name, 0, progress)

    with continued_folder(path, overwrite=changed) as results:
        session = StudySession(
            results.path, told, settings.should_stop, settings.workers,
            earlier=_earlier(name, settings),
        )  # fmt: skip
        result = entry.run(settings.quick, session)
        failed = write_study(result, results.path, settings.formats)
        results.unfinished = result.interrupted
        results.publish()
    for kept in results.kept:
        settings.say(f"{name}: not written by cdpr, or changed since, and kept in {kept.folder}")
    return result, "; ".join(f"{name}: {why}" for name, why in failed.items())[:300]


def _earlier(name: str, settings: RunSettings) -> Path | None:
    """Where earlier runs of a study are; where there are none, that is said."""
    if settings.runs_from is None:
        return None
    path = study_folder(settings.runs_from, name)
    try:
        check_earlier(path, {"study": name, "quick": settings.quick})
    except OutputFolderError as problem:
        settings.say(f"{name}: all is computed: {problem}")
        return None
    return path


def earlier_words(result: StudyResult) -> str:
    """Which runs of a study were computed by earlier code; empty: none."""
    earlier, progress = getattr(result, "earlier", None), getattr(result, "progress", None)
    if not isinstance(earlier, EarlierRuns) or not isinstance(progress, WorkProgress):
        return ""
    return earlier.words()


def _tables(result: StudyResult) -> tuple[dict[str, Any], ...]:
    """A study's tables as words."""
    return tuple(map(_words, result.tables()))


def _words(table: Table) -> dict[str, Any]:
    columns = [[str(cell) for cell in column.cells] for column in table.columns]
    return {
        "title": str(table.title or ""),
        "caption": str(table.caption or ""),
        "columns": [str(column.header) for column in table.columns],
        "rows": [list(row) for row in zip(*columns, strict=True)],
    }
