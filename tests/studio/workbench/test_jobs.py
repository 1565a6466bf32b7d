"""Jobs without a page: small programs stand for `cdpr`, but where the name says a run."""

import json
import os
import signal
import sys
import time

import pytest

from cdpr_drake.studio.jobs import (
    MOST_EVENTS,
    CommandJob,
    Event,
    JobError,
    JobManager,
    JobState,
    progress_of,
)
from cdpr_drake.studio.run_job import RunJob
from tests.studio.conftest import RUN_SETTINGS

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""


class Toy(CommandJob):
    """A program of a few lines in the place of `cdpr`."""

    program = (sys.executable, "-c")


def toy(code, folder):
    return Toy("toy", [code], folder)


def until(holds):
    """Waits for something that another process does."""
    for _ in range(int(LONGEST / 0.01)):
        if holds():
            return True
        time.sleep(0.01)
    return False


SAYS = (
    "import sys; print('{\"answer\": 42}')\n"
    "print('progress: Grid:  45 %, 9 of 20', file=sys.stderr)\n"
)
SLEEPS = "import time; print('ready', flush=True); time.sleep(3600)"
POLITE = (
    "import signal, sys, time\n"
    "signal.signal(signal.SIGTERM, lambda *_: (open('kept', 'w').write('all'), sys.exit(130)))\n"
    "print('ready', file=sys.stderr, flush=True)\n"
    "time.sleep(3600)\n"
)


DEAF = (
    "import signal, sys, time\n"
    "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    "print('ready', file=sys.stderr, flush=True)\n"
    "time.sleep(3600)\n"
)


def test_a_command_ends_with_its_result_and_told_its_progress(tmp_path):
    job = toy(SAYS, tmp_path)
    listeners = [job.listen(), job.listen()]
    job.begin()
    assert job.wait(LONGEST)
    assert (job.state, job.message, job.result()) == (JobState.FINISHED, "", {"answer": 42})
    for listener in listeners:
        events = {event.kind: event.data for event in listener.take()}
        assert events["state"]["state"] == "finished"
        assert events["progress"]["fraction"] == 1.0
    assert progress_of("progress: Grid:  45 %, 9 of 20") == (0.45, "Grid: 9 of 20")
    assert progress_of("progress: Grid, building") == (None, "Grid, building")
    assert progress_of("Grid:  45 %, 9 of 20") is None


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import sys; print('cdpr: found 3; accepted: 4', file=sys.stderr); sys.exit(2)",
         "found 3; accepted: 4"),
        ("1 / 0", "exit code 1: ZeroDivisionError"),
    ],
)  # fmt: skip
def test_a_failure_is_one_line(tmp_path, code, words):
    job = toy(code, tmp_path)
    job.begin()
    assert job.wait(LONGEST)
    assert job.state == JobState.FAILED
    assert job.message.startswith(words)


def test_what_kills_a_job_is_named_and_leaves_the_server_alone(tmp_path):
    job = toy(SLEEPS, tmp_path)
    job.begin()
    os.kill(job.process_id, signal.SIGKILL)
    assert job.wait(LONGEST)
    assert (job.state, job.message) == (JobState.FAILED, "the process was ended by SIGKILL")


def test_what_cannot_be_started_has_failed(tmp_path):
    job = Toy("toy", [SLEEPS], tmp_path / "not there")
    job.begin()
    assert job.state == JobState.FAILED
    assert "not there" in job.message


def test_stop_lets_a_job_keep_what_it_has(tmp_path):
    job = toy(POLITE, tmp_path)
    job.begin()
    assert until(lambda: job.lines == ["ready"])
    job.stop()
    assert job.state in (JobState.STOPPING, JobState.STOPPED)
    assert job.wait(LONGEST)
    assert job.state == JobState.STOPPED
    assert (tmp_path / "kept").read_text() == "all"


def test_so_many_at_once_and_the_rest_in_order(tmp_path):
    jobs = JobManager(at_once=1)
    first, second, third = (jobs.submit(toy(code, tmp_path)) for code in (SLEEPS, SLEEPS, SAYS))
    assert [job.state for job in (first, second, third)] == ["running", "queued", "queued"]
    second.stop()
    assert second.state == JobState.STOPPED
    first.stop()
    assert third.wait(LONGEST)
    assert (first.state, third.state) == (JobState.STOPPED, JobState.FINISHED)
    assert jobs.job(third.number) is third


def test_the_end_of_the_server_stops_all_in_order(tmp_path):
    jobs = JobManager(at_once=1)
    polite, queued = jobs.submit(toy(POLITE, tmp_path)), jobs.submit(toy(SLEEPS, tmp_path))
    assert until(lambda: polite.lines == ["ready"])
    jobs.close()
    assert (polite.state, queued.state) == (JobState.STOPPED, JobState.STOPPED)
    assert (tmp_path / "kept").exists()
    with pytest.raises(JobError, match="ending"):
        jobs.submit(toy(SAYS, tmp_path))


def test_what_does_not_stop_is_killed_at_the_end(tmp_path):
    deaf = toy(DEAF, tmp_path)
    jobs = JobManager(at_once=1)
    jobs.submit(deaf)
    assert until(lambda: deaf.lines == ["ready"])
    jobs.close(seconds=0.0)
    assert deaf.state == JobState.STOPPED


def test_a_job_whose_server_is_killed_keeps_what_it_has_and_ends(tmp_path):
    """The kernel closes the server's end of the pipe then; no other job has it."""
    job = toy(
        "from cdpr_drake.cli.process import exit_with_parent\nexit_with_parent()\n" + POLITE,
        tmp_path,
    )
    job.begin()
    assert until(lambda: job.lines == ["ready"])
    other = toy(SLEEPS, tmp_path)
    other.begin()
    os.dup2(os.open(os.devnull, os.O_WRONLY), job._child._lifeline)
    assert job.wait(LONGEST)
    assert (tmp_path / "kept").read_text() == "all"
    assert not other.state.is_over
    other.kill()
    assert other.wait(LONGEST)


def test_a_slow_listener_keeps_the_newest_and_one_image(tmp_path):
    job = toy(SAYS, tmp_path)
    listener = job.listen()
    for number in range(10 * MOST_EVENTS):
        job.emit(Event("sample", {"t": number}))
        job.emit(Event("image", {"t": number}, b"jpeg"))
    events = listener.take()
    samples = [event.data["t"] for event in events if event.kind == "sample"]
    assert samples == list(range(9 * MOST_EVENTS, 10 * MOST_EVENTS))
    assert [event.data["t"] for event in events if event.kind == "image"] == [samples[-1]]
    assert listener.lost == 9 * MOST_EVENTS
    job.forget(listener)
    job.emit(Event("sample"))
    assert listener.take() == []


def test_a_run_that_is_watched_paused_and_stepped_has_the_same_log(tmp_path, alone):
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out", settings=RUN_SETTINGS, paused=True)
    quick, slow = job.listen(), job.listen()
    job.begin()
    assert until(lambda: job.state == JobState.PAUSED or job.state.is_over)
    assert job.state == JobState.PAUSED, job.message
    assert job.samples.last["t"] == 0.0
    job.step()
    assert until(lambda: job.samples.last["t"] > 0.0 and job.state == JobState.PAUSED)
    first = job.samples.last["t"]
    assert first == pytest.approx(job.header["period"], abs=2e-3)  # a step of the integration
    assert job.image.startswith(b"\xff\xd8")  # as JPEG does
    assert {event.kind for event in quick.take()} >= {"begin", "sample", "image", "pace"}
    job.set_speed(1.0)
    job.go()
    assert job.wait(LONGEST)
    assert job.state == JobState.FINISHED, job.message
    # What a run says while it loads comes before, where that takes long.
    kinds = [event.kind for event in slow.take()]
    assert next(kind for kind in kinds if kind not in ("line", "progress")) == "begin"
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
