"""Jobs on a Dask cluster of this machine: what workers do, lack, or die of."""

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import pytest

from cdpr_drake.analyses.frame import cluster as module
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.job import ProcessDied
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.runs.seeds import run_many, with_seeds
from cdpr_drake.errors import SweepError
from cdpr_drake.schema.input_files import input_text, inputs_read_once
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.frame.test_jobs import read, square
from tests.messages import printed

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def local():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as cluster:
        yield cluster


def test_jobs_come_back_in_few_batches_and_the_dashboard_is_named(local, monkeypatch):
    sizes, lines = [], []
    submit = module._Cluster._submit
    monkeypatch.setattr(
        module._Cluster, "_submit",
        lambda self, batch, place: (sizes.append(len(batch.numbers)), submit(self, batch, place)),
    )  # fmt: skip
    address = local.scheduler_address
    finished = list(finished_jobs(square, range(500), address, say=lines.append, name="square"))
    assert sorted((one.number, one.result) for one in finished) == [(k, k * k) for k in range(500)]
    assert {one.place for one in finished} == {w.worker_address for w in local.workers.values()}
    assert len(sizes) < 50
    assert lines[0].startswith("Dask dashboard: http")


def fails(number):
    if number == 2:
        raise ValueError("two\nis odd")
    if number == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_job_that_raises_or_kills_its_worker_is_named_and_others_go_on(local, capfd):
    finished = {one.number: one for one in finished_jobs(fails, range(8), local.scheduler_address)}
    assert printed(capfd).err == ""
    assert sorted(finished) == list(range(8))
    assert finished[2].words().startswith("ValueError: two (on worker tcp://")
    assert isinstance(finished[4].problem, ProcessDied)
    assert "its process died 2 times" in finished[4].words()
    assert [finished[k].result for k in (0, 1, 3, 5, 6, 7)] == [0, 1, 3, 5, 6, 7]


def wait_and_name(number):
    time.sleep(0.02)
    return os.getpid()


@pytest.fixture
def workers(local):
    """Process ids of the two workers."""
    with distributed.Client(local.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2)  # those that died are replaced
        return list(client.run(os.getpid).values())


def test_a_worker_that_hangs_holds_nobody_up(local, workers, monkeypatch):
    monkeypatch.setattr(module, "SILENCE", 2.0)
    os.kill(workers[0], signal.SIGSTOP)
    try:
        finished = list(finished_jobs(wait_and_name, range(40), local.scheduler_address))
    finally:
        os.kill(workers[0], signal.SIGCONT)
    assert sorted(one.number for one in finished) == list(range(40))


def test_it_says_so_if_no_worker_answers(local, workers, monkeypatch):
    monkeypatch.setattr(module, "SILENCE", 2.0)
    lines = []

    def say(words):
        lines.append(words)
        if "none answers" in words:
            for process in workers:
                os.kill(process, signal.SIGCONT)

    for process in workers:
        os.kill(process, signal.SIGSTOP)
    finished = list(finished_jobs(square, range(9), local.scheduler_address, say=say))
    assert len(finished) == 9
    assert len(lines) == 2


def test_jobs_see_files_as_they_were_read_here(local, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text("mass: 1")
    with inputs_read_once():
        input_text(path)
        path.write_text("mass: 2")
        jobs = finished_jobs(partial(read, path), [0, 1], local.scheduler_address)
        assert [one.result for one in jobs] == ["mass: 1", "mass: 1"]


def test_workers_with_other_code_are_refused_by_name(local, monkeypatch):
    monkeypatch.setattr(module, "code_version", lambda: "0.0 of somebody")
    lines = []
    with pytest.raises(SweepError, match=r"no worker can do the jobs\. tcp://.*accepted: 0\.0 of"):
        list(finished_jobs(square, range(3), local.scheduler_address, say=lines.append))
    assert any("is not used: it has cdpr_drake" in line for line in lines)


def test_runs_over_seeds_are_those_of_this_machine_though_a_worker_dies(local, workers):
    changes = ["camera.kind=projected", "duration=0.1", "integration.loop=compiled"]
    scenarios = with_seeds(load_scenario("acrobot_pbvs", changes), range(6))
    here = run_many(scenarios, 1, traces=True)

    def kill_one(progress):
        if progress.done == 1:
            os.kill(workers[0], signal.SIGKILL)

    there = run_many(scenarios, local.scheduler_address, traces=True, follow=Follow(kill_one))
    assert [record.seed for record in there.records] == list(range(6))
    for one, other in zip(here.records, there.records, strict=True):
        assert one.end.tobytes() == other.end.tobytes()
        assert one.traces.keys() == other.traces.keys()
        assert all(
            one.traces[name].tobytes() == other.traces[name].tobytes() for name in one.traces
        )


@pytest.fixture
def scattered(tmp_path):
    """Starts a scheduler without this package, and workers with or without it, as programs."""
    (tmp_path / "cdpr_drake.py").write_text("raise ModuleNotFoundError('no cdpr_drake')")
    file = tmp_path / "scheduler.json"
    words = ("--scheduler-file", str(file), "--no-dashboard")
    programs = []

    def start(*more, has_package):
        place = {} if has_package else {"cwd": tmp_path}  # modules of which are found first
        command = [sys.executable, "-m", "dask", *more, *words]
        programs.append(subprocess.Popen(command, stderr=subprocess.DEVNULL, **place))

    def cluster(has_package):
        start("scheduler", "--host", "127.0.0.1", "--port", "0", has_package=False)
        start("worker", "--nthreads", "1", "--no-nanny", has_package=has_package)
        while not file.exists():
            time.sleep(0.05)
        return str(file), programs

    yield cluster
    for program in programs:
        program.kill()
        program.wait()


def test_a_scheduler_needs_no_package(scattered):
    finished = list(finished_jobs(square, range(5), scattered(True)[0]))
    assert sorted(one.result for one in finished) == [0, 1, 4, 9, 16]


def test_workers_without_the_package_are_named(scattered):
    with pytest.raises(SweepError, match=r"no worker can do the jobs.*no cdpr_drake"):
        list(finished_jobs(square, range(5), scattered(False)[0]))


def test_a_scheduler_that_hangs_is_lost_in_time(scattered, monkeypatch):
    monkeypatch.setattr(module, "SILENCE", 2.0)
    file, (scheduler, _) = scattered(True)
    finished = finished_jobs(wait_and_name, range(1000), file)
    next(finished)
    scheduler.send_signal(signal.SIGSTOP)
    began = time.monotonic()
    with pytest.raises(SweepError, match="the scheduler was lost; what was finished is kept"):
        list(finished)
    assert time.monotonic() - began < 10.0


def test_without_workers_it_says_so_and_gives_up(monkeypatch):
    monkeypatch.setattr(module, "NO_WORKER", (0.5, 2.0))
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty:
        lines = []
        with pytest.raises(SweepError, match="no worker can do the jobs"):
            list(finished_jobs(square, [1], empty.scheduler_address, say=lines.append))
        assert any("waits for workers; none is connected" in line for line in lines)


def test_without_workers_a_request_to_stop_ends_it():
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty:
        asked = threading.Event()
        threading.Timer(1.0, asked.set).start()
        assert list(finished_jobs(square, [1], empty.scheduler_address, stop=asked.is_set)) == []


REFUSALS = {
    "empty": ("", "found an empty word; accepted: the address of a Dask scheduler"),
    "nobody": ("tcp://127.0.0.1:9", "does not answer"),
    "no port": ("tcp://localhost", "does not answer"),
    "no file": ("no_such.json", "found no file no_such.json"),
    "certificates": ("tls://127.0.0.1:8786", "DASK_DISTRIBUTED__COMM__TLS__CA_FILE"),
}


@pytest.mark.parametrize(("word", "words"), REFUSALS.values(), ids=REFUSALS)
def test_an_address_is_refused_in_one_line(monkeypatch, word, words):
    """A client that cannot start is closed at once; collected later, it would print a traceback."""
    monkeypatch.setattr(module, "SCHEDULER_TIMEOUT", 1.0)
    started, start = [], distributed.Client.start
    monkeypatch.setattr(
        distributed.Client, "start", lambda self, **how: (started.append(self), start(self, **how))
    )
    with pytest.raises(SweepError, match=words) as caught:
        list(finished_jobs(square, [1], word))
    assert len(str(caught.value).splitlines()) == 1
    assert {client.status for client in started} <= {"closed"}
