"""Jobs and what they left, without a page: small programs stand for `cdpr`, but for one run."""

import asyncio
import json
import os
import select
import sys

import pytest

from cdpr_drake.analyses.runs.steering import Message
from cdpr_drake.studio.jobs import Job, JobError, JobManager, JobState, progress_of
from cdpr_drake.studio.run_job import MOST_EVENTS, RunJob, Samples
from tests.studio.conftest import RUN_SETTINGS
from tests.studio.pages import until

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""


class Toy(Job):
    """A program of a few lines in the place of `cdpr`."""

    program = (sys.executable, "-c")


def toy(code, folder):
    return Toy("toy", [code], folder)


SAYS = (
    "import sys; print('{\"answer\": 42}')\n"
    "print('progress: Grid:  45 %, 9 of 20', file=sys.stderr)\n"
    "sys.stderr.write('at last'); sys.exit(int(sys.argv[1]) if sys.argv[1:] else 0)"
)
SLEEPS = "import time; time.sleep(3600)"
POLITE = (
    "import signal, sys, time\n"
    "signal.signal(signal.SIGTERM, lambda *_: (open('kept', 'w').write('all'), sys.exit(130)))\n"
    "print('ready', file=sys.stderr, flush=True)\n"
    "time.sleep(3600)\n"
)
DEAF = POLITE.replace(
    "lambda *_: (open('kept', 'w').write('all'), sys.exit(130))", "signal.SIG_IGN"
)


def test_progress_is_told_by_lines():
    assert progress_of("progress: Grid:  45 %, 9 of 20") == (0.45, "Grid: 9 of 20")
    assert progress_of("progress: Grid, building") == (None, "Grid, building")
    assert progress_of("Grid:  45 %, 9 of 20") is None


@pytest.mark.parametrize(
    ("code", "state", "words"),
    [
        (SAYS, "finished", ""),
        (SAYS.replace("sys.argv[1:] else 0", "0 else 3"), "finished", "exit code 3: at last"),
        (SAYS.replace("sys.argv[1:] else 0", "0 else 1"), "failed", "exit code 1: at last"),
        ("import sys; print('cdpr: a\\ncdpr: b', file=sys.stderr); sys.exit(2)", "failed",
         "a; and 1 more"),
        ("1 / 0", "failed", "exit code 1: ZeroDivisionError: division by zero"),
        ("import os; os.kill(os.getpid(), 9)", "failed", "the process was ended by SIGKILL"),
        ("a\0b", "failed", "cannot be started: embedded null byte"),
        (SLEEPS, "failed", "not there"),
    ],
)  # fmt: skip
async def test_how_a_job_ends_is_one_line(tmp_path, code, state, words):
    job = toy(code, tmp_path / "not there" if "not there" in words else tmp_path)
    told = []
    job.changed = lambda: told.append(job.state)
    assert job.elapsed == 0.0
    job.begin()
    assert job.state == JobState.RUNNING
    assert await job.wait(LONGEST)
    assert job.state == state
    assert job.message == words or "not there" in words in job.message
    assert told == ["running", state]
    assert job.elapsed > 0.0
    if code.startswith("import sys; print('{"):
        assert job.result() == {"answer": 42}
        assert job.lines == ["at last"]
        assert job.progress == ((1.0, "") if state == "finished" else (0.45, "Grid: 9 of 20"))


async def test_so_many_at_once_and_the_rest_in_order(tmp_path):
    jobs = JobManager(at_once=1)
    first, second, third = (jobs.submit(toy(code, tmp_path)) for code in (POLITE, SLEEPS, SAYS))
    assert [job.state for job in jobs.jobs] == ["running", "queued", "queued"]
    assert jobs.is_busy
    second.stop()
    assert second.state == JobState.STOPPED
    await until(lambda: first.lines == ["ready"])
    first.stop()
    assert first.state == JobState.STOPPING
    assert third.state == JobState.QUEUED
    assert await third.wait(LONGEST)
    assert (first.state, third.state) == (JobState.STOPPED, JobState.FINISHED)
    assert (tmp_path / "kept").read_text() == "all"
    assert jobs.job(third.number) is third
    assert not jobs.is_busy
    third.stop()
    assert third.state == JobState.FINISHED


@pytest.mark.parametrize(("code", "seconds"), [(POLITE, LONGEST), (DEAF, 0.0)])
async def test_the_end_of_the_server_stops_all_in_order(tmp_path, code, seconds):
    jobs = JobManager(at_once=1)
    working, queued = jobs.submit(toy(code, tmp_path)), jobs.submit(toy(SLEEPS, tmp_path))
    await until(lambda: working.lines == ["ready"])
    await jobs.close(seconds)
    assert (working.state, queued.state) == (JobState.STOPPED, JobState.STOPPED)
    assert (tmp_path / "kept").exists() == (code == POLITE)
    with pytest.raises(JobError, match="ending"):
        jobs.submit(toy(SAYS, tmp_path))


def test_no_process_outlives_the_event_loop(tmp_path):
    async def leave():
        job = toy(DEAF, tmp_path)
        job.begin()
        await until(lambda: job.lines == ["ready"])
        return os.pidfd_open(job.process_id)

    descriptor = asyncio.run(leave())
    assert select.select([descriptor], [], [], LONGEST)[0] == [descriptor]
    os.close(descriptor)


async def test_a_job_whose_server_is_killed_keeps_what_it_has_and_ends(tmp_path):
    """The kernel closes the server's end of the pipe then; no other job has it."""
    job = toy(
        "from cdpr_drake.cli.process import exit_with_parent\nexit_with_parent()\n" + POLITE,
        tmp_path,
    )
    job.begin()
    await until(lambda: job.lines == ["ready"])
    other = toy(SLEEPS, tmp_path)
    other.begin()
    await until(lambda: other.process_id is not None)
    os.dup2(os.open(os.devnull, os.O_WRONLY), job._lifeline)
    assert await job.wait(LONGEST)
    assert (tmp_path / "kept").read_text() == "all"
    assert not other.state.is_over
    other.kill()
    assert await other.wait(LONGEST)


async def test_a_slow_listener_keeps_the_newest_and_one_image(tmp_path):
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out")
    listener = job.listen()
    error = {"position_error": None, "rotation_error": None}
    for number in range(10 * MOST_EVENTS):
        job.take(Message("sample", {"t": number, **error}))
        job.take(Message("image", {"t": number}, b"jpeg"))
    events = listener.take()
    samples = [event.data["t"] for event in events if event.kind == "sample"]
    assert samples == list(range(9 * MOST_EVENTS, 10 * MOST_EVENTS))
    assert [event.data["t"] for event in events if event.kind == "image"] == [samples[-1]]
    assert listener.lost == 9 * MOST_EVENTS
    job.forget(listener)
    job.take(Message("sample", {"t": 0, **error}))
    assert listener.take() == []


def test_samples_are_thinned_evenly_and_the_newest_is_kept():
    samples = Samples(limit=10)
    for number in range(100):
        samples.add({"t": number})
    times = [sample["t"] for sample in samples.all()]
    assert times == [0, 16, 32, 48, 64, 80, 96, 99]


async def test_a_run_that_is_watched_paused_and_stepped_has_the_same_log(tmp_path, alone):
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out", settings=RUN_SETTINGS)
    job.pause()
    quick, slow = job.listen(), job.listen()
    job.begin()
    await until(lambda: job.state == JobState.PAUSED or job.state.is_over, LONGEST)
    assert job.state == JobState.PAUSED, job.message
    assert job.samples.last["t"] == 0.0
    job.step()
    await until(lambda: job.samples.last["t"] > 0.0 and job.state == JobState.PAUSED)
    first = job.samples.last["t"]
    assert first == pytest.approx(job.header["period"], abs=2e-3)  # a step of the integration
    assert job.image.startswith(b"\xff\xd8")  # as JPEG does
    assert {event.kind for event in quick.take()} >= {"begin", "sample", "image", "pace"}
    assert job.progress[0] == pytest.approx(first / 0.2)
    job.set_speed(1.0)
    job.go()
    assert await job.wait(LONGEST)
    assert job.state == JobState.FINISHED, job.message
    assert slow.take()[0].kind == "begin"
    for name in ("log.csv", "scenario.yaml", "robot.yaml"):
        assert (tmp_path / "out" / name).read_bytes() == (alone / name).read_bytes()
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        path.name for path in alone.iterdir()
    }
    said = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert job.result() == said
    assert said["outcome"] == "timeout"


def test_a_speed_without_sense_is_refused(tmp_path):
    with pytest.raises(JobError, match="speed: found 0;"):
        RunJob("acrobot_pbvs", tmp_path, tmp_path / "out", speed=0.0)
