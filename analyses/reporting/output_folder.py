"""Results folders: finished data gets its name at once, and nothing foreign is deleted."""

from __future__ import annotations

import errno
import json
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drake.analyses.reporting.folder_lock import free_folder, locked
from cdpr_drake.analyses.reporting.left_folders import (
    BEFORE,
    FINISHED,
    RESULTS,
    KeptFiles,
    clear_hidden,
    remove_older,
    sibling_folder,
)
from cdpr_drake.analyses.reporting.written_files import (
    DRAWING,
    MARKER,
    WORK,
    WritingFolder,
    claim,
    list_all,
    mark,
    others_in,
    whole_file,
    writing,
)
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.input_files import inputs_held
from cdpr_drake.schema.json_text import load_json

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What fails when a file is written that was opened before, and then has no name."""


class ResultsFolder:
    """A results folder in the making.

    Attributes:
        path: Where to write now: a hidden folder until `publish`, then the final one.
        recovered: Where finished results of killed commands were put that nobody had seen yet.
        kept: What of older results was not this program's, once they are replaced.
        redone: Whether older results are those that ended while their pictures were drawn.
    """

    def __init__(
        self, work: Path, final: Path, recovered: list[Path], files: WritingFolder
    ) -> None:
        """With the hidden folder and the final one, and the list of the former's files."""
        self.path, self.recovered = work, recovered
        self.kept: list[KeptFiles] = []
        self.redone = False
        self._final, self._files = final, files

    @property
    def final(self) -> Path:
        """The final folder, whether or not it is there yet."""
        return self._final

    @property
    def published(self) -> bool:
        """Whether what was written has its final name."""
        return self.path == self._final

    def publish(self) -> Path:
        """Gives what was written its final name, in the place of older results; returns the path.

        Raises:
            OutputFolderError: The folder cannot be written, or holds something by now.
        """
        if self.published:
            return self.path
        try:
            self.path.chmod(0o755)
            _tell_inputs(self.path)
            list_all(self.path)
            before = None
            if self._final.exists():
                if not _replaceable(self._final):
                    raise OutputFolderError(
                        f"{self._final}: holds files by now that cdpr did not write; the results "
                        f"are in {self._keep()}"
                    )
                before = self._put_aside()
            self.path.rename(self._final)
            self._files.shown_as(self._final)
            other = self.redone and before is not None and not _same_asked(before, self._final)
            if before is not None and other:
                _rename_own(before, sibling_folder(self._final))
            elif before is not None:
                self.replace(before)
        except OSError as problem:
            raise OutputFolderError(
                f"{self._final}: cannot be written: {problem.strerror}; the results are in "
                f"{self._keep()}"
            ) from problem
        self.path = self._final
        return self.path

    def _put_aside(self) -> Path:
        """Renames older results, to a name that can be seen if others' files are among them."""
        hidden = self._final.with_name(f".{self._final.name}{BEFORE}{os.getpid()}")
        if others_in(self._final):
            return self._final.rename(sibling_folder(self._final, "kept"))
        return _rename_own(self._final, hidden)

    def replace(self, before: Path) -> None:
        """Removes older results; what among them is not this program's is kept, and named."""
        self.kept += remove_older(before, self._final)

    def _keep(self, what: str = "results") -> Path:
        """Gives results that cannot have their own name another one that can be seen."""
        other = free_folder(self._final.with_name(f"{self._final.name}-{what}"))
        try:
            self.path.chmod(0o755)
            list_all(self.path)
            self.path.rename(other)
            self._files.shown_as(other)
        except OSError:
            return self.path
        self._final = self.path = other
        return other


def _rename_own(folder: Path, name: Path) -> Path:
    """Renames results of this program, also for a results folder that they lie in."""
    claim(name, ending="/")
    return folder.rename(name)


@contextmanager
def results_folder(
    folder: Path, overwrite: bool = False, redo: bool = False
) -> Iterator[ResultsFolder]:
    """A fresh hidden folder to write to, which gets its name when its data is finished.

    Entering it before a long computation finds out in time whether results can be written. Where
    the block ends without `publish` and without an error, it is published; where it ends by an
    error before, nothing is left; after it, all is kept. Hidden folders that killed runs left
    behind are removed, or shown where they hold finished data.

    Args:
        folder: Where the results shall be.
        overwrite: Whether results of this program that are there already may be replaced.
        redo: Whether those may be that ended while their pictures were drawn, which are the same
            where the same was asked; of what was asked otherwise they are kept as NAME-before.

    Raises:
        OutputFolderError: The folder holds something, is a file, a mount point, the working folder
            or one above it, cannot be written, or another run is writing it.
    """
    final = _checked(folder)
    if final.exists():
        if not final.is_dir():
            raise OutputFolderError(f"{final}: found a file; accepted: a folder")
        redo = redo and not overwrite and (final / DRAWING).is_file()
        if any(final.iterdir()) and not (overwrite or redo):
            raise OutputFolderError(
                f"{final}: holds files already; name another folder, or add overwrite"
            )
        _check_replaceable(final)
    made = [parent for parent in final.parents if not parent.exists()]
    try:
        final.parent.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        _remove_empty(made)
        raise OutputFolderError(f"{final}: cannot be written: {problem.strerror}") from problem
    work = None
    try:
        with locked(final):
            recovered, kept = clear_hidden(final)
            try:
                work = final.with_name(f".{final.name}{WORK}{secrets.token_hex(4)}")
                claim(work, ending="/")
                work.mkdir(0o700)
                mark(work)
            except OSError as problem:
                if work is not None:  # made, and the disk was full for what is in it
                    shutil.rmtree(work, ignore_errors=True)
                raise OutputFolderError(
                    f"{final}: cannot be written: {problem.strerror}"
                ) from problem
            with writing(work, hidden=True) as files:
                results = ResultsFolder(work, final, recovered, files)
                results.kept += kept
                results.redone = redo
                try:
                    yield results
                    results.publish()
                except BaseException as problem:
                    if isinstance(problem, OSError):
                        _name_folder(problem, results)
                    _say_left(problem, results)
                    raise
    except BaseException:
        _remove_empty(made)
        raise


def _say_left(problem: BaseException, results: ResultsFolder) -> None:
    """Notes where what was finished is, and removes what is not."""
    if not results.published and (results.path / RESULTS).is_file():
        problem.add_note(f"what was finished is in {results.publish()}")
    elif not results.published:
        shutil.rmtree(results.path, ignore_errors=True)


def _name_folder(problem: OSError, results: ResultsFolder) -> None:
    """Says which folder a full disk is under: what fails when written has no name of its own.

    A file of the folder in the making is named as it would have been called.
    """
    if problem.errno in FULL and not problem.filename:
        problem.filename = str(results.final)
    elif problem.filename and Path(str(problem.filename)).is_relative_to(results.path):
        inside = Path(str(problem.filename)).relative_to(results.path)
        problem.filename = str(results.final / inside)


def _checked(folder: Path) -> Path:
    """The folder without links and dots, if results may ever be put there."""
    try:
        final, here = folder.resolve(), Path.cwd().resolve()
    except (OSError, RuntimeError) as problem:
        raise OutputFolderError(f"{folder}: cannot be found: {problem}") from problem
    if final == here or final in here.parents:
        raise OutputFolderError(
            f"{folder}: found the working folder or one above it; accepted: another folder"
        )
    if os.path.ismount(final):
        raise OutputFolderError(f"{folder}: found a mount point; accepted: a folder in it")
    return final


def _replaceable(folder: Path) -> bool:
    """Whether a folder is empty or was written by this program."""
    return (folder / MARKER).is_file() or not any(folder.iterdir())


def _check_replaceable(final: Path) -> None:
    """Refuses to replace what others wrote."""
    if not _replaceable(final):
        raise OutputFolderError(
            f"{final}: holds files that cdpr did not write, which are never replaced; name "
            "another folder"
        )


def _remove_empty(folders: list[Path]) -> None:
    """Removes folders, the deepest first, that exist and hold nothing."""
    for folder in folders:
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()


INPUTS = "inputs.json"
"""Which files of users the results follow from, with their SHA-256 and sizes [byte]."""


IDENTIFIED = "identification.json"
"""What identifications have in the place of summary or results."""


def _tell_inputs(folder: Path) -> None:
    """Writes `INPUTS`, where files of users were read; not of files that the folder has itself."""
    held = inputs_held()
    hashes = {} if held is None else held.hashes(folder)
    if hashes and folder.is_dir():
        with whole_file(folder / INPUTS) as part:
            part.write_text(json.dumps(hashes, indent=2) + "\n", encoding="utf-8")


def _same_asked(one: Path, other: Path) -> bool:
    """Whether two folders have the same arguments, or, where none are told, the same numbers."""
    found = [_told(folder) for folder in (one, other)]
    return bool(found[0]) and found[0] == found[1]


def _told(folder: Path) -> object:
    """What was asked, or all that was found but for how long it took; None: nothing is told."""
    for name in (*FINISHED, IDENTIFIED):
        try:
            told = load_json((folder / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(told, dict):
            return told.get("arguments") or {k: v for k, v in told.items() if k != "wall_time_s"}
    return None
