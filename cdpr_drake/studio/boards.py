"""What a session looks at of one folder of results: jobs of the server, and what others left."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.jobs import Job, JobManager, JobState
from cdpr_drake.studio.results import NOTHING, Subject
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


@dataclass(frozen=True)
class Entry:
    """Results that are there, or come.

    Attributes:
        folder: The results folder.
        name: What people see.
        job: The newest job that works in the folder, as long as the server has it.
        asked: Words by which it goes on; empty: nobody knows them, or it is done; None: nobody
            asked for it here.
        about: The robot that it is about, as it was when this was asked for.
        files: Names of what is in the folder.
        is_whole: True if all results are there.
        changed: When its numbers were written, in seconds since 1970; 0: there are none.
    """

    folder: Path
    name: str = ""
    job: Job | None = None
    asked: tuple[str, ...] | None = None
    about: Subject = NOTHING
    files: frozenset[str] = frozenset()
    is_whole: bool = False
    changed: float = 0.0


def write_asked(path: Path, words: Sequence[str], about: Subject) -> None:
    """Writes by which words a folder beside can go on, none if it is done, and on which robot."""
    data = {"words": list(words), "robot": about.robot, "digest": about.digest}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(data), encoding="utf-8")


def numbers_file(folder: Path) -> Path | None:
    """The file with a command's numbers; None: it has not finished in that folder."""
    return next((folder / name for name in RESULTS if (folder / name).is_file()), None)


class Board:
    """Results below one folder of the working folder, each with the job that works there.

    Attributes:
        folder: What all results are below.
        shown: Key of what is looked at, of `choices`, the name of its folder; empty: nothing.
        entry: What is looked at, by the last `follow`; None: nothing.
    """

    def __init__(self, jobs: JobManager, root: Path, name: str) -> None:
        """With the server's jobs, for the folder of a name in the working folder."""
        self._jobs, self._root, self.folder = jobs, root, root / name
        self.shown = ""
        self.entry: Entry | None = None
        self._left: dict[str, Entry] = {}
        self._looks, self._looked = False, -LOOK_PERIOD

    def choices(self) -> dict[str, Entry]:
        """What there is, the newest first: jobs of the server, then folders.

        Folders are read by another thread, and are those of the last look.
        """
        if not self._looks and time.monotonic() - self._looked > LOOK_PERIOD:
            self._looks = True
            asyncio.get_running_loop().run_in_executor(None, self._look)
        entries: dict[str, Entry] = {}
        for job in reversed(self._jobs.jobs):
            folder = job.folder
            if folder and folder.parent == self.folder and folder.name not in entries:
                there, name = self._left.get(folder.name), f"{folder.name}, {job.state.value}"
                entries[folder.name] = replace(there or Entry(folder), name=name, job=job)
        for key, one in self._left.items():
            if one.is_whole or one.asked is not None:
                entries.setdefault(key, one)
        return entries

    def follow(self) -> dict[str, Entry]:
        """Gives `choices`, and looks at the newest where what was looked at is gone."""
        choices = self.choices()
        if self.shown not in choices:
            self.shown = self.newest(choices)
        self.entry = choices.get(self.shown)
        return choices

    def newest(self, choices: Mapping[str, Entry]) -> str:
        """Key of what is looked at where nothing is chosen; empty: nothing."""
        return next(iter(choices), "")

    def is_whole(self, folder: Path) -> bool:
        """True if all results are in a folder."""
        return numbers_file(folder) is not None

    def _look(self) -> None:
        """Reads what there is in the folders, the newest first; none that a link leads to."""
        left: list[Entry] = []
        with suppress(OSError):
            if self.folder.is_dir() and not self.folder.is_symlink():
                folders = [path for path in self.folder.iterdir() if _is_own(path)]
                folders.sort(key=lambda path: -path.stat().st_mtime)
                left = [self._read(folder) for folder in folders[:MOST_FOLDERS]]
        self._left = {entry.folder.name: entry for entry in left}
        self._looks, self._looked = False, time.monotonic()

    def _read(self, folder: Path) -> Entry:
        asked = _asked(self._beside(folder))
        words = tuple(map(str, asked["words"])) if asked else None
        file = numbers_file(folder)
        return Entry(
            folder, f"{folder.name}, stopped" if words else folder.name, asked=words,
            about=Subject(str(asked.get("robot", "")), str(asked.get("digest", ""))),
            files=frozenset(path.name for path in folder.glob("*")), is_whole=self.is_whole(folder),
            changed=0.0 if file is None else file.stat().st_mtime,
        )  # fmt: skip

    def _beside(self, folder: Path) -> Path:
        return self.folder / f".{folder.name}{ASKED}"

    async def start(self, verb: Verb, words: Sequence[str], name: str, about: Subject) -> Job:
        """Begins a verb, by words of its form about a robot, with results in a new folder of a
        name, and looks at it."""
        folder = self._jobs.free_folder(self.folder / name)
        with suppress(OSError):  # a full disk, say: the command will tell
            await asyncio.to_thread(write_asked, self._beside(folder), words, about)
        return self._submit(folder, verb, words, about)

    async def go_on(self, entry: Entry, verbs: Mapping[str, Verb], folder: WorkingFolder) -> Job:
        """Begins a command anew where it was stopped.

        Raises:
            CdprError: Its words, which a file has, are not such as a form of the page makes.
        """
        words = entry.asked or ()
        verb = verbs.get(words[0]) if words else None
        if verb is None or (entry.job is not None and not entry.job.state.is_over):
            raise CdprError(f"{entry.folder.name}: nobody knows how it was asked for, or it works")
        await asyncio.to_thread(verb.accept, words, folder)
        return self._submit(entry.folder, verb, words, entry.about)

    def _submit(self, folder: Path, verb: Verb, words: Sequence[str], about: Subject) -> Job:
        out = [f"--out={folder}"] if verb.writes_folder else []
        job = Job([words[0], *out, "--json", *words[1:]], self._root, folder)
        job.put_away = partial(_put_away, self._beside(folder), about)
        self.shown = folder.name
        return self._jobs.submit(job)


def _is_own(path: Path) -> bool:
    """True for a folder that is neither hidden nor a link."""
    return path.is_dir() and not path.is_symlink() and not path.name.startswith(".")


def _put_away(path: Path, about: Subject, job: Job) -> None:
    """Writes a command's answer as the numbers of its folder, where it has written none itself.

    The file beside the folder says by which words it can go on, until it is done.
    """
    data, folder = job.result(), job.folder
    assert folder is not None
    with suppress(OSError):  # a full disk, say: the page shows what there is
        if data is not None and numbers_file(folder) is None:  # also of `check`, which fails
            rows = data if isinstance(data, dict) else {job.arguments[0]: data}
            folder.mkdir(parents=True, exist_ok=True)
            (folder / RESULTS[0]).write_text(json.dumps(rows, indent=2), encoding="utf-8")
        if job.state == JobState.FINISHED:
            write_asked(path, (), about)
        elif not folder.is_dir():
            path.unlink(missing_ok=True)


def _asked(path: Path) -> dict[str, Any]:
    """What a file beside a folder says; empty: there is none."""
    if not path.is_file():
        return {}
    with suppress(OSError, ValueError):
        if not path.is_symlink() and path.stat().st_size <= LARGEST_FILE:
            data = load_json(path.read_text(encoding="utf-8"))
            if isinstance(data, dict) and isinstance(data.get("words"), list):
                return data
    return {"words": []}
