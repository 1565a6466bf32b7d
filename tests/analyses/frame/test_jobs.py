"""Jobs here and in processes: every result, every problem with its job, and an end when asked."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from cdpr_drake.analyses.frame import jobs as module
from cdpr_drake.analyses.frame.job import ProcessDied
from cdpr_drake.analyses.frame.jobs import Processes, finished_jobs
from cdpr_drake.errors import SweepError
from cdpr_drake.schema.input_files import input_text, inputs_read_once

WORKERS = [1, 2]


def square(number):
    return number * number


def at_odds(number):
    """Raises, dies or gives what does not pickle, by the job."""
    match number:
        case 1:
            raise ValueError("one is\nodd")
        case 3:
            os.kill(os.getpid(), signal.SIGKILL)
        case 5:
            return lambda: 5
        case 6:
            raise SystemExit(3)
    return number


def read(path, number):
    return input_text(path)


def process_id(number):
    return os.getpid()


@pytest.mark.parametrize("workers", [*WORKERS, None])
def test_every_job_gives_its_result(workers):
    finished = list(finished_jobs(square, range(9), workers))
    assert sorted((one.number, one.result) for one in finished) == [(k, k * k) for k in range(9)]


@pytest.mark.parametrize("workers", [2, "tcp://127.0.0.1:9"])
def test_nothing_to_do_starts_nothing(workers):
    assert list(finished_jobs(square, [], workers)) == []


def test_a_job_that_raises_or_whose_process_dies_is_named_and_others_go_on():
    finished = {one.number: one for one in finished_jobs(at_odds, range(8), 2)}
    assert len(finished) == 8
    assert finished[1].words() == "ValueError: one is"
    assert isinstance(finished[3].problem, ProcessDied)
    assert finished[3].words() == "its process died (SIGKILL; out of memory?)"
    assert "pickle" in finished[5].words()
    assert finished[6].words() == "SystemExit: 3"
    assert [finished[k].result for k in (0, 2, 4, 7)] == [0, 2, 4, 7]


def test_here_a_job_that_raises_is_named_too():
    finished = list(finished_jobs(at_odds, [0, 1, 2], 1))
    assert [one.result for one in finished] == [0, None, 2]
    assert finished[1].words() == "ValueError: one is"


@pytest.mark.parametrize("workers", WORKERS)
def test_after_a_stop_no_job_begins_and_those_under_way_are_given(workers):
    done = []
    for finished in finished_jobs(square, range(50), workers, stop=lambda: len(done) >= 2):
        done.append(finished.number)
    assert 2 <= len(done) <= 2 + workers


def test_who_leaves_the_loop_ends_the_processes():
    ids = set()
    for finished in finished_jobs(process_id, range(50), 2):
        ids.add(finished.result)
        if len(ids) == 2:
            break
    assert not any(os.path.exists(f"/proc/{number}") for number in ids)


def test_processes_are_replaced_after_some_jobs(monkeypatch):
    monkeypatch.setattr(module, "JOBS_PER_PROCESS", 3)
    ids = [one.result for one in finished_jobs(process_id, range(8), 2)]
    assert max(map(ids.count, ids)) <= 3
    assert len(set(ids)) >= 3


def test_standing_processes_are_the_same_in_every_call_and_end_with_their_block():
    with Processes() as standing:
        hosts = {
            finished.result for _ in range(3)
            for finished in finished_jobs(process_id, range(4), 2, standing=standing)
        }  # fmt: skip
        assert 1 <= len(hosts) <= 2
        assert os.getpid() not in hosts
        assert all(Path(f"/proc/{host}").exists() for host in hosts)
    assert not any(Path(f"/proc/{host}").exists() for host in hosts)


def test_jobs_elsewhere_see_files_as_they_were_read_here(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text("mass: 1")
    with inputs_read_once():
        input_text(path)
        path.write_text("mass: 2")
        results = [one.result for one in finished_jobs(partial(read, path), [0, 1], 2)]
    assert results == ["mass: 1", "mass: 1"]


@pytest.mark.parametrize("workers", [0, -1])
def test_a_number_of_workers_is_at_least_one(workers):
    with pytest.raises(SweepError, match=f"workers: found {workers}; accepted: at least 1"):
        list(finished_jobs(square, [1], workers))


def slow(number):
    time.sleep(0.05)
    return number


def test_long_work_starts_processes_by_itself(monkeypatch):
    monkeypatch.setattr(module, "WORTH_PROCESSES", 0.1)
    monkeypatch.setattr(module, "default_workers", lambda: 2)
    finished = list(finished_jobs(slow, range(6)))
    assert sorted(one.result for one in finished) == list(range(6))


STARTED = """
from cdpr_drake.analyses.frame.jobs import _Process
process = _Process(abs)
print(open(f"/proc/{process._process.pid}/status").read())
process.end(at_once=True)
"""


def test_ctrl_c_does_not_end_the_first_process_while_it_starts():
    """Python's resource tracker, which starts before it, lets signals through."""
    status = subprocess.run([sys.executable, "-c", STARTED], capture_output=True, text=True).stdout
    blocked = int(status.split("SigBlk:")[1].split()[0], 16)
    for number in (signal.SIGINT, signal.SIGTERM):
        assert blocked & 1 << (number - 1)
