"""Starts commands in the working folder, and knows what they left there."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.workbench.command_form import CommandForm
from cdpr_drake.studio.workbench.command_job import CommandJob
from cdpr_drake.studio.workbench.job_manager import JobManager

MOST_FOLDERS = 200
MOST_TOLD = 4 * MOST_FOLDERS
"""Results folders that are offered, the newest ones."""

ASKED = ".asked.json"
"""Ending of the file beside a results folder that says how it was asked for, so that it can go on
when the server was started anew; gone when the work is done."""

ABOUT = ".about.json"
"""Ending of the file beside a results folder that says which robot it is about, as it was then."""

LARGEST_ASKED = 100_000
"""Of such a file that is read [bytes]."""


@dataclass(frozen=True)
class CommandEntry:
    """What a command computes or has computed.

    Attributes:
        name: What people see.
        job: The newest job that works in the folder, as long as the server has it.
        folder: Its results folder.
        asked: Arguments by which it goes on, without --out and --json; empty: nobody knows them,
            or it is done.
        about: Name and digest of the robot that it is about; empty: not known.
        is_whole: Whether all results are there.
    """

    name: str
    job: CommandJob | None
    folder: Path
    asked: tuple[str, ...] = ()
    about: Mapping[str, str] = field(default_factory=dict)
    is_whole: bool = False

    @property
    def key(self) -> str:
        """For lists of choices."""
        return self.folder.name


class CommandBoard:
    """Commands of one kind of a server, with results below one folder.

    Attributes:
        name: Of the folder that all results are below.
        shown: Key of what is looked at, of `choices`; empty: nothing.
    """

    def __init__(
        self,
        jobs: JobManager,
        root: Path,
        below: str,
        forms: Mapping[str, CommandForm],
        *,
        is_whole: Callable[[Path], bool] = lambda folder: (folder / "results.json").is_file(),
    ) -> None:
        """With the server's jobs, the working folder, and the name of a folder in it.

        Args:
            jobs: The jobs.
            root: The working folder.
            below: The name.
            forms: Of the commands that may go on; what a file asks for beyond them is not run.
            is_whole: Whether all results are in a folder.
        """
        self._is_whole = is_whole
        self._jobs, self._root, self.name, self._forms = jobs, root, below, forms
        self.shown = ""

    @property
    def folder(self) -> Path:
        """What all results are below."""
        return self._root / self.name

    def start(
        self, name: str, arguments: Sequence[str], about: Mapping[str, str] | None = None
    ) -> CommandJob:
        """Begins a command with results in a new folder, and looks at it.

        Args:
            name: Of the folder.
            arguments: Of the command, without --out and --json.
            about: Name and digest of the robot that it is about; None: no robot.
        """
        folder = self._jobs.free_folder(self.folder / name)
        with suppress(OSError):  # a full disk, say: the command will tell
            self.folder.mkdir(parents=True, exist_ok=True)
            self._asked(folder).write_text(json.dumps(list(arguments)), encoding="utf-8")
            _TOLD[_state(self._asked(folder))] = list(arguments)
            if about is not None:
                self._about_file(folder).write_text(json.dumps(dict(about)), encoding="utf-8")
                _TOLD[_state(self._about_file(folder))] = dict(about)
        return self._submit(folder, arguments)

    def go_on(self, computed: CommandEntry) -> CommandJob | None:
        """Begins a command anew where it was stopped; None: it works, or nobody knows how it was
        asked for."""
        if not computed.asked or (computed.job is not None and not computed.job.state.is_over):
            return None
        return self._submit(computed.folder, computed.asked)

    def _submit(self, folder: Path, arguments: Sequence[str]) -> CommandJob:
        job = CommandJob(
            folder.name, [*arguments, f"--out={folder}", "--json"], self._root, folder,
            done_with=self._asked(folder),
        )  # fmt: skip
        self._jobs.submit(job)
        self.shown = folder.name
        return job

    def _asked(self, folder: Path) -> Path:
        return self.folder / f".{folder.name}{ASKED}"

    def _about_file(self, folder: Path) -> Path:
        return self.folder / f".{folder.name}{ABOUT}"

    def _about(self, folder: Path) -> dict[str, str]:
        told = _told(self._about_file(folder))
        fits = isinstance(told, dict) and all(isinstance(value, str) for value in told.values())
        return told if fits else {}

    def _how(self, folder: Path) -> tuple[str, ...]:
        """How a folder was asked for; empty where that is not known, or nothing to be run."""
        told = _told(self._asked(folder))
        fits = isinstance(told, list) and all(isinstance(word, str) for word in told)
        return tuple(told) if fits and self._may_run(told) else ()

    def _may_run(self, words: Sequence[str]) -> bool:
        """Whether arguments from a file are such as a page would make."""
        form = self._forms.get(words[0]) if words else None
        if form is None or len(words) < 2 or words[1].startswith("-"):
            return False
        known = words[0] == "study" or words[1] in robot_names() or self._is_inside(words[1])
        return known and form.allows(words[2:], self._is_inside)

    def _is_inside(self, name: str) -> bool:
        """Whether a path leads to something in the working folder, also by links."""
        try:
            return (self._root / name).resolve().is_relative_to(self._root.resolve())
        except (OSError, RuntimeError, ValueError):
            return False

    def choices(self) -> dict[str, CommandEntry]:
        """What there is, the newest first: jobs of the server, then folders."""
        found: dict[str, CommandEntry] = {}
        for job in reversed(self._jobs.jobs):
            if isinstance(job, CommandJob) and job.folder is not None:
                key = job.folder.name
                if job.folder.parent == self.folder and key not in found:
                    words = f"{key}, {job.state.value}"
                    over = job.state.is_over
                    asked = self._how(job.folder) if over else ()
                    found[key] = self._entry(words, job, job.folder, asked)
        for folder in self._results():
            told = [_told(path) for path in (self._about_file(folder), self._asked(folder))]
            if folder.name not in found and _UNREAD not in told:
                asked = self._how(folder)
                words = f"{folder.name}, stopped" if asked else folder.name
                found[folder.name] = self._entry(words, None, folder, asked)
        return found

    def _entry(
        self, words: str, job: CommandJob | None, folder: Path, asked: tuple[str, ...]
    ) -> CommandEntry:
        return CommandEntry(words, job, folder, asked, self._about(folder), self._is_whole(folder))

    def _results(self) -> list[Path]:
        """Folders with results, whole or not, the newest first; none that a link leads to."""
        if not self.folder.is_dir() or self.folder.is_symlink():
            return []
        some = [
            path for path in self.folder.iterdir()
            if not path.is_symlink() and not path.name.startswith(".")
            and path.is_dir()
            and (self._is_whole(path) or self._asked(path).is_file())
        ]  # fmt: skip
        return sorted(some, key=lambda path: -path.stat().st_mtime)[:MOST_FOLDERS]


_UNREAD = object()


def _told(path: Path) -> Any:
    """What a file of JSON beside a folder says; None: nothing that can be read.

    In an event loop it is read by another thread: there it is `_UNREAD` until that is done, and a
    page asks again soon.
    """
    try:
        key = _state(path)
    except OSError:
        return None
    if key not in _TOLD:
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            _read(key)
        else:
            _TOLD[key] = _UNREAD
            loop.run_in_executor(None, _read, key)
    return _TOLD.get(key)


def _state(path: Path) -> tuple[Path, int, int]:
    state = path.lstat()
    return path, state.st_mtime_ns, state.st_size


def _read(key: tuple[Path, int, int]) -> None:
    path, _, size = key
    told = None
    with suppress(OSError, ValueError):
        if path.is_file() and not path.is_symlink() and size <= LARGEST_ASKED:
            told = load_json(path.read_text(encoding="utf-8"))
    if len(_TOLD) > MOST_TOLD:
        _TOLD.pop(next(iter(_TOLD)))
    _TOLD[key] = told


_TOLD: dict[tuple[Path, int, int], Any] = {}
"""What files say by their path and state."""
