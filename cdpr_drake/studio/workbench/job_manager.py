"""Lets a few jobs work at a time, and ends them all with the server."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from typing import TypeVar

from cdpr_drake.studio.workbench.job import Event, Job, JobError, JobState

MOST_JOBS = 200
"""Jobs that are remembered; the oldest that are over are forgotten."""

LONGEST_END = 20.0
"""Time that jobs have to put away what they have when the server ends [s]."""

AT_WORK = (JobState.RUNNING, JobState.STOPPING)
"""States that take a place; a run that stands takes no processor, and none."""

LOOK_PERIOD = 0.1
"""Time between looks whether the next job may begin [s]."""

J = TypeVar("J", bound=Job)


def usual_count() -> int:
    """Jobs at once: a processor is left for server and browser, where there are several."""
    return max(1, len(os.sched_getaffinity(0)) - 1)


class JobManager:
    """The jobs of a server, in the order in which they were asked for."""

    def __init__(self, at_once: int | None = None) -> None:
        """For so many jobs at once; None: `usual_count`."""
        self.at_once = usual_count() if at_once is None else at_once
        self._jobs: list[Job] = []
        self._lock = threading.RLock()
        self._closed = False
        self._news = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def jobs(self) -> list[Job]:
        """All that are remembered, the oldest first."""
        with self._lock:
            return list(self._jobs)

    def job(self, number: int) -> Job | None:
        """The job of a number; None: there is none any more."""
        return next((job for job in self.jobs if job.number == number), None)

    def submit(self, job: J) -> J:
        """Takes a job over, and begins it when there is room.

        Raises:
            JobError: The server is ending.
        """
        with self._lock:
            if self._closed:
                raise JobError("the server is ending; nothing new is begun")
            self._jobs.append(job)
            self._forget_old()
            self._begin_next()
            if self._thread is None:
                self._thread = threading.Thread(target=self._attend, daemon=True, name="jobs")
                self._thread.start()
        self._news.set()
        return job

    def free_folder(self, base: Path) -> Path:
        """The first of base, base-2, ... that is not there and that no job will write."""
        with self._lock:
            taken = {
                Path(getattr(job, "folder", None) or "") for job in self._jobs
                if not job.state.is_over
            }  # fmt: skip
        number, folder = 1, base
        while folder.exists() or folder in taken:
            number += 1
            folder = base.with_name(f"{base.name}-{number}")
        return folder

    def close(self, seconds: float = LONGEST_END) -> None:
        """Stops all jobs, lets them put away what they have, and returns when they are over.

        Those that need longer are killed; what they had on disk stays there.
        """
        with self._lock:
            self._closed = True
            open_jobs = [job for job in self._jobs if not job.state.is_over]
        self._news.set()
        for job in open_jobs:
            job.stop()
        until = time.monotonic() + seconds
        for job in open_jobs:
            if not job.wait(max(until - time.monotonic(), 0.0)):
                job.kill()
        for job in open_jobs:
            job.wait(1.0)

    def _attend(self) -> None:
        """Begins the next job when one is over."""
        while not self._closed:
            with self._lock:
                busy = any(not job.state.is_over for job in self._jobs)
                self._begin_next()
            self._news.wait(LOOK_PERIOD if busy else None)
            self._news.clear()

    def _begin_next(self) -> None:
        if self._closed:
            return
        at_work = sum(job.state in AT_WORK for job in self._jobs)
        for job in self._jobs:
            if at_work >= self.at_once:
                return
            if job.state == JobState.QUEUED:
                job.begin()
                at_work += 1

    def _forget_old(self) -> None:
        over = [job for job in self._jobs if job.state.is_over]
        for job in over[: max(len(self._jobs) - MOST_JOBS, 0)]:
            self._jobs.remove(job)
            job.emit(Event("forgotten"))
