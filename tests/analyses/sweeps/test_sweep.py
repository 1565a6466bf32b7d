"""Folders of finished chunks, and jobs on a cluster that loses workers."""

import gc
import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.written_files import MARKER, mark, new_part
from cdpr_drake.analyses.simulation.monte_carlo import run_many, with_seeds
from cdpr_drake.analyses.sweeps import workers as sweep_workers
from cdpr_drake.analyses.sweeps.folder import SweepFolder, differences
from cdpr_drake.analyses.sweeps.workers import check_scheduler, run_jobs_on
from cdpr_drake.errors import OutputFolderError, SweepError
from cdpr_drake.systems.diagrams.load import load_scenario

PATIENCE = 1800.0
"""So long may Dask take for what is quick on an idle machine [s]."""

ARGUMENTS = {"robot": "acrobot_large", "seed": 1, "bounds": {"r_A": 0.005, "r_B": 0.005}}


CHUNK = {"x": np.arange(3.0)}


@pytest.fixture
def kept(tmp_path):
    """Makes the folder, or opens it again."""
    return lambda: SweepFolder(tmp_path / "s", ARGUMENTS)


def test_a_chunk_is_there_again_unless_it_is_damaged(tmp_path, kept):
    (tmp_path / "s").mkdir()
    mark(tmp_path / "s")
    new_part(tmp_path / "s" / "arguments.json").write_text("{")  # of who was killed
    kept().store("seed-1", 0, 3, CHUNK)
    np.testing.assert_array_equal(kept().load("seed-1", 0, 3)["x"], CHUNK["x"])
    assert kept().load("seed-1", 0, 2) is None
    (chunk,) = (tmp_path / "s" / "chunks").iterdir()
    chunk.write_bytes(chunk.read_bytes()[:100])
    assert kept().load("seed-1", 0, 3) is None
    assert sorted(os.listdir(tmp_path / "s")) == [MARKER, "arguments.json", "chunks"]


def test_a_folder_of_other_arguments_is_refused_by_name_of_the_difference(tmp_path, kept):
    kept()
    other = ARGUMENTS | {"seed": 2, "bounds": {"r_A": 0.01, "r_B": 0.005}}
    with pytest.raises(OutputFolderError) as refused:
        SweepFolder(tmp_path / "s", other)
    words = str(refused.value)
    assert "seed is 1 there, 2 here" in words
    assert "bounds.r_A is 0.005 there, 0.01 here" in words
    assert "r_B" not in words
    assert "\n" not in words


def test_other_folders_are_refused_before_anything_is_computed_and_left_alone(tmp_path):
    thesis = tmp_path / "thesis.txt"
    thesis.write_text("x")

    with pytest.raises(OutputFolderError, match="holds files already"):
        SweepFolder(tmp_path, ARGUMENTS)
    with pytest.raises(OutputFolderError, match="found a file"):
        SweepFolder(thesis, ARGUMENTS)
    assert os.listdir(tmp_path) == ["thesis.txt"]
    thesis.unlink()
    (tmp_path / "arguments.json").write_text("{")
    with pytest.raises(OutputFolderError, match="no JSON"):
        SweepFolder(tmp_path, ARGUMENTS)


def test_differences_are_named_wherever_they_are():
    there = {"a": 1, "b": {"c": [1, 2], "d": 3}, "e": 0}
    here = {"a": 1, "b": {"c": [1, 5], "d": [3]}, "f": None}
    assert list(differences(there, here)) == [
        "b.c[1] is 2 there, 5 here",
        "b.d is 3 there, [3] here",
        "f is not there, null here",
        "e is 0 there, not here",
    ]
    assert not list(differences(there, json.loads(json.dumps(there))))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_named_and_its_client_closed_at_once(
    monkeypatch, address
):
    # One that is left to the garbage collector takes a lock there, which deadlocks with the start
    # of another.
    from distributed import Client

    monkeypatch.setattr(sweep_workers, "SCHEDULER_TIMEOUT", 0.3)
    gc.collect()
    gc.disable()
    try:
        with pytest.raises(SweepError) as refused:
            check_scheduler(address)
        left = [thing.status for thing in gc.get_objects() if issubclass(type(thing), Client)]
    finally:
        gc.enable()
    assert set(left) == {"closed"}
    assert f"{address}: does not answer" in str(refused.value)
    assert "on this machine" in str(refused.value)
    assert "\n" not in str(refused.value)


def _dask(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


class Cluster:
    """A Dask scheduler and its workers; what a test has killed is started again where it is asked
    for."""

    def __init__(self, folder):
        self.folder, self.address, self.scheduler, self.started = folder, "", None, 0
        self.workers = {}
        """By the names that the scheduler has of them."""

    def begin(self):
        self.address, file = "", self.folder / "scheduler.json"
        file.unlink(missing_ok=True)
        self.scheduler = _dask(
            "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
            "--no-dashboard", "--scheduler-file", str(file),
        )  # fmt: skip
        while not self.address:  # the file may be there before its text is
            assert self.scheduler.poll() is None
            with suppress(FileNotFoundError, json.JSONDecodeError):
                self.address = json.loads(file.read_text())["address"]
            time.sleep(0.05)

    def of(self, count):
        """Address of the scheduler, and at least so many workers, which it knows."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            self.end()
            self.begin()
        alive = {name: one for name, one in self.workers.items() if one.poll() is None}
        while len(alive) < count:
            self.started += 1
            name = f"worker {self.started}"
            alive[name] = _dask(
                "distributed.cli.dask_worker", "--no-nanny", "--nthreads", "1", "--no-dashboard",
                "--name", name, "--local-directory", str(self.folder), self.address,
            )  # fmt: skip
        self.workers = alive
        wait_for_workers(self.address, set(alive))
        return self.address, list(alive.values())

    def end(self):
        for process in (*self.workers.values(), *([self.scheduler] if self.scheduler else [])):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster_of_all(tmp_path_factory):
    one = Cluster(tmp_path_factory.mktemp("cluster"))
    yield one
    one.end()


@pytest.fixture
def cluster(cluster_of_all, monkeypatch):
    """See `Cluster.of`."""
    monkeypatch.setattr(sweep_workers, "SCHEDULER_TIMEOUT", PATIENCE)
    return cluster_of_all


def wait_for_workers(address, names):
    """Until a scheduler knows these workers and no others.

    It is asked, and not the workers: one that was killed may be known for a moment, and never
    answers.
    """
    from distributed import Client

    deadline = time.monotonic() + PATIENCE
    with Client(address, timeout=PATIENCE, set_as_default=False) as client:
        while names != {one["name"] for one in client.scheduler_info()["workers"].values()}:
            assert time.monotonic() < deadline
            time.sleep(0.05)


def test_a_cluster_with_other_code_is_refused(cluster, monkeypatch):
    """Its numbers could be others, and once were taken without a word."""
    address, _ = cluster.of(2)
    monkeypatch.setattr("cdpr_drake.analyses.sweeps.workers.code_version", lambda: "0.0.1 other")
    with pytest.raises(SweepError, match=r"a worker of the cluster has cdpr_drake .*0\.0\.1 other"):
        list(run_jobs_on(address, math.sqrt, [1.0] * 9))


def refuse():
    raise ValueError("cannot be unpickled")


class NotSendable(Exception):
    """An error that pickles and does not unpickle."""

    def __reduce__(self):
        return refuse, ()


def fail(job):
    raise NotSendable


def test_an_error_that_cannot_be_sent_is_an_error_all_the_same(cluster):
    """Once nobody ever heard of it."""
    address, _ = cluster.of(2)
    with pytest.raises(Exception, match="NotSendable"):  # Dask has its words only
        list(run_jobs_on(address, fail, [1, 2]))


def test_runs_over_seeds_on_a_cluster_that_loses_a_worker_are_those_of_this_machine(cluster):
    scenario = load_scenario(
        "acrobot_pbvs", ["camera.kind=projected", "duration=0.1", "integration.loop=compiled"]
    )
    scenarios = with_seeds(scenario, range(6))
    here = run_many(scenarios, 1, keep_traces=True)
    address, workers = cluster.of(2)

    def kill_one(progress):
        if progress.done == 1:
            workers[0].send_signal(signal.SIGKILL)

    there = run_many(scenarios, None, kill_one, keep_traces=True, scheduler=address)
    assert workers[0].wait(PATIENCE) == -signal.SIGKILL
    assert [record.seed for record in there.records] == list(range(6))
    for one, other in zip(here.records, there.records, strict=True):
        assert one.end.tobytes() == other.end.tobytes()
        assert {n: a.tobytes() for n, a in one.traces.items()} == {
            n: a.tobytes() for n, a in other.traces.items()
        }


def test_a_cluster_without_workers_is_said(cluster):
    address, workers = cluster.of(1)
    for worker in workers:
        worker.kill()
        worker.wait()
    deadline = time.monotonic() + PATIENCE

    def ask():
        while time.monotonic() < deadline:  # the scheduler may know them for a moment
            check_scheduler(address)
            time.sleep(0.2)

    with pytest.raises(SweepError, match="has no workers"):
        ask()


def test_a_scheduler_that_is_lost_is_said_after_what_was_finished(cluster):
    address, _ = cluster.of(1)
    finished = []

    def lose_it():
        for _, root in run_jobs_on(address, math.sqrt, [4.0] * 500):
            finished.append(root)
            if len(finished) == 20:
                cluster.scheduler.kill()

    with pytest.raises(SweepError, match=r"was lost on the way .* run again to continue"):
        lose_it()
    assert set(finished) == {2.0}
    assert 20 <= len(finished) < 500
