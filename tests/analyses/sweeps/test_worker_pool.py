"""Jobs in processes: all done, in any order, stopped when asked; what measures times comes last."""

import math
import os
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

import pytest

from cdpr_drake.analyses.sweeps import worker_pool
from cdpr_drake.analyses.sweeps.worker_pool import run_jobs
from tests.analyses.sweeps.dying_jobs import die_for, hold, newest_dies


@pytest.mark.parametrize("workers", [1, 2])
def test_every_job_is_done_once_with_its_own_result(workers):
    found = dict(run_jobs(math.sqrt, [0.0, 1.0, 4.0, 9.0], workers))
    assert found == {0: 0.0, 1: 1.0, 2: 2.0, 3: 3.0}


def test_two_workers_are_processes_of_their_own():
    here = str(os.getpid())
    jobs = ["/proc/self"] * 2
    assert all(there != here for _, there in run_jobs(os.readlink, jobs, 2))
    assert [there for _, there in run_jobs(os.readlink, jobs, 1)] == [here, here]


def test_unasked_processes_are_started_for_long_work_only(monkeypatch):
    """Small maps paid two processes that each imported Drake: half of the command's time."""
    here, jobs = str(os.getpid()), ["/proc/self"] * 4
    monkeypatch.setattr(worker_pool, "default_workers", lambda: 2)
    hosts = [there for _, there in sorted(run_jobs(os.readlink, jobs))]
    assert hosts == [here] * 4
    monkeypatch.setattr(worker_pool, "WORTH_PROCESSES", 0.0)
    hosts = [there for _, there in sorted(run_jobs(os.readlink, jobs))]
    assert hosts[0] == here
    assert here not in hosts[1:]
    compiled = lambda: 2.0 * time.perf_counter()  # noqa: E731, more than all
    monkeypatch.setattr(worker_pool, "compilation_time", compiled)
    hosts = [there for _, there in sorted(run_jobs(os.readlink, jobs))]
    assert hosts == [here] * 4


@pytest.mark.parametrize("workers", [1, 2])
def test_a_request_to_stop_keeps_what_is_done(workers):
    done = []
    for item in run_jobs(math.sqrt, [1.0] * 100, workers, lambda: len(done) >= 3):
        done.append(item)
    assert 3 <= len(done) <= 3 + workers


@pytest.mark.parametrize("workers", [1, 2])
def test_errors_reach_the_caller(workers):
    with pytest.raises(ValueError, match=r"domain error|nonnegative"):
        list(run_jobs(math.sqrt, [1.0, -1.0, 1.0], workers))


def test_a_process_that_dies_is_an_error_and_not_a_missing_result():
    with pytest.raises(BrokenProcessPool):
        list(run_jobs(os._exit, [3, 3], 2))


def test_a_process_that_dies_costs_its_own_job_only():
    """A child out of memory once lost every run that was finished."""
    lost = []
    jobs = [1, 2, -9, 4, 5, -3, 7]
    found = dict(run_jobs(die_for, jobs, 2, on_lost=lost.append))
    assert sorted(lost) == [2, 5]
    assert found == {0: 1, 1: 2, 3: 4, 4: 5, 6: 7}


@pytest.mark.parametrize(("workers", "most"), [(1, 1), (2, 2)])
def test_processes_that_keep_memory_are_replaced_and_no_job_is_lost(monkeypatch, workers, most):
    """Each start of the study of basins left 0.2 MB: 14,000 of them filled a machine."""
    size, jobs = 20_000_000, 6

    def hosts(most_growth):
        monkeypatch.setattr(worker_pool, "MOST_GROWTH", most_growth)
        found = dict(run_jobs(hold, [size] * jobs, workers))
        assert set(found) == set(range(jobs))
        return set(found.values())

    assert len(hosts(100 * size)) <= most
    assert len(hosts(size // 2)) > most


def test_no_jobs_no_results():
    assert list(run_jobs(math.sqrt, [])) == []


def test_a_death_is_noticed_while_what_runs_beside_it_goes_on(tmp_path, monkeypatch):
    """An executor may not know its newest process yet, and SIGTERM ends none of the others."""
    lost, start = [], worker_pool._SpawnAndNote.Process

    def late(context, *arguments, **named):
        if context.processes:
            time.sleep(0.5)  # woken by the job, the executor looks at its processes before
        return start(context, *arguments, **named)

    monkeypatch.setattr(worker_pool._SpawnAndNote, "Process", late)
    jobs = [str(tmp_path)] * 2
    assert dict(run_jobs(newest_dies, jobs, 2, on_lost=lost.append)) == {0: "done", 1: "done"}
    assert lost == []
    assert not (tmp_path / "nobody looked").exists()


class BrokenAfter:
    """A pool that does its jobs at once, until one of its processes dies: at that submission."""

    def __init__(self, submissions):
        self.left = submissions
        self.killed = self.ended = False

    def submit(self, work, *given):
        future = Future()
        self.left -= 1
        if self.left < 0:
            raise BrokenProcessPool("one died since the last look")
        future.set_result(work(*given))
        return future

    def lost_one(self):
        return False

    def kill(self):
        self.killed = True

    def shutdown(self, **how):
        self.ended = True

    def followed(self):
        self.kill()
        self.shutdown()
        return worker_pool._Pool(2)


@pytest.mark.parametrize("submissions", [0, 1, 2, 3])
@pytest.mark.parametrize("on_lost", [None, [].append])
def test_a_job_given_to_a_broken_pool_is_given_again(submissions, on_lost, monkeypatch):
    pools = [BrokenAfter(submissions), BrokenAfter(9)]
    made = iter(pools)
    monkeypatch.setattr(worker_pool, "_Pool", lambda count: next(made))
    found = list(run_jobs(math.sqrt, [0.0, 1.0, 4.0, 9.0], 2, on_lost=on_lost))
    assert sorted(found) == [(0, 0.0), (1, 1.0), (2, 2.0), (3, 3.0)]
    assert pools[0].killed
    assert pools[0].ended
    assert pools[1].ended
