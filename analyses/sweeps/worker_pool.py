"""Runs independent jobs in processes of this machine, in any order, and stops when asked."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import TypeVar

from cdpr_drake.worker_process import become_worker

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
    *,
    on_lost: Callable[[int], None] | None = None,
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
        on_lost: Called with the index of a job whose process died, for instance out of memory; the
            others go on. None: that is an error. Jobs that ran beside it are done again, one by
            one, so that it is known which it was.

    Yields:
        Index of the job and its result.

    Raises:
        Whatever `work` raises; BrokenProcessPool where a process dies and nobody listens.
    """
    count = min(workers or default_workers(), max(len(jobs), 1))
    stop = should_stop or (lambda: False)
    if count == 1:
        for index, job in enumerate(jobs):
            if stop():
                return
            yield index, work(job)
        return
    others = set(multiprocessing.active_children())
    pool = _new_pool(count)
    waiting, suspects = deque(range(len(jobs))), deque[int]()
    running: dict[Future[Result], int] = {}
    alone = False  # whether what runs is a suspect, with nobody beside it
    try:
        while True:
            broken = False
            while not stop() and (not running if suspects or alone else len(running) < count):
                alone = bool(suspects)
                queue = suspects or waiting
                if not queue:
                    break
                index = queue.popleft()
                try:
                    running[pool.submit(work, jobs[index])] = index
                except BrokenProcessPool:  # one died since the last look
                    queue.appendleft(index)
                    broken = True
                    break
            if not running and not broken:
                break
            if not running:
                _kill_all_but(others)
                pool.shutdown(wait=True, cancel_futures=True)
                pool = _new_pool(count)
                continue
            done, _ = wait(running, POLL, FIRST_COMPLETED)
            dead = [future for future in done if isinstance(future.exception(), BrokenProcessPool)]
            for future in done - set(dead):
                yield running.pop(future), future.result()
            if not dead:
                continue
            if on_lost is None:
                dead[0].result()
            lost = sorted(running.values())  # a broken pool finishes none of them
            running.clear()
            # A broken pool asks the others by SIGTERM, which they leave to this process.
            _kill_all_but(others)
            pool.shutdown(wait=True, cancel_futures=True)
            pool = _new_pool(count)
            if alone and on_lost is not None:
                on_lost(lost[0])
            else:
                suspects.extend(lost)
    except BaseException:
        # Nobody will look at what is under way. Pools can end it themselves since Python 3.14 only.
        _kill_all_but(others)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _kill_all_but(others: set[BaseProcess]) -> None:
    for process in set(multiprocessing.active_children()) - others:
        process.kill()  # they leave SIGTERM to this process


def _new_pool(count: int) -> ProcessPoolExecutor:
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, spawn, initializer=become_worker)
