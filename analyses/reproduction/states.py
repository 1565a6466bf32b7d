"""How far each study of a reproduction is, kept beside its results."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.written_files import JOURNAL, MARKER, claim, mark, whole_name
from cdpr_drake.analyses.studies.catalogue import RESULTS
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

STUDIES, STATES, ABOUT = "studies", "states", "reproduction.json"
"""Folders of the studies' results and states, and file of what the reproduction is."""

BEGUN, FINISHED, STOPPED, FAILED = "begun", "finished", "stopped", "failed"
"""What a state says; BEGUN is left behind by what was killed."""


@dataclass(frozen=True)
class StudyState:
    """How far a study is.

    Attributes:
        study: Its name.
        status: BEGUN, FINISHED, STOPPED or FAILED.
        quick: Whether it is the quick form.
        code: Version of the code, see `reporting.provenance.code_version`.
        seconds: Wall time of all sessions [s].
        note: What happened to earlier results, such as that the code has changed.
        error: What went wrong, in a line.
        tables: Its tables: title, caption, columns, rows of words.
        taken_over: Whether this session found it finished.
    """

    study: str
    status: str
    quick: bool
    code: str
    seconds: float = 0.0
    note: str = ""
    error: str = ""
    tables: tuple[dict[str, Any], ...] = ()
    taken_over: bool = field(default=False, compare=False)

    @property
    def unfinished(self) -> bool:
        """Whether it was stopped or killed, and goes on when it is run again."""
        return self.status in (BEGUN, STOPPED)

    @property
    def lacks_pictures(self) -> bool:
        """Whether its data is complete and figures could not be written, as on a full disk."""
        return self.status == FINISHED and bool(self.error)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, without the tables."""
        return {key: value for key, value in asdict(self).items() if key != "tables"}


def study_folder(folder: Path, study: str) -> Path:
    """Where a study's results are in a reproduction's folder."""
    return folder / STUDIES / study


def write_state(folder: Path, state: StudyState) -> None:
    """Keeps a state; the file appears whole or not at all."""
    path = folder / STATES / f"{state.study}.json"
    claim(path)  # so that its folder is known, too
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, finite(asdict(state)))


def read_state(folder: Path, study: str) -> StudyState | None:
    """The state of a study; None where there is none that can be read."""
    path = folder / STATES / f"{study}.json"
    try:
        content = load_json(path.read_text(encoding="utf-8"))
        return StudyState(**{**content, "tables": tuple(content["tables"]), "taken_over": False})
    except (OSError, ValueError, KeyError, TypeError):
        return None


def read_results(folder: Path, study: str) -> dict[str, Any] | None:
    """A study's numbers; None where there are none that can be read."""
    path = study_folder(folder, study) / RESULTS
    try:
        content: Any = load_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def check_reproduction(folder: Path, quick: bool) -> None:
    """Finds a folder to be a reproduction's in a form.

    Args:
        folder: The folder.
        quick: Whether the quick form is asked for.

    Raises:
        OutputFolderError: It is none, or one of the other form.
    """
    about = folder / ABOUT
    if not about.is_file():
        raise OutputFolderError(f"{folder}: found no reproduction; accepted: one of cdpr reproduce")
    try:
        before = bool(load_json(about.read_text(encoding="utf-8"))["quick"])
    except (ValueError, KeyError, TypeError) as problem:
        raise OutputFolderError(f"{about}: found no JSON of a reproduction") from problem
    if before != quick:
        words = {True: "the quick form", False: "the full form"}
        raise OutputFolderError(
            f"{folder}: holds a reproduction in {words[before]}, {words[quick]} is asked for; "
            "name another folder or allow overwrite"
        )


def check_folder(folder: Path, quick: bool) -> None:
    """Makes the folder of a reproduction, or finds it to be one of the same form.

    Args:
        folder: Where results go; its parent exists.
        quick: Whether the quick form is asked for.

    Raises:
        OutputFolderError: It is a file, holds what this program did not write or a reproduction of
            the other form, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputFolderError(f"{folder}: found a file; accepted: a folder")
    if (folder / ABOUT).is_file():
        check_reproduction(folder, quick)
        return
    # By who was killed at once.
    begun = [path.name for path in folder.iterdir()] if folder.is_dir() else []
    own = (MARKER, ABOUT)
    if any(name not in (MARKER, JOURNAL) and whole_name(name) not in own for name in begun):
        raise OutputFolderError(
            f"{folder}: holds files that cdpr reproduce did not write; name another folder"
        )
    try:
        folder.mkdir(exist_ok=True)
        mark(folder)
        write_json(folder / ABOUT, {"quick": quick})
    except OSError as problem:
        raise OutputFolderError(f"{folder}: cannot be written: {problem.strerror}") from problem
