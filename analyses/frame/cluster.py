"""Jobs on a Dask cluster: small ones in batches, each on a worker that is known.

A batch is bound to a worker, so that a job that kills its process is known and kills no second
worker unseen, and so that a worker that hangs keeps its own batches only.
"""

from __future__ import annotations

import gc
import logging
import pickle
import queue
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from cdpr_drake.analyses.frame.job import POLL, FinishedJob, ProcessDied, portable_job
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.blas_threads import one_blas_thread
from cdpr_drake.errors import SweepError, install_words
from cdpr_drake.kernel_cache.locks import share_compilation

Job = TypeVar("Job")
Result = TypeVar("Result")

ACCEPTED = (
    "accepted: the address of a Dask scheduler, such as tcp://host:8786, or its scheduler file, "
    "such as scheduler.json"
)

SCHEDULER_TIMEOUT = 5.0
"""A scheduler answers within this time [s]."""

BATCH_TIME = 0.1, 1.0
"""Least and wanted length of a batch [s]: client and scheduler spend some 10 ms on each."""

BATCHES_AHEAD = 2
"""Batches of a thread: one that it does and one that waits there."""

LOOK = 1.0
"""Time between two looks at the workers [s]."""

SILENCE = 30.0
"""A scheduler without an answer for so long is lost [s]. A worker without a heartbeat hangs, or
holds the interpreter's lock in a long call; others do its batches, too."""

NO_WORKER = 8.0, 300.0
"""Times without a worker until it is said, and until the command gives up [s]."""

TRIES = 2
"""A job that is alone on a worker may lose so many of them before it is taken for the cause."""


@dataclass(eq=False)
class _Batch:
    """Jobs that one worker does."""

    numbers: list[int]
    alone: bool = False
    """True if its worker does nothing else meanwhile."""
    places: dict[str, Any] = field(default_factory=dict)
    """Futures by address of the worker."""


def cluster_jobs(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    scheduler: str,
    *,
    stop: Callable[[], bool],
    say: Callable[[str], None],
    name: str,
) -> Iterator[FinishedJob[Result]]:
    """Does jobs on the workers of a Dask cluster; see `jobs.finished_jobs`.

    Workers may come and go. Certificates for tls:// addresses are those of Dask's configuration
    (`distributed.comm.tls`).

    Args:
        work: What does a job.
        jobs: Its arguments.
        scheduler: Address, or scheduler file, which ends with .json.
        stop: Asked often.
        say: Gets the address of the dashboard, and words on workers.
        name: Of the jobs on the dashboard.

    Raises:
        SweepError: The scheduler does not answer, or no worker can do the jobs.
    """
    with _connected(scheduler) as client:
        say(f"Dask dashboard: {client.dashboard_link}")
        yield from _Cluster(client, scheduler, work, jobs, stop, say, name).finished()


class _Cluster:
    """The jobs of one call, and where they are."""

    def __init__(
        self, client: Any, scheduler: str, work: Callable[[Any], Any], jobs: Sequence[Any],
        stop: Callable[[], bool], say: Callable[[str], None], name: str,
    ) -> None:  # fmt: skip
        self._client, self._scheduler, self._jobs = client, scheduler, jobs
        self._stop, self._say, self._name = stop, say, name
        self._call = work
        self._waiting = deque(range(len(jobs)))
        self._suspects: deque[int] = deque()  # jobs that a lost worker had
        self._lost: Counter[int] = Counter()
        self._batches: list[_Batch] = []
        self._ended: queue.Queue[tuple[_Batch, str, Any]] = queue.Queue()
        self._refused: dict[str, str] = {}
        self._threads: dict[str, int] = {}
        self._heard: dict[str, tuple[float, float]] = {}
        self._seconds, self._done = 0.0, 0
        self._looked, self._alone_since, self._told = -LOOK, time.monotonic(), False

    def finished(self) -> Iterator[FinishedJob[Any]]:
        try:
            while self._waiting or self._suspects or self._batches:
                self._look()
                yield from self._missed()
                if not self._stop():
                    self._hand_out()
                elif all(self._hangs(place) for batch in self._batches for place in batch.places):
                    return
                with suppress(queue.Empty):
                    batch, place, future = self._ended.get(timeout=POLL)
                    yield from self._results(batch, place, future)
        finally:
            for batch in self._batches:
                for future in batch.places.values():
                    with suppress(Exception):
                        future.cancel()

    def _look(self) -> None:
        """Learns which workers there are, and which of them are silent."""
        now = time.monotonic()
        if now - self._looked < LOOK:
            return
        self._looked = now
        try:
            identity = self._client.scheduler.identity
            workers = self._client.sync(identity, callback_timeout=SILENCE)["workers"]
        except Exception as problem:
            raise SweepError(
                f"{self._scheduler}: the scheduler was lost; what was finished is kept: run again "
                "to go on"
            ) from problem
        self._threads = {place: worker["nthreads"] for place, worker in workers.items()}
        for place, worker in workers.items():
            if place not in self._heard or self._heard[place][0] != worker["last_seen"]:
                self._heard[place] = (worker["last_seen"], now)
        if usable := set(self._threads) - set(self._refused):
            silent = all(map(self._hangs, usable))
            if silent and not self._told:
                self._say(f"{self._scheduler}: waits for workers; none answers")
            self._alone_since, self._told = now, silent
            return
        refusals = "; ".join(f"{place}: {why}" for place, why in self._refused.items())
        if now - self._alone_since > NO_WORKER[1] or (refusals and not self._batches):
            raise SweepError(f"{self._scheduler}: no worker can do the jobs. {refusals}".strip())
        if now - self._alone_since > NO_WORKER[0] and not self._told:
            self._told = True
            self._say(f"{self._scheduler}: waits for workers; none is connected")

    def _hangs(self, place: str) -> bool:
        seen = self._heard.get(place)
        return seen is None or time.monotonic() - seen[1] > SILENCE

    def _missed(self) -> Iterator[FinishedJob[Any]]:
        """Takes back what lost workers had; a job that lost several was the cause."""
        for batch in list(self._batches):
            for place in [place for place in batch.places if place not in self._threads]:
                del batch.places[place]
                if batch.places:
                    continue
                self._batches.remove(batch)
                if not batch.alone:
                    self._suspects.extend(batch.numbers)
                    continue
                (number,) = batch.numbers
                self._lost[number] += 1
                if self._lost[number] < TRIES:
                    self._suspects.append(number)
                else:
                    words = f"its process died {TRIES} times (out of memory?)"
                    yield FinishedJob(number, problem=ProcessDied(words), place=place)

    def _hand_out(self) -> None:
        """Gives each worker that is heard what its threads can do now and next."""
        load = Counter(place for batch in self._batches for place in batch.places)
        reserved = {place for batch in self._batches if batch.alone for place in batch.places}
        for place, threads in self._threads.items():
            if place in reserved or place in self._refused or self._hangs(place):
                continue
            if self._suspects:
                if not load[place]:
                    batch = _Batch([self._suspects.popleft()], alone=True)
                    self._batches.append(batch)
                    self._submit(batch, place)
                continue
            while load[place] < BATCHES_AHEAD * threads:
                following = self._next(place)
                if following is None:
                    break
                self._submit(following, place)
                load[place] += 1

    def _next(self, place: str) -> _Batch | None:
        """A new batch, or one whose workers all hang."""
        if self._waiting:
            threads = sum(self._threads.values())
            seconds = self._seconds / self._done if self._done else BATCH_TIME[1]
            fair = len(self._waiting) // (2 * BATCHES_AHEAD * threads)
            least, most = (round(time / max(seconds, 1e-6)) for time in BATCH_TIME)
            size = max(1, min(most, max(fair, least)))
            numbers = [self._waiting.popleft() for _ in range(min(size, len(self._waiting)))]
        else:
            hanging = (
                batch for batch in self._batches
                if place not in batch.places and all(map(self._hangs, batch.places))
                and not batch.alone
            )  # fmt: skip
            return next(hanging, None)
        batch = _Batch(numbers)
        self._batches.append(batch)
        return batch

    def _submit(self, batch: _Batch, place: str) -> None:
        from distributed.protocol.pickle import dumps

        jobs = [(number, self._jobs[number]) for number in batch.numbers]
        call = dumps(_Call(do_batch, self._call, jobs, code_version()))
        future = self._client.submit(
            pickle.loads, call, pure=False, workers=[place], allow_other_workers=False,
            key=f"{self._name}-{uuid.uuid4()}",
        )  # fmt: skip
        batch.places[place] = future
        future.add_done_callback(lambda ended: self._ended.put((batch, place, ended)))

    def _results(self, batch: _Batch, place: str, future: Any) -> Iterator[FinishedJob[Any]]:
        if batch not in self._batches or id(future) != id(batch.places.get(place)):
            return
        try:
            seconds, finished = future.result(timeout=SCHEDULER_TIMEOUT)
        except Exception as problem:
            del batch.places[place]
            # Else the worker was lost with the result.
            if future.status == "error" and place not in self._refused:
                words = (str(problem) or type(problem).__name__).splitlines()[0][:300]
                self._refused[place] = words
                self._say(f"worker {place} is not used: {words}")
            if not batch.places:
                self._batches.remove(batch)
                self._waiting.extendleft(reversed(batch.numbers))
            return
        self._batches.remove(batch)
        self._seconds += seconds
        self._done += len(finished)
        yield from (replace(job, place=place) for job in finished)


class _Call:
    """A call that is made where its pickle is read: schedulers only hand its bytes on."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self._call = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self._call


def do_batch(
    work: Callable[[Any], Any], jobs: Sequence[tuple[int, Any]], version: str
) -> tuple[float, list[FinishedJob[Any]]]:
    """Does some jobs in a process of the cluster; gives the time that they took [s], and them.

    Raises:
        SweepError: The process has other code, whose numbers could be others.
    """
    if code_version() != version:
        raise SweepError(f"it has cdpr_drake {code_version()}; accepted: {version}, as here")
    share_compilation()
    began = time.perf_counter()
    with one_blas_thread():
        finished = [portable_job(work, job, number) for number, job in jobs]
    return time.perf_counter() - began, finished


@contextmanager
def _connected(scheduler: str) -> Iterator[Any]:
    """A client of a scheduler; Dask's log stays silent: what matters is said here."""
    if not scheduler.strip():
        raise SweepError(f"workers: found an empty word; {ACCEPTED}")
    try:
        from distributed import Client
    except ImportError as problem:
        raise SweepError(
            f"workers: found {scheduler}, and Dask is not installed; {install_words('cluster')}"
        ) from problem

    class ClosingClient(Client):  # type: ignore[misc, unused-ignore]
        """Closes itself if it cannot start; the garbage collector would do so in a traceback."""

        def start(self, **kwargs: Any) -> None:
            try:
                super().start(**kwargs)
            except BaseException:
                self.close()
                raise

    libraries = ("distributed", "asyncio", "tornado")  # loggers below them have levels, too
    names = [name for name in logging.root.manager.loggerDict if name.startswith(libraries)]
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    by_file = scheduler.endswith(".json")
    if by_file and not Path(scheduler).is_file():  # Dask would wait for it without end
        raise SweepError(f"workers: found no file {scheduler}; {ACCEPTED}")
    where = {"scheduler_file": scheduler} if by_file else {"address": scheduler}
    try:
        try:
            client = ClosingClient(timeout=SCHEDULER_TIMEOUT, set_as_default=False, **where)
        except Exception as problem:
            words = (str(problem) or type(problem).__name__).splitlines()[0]
            if "ssl_context" in words:
                words = (
                    "no certificates: set DASK_DISTRIBUTED__COMM__TLS__CA_FILE, "
                    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and "
                    "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY"
                )
            raise SweepError(
                f"workers: {scheduler} does not answer ({words}); {ACCEPTED}"
            ) from problem
        try:
            yield client
        finally:
            with suppress(Exception):
                client.close(timeout=SCHEDULER_TIMEOUT)
    finally:
        gc.collect()  # Dask's tasks that failed say so when they go
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
