"""Jobs on a Dask cluster."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.sweeps.worker_pool import with_inputs
from cdpr_drake.blas_threads import one_blas_thread
from cdpr_drake.errors import SweepError
from cdpr_drake.kernel_cache.locks import share_compilation

POLL = 0.1
"""Time between looks at a request to stop [s]."""

JOBS_AHEAD = 2
"""Jobs handed out per thread of a cluster, so that none waits for the next."""

SCHEDULER_TIMEOUT = 5.0
"""A scheduler must answer within this time [s]."""


Job = TypeVar("Job")
Result = TypeVar("Result")

Submit = Callable[[Callable[[Any], Any], Any], Any]
"""Hands out a job, with what does it, and returns a future."""


def do_by_same_code(work: Callable[[Job], Result], job: Job, version: str) -> Result:
    """Does a job in a process of somebody else's, if that has the code of the one who asks.

    Raises:
        SweepError: It has other code, whose numbers could be others.
    """
    if code_version() != version:
        raise SweepError(
            f"a worker of the cluster has cdpr_drake {code_version()}; accepted: {version}, as "
            "here; install the same on all workers"
        )
    share_compilation()
    with one_blas_thread():
        return work(job)


def run_jobs_on(
    scheduler: str,
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    should_stop: Callable[[], bool] | None = None,
) -> Iterator[tuple[int, Result]]:
    """As `run_jobs`, on a Dask cluster; what a worker had that got lost is done by another one.

    Args:
        scheduler: Address of its scheduler.
        work: A function of a module of the package.
        jobs: Its arguments.
        should_stop: Asked often; with True no more jobs are handed out, those under way end.

    Yields:
        Index of the job and its result, in the order in which they get finished.

    Raises:
        Exception: Whatever `work` raises.
        SweepError: The scheduler does not answer or got lost, or a worker has other code.
    """
    with _dask(scheduler) as (submit, threads):
        never: Callable[[], bool] = lambda: False  # noqa: E731
        ahead = JOBS_AHEAD * threads
        yield from _hand_out(work, jobs, submit, ahead, should_stop or never)


def check_scheduler(scheduler: str) -> None:
    """Makes sure that a Dask scheduler answers and has workers, before anything is written.

    Raises:
        SweepError: It does not, or Dask is not installed.
    """
    with _dask(scheduler):
        pass


def _hand_out(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    submit: Submit,
    ahead: int,
    should_stop: Callable[[], bool],
) -> Iterator[tuple[int, Result]]:
    """Keeps `ahead` jobs under way on a cluster."""
    finished: queue.SimpleQueue[int] = queue.SimpleQueue()
    under_way: dict[int, Any] = {}
    following = 0
    while True:
        stopping = should_stop()
        while not stopping and following < len(jobs) and len(under_way) < ahead:
            future = submit(work, jobs[following])
            under_way[following] = future
            future.add_done_callback(lambda _, number=following: finished.put(number))
            following += 1
        if not under_way:
            return
        try:
            number = finished.get(timeout=POLL)
        except queue.Empty:
            # An error that cannot be sent here is not reported either.
            ended = [k for k, future in under_way.items() if _has_failed(future)]
            if not ended:
                continue
            number = ended[0]
        if number in under_way:
            yield number, under_way.pop(number).result()


def _has_failed(future: Any) -> bool:
    return str(getattr(future, "status", "")) in ("error", "lost", "cancelled")


@contextmanager
def _dask(address: str) -> Iterator[tuple[Submit, int]]:
    """How to hand out jobs to a Dask cluster, and its number of threads.

    Raises:
        SweepError: Dask is not installed, or the scheduler does not answer or has no workers.
    """
    local = "leave out workers to compute on this machine"
    try:
        from distributed import Client
    except ImportError as problem:
        raise SweepError(
            f"workers {address}: needs Dask; install cdpr_drake[cluster], or {local}"
        ) from problem

    class ClosingClient(Client):  # type: ignore[misc, unused-ignore]
        """Closes itself if it cannot start.

        Left to the garbage collector, it would do so while another one starts, perhaps, and wait
        for a lock that this one holds.
        """

        def start(self, **kwargs: Any) -> None:
            try:
                super().start(**kwargs)
            except BaseException:
                self.close()
                raise

    try:
        client = ClosingClient(address, timeout=SCHEDULER_TIMEOUT, set_as_default=False)
    except Exception as problem:  # whatever Dask makes of an address
        raise SweepError(
            f"workers {address}: does not answer ({_first_line(problem)}); accepted: the "
            f"address of a Dask scheduler, such as tcp://host:8786, or {local}"
        ) from problem
    try:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise SweepError(f"workers {address}: has no workers; start some, or {local}")
        try:
            version = code_version()
            yield (
                lambda work, job: client.submit(
                    do_by_same_code, with_inputs(work), job, version, pure=False
                ),
                threads,
            )
        except Exception as problem:
            if client.status == "running" and not _is_lost(problem):
                raise
            raise SweepError(
                f"workers {address}: was lost on the way ({_first_line(problem)}); what was "
                f"finished is kept: run again to continue, or {local}"
            ) from problem
    finally:
        client.close()


def _is_lost(problem: Exception) -> bool:
    """Whether Dask gave up, and not the computation."""
    return type(problem).__module__.partition(".")[0] == "distributed" or isinstance(
        problem, OSError
    )


def _first_line(problem: Exception) -> str:
    return (str(problem) or type(problem).__name__).splitlines()[0]
