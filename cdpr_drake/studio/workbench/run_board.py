"""Which run a session looks at, and what it asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_drake.studio.finished_run import FinishedRun, is_run
from cdpr_drake.studio.workbench.command_job import CommandJob
from cdpr_drake.studio.workbench.job_manager import JobManager
from cdpr_drake.studio.workbench.run_job import RunJob
from cdpr_drake.studio.workbench.scenario_draft import ScenarioDraft
from cdpr_drake.systems.diagrams.load import load_scenario

RUNS = "runs"
"""Folder of results in the working folder, as that of `cdpr simulate`."""

MOST_FOLDERS = 200
"""Results folders that are offered, the newest ones."""


@dataclass(frozen=True)
class RunEntry:
    """A run to look at.

    Attributes:
        name: What people see.
        job: The job, as long as the server has it.
        folder: Its results folder.
    """

    name: str
    job: RunJob | None
    folder: Path

    def scenario(self) -> Any | None:
        """Its scenario; None: it is not known any more.

        Raises:
            CdprError: It is not accepted any more.
        """
        file = self.folder / "scenario.yaml"
        if file.is_file():
            return load_scenario(file)
        return None if self.job is None else load_scenario(self.job.scenario, self.job.settings)


class RunBoard:
    """What the run panel of a session shows; all its tabs show the same.

    Attributes:
        draft: The scenario that is worked on; None: none was chosen.
        shown: Key of the run that is looked at, of `choices`; empty: none.
        compared: Key of the run behind it; empty: none.
        speed: Speed of the next run; None: as fast as possible.
        cursor: Time that is looked at in a finished run [s]; None: none.
    """

    def __init__(self, jobs: JobManager, root: Path) -> None:
        """With the jobs of the server and the working folder."""
        self._jobs, self._root = jobs, root
        self.draft: ScenarioDraft | None = None
        self.shown, self.compared = "", ""
        self.speed: float | None = 1.0
        self.cursor: float | None = None
        self._finished: dict[Path, FinishedRun] = {}

    def choose(self, scenario: str) -> ScenarioDraft:
        """Works on a scenario from now on; changes of the same one are kept.

        Raises:
            CdprError: It is not accepted.
        """
        if self.draft is None or self.draft.name != scenario:
            self.draft = ScenarioDraft(scenario, self._root)
        return self.draft

    def start(self, *, paused: bool = False, by_hand: bool = False) -> RunJob:
        """Begins a run of the draft, and looks at it.

        Args:
            paused: Whether it stands at the start.
            by_hand: Whether cables can be broken and the platform pushed while it runs.

        Raises:
            CdprError: The draft is not accepted.
        """
        assert self.draft is not None
        scenario = self.draft.check()
        folder = self._jobs.free_folder(self._root / RUNS / scenario.name)
        job = RunJob(
            self.draft.name, self._root, folder,
            settings=(*self.draft.settings(), *(self.draft.by_hand() if by_hand else ())),
            speed=self.speed, paused=paused,
        )  # fmt: skip
        self._jobs.submit(job)
        self.shown, self.cursor = key_of(job), None
        return job

    def recover(self, job: RunJob) -> CommandJob:
        """Writes results of a run that was killed, as far as it was simulated."""
        assert job.folder is not None
        title = f"{job.title}: results of what there is"
        arguments = ["finish", str(job.folder), "--json"]
        return self._jobs.submit(CommandJob(title, arguments, self._root, job.folder))

    def choices(self) -> dict[str, RunEntry]:
        """Runs to look at by their keys: jobs of the server, the newest first, then folders."""
        found: dict[str, RunEntry] = {}
        folders = set()
        for job in reversed(self._jobs.jobs):
            if isinstance(job, RunJob) and job.folder is not None:
                folders.add(job.folder)
                name = f"{job.folder.name}, {job.state.value}"
                found[key_of(job)] = RunEntry(name, job, job.folder)
        for folder in _results(self._root / RUNS):
            if folder not in folders:
                found[f"folder {folder.name}"] = RunEntry(folder.name, None, folder)
        return found

    def look_at_newest(self, choices: Mapping[str, RunEntry]) -> None:
        """Looks at the newest run of the server among the choices, if none of them was chosen."""
        if self.shown not in choices:
            self.shown = next((key for key, run in choices.items() if run.job), "")

    def run(self, key: str) -> RunEntry | None:
        """The run of a key; None: there is none any more."""
        return self.choices().get(key)

    def finished(self, folder: Path) -> FinishedRun:
        """The results in a folder, read once.

        Raises:
            CdprError: There are none that can be read.
        """
        if folder not in self._finished:
            while len(self._finished) >= 4:
                self._finished.pop(next(iter(self._finished)))
            self._finished[folder] = FinishedRun(folder)
        return self._finished[folder]


def key_of(job: RunJob) -> str:
    """Key of a job among `RunBoard.choices`."""
    return f"job {job.number}"


def outcome_words(sample: dict[str, Any] | None, summary: dict[str, Any] | None) -> str:
    """How a run stands or ended, as in its summary: running, converged, target_lost, ..."""
    if summary is not None:
        return str(summary.get("outcome", ""))
    return "" if sample is None else str(sample.get("outcome", ""))


def _results(folder: Path) -> list[Path]:
    try:
        found = [path for path in folder.iterdir() if not path.name.startswith(".")]
        found = [path for path in found if not path.is_symlink() and is_run(path)]
        return sorted(found, key=lambda path: -path.stat().st_mtime)[:MOST_FOLDERS]
    except OSError:
        return []
