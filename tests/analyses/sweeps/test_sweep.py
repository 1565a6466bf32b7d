"""Sweeps: the same numbers however they are cut, stopped, continued or computed by others."""

import gc
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.written_files import MARKER, mark, new_part
from cdpr_drake.analyses.simulation.monte_carlo import run_many, with_seeds
from cdpr_drake.analyses.sweeps import workers as sweep_workers
from cdpr_drake.analyses.sweeps.folder import SweepFolder, differences
from cdpr_drake.analyses.sweeps.sweep import run_sweep
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.analyses.workspaces.stability import held_poses
from cdpr_drake.errors import OutputFolderError, SweepError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.pose_grid import grid_by_count

PATIENCE = 1800.0
"""So long may Dask take for what is quick on an idle machine [s]."""

ARGUMENTS = {"robot": "acrobot_large", "seed": 1, "bounds": {"r_A": 0.005, "r_B": 0.005}}


@pytest.fixture(scope="module")
def tasks():
    grid = grid_by_count([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0], [13, 13, 6])
    robot = load_robot("acrobot_large")
    return {
        name: (partial(held_poses, static_case(robot, (low, 60.0)), grid), grid.size)
        for name, low in (("slack", 0.0), ("taut", 1.0))
    }


@pytest.fixture(scope="module")
def expected(tasks):
    return {name: task(0, count)["feasible"] for name, (task, count) in tasks.items()}


@pytest.fixture
def kept(tmp_path):
    """Makes the folder of a sweep, or finds it again."""
    return lambda: SweepFolder(tmp_path / "s", ARGUMENTS)


def same(result, expected):
    assert result.arrays.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(result.arrays[name]["feasible"], values)


def stopped(tasks, size, folder=None, after=500):
    """A sweep that is told to stop once so much is done."""
    reports = []
    return run_sweep(
        tasks, size, folder, on_progress=reports.append,
        should_stop=lambda: reports[-1].done >= after,
    )  # fmt: skip


@pytest.mark.parametrize("chunk_size", [1014, 100, 37])
def test_the_cut_does_not_matter(tasks, expected, chunk_size):
    same(run_sweep(tasks, chunk_size), expected)


def test_two_processes_find_the_same_and_report_progress(tasks, expected):
    reports = []
    same(run_sweep(tasks, 200, workers=2, on_progress=reports.append), expected)
    assert [report.done for report in reports] == sorted(report.done for report in reports)
    assert (reports[0].done, reports[-1].done, reports[-1].total) == (0, 2028, 2028)
    assert reports[-1].speed > 0.0


def test_a_stopped_sweep_continues_where_it_stopped(tasks, expected, kept):
    first = stopped(tasks, 100, kept())
    assert first.arrays is None
    assert (first.progress.done, first.progress.what, first.finished) == (500, "slack", {})
    for found in (500, 2028):
        again = run_sweep(tasks, 100, kept())
        assert again.progress.found == found
        same(again, expected)


def test_a_folder_with_chunks_of_another_size_gives_the_same(tasks, expected, kept):
    stopped(tasks, 100, kept())
    for size in (37, 200, 100):
        same(run_sweep(tasks, size, kept()), expected)


def test_finished_tasks_of_a_stopped_sweep_are_there(tasks, expected):
    first = stopped(tasks, 500, after=1015)
    assert first.arrays is None
    assert list(first.finished) == ["slack"]
    np.testing.assert_array_equal(first.finished["slack"]["feasible"], expected["slack"])


def test_a_finished_sweep_is_one_file_and_is_found_again(tasks, expected, tmp_path, kept):
    folder = kept()
    folder.finish(run_sweep(tasks, 500, folder).arrays)
    assert sorted(os.listdir(tmp_path / "s")) == [MARKER, "arguments.json", "parts.npz"]
    again = run_sweep(tasks, 77, kept())  # cut as one likes
    assert again.progress.found == again.progress.total == 2028
    same(again, expected)
    whole = tmp_path / "s" / "parts.npz"
    whole.write_bytes(whole.read_bytes()[:-100])
    damaged = run_sweep(tasks, 500, kept())
    assert damaged.progress.found == 0
    same(damaged, expected)


def test_what_others_put_beside_the_chunks_stays(tasks, tmp_path, kept):
    folder = kept()
    arrays = run_sweep(tasks, 500, folder).arrays
    chunks = tmp_path / "s" / "chunks"
    for name in ("notes.txt", "mine.npz"):
        (chunks / name).write_text("mine")
    own = next(path for path in chunks.iterdir() if path.name.endswith("500.npz"))
    new_part(own)  # of who was killed
    folder.finish(arrays)
    assert sorted(os.listdir(chunks)) == ["mine.npz", "notes.txt"]


def test_who_is_killed_at_the_start_leaves_a_folder_that_can_be_used(tasks, tmp_path, kept):
    (tmp_path / "s").mkdir()
    mark(tmp_path / "s")
    new_part(tmp_path / "s" / "arguments.json").write_text("{")
    kept()
    new_part(tmp_path / "s" / "parts.npz")  # and another one at the end
    folder = kept()
    folder.finish(run_sweep(tasks, 500, folder).arrays)
    assert sorted(os.listdir(tmp_path / "s")) == [MARKER, "arguments.json", "parts.npz"]


def test_a_damaged_chunk_is_computed_again(tasks, expected, tmp_path, kept):
    run_sweep(tasks, 500, kept())
    chunk = sorted((tmp_path / "s" / "chunks").iterdir())[0]
    chunk.write_bytes(chunk.read_bytes()[:100])
    again = run_sweep(tasks, 500, kept())
    assert again.progress.found == 2028 - 500
    same(again, expected)


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
            run_sweep({}, 20, scheduler=address)
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


def test_a_cluster_with_other_code_is_refused(tasks, cluster, monkeypatch):
    """Its numbers could be others, and once were taken without a word."""
    address, _ = cluster.of(2)
    monkeypatch.setattr("cdpr_drake.analyses.sweeps.workers.code_version", lambda: "0.0.1 other")
    with pytest.raises(SweepError, match=r"a worker of the cluster has cdpr_drake .*0\.0\.1 other"):
        run_sweep(tasks, 20, scheduler=address)


def refuse():
    raise ValueError("cannot be unpickled")


class NotSendable(Exception):
    """An error that pickles and does not unpickle."""

    def __reduce__(self):
        return refuse, ()


class Failing:
    """A task that ends in such an error."""

    def __call__(self, start, stop):
        raise NotSendable


def test_an_error_that_cannot_be_sent_is_an_error_all_the_same(cluster):
    """It once kept the sweep waiting for ever."""
    address, _ = cluster.of(2)
    with pytest.raises(Exception, match="NotSendable"):  # Dask has its words only
        run_sweep({"failing": (Failing(), 40)}, 20, scheduler=address)


def test_a_cluster_that_loses_a_worker_finds_the_same(tasks, expected, cluster, kept):
    address, workers = cluster.of(2)
    killed = []

    def kill_one(progress):
        if progress.done > 300 and not killed:
            workers[0].send_signal(signal.SIGKILL)
            killed.append(progress.done)

    result = run_sweep(tasks, 20, kept(), scheduler=address, on_progress=kill_one)
    assert killed
    assert killed[0] < 1500
    assert workers[0].wait(PATIENCE) == -signal.SIGKILL
    same(result, expected)


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


def test_a_cluster_without_workers_is_said(tasks, cluster):
    address, workers = cluster.of(1)
    for worker in workers:
        worker.kill()
        worker.wait()
    deadline = time.monotonic() + PATIENCE

    def ask():
        while time.monotonic() < deadline:  # the scheduler may know them for a moment
            run_sweep({}, 20, scheduler=address)
            time.sleep(0.2)

    with pytest.raises(SweepError, match="has no workers"):
        ask()


def test_a_scheduler_that_is_lost_keeps_what_was_finished(tasks, expected, cluster, kept):
    address, _ = cluster.of(1)
    with pytest.raises(SweepError, match=r"was lost on the way .* run again to continue"):
        run_sweep(
            tasks, 20, kept(), scheduler=address,
            on_progress=lambda p: cluster.scheduler.kill() if p.done > 100 else None,
        )  # fmt: skip
    again = run_sweep(tasks, 20, kept())
    assert 100 < again.progress.found < 2028
    same(again, expected)
