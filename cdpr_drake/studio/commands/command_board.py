"""Starts commands in the working folder, and knows what they left there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cdpr_drake.studio.jobs import CommandJob, JobManager

MOST_FOLDERS = 200
"""Results folders that are offered, the newest ones."""


@dataclass(frozen=True)
class Computed:
    """What a command computes or has computed.

    Attributes:
        name: What people see.
        job: The newest job that works in the folder, as long as the server has it.
        folder: Its results folder.
    """

    name: str
    job: CommandJob | None
    folder: Path

    @property
    def key(self) -> str:
        """For lists of choices."""
        return self.folder.name

    @property
    def is_whole(self) -> bool:
        """Whether all results are there."""
        return (self.folder / "results.json").is_file()


class CommandBoard:
    """Commands of one kind of a server, with results below one folder.

    Attributes:
        name: Of the folder that all results are below.
        shown: Key of what is looked at, of `choices`; empty: nothing.
    """

    def __init__(self, jobs: JobManager, root: Path, below: str) -> None:
        """With the server's jobs, the working folder, and the name of a folder in it."""
        self._jobs, self._root, self.name = jobs, root, below
        self.shown = ""

    @property
    def folder(self) -> Path:
        """What all results are below."""
        return self._root / self.name

    def start(self, name: str, arguments: Sequence[str]) -> CommandJob:
        """Begins a command with results in a new folder, and looks at it.

        Args:
            name: Of the folder.
            arguments: Of the command, without --out and --json.
        """
        folder = self._jobs.free_folder(self.folder / name)
        job = CommandJob(folder.name, [*arguments, f"--out={folder}", "--json"], self._root, folder)
        self._jobs.submit(job)
        self.shown = folder.name
        return job

    def go_on(self, computed: Computed) -> CommandJob | None:
        """Begins a command anew where it was stopped; None: nobody knows how it was asked for."""
        if computed.job is None or not computed.job.state.is_over:
            return None
        job = CommandJob(computed.folder.name, computed.job.arguments, self._root, computed.folder)
        return self._jobs.submit(job)

    def choices(self) -> dict[str, Computed]:
        """What there is, the newest first: jobs of the server, then folders."""
        found: dict[str, Computed] = {}
        for job in reversed(self._jobs.jobs):
            if isinstance(job, CommandJob) and job.folder is not None:
                key = job.folder.name
                if job.folder.parent == self.folder and key not in found:
                    found[key] = Computed(f"{key}, {job.state.value}", job, job.folder)
        for folder in self._results():
            found.setdefault(folder.name, Computed(folder.name, None, folder))
        return found

    def _results(self) -> list[Path]:
        """Folders with results, the newest first; none that a link leads to."""
        if not self.folder.is_dir() or self.folder.is_symlink():
            return []
        some = [
            path for path in self.folder.iterdir()
            if not path.is_symlink() and not path.name.startswith(".")
            and (path / "results.json").is_file()
        ]  # fmt: skip
        return sorted(some, key=lambda path: -path.stat().st_mtime)[:MOST_FOLDERS]
