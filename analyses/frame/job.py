"""A job that has ended, wherever it was done."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

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


def failed_job(number: int, problem: BaseException) -> FinishedJob[Any]:
    """A job that raised; one that asks to exit ends neither its process nor a worker."""
    if not isinstance(problem, Exception):
        problem = SweepError(f"{type(problem).__name__}: {problem}")
    return FinishedJob(number, problem=problem)


def portable_job(work: Callable[[Job], Result], job: Job, number: int) -> FinishedJob[Result]:
    """Does a job for another process: what does not pickle becomes a problem in words."""
    try:
        finished = FinishedJob(number, work(job))
    except (Exception, SystemExit) as problem:
        finished = failed_job(number, problem)
    try:
        pickle.loads(pickle.dumps(finished))
        return finished
    except Exception as unpicklable:
        why = finished.problem or unpicklable
        return FinishedJob(number, problem=SweepError(f"{type(why).__name__}: {why}"))
