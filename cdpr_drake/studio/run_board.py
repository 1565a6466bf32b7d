"""What a session looks at of runs: the draft of the next one, what is shown, and results."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cdpr_drake.studio.boards import Board, Entry
from cdpr_drake.studio.finished_run import FinishedRun, is_run
from cdpr_drake.studio.jobs import Job, JobManager
from cdpr_drake.studio.run_job import RunJob
from cdpr_drake.studio.scenario import ScenarioDraft

RUNS = "runs"
"""Folder of results in the working folder, as that of `cdpr simulate`."""

RunEntry = Entry[RunJob]


class RunBoard(Board[RunJob]):
    """What the run panel of a session shows; all its tabs show the same.

    Attributes:
        draft: The scenario that is worked on; None: none was chosen.
        compared: Key of the run behind the one that is shown; empty: none.
        speed: Speed of the next run; None: as fast as possible.
        cursor: Time that is looked at in a finished run [s]; None: none.
    """

    def __init__(self, jobs: JobManager, root: Path) -> None:
        """With the jobs of the server and the working folder."""
        super().__init__(jobs, root, RUNS, RunJob, is_run)
        self.draft: ScenarioDraft | None = None
        self.compared = ""
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

    async def start(self, *, paused: bool = False, by_hand: bool = False) -> RunJob:
        """Begins a run of the draft, perhaps standing at the start, and looks at it.

        `by_hand`: cables can be broken and the platform pushed while it runs.

        Raises:
            CdprError: The draft is not accepted.
        """
        draft = self.draft
        assert draft is not None
        scenario = await asyncio.to_thread(draft.check)
        hands = await asyncio.to_thread(draft.by_hand) if by_hand else ()
        job = RunJob(
            draft.name, self._root, self._jobs.free_folder(self.folder / scenario.name),
            settings=(*draft.settings(), *hands), speed=self.speed, paused=paused,
        )  # fmt: skip
        self._jobs.submit(job)
        assert job.folder is not None
        self.shown, self.cursor = job.folder.name, None
        return job

    def recover(self, job: RunJob) -> Job:
        """Writes results of a run that was killed, as far as it was simulated."""
        assert job.folder is not None
        title = f"{job.title}: results of what there is"
        arguments = ["finish", str(job.folder), "--json"]
        return self._jobs.submit(Job(title, arguments, self._root, job.folder))

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


def outcome_words(sample: dict[str, Any] | None, summary: dict[str, Any] | None) -> str:
    """How a run stands or ended, as in its summary: running, converged, target_lost, ..."""
    return str((summary or sample or {}).get("outcome", ""))
