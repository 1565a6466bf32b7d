"""Independent jobs, done here, in processes of this machine, or on a Dask cluster.

`finished_jobs` gives each job as it ends. A job that raises, or whose process dies, is given with
its problem, and the others go on. Files that were read before (`schema.input_files`) travel with
the jobs by content, so that every job sees the same.
"""

from __future__ import annotations

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Self, TypeVar

from cdpr_drake.analyses.frame.job import POLL, FinishedJob, ProcessDied, failed_job, portable_job
from cdpr_drake.blas_threads import one_blas_thread, started_with_one_thread
from cdpr_drake.errors import SweepError
from cdpr_drake.kernel_cache.locks import compilation_time, share_compilation
from cdpr_drake.schema.input_files import SentInputs, inputs_held
from cdpr_drake.worker_process import become_worker

Job = TypeVar("Job")
Result = TypeVar("Result")

WORTH_PROCESSES = 10.0
"""Work left for which processes are started if nobody says how many [s]: each takes two to three
seconds to load Drake and kernels."""

JOBS_PER_PROCESS = 200
"""A process is replaced after so many jobs: Drake's systems written in Python are never freed
(Drake issue 24162)."""


def default_workers() -> int:
    """One worker for each processor that this process may use."""
    return len(os.sched_getaffinity(0))


def finished_jobs(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int | str | None = None,
    *,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = lambda words: None,
    name: str = "job",
    standing: Processes | None = None,
) -> Iterator[FinishedJob[Result]]:
    """Does jobs in any order and gives each as it ends.

    Args:
        work: A function of a module, or a partial of one.
        jobs: Its arguments; they and the results must pickle.
        workers: Number of processes, 1 for this one; a scheduler, see `cluster.cluster_jobs`; None:
            one for each processor, once ten seconds of work are left.
        stop: Asked often; after True no further job begins, and those under way are still given.
        say: Gets words on what a cluster lacks.
        name: Of the jobs, for the dashboard of a cluster.
        standing: Keeps the processes of this machine for the next call with the same `work`.

    Raises:
        SweepError: The number of workers is not accepted, or the cluster cannot be used.
    """
    if not jobs:
        return
    if isinstance(workers, str):
        from cdpr_drake.analyses.frame.cluster import cluster_jobs

        yield from cluster_jobs(with_inputs(work), jobs, workers, stop=stop, say=say, name=name)
        return
    if workers is not None and workers < 1:
        raise SweepError(f"workers: found {workers}; accepted: at least 1, or a scheduler")
    waiting = deque(range(len(jobs)))
    count = min(workers or default_workers(), len(jobs))
    while waiting and (count == 1 or workers is None):
        if stop():
            return
        began, compiled = time.perf_counter(), compilation_time()
        number = waiting.popleft()
        with one_blas_thread():
            try:
                finished = FinishedJob(number, work(jobs[number]))
            except (Exception, SystemExit) as problem:
                finished = failed_job(number, problem)
        passed = time.perf_counter() - began - (compilation_time() - compiled)
        yield finished
        if count > 1 and passed * len(waiting) > WORTH_PROCESSES:
            break
    if waiting:
        yield from _in_processes(with_inputs(work), jobs, waiting, count, stop, standing)


def with_inputs(work: Callable[[Job], Result]) -> Callable[[Job], Result]:
    """What does a job in another process with the files that were read here."""
    files = inputs_held()
    return work if files is None else SentInputs(work, files)


def _in_processes(
    work: Callable[[Job], Result], jobs: Sequence[Job], waiting: deque[int], count: int,
    stop: Callable[[], bool], standing: Processes | None,
) -> Iterator[FinishedJob[Result]]:  # fmt: skip
    idle = [] if standing is None else standing.idle
    idle += [_Process(work) for _ in range(min(count, len(waiting)) - len(idle))]
    busy: dict[Connection[Any, Any], _Process] = {}
    try:
        while waiting or busy:
            while idle and waiting and not stop():
                process = idle.pop()
                process.begin(waiting.popleft(), jobs)
                busy[process.connection] = process
            if not busy:
                return
            ready = wait(list(busy), POLL)
            for connection in [connection for connection in busy if connection in ready]:
                process = busy.pop(connection)
                finished = process.finished()
                if isinstance(finished.problem, ProcessDied) or process.jobs >= JOBS_PER_PROCESS:
                    process.end()
                    process = _Process(work)
                idle.append(process)
                yield finished
    finally:
        for process in [*(idle if standing is None else ()), *busy.values()]:
            process.end(at_once=process.connection in busy)


class Processes:
    """Processes that stay from one call of `finished_jobs` to the next, inside a `with` block."""

    def __init__(self) -> None:
        """Of no process yet."""
        self.idle: list[_Process] = []

    def __enter__(self) -> Self:
        """The block begins."""
        return self

    def __exit__(self, *_: object) -> None:
        """Ends them."""
        for process in self.idle:
            process.end()


class _Process:
    """A process that does one job after the other; Ctrl-C and SIGTERM are its parent's."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        """Starts it, anew and not forked: threads of Drake and numba do not survive a fork."""
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.jobs, self._number = 0, -1
        self._process = context.Process(target=_serve, args=(theirs, work))
        resource_tracker.ensure_running()  # its start would let the signals through again
        held = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
        try:
            with started_with_one_thread():
                self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)
        theirs.close()

    def begin(self, number: int, jobs: Sequence[Any]) -> None:
        self._number, self.jobs = number, self.jobs + 1
        with suppress(OSError):  # it has died; `finished` says so
            self.connection.send((number, jobs[number]))

    def finished(self) -> FinishedJob[Any]:
        """Its job, once the connection has something to read."""
        try:
            finished: FinishedJob[Any] = self.connection.recv()
        except (EOFError, OSError):
            self._process.join()
            code = self._process.exitcode or 0
            how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            words = f"its process died ({how}; out of memory?)"
            return FinishedJob(self._number, problem=ProcessDied(words))
        return finished

    def end(self, at_once: bool = False) -> None:
        self.connection.close()
        if at_once:
            self._process.kill()
        self._process.join()


def _serve(connection: Connection[Any, Any], work: Callable[[Any], Any]) -> None:
    become_worker()
    share_compilation()
    with suppress(EOFError):  # the parent has no more jobs
        while True:
            number, job = connection.recv()
            connection.send(portable_job(work, job, number))
