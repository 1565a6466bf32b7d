"""Runs independent jobs in processes of this machine, in any order, and stops when asked."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import Any, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

POLL = 0.2
"""Time between two looks at a request to stop [s]."""


def default_workers() -> int:
    """One worker for each processor that this process may use."""
    return len(os.sched_getaffinity(0))


def run_jobs(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Iterator[tuple[int, Result]]:
    """Does jobs in processes and yields each as it is finished.

    The processes are started anew rather than forked, since threads of Drake and numba do not
    survive a fork. They ignore Ctrl-C and SIGTERM: it is for this process to ask them to stop;
    should it be killed, they end too. Any exception here, and who leaves the loop, ends them at
    once, in the middle of their jobs. With one worker the jobs are done in this process, in order.

    Args:
        work: A function of a module, so that a process can find it by name.
        jobs: Its arguments; they and the results must pickle.
        workers: Number of processes; None: one for each processor.
        should_stop: Asked all the time; after True no further job begins, and those under way are
            still yielded.

    Yields:
        Index of the job and its result.

    Raises:
        Whatever `work` raises; BrokenProcessPool where a process dies.
    """
    count = min(workers or default_workers(), max(len(jobs), 1))
    stop = should_stop or (lambda: False)
    if count == 1:
        for index, job in enumerate(jobs):
            if stop():
                return
            yield index, work(job)
        return
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(count, context, initializer=_become_worker)
    waiting = iter(enumerate(jobs))
    running: dict[Future[Result], int] = {}
    try:
        while True:
            while len(running) < count and not stop():
                upcoming = next(waiting, None)
                if upcoming is None:
                    break
                running[pool.submit(work, upcoming[1])] = upcoming[0]
            if not running:
                break
            done, _ = wait(running, POLL, FIRST_COMPLETED)
            for future in done:
                yield running.pop(future), future.result()
    except BaseException:
        # Nobody will look at what is under way. Pools can end it themselves since Python 3.14 only.
        for process in set(multiprocessing.active_children()) - others:
            process.kill()  # they leave SIGTERM to this process
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _become_worker() -> None:
    """Leaves Ctrl-C and SIGTERM to the parent process, and ends with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)
