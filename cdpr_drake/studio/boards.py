"""What a session looks at of one folder of results: jobs of the server, and what others left."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.jobs import Job, JobManager, JobState
from cdpr_drake.studio.workbench.command_form import CommandForm

MOST_FOLDERS = 200
"""Results folders that are offered, the newest ones."""

LOOK_PERIOD = 0.4
"""Between two looks at the folders [s]."""

ASKED = ".asked.json"
"""Ending of the file beside a results folder that says how it was asked for, so that it can go on
when the server was started anew; gone when the work is done."""

ABOUT = ".about.json"
"""Ending of the file beside a results folder that says which robot it is about, as it was then."""

LARGEST_FILE = 100_000
"""Of such a file that is read [bytes]."""


J = TypeVar("J", bound=Job)


@dataclass(frozen=True)
class Entry(Generic[J]):
    """Results that are there, or come.

    Attributes:
        folder: The results folder.
        name: What people see.
        job: The newest job that works in the folder, as long as the server has it.
        asked: Arguments by which it goes on, without --out and --json; empty: nobody knows them,
            or it is done.
        about: Name and digest of the robot that it is about; empty: not known.
        is_whole: Whether all results are there.
    """

    folder: Path
    name: str = ""
    job: J | None = None
    asked: tuple[str, ...] = ()
    about: Mapping[str, str] = field(default_factory=dict)
    is_whole: bool = False


CommandEntry = Entry[Job]


class Board(Generic[J]):
    """Results below one folder, each with the job that works there.

    Attributes:
        name: Of the folder that all results are below.
        shown: Key of what is looked at, of `choices`, the name of its folder; empty: nothing.
    """

    def __init__(
        self, jobs: JobManager, root: Path, name: str, kind: type[J],
        is_whole: Callable[[Path], bool],
    ) -> None:  # fmt: skip
        """With the server's jobs of a kind and the working folder; `is_whole` says whether all
        results are in a folder."""
        self._jobs, self._root, self.name = jobs, root, name
        self._kind, self._is_whole = kind, is_whole
        self.shown = ""
        self._left: dict[Path, Entry[J]] = {}
        self._looks, self._looked = False, -LOOK_PERIOD

    @property
    def folder(self) -> Path:
        """What all results are below."""
        return self._root / self.name

    def choices(self) -> dict[str, Entry[J]]:
        """What there is, the newest first: jobs of the server, then folders.

        In an event loop folders are read by another thread, and are those of the last look.
        """
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            self._look()
        else:
            if not self._looks and time.monotonic() - self._looked > LOOK_PERIOD:
                self._looks = True
                loop.run_in_executor(None, self._look)
        found: dict[str, Entry[J]] = {}
        for job in reversed(self._jobs.jobs):
            folder = job.folder
            if isinstance(job, self._kind) and folder and folder.parent == self.folder:
                there = self._left.get(folder) or Entry(folder)
                goes_on = job.state in (JobState.FAILED, JobState.STOPPED)
                entry = replace(
                    there, name=f"{folder.name}, {job.state.value}", job=job,
                    asked=there.asked if goes_on else (),
                )  # fmt: skip
                found.setdefault(folder.name, entry)
        for folder, there in self._left.items():
            found.setdefault(folder.name, there)
        return found

    def _look(self) -> None:
        """Reads what there is in the folders."""
        try:
            self._left = {folder: self._read(folder) for folder in self._results()}
        except OSError:
            self._left = {}
        finally:
            self._looks, self._looked = False, time.monotonic()

    def _read(self, folder: Path) -> Entry[J]:
        words, about = (_told(self._beside(folder, ending)) for ending in (ASKED, ABOUT))
        fits = isinstance(words, list) and all(isinstance(word, str) for word in words)
        asked = tuple(words) if fits and self._may_run(words) else ()
        fits = isinstance(about, dict) and all(isinstance(each, str) for each in about.values())
        return Entry(
            folder, f"{folder.name}, stopped" if asked else folder.name, asked=asked,
            about=about if fits else {}, is_whole=self._is_whole(folder),
        )  # fmt: skip

    def _results(self) -> list[Path]:
        """Folders with results, whole or not, the newest first; none that a link leads to."""
        if not self.folder.is_dir() or self.folder.is_symlink():
            return []
        some = [
            path for path in self.folder.iterdir()
            if not path.is_symlink() and not path.name.startswith(".") and path.is_dir()
            and (self._is_whole(path) or self._beside(path, ASKED).is_file())
        ]  # fmt: skip
        return sorted(some, key=lambda path: -path.stat().st_mtime)[:MOST_FOLDERS]

    def _beside(self, folder: Path, ending: str) -> Path:
        return self.folder / f".{folder.name}{ending}"

    def _may_run(self, words: Sequence[str]) -> bool:
        """Whether arguments from a file are such as a page would make."""
        return False


class CommandBoard(Board[Job]):
    """Commands of one kind, which go on in the folder where they were stopped."""

    def __init__(
        self,
        jobs: JobManager,
        root: Path,
        name: str,
        forms: Mapping[str, CommandForm],
        *,
        is_whole: Callable[[Path], bool] = lambda folder: (folder / "results.json").is_file(),
    ) -> None:
        """As the base class; what a file asks for beyond the `forms` of commands is not run."""
        super().__init__(jobs, root, name, Job, is_whole)
        self._forms = forms

    def start(
        self, name: str, arguments: Sequence[str], about: Mapping[str, str] | None = None
    ) -> Job:
        """Begins a command with results in a new folder of that name, and looks at it.

        `arguments` are without --out and --json; `about` is name and digest of its robot.
        """
        folder = self._jobs.free_folder(self.folder / name)
        with suppress(OSError):  # a full disk, say: the command will tell
            self.folder.mkdir(parents=True, exist_ok=True)
            self._beside(folder, ASKED).write_text(json.dumps(list(arguments)), encoding="utf-8")
            if about is not None:
                self._beside(folder, ABOUT).write_text(json.dumps(dict(about)), encoding="utf-8")
        return self._submit(folder, arguments)

    def go_on(self, computed: CommandEntry) -> Job | None:
        """Begins a command anew where it was stopped; None: it works, or nobody knows how it was
        asked for."""
        if not computed.asked or (computed.job is not None and not computed.job.state.is_over):
            return None
        return self._submit(computed.folder, computed.asked)

    def _submit(self, folder: Path, arguments: Sequence[str]) -> Job:
        job = Job(
            folder.name, [*arguments, f"--out={folder}", "--json"], self._root, folder,
            done_with=self._beside(folder, ASKED),
        )  # fmt: skip
        self._jobs.submit(job)
        self.shown = folder.name
        return job

    def _may_run(self, words: Sequence[str]) -> bool:
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


def _told(path: Path) -> Any:
    """What a file of JSON beside a folder says; None: nothing that can be read."""
    try:
        state = path.lstat()
    except OSError:
        return None
    return _read(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=4 * MOST_FOLDERS)
def _read(path: Path, changed: int, size: int) -> Any:
    """What a file says that was changed last then, and has that size."""
    with suppress(OSError, ValueError):
        if path.is_file() and not path.is_symlink() and size <= LARGEST_FILE:
            return load_json(path.read_text(encoding="utf-8"))
    return None
