"""A job that has ended, wherever it was done."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from cdpr_drake.errors import SweepError

Job = TypeVar("Job")
Result = TypeVar("Result")

POLL = 0.2
"""Time between two looks at a request to stop [s]."""


@dataclass(frozen=True, eq=False)
class FinishedJob(Generic[Result]):
    """A job that has ended.

    Attributes:
        number: Its index.
        result: What it gave; None with a problem.
        problem: Why it gave nothing; None if it did.
        place: The worker of a cluster that did it; empty here.
    """

    number: int
    result: Result | None = None
    problem: Exception | None = None
    place: str = ""

    def words(self) -> str:
        """The problem in one line, with its place."""
        lines = (str(self.problem) or type(self.problem).__name__).splitlines()
        kind = "" if isinstance(self.problem, SweepError) else f"{type(self.problem).__name__}: "
        at = f" (on worker {self.place})" if self.place else ""
        return f"{kind}{lines[0][:300]}{at}"


class ProcessDied(SweepError):
    """The process of a job died, for instance because memory ran out."""


def do_job(work: Callable[[Job], Result], job: Job, number: int) -> FinishedJob[Result]:
    """Does a job in this process; what it raises is its problem."""
    try:
        return FinishedJob(number, work(job))
    except Exception as problem:
        return FinishedJob(number, problem=problem)
    except SystemExit as end:  # else a worker of a cluster ends, and others do the job again
        return FinishedJob(number, problem=SweepError(f"SystemExit: {end}"))


def portable(finished: FinishedJob[Result]) -> FinishedJob[Result]:
    """The same for another process: what does not pickle becomes a problem in words."""
    try:
        pickle.loads(pickle.dumps(finished))
        return finished
    except Exception as unpicklable:
        problem = finished.problem or unpicklable
        words = f"{type(problem).__name__}: {problem}"
        return FinishedJob(finished.number, problem=SweepError(words))
