"""Jobs and what they left, without a page: small programs stand for `cdpr`."""

import asyncio
import errno
import os
import select
import signal
import sys
import tempfile

import pytest

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.jobs import Job, JobManager, progress_of
from cdpr_drake.studio.runs import RunJob
from tests.studio.pages import LONGEST, until


def toy(code, folder):
    """A program of a few lines in the place of `cdpr`."""
    job = Job([code], folder)
    job.program = (sys.executable, "-c")
    return job


def ready(job):
    return until(lambda: job.lines == ["ready"])


SAYS = (
    "import sys; print('{\"answer\": 42}')\n"
    "print('progress: Grid:  45 %, 9 of 20', file=sys.stderr)\n"
    "sys.stderr.write('at last'); sys.exit("
)
SLEEPS = "import time; time.sleep(3600)"
DEAF = (
    "import signal, sys, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    "print('ready', file=sys.stderr, flush=True)\ntime.sleep(3600)\n"
)
POLITE = DEAF.replace(
    "signal.SIG_IGN", "lambda *_: (open('kept', 'w').write('all'), sys.exit(130))"
)


def test_progress_is_told_by_lines():
    assert progress_of("progress: Grid:  45 %, 9 of 20") == (0.45, "Grid: 9 of 20")
    assert progress_of("progress: Grid, building") == (None, "Grid, building")
    assert progress_of("Grid:  45 %, 9 of 20") is None


@pytest.mark.parametrize(
    ("code", "state", "words"),
    [
        (SAYS + "0)", "finished", ""),
        (SAYS + "3)", "finished", "exit code 3: at last"),
        (SAYS + "1)", "failed", "exit code 1: at last"),
        ("import sys; print('cdpr: a\\ncdpr: b', file=sys.stderr); sys.exit(2)", "failed",
         "a; and 1 more"),
        ("1 / 0", "failed", "exit code 1: ZeroDivisionError: division by zero"),
        ("import os; os.kill(os.getpid(), 9)", "failed", "the process was ended by SIGKILL"),
        ("a\0b", "failed", "cannot be started: embedded null byte"),
    ],
)  # fmt: skip
async def test_how_a_job_ends_is_one_line(tmp_path, code, state, words):
    job, states = toy(code, tmp_path), []
    job.changed = lambda: states.append(job.state)
    assert job.elapsed == 0.0
    job.begin()
    assert await job.wait(LONGEST)
    assert (states, job.message) == (["running", state], words)
    assert job.elapsed > 0.0
    if code.startswith(SAYS):
        assert (job.result(), job.lines) == ({"answer": 42}, ["at last"])
        assert job.progress == ((1.0, "") if state == "finished" else (0.45, "Grid: 9 of 20"))


async def test_a_job_that_a_full_disk_keeps_from_starting_has_failed(tmp_path, monkeypatch):
    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    files = len(os.listdir("/proc/self/fd"))
    for job in (toy("", tmp_path), RunJob("", tmp_path, tmp_path)):
        job.begin()
        assert await job.wait(LONGEST)
        assert (job.state, job.message) == (
            "failed", "cannot be started: [Errno 28] No space left on device",
        )  # fmt: skip
    del job
    await until(lambda: len(os.listdir("/proc/self/fd")) == files)


async def test_so_many_at_once_and_the_rest_in_order(tmp_path):
    jobs = JobManager(at_once=1)
    first, second, third = (jobs.submit(toy(code, tmp_path)) for code in (POLITE, SLEEPS, "1"))
    assert [job.state for job in jobs.jobs] == ["running", "queued", "queued"]
    assert jobs.is_busy
    second.stop()
    await ready(first)
    first.stop()
    assert [job.state for job in jobs.jobs] == ["stopping", "stopped", "queued"]
    assert await third.wait(LONGEST)
    third.stop()
    assert (first.state, third.state, jobs.is_busy) == ("stopped", "finished", False)


@pytest.mark.parametrize(("code", "seconds"), [(POLITE, LONGEST), (DEAF, 0.0)])
async def test_the_end_of_the_server_stops_all_in_order(tmp_path, code, seconds):
    jobs = JobManager(at_once=1)
    working, queued = jobs.submit(toy(code, tmp_path)), jobs.submit(toy(SLEEPS, tmp_path))
    await ready(working)
    await jobs.close(seconds)
    assert (working.state, queued.state) == ("stopped", "stopped")
    assert (tmp_path / "kept").exists() == (code == POLITE)
    with pytest.raises(CdprError, match="ending"):
        jobs.submit(queued)


def test_no_process_outlives_the_event_loop(tmp_path):
    async def leave():
        job = toy(DEAF, tmp_path)
        job.begin()
        await ready(job)
        return os.pidfd_open(job._process.pid)

    descriptor = asyncio.run(leave())
    assert select.select([descriptor], [], [], LONGEST)[0] == [descriptor]
    os.close(descriptor)


async def test_a_job_whose_server_is_killed_keeps_what_it_has_and_ends(tmp_path):
    """The kernel closes the server's end of the pipe then; no other job has it."""
    watches = "from cdpr_drake.cli.process import exit_with_parent\nexit_with_parent()\n"
    job, other = toy(watches + POLITE, tmp_path), toy(SLEEPS, tmp_path)
    job.begin()
    await ready(job)
    other.begin()
    await until(lambda: other._process is not None)
    os.dup2(os.open(os.devnull, os.O_WRONLY), job._lifeline)
    assert await job.wait(LONGEST)
    assert (tmp_path / "kept").read_text() == "all"
    assert not other.state.is_over
    other.stop(signal.SIGKILL)
    assert await other.wait(LONGEST)
