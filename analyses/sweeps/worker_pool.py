"""Runs independent jobs in processes of this machine, in any order, and stops when asked."""

from __future__ import annotations

import math
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, TypeVar

from cdpr_drake.blas_threads import started_with_one_thread
from cdpr_drake.kernel_cache.locks import compilation_time, share_compilation
from cdpr_drake.schema.input_files import SentInputs, inputs_held
from cdpr_drake.worker_process import become_worker, resident_memory

Job = TypeVar("Job")
Result = TypeVar("Result")

POLL = 0.2
"""Time between two looks at a request to stop, and at whether all processes live [s]."""

WORTH_PROCESSES = 10.0
"""Work that is left, in this process, for which others are started where nobody says how many [s].

Each needs two to three seconds to start and to load Drake and kernels, on a processor of its own.
"""

MOST_GROWTH = 2**30
"""Memory that a process may keep after its first job, before others take the place of all [bytes].

Drake's systems written in Python are never freed (Drake issue 24162): a process that builds many
diagrams grows until the machine has no memory left.
"""


def default_workers() -> int:
    """One worker for each processor that this process may use."""
    return len(os.sched_getaffinity(0))


def run_jobs(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int | None = None,
    should_stop: Callable[[], bool] | None = None,
    *,
    on_lost: Callable[[int], None] | None = None,
) -> Iterator[tuple[int, Result]]:
    """Does jobs in processes and yields each as it is finished.

    The processes are started anew rather than forked, since threads of Drake and numba do not
    survive a fork. They ignore Ctrl-C and SIGTERM: it is for this process to ask them to stop;
    should it be killed, they end too. Any exception here, and who leaves the loop, ends them at
    once, in the middle of their jobs. With one worker the jobs are done in this process, in order.
    Where nobody says how many, the first jobs are done here, too, until the shortest of them, times
    the number of those that wait, is more than `WORTH_PROCESSES`; compilation does not count.
    Processes whose memory has grown by `MOST_GROWTH` are replaced between two jobs; of one worker,
    another process does the rest.

    Args:
        work: A function of a module, so that a process can find it by name.
        jobs: Its arguments; they and the results must pickle.
        workers: Number of processes; None: one for each processor, once the work is worth it.
        should_stop: Asked all the time; after True no further job begins, and those under way are
            still yielded.
        on_lost: Called with the index of a job whose process died, for instance out of memory; the
            others go on. None: that is an error. Jobs that ran beside it are done again, one by
            one, so that it is known which it was.

    Yields:
        Index of the job and its result.

    Raises:
        Exception: Whatever `work` raises.
        BrokenProcessPool: A process died and nobody listens.
    """
    count = min(workers or default_workers(), max(len(jobs), 1))
    stop = should_stop or (lambda: False)
    waiting, suspects = deque(range(len(jobs))), deque[int]()
    if count == 1 or workers is None:
        before, shortest, others = resident_memory(), math.inf, False
        while waiting and not others:
            if stop():
                return
            index = waiting.popleft()
            began, compiled = time.perf_counter(), compilation_time()
            result = work(jobs[index])
            passed = time.perf_counter() - began - (compilation_time() - compiled)
            shortest = min(shortest, passed)
            yield index, result
            others = resident_memory() - before > MOST_GROWTH or (
                count > 1 and shortest * len(waiting) > WORTH_PROCESSES
            )
        if not waiting:
            return
    pool = _Pool(count)
    running: dict[Future[tuple[Result, bool]], int] = {}
    alone = False  # whether what runs is a suspect, with nobody beside it
    grown = False  # whether a process keeps too much memory
    try:
        while True:
            broken = False
            if grown and not running:
                pool = pool.followed()
                grown = False
            while (
                not grown
                and not stop()
                and (not running if suspects or alone else len(running) < count)
            ):
                alone = bool(suspects)
                queue = suspects or waiting
                if not queue:
                    break
                index = queue.popleft()
                try:
                    future = pool.submit(
                        _work_in_turns, with_inputs(work), jobs[index], MOST_GROWTH
                    )
                    running[future] = index
                except BrokenProcessPool:  # one died since the last look
                    queue.appendleft(index)
                    broken = True
                    break
            if not running and not broken:
                break
            if not running:
                pool = pool.followed()
                continue
            done, _ = wait(running, POLL, FIRST_COMPLETED)
            if not done and pool.lost_one():
                pool.kill()  # and what runs there is broken at the next look
            dead = [future for future in done if isinstance(future.exception(), BrokenProcessPool)]
            for future in done - set(dead):
                result, swollen = future.result()
                grown = grown or swollen
                yield running.pop(future), result
            if not dead:
                continue
            if on_lost is None:
                dead[0].result()
            lost = sorted(running.values())  # a broken pool finishes none of them
            running.clear()
            pool = pool.followed()
            if alone and on_lost is not None:
                on_lost(lost[0])
            else:
                suspects.extend(lost)
    except BaseException:
        # Nobody will look at what is under way. Pools can end it themselves since Python 3.14 only.
        pool.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def with_inputs(work: Callable[[Job], Result]) -> Callable[[Job], Result]:
    """What does a job elsewhere with the files that were read here."""
    held = inputs_held()
    return work if held is None else SentInputs(work, held)


def _work_in_turns(
    work: Callable[[Job], Result], job: Job, most_growth: int
) -> tuple[Result, bool]:
    """Does a job in a process of a pool; of kernels that are missing each compiles others.

    Returns:
        The result, and whether the process keeps more memory than `most_growth` [bytes] since its
        first job.
    """
    share_compilation()
    result = work(job)
    used = resident_memory()
    return result, used - _after_first_job.setdefault("memory", used) > most_growth


_after_first_job: dict[str, int] = {}
"""Memory of this process when its first job was done [bytes]."""


class _Pool(ProcessPoolExecutor):
    """A pool that knows its processes: it sees each death, and can end them all.

    The executor looks at the processes that it knew when it last woke up: should the newest one die
    first, it says so only when another job is finished. And a broken one asks the rest to end by
    SIGTERM, which they leave to this process.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._started = _SpawnAndNote()
        super().__init__(count, self._started, initializer=become_worker)

    def lost_one(self) -> bool:
        """Whether one of the processes has ended."""
        return any(process.exitcode is not None for process in self._started.processes)

    def kill(self) -> None:
        """Ends all processes, in the middle of their jobs."""
        for process in self._started.processes:
            if process.pid is not None:  # else its start has failed
                process.kill()

    def followed(self) -> _Pool:
        """Ends this one and returns one like it."""
        self.kill()
        self.shutdown(wait=True, cancel_futures=True)
        return _Pool(self._count)


class _ShelteredProcess(SpawnProcess):
    """Gets no signal before it can leave it to its parent, as a terminal sends Ctrl-C to all."""

    def start(self) -> None:
        """Starts it; the parent gets what was sent meanwhile."""
        held = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
        try:
            with started_with_one_thread():
                super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)


class _SpawnAndNote(SpawnContext):
    """Starts processes anew and keeps what it started."""

    def __init__(self) -> None:
        self.processes: list[SpawnProcess] = []

    def Process(self, *arguments: Any, **named: Any) -> SpawnProcess:  # type: ignore[override]
        process = _ShelteredProcess(*arguments, **named)
        self.processes.append(process)
        return process
