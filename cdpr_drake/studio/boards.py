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

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import Job, JobManager, JobState
from cdpr_drake.studio.verb_form import Verb

RESULTS = ("results.json", "summary.json")
"""Files that have a command's numbers; the first that is there."""

MOST_FOLDERS = 200
"""Results folders that are offered, the newest ones."""

LOOK_PERIOD = 0.4
"""Between two looks at the folders [s]."""

ASKED = ".asked.json"
"""Ending of the file beside a results folder that says by which words it was asked for, so that it
can go on when the server was started anew, and which robot it is about, as it was then."""

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
        asked: Words by which it goes on; empty: nobody knows them, or it is done.
        about: Name and digest of the robot that it is about; empty: not known.
        is_whole: True if all results are there.
        changed: When its numbers were written, in seconds since 1970; 0: there are none.
    """

    folder: Path
    name: str = ""
    job: J | None = None
    asked: tuple[str, ...] = ()
    about: Mapping[str, str] = field(default_factory=dict)
    is_whole: bool = False
    changed: float = 0.0

    def digest(self, robot: str) -> str:
        """Digest of the robot of a name, as it was when this was asked for; empty: not known."""
        return self.about.get("digest", "") if self.about.get("robot") == robot else ""


class VerbJob(Job):
    """A command whose answer becomes the numbers of its folder, where it writes none itself."""

    def __init__(
        self,
        words: Sequence[str],
        working: Path,
        folder: Path,
        asked: Path,
        about: Mapping[str, str],
    ) -> None:
        """Of a command line; the file `asked` says by which words it can go on, until it is done.

        `about` is name and digest of the robot that it is about.
        """
        super().__init__(folder.name, words, working, folder)
        self._asked, self._about = asked, about

    async def _work(self) -> None:
        await super()._work()
        await asyncio.to_thread(self._put_away)

    def _put_away(self) -> None:
        data, folder = self.result(), self.folder
        assert folder is not None
        with suppress(OSError):  # a full disk, say: the page shows what there is
            if data is not None and not has_numbers(folder):  # also of `check`, which fails
                rows = data if isinstance(data, dict) else {self.arguments[0]: data}
                folder.mkdir(parents=True, exist_ok=True)
                (folder / RESULTS[0]).write_text(json.dumps(rows, indent=2), encoding="utf-8")
            if self.state == JobState.FINISHED:
                write_asked(self._asked, (), self._about)
            elif not folder.is_dir():
                self._asked.unlink(missing_ok=True)


def write_asked(path: Path, words: Sequence[str], about: Mapping[str, str]) -> None:
    """Writes by which words a folder beside can go on, none if it is done, and on which robot."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"words": list(words), **about}), encoding="utf-8")


def numbers_file(folder: Path) -> Path | None:
    """The file with a command's numbers; None: it has not finished in that folder."""
    return next((folder / name for name in RESULTS if (folder / name).is_file()), None)


def has_numbers(folder: Path) -> bool:
    """True if a command has finished in a folder."""
    return numbers_file(folder) is not None


class Board(Generic[J]):
    """Results below one folder of the working folder, each with the job that works there.

    Attributes:
        name: Of that folder.
        shown: Key of what is looked at, of `choices`, the name of its folder; empty: nothing.
    """

    def __init__(
        self, jobs: JobManager, root: Path, name: str, kind: type[J],
        is_whole: Callable[[Path], bool] = has_numbers,
    ) -> None:  # fmt: skip
        """With the server's jobs of a kind; `is_whole` tells if all results are in a folder."""
        self._jobs, self._root, self.name = jobs, root, name
        self._kind, self._is_whole = kind, is_whole
        self.shown = ""
        self._left: dict[str, Entry[J]] = {}
        self._looks, self._looked = False, -LOOK_PERIOD

    @property
    def folder(self) -> Path:
        """What all results are below."""
        return self._root / self.name

    def choices(self) -> dict[str, Entry[J]]:
        """What there is, the newest first: jobs of the server, then folders.

        Folders are read by another thread, and are those of the last look.
        """
        if not self._looks and time.monotonic() - self._looked > LOOK_PERIOD:
            self._looks = True
            asyncio.get_running_loop().run_in_executor(None, self._look)
        entries: dict[str, Entry[J]] = {}
        for job in reversed(self._jobs.jobs):
            folder = job.folder
            if isinstance(job, self._kind) and folder and folder.parent == self.folder:
                there = self._left.get(folder.name) or Entry(folder)
                name = f"{folder.name}, {job.state.value}"
                entries.setdefault(folder.name, replace(there, name=name, job=job))
        return entries | {key: one for key, one in self._left.items() if key not in entries}

    def shown_entry(self) -> Entry[J] | None:
        """What is looked at; the newest if that is gone; None: there is nothing."""
        choices = self.choices()
        if self.shown not in choices:
            self.shown = next(iter(choices), "")
        return choices.get(self.shown)

    def _look(self) -> None:
        """Reads what there is in the folders."""
        try:
            self._left = {folder.name: self._read(folder) for folder in self._results()}
        except OSError:
            self._left = {}
        finally:
            self._looks, self._looked = False, time.monotonic()

    def _results(self) -> list[Path]:
        """Folders with results, whole or not, the newest first; none that a link leads to."""
        if not self.folder.is_dir() or self.folder.is_symlink():
            return []
        some = [
            path for path in self.folder.iterdir()
            if not path.is_symlink() and not path.name.startswith(".") and path.is_dir()
            and (self._is_whole(path) or self._beside(path).is_file())
        ]  # fmt: skip
        return sorted(some, key=lambda path: -path.stat().st_mtime)[:MOST_FOLDERS]

    def _read(self, folder: Path) -> Entry[J]:
        asked = _asked(self._beside(folder))
        words = tuple(map(str, asked.pop("words", ())))
        about = {key: str(value) for key, value in asked.items()}
        name = f"{folder.name}, stopped" if words else folder.name
        file = numbers_file(folder)
        return Entry(
            folder, name, asked=words, about=about, is_whole=self._is_whole(folder),
            changed=0.0 if file is None else file.stat().st_mtime,
        )  # fmt: skip

    def _beside(self, folder: Path) -> Path:
        return self.folder / f".{folder.name}{ASKED}"


class VerbBoard(Board[VerbJob]):
    """Commands and their results below one folder."""

    async def start(
        self, verb: Verb, words: Sequence[str], name: str, about: Mapping[str, str]
    ) -> VerbJob:
        """Begins a verb with results in a new folder of a name, and looks at it.

        `words` are those of its form, `about` is name and digest of its robot, if it has one.
        """
        folder = self._jobs.free_folder(self.folder / name)
        with suppress(OSError):  # a full disk, say: the command will tell
            await asyncio.to_thread(write_asked, self._beside(folder), words, about)
        return self._submit(folder, verb, words, about)

    async def go_on(
        self, entry: Entry[VerbJob], verbs: Mapping[str, Verb], folder: WorkingFolder
    ) -> VerbJob:
        """Begins a command anew where it was stopped.

        Raises:
            CdprError: Its words, which a file has, are not such as a form of the page makes.
        """
        verb = verbs.get(entry.asked[0]) if entry.asked else None
        if verb is None or (entry.job is not None and not entry.job.state.is_over):
            raise CdprError(f"{entry.folder.name}: nobody knows how it was asked for, or it works")
        await asyncio.to_thread(verb.accept, entry.asked, folder)
        return self._submit(entry.folder, verb, entry.asked, entry.about)

    def _submit(
        self, folder: Path, verb: Verb, words: Sequence[str],
        about: Mapping[str, str],
    ) -> VerbJob:  # fmt: skip
        out = [f"--out={folder}"] if verb.writes_folder else []
        line = [words[0], *out, "--json", *words[1:]]
        self.shown = folder.name
        return self._jobs.submit(VerbJob(line, self._root, folder, self._beside(folder), about))


def _asked(path: Path) -> dict[str, Any]:
    """What a file beside a folder says; empty: nothing that can be read."""
    with suppress(OSError):
        state = path.lstat()
        return dict(_read(path, state.st_mtime_ns, state.st_size))
    return {}


@lru_cache(maxsize=4 * MOST_FOLDERS)
def _read(path: Path, changed: int, size: int) -> dict[str, Any]:
    """What a file says that was changed last then, and has that size."""
    with suppress(OSError, ValueError):
        if path.is_file() and not path.is_symlink() and size <= LARGEST_FILE:
            data = load_json(path.read_text(encoding="utf-8"))
            if isinstance(data, dict) and isinstance(data.get("words"), list):
                return data
    return {}
