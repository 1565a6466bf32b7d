"""Jobs and what they left, without a page: small programs stand for `cdpr`."""

import asyncio
import json
import os
import select
import signal
import sys

import pytest

<<<<<<< HEAD
from cdpr_drake.analyses.runs.steering import Message
from cdpr_drake.studio.jobs import Job, JobError, JobManager, JobState, progress_of
from cdpr_drake.studio.run_job import MOST_EVENTS, RunJob, Samples
from tests.studio.conftest import RUN_SETTINGS
=======
from cdpr_drake.cli.command_forms import command_forms
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import CommandBoard
from cdpr_drake.studio.jobs import Job, JobManager, JobState, progress_of
from cdpr_drake.studio.runs import RunBoard
>>>>>>> runs-ready
from tests.studio.pages import until

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""


def toy(code, folder):
    """A program of a few lines in the place of `cdpr`."""
    job = Job("toy", [code], folder)
    job.program = (sys.executable, "-c")
    return job


SAYS = (
    "import sys; print('{\"answer\": 42}')\n"
    "print('progress: Grid:  45 %, 9 of 20', file=sys.stderr)\n"
    "sys.stderr.write('at last'); sys.exit(CODE)"
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
        (SAYS.replace("CODE", "0"), "finished", ""),
        (SAYS.replace("CODE", "3"), "finished", "exit code 3: at last"),
        (SAYS.replace("CODE", "1"), "failed", "exit code 1: at last"),
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
    if "answer" in code:
        assert (job.result(), job.lines) == ({"answer": 42}, ["at last"])
        assert job.progress == ((1.0, "") if state == "finished" else (0.45, "Grid: 9 of 20"))


async def test_so_many_at_once_and_the_rest_in_order(tmp_path):
    jobs = JobManager(at_once=1)
    first, second, third = (jobs.submit(toy(code, tmp_path)) for code in (POLITE, SLEEPS, "1"))
    assert [job.state for job in jobs.jobs] == ["running", "queued", "queued"]
    assert jobs.is_busy
    second.stop()
    await until(lambda: first.lines == ["ready"])
    first.stop()
    assert [job.state for job in jobs.jobs] == ["stopping", "stopped", "queued"]
    assert await third.wait(LONGEST)
    assert (first.state, third.state) == (JobState.STOPPED, JobState.FINISHED)
    assert (tmp_path / "kept").read_text() == "all"
    third.stop()
    assert third.state == JobState.FINISHED
    assert not jobs.is_busy


@pytest.mark.parametrize(("code", "seconds"), [(POLITE, LONGEST), (DEAF, 0.0)])
async def test_the_end_of_the_server_stops_all_in_order(tmp_path, code, seconds):
    jobs = JobManager(at_once=1)
    working, queued = jobs.submit(toy(code, tmp_path)), jobs.submit(toy(SLEEPS, tmp_path))
    await until(lambda: working.lines == ["ready"])
    await jobs.close(seconds)
    assert (working.state, queued.state) == (JobState.STOPPED, JobState.STOPPED)
    assert (tmp_path / "kept").exists() == (code == POLITE)
    with pytest.raises(CdprError, match="ending"):
        jobs.submit(toy(SLEEPS, tmp_path))


def test_no_process_outlives_the_event_loop(tmp_path):
    async def leave():
        job = toy(DEAF, tmp_path)
        job.begin()
        await until(lambda: job.lines == ["ready"])
        return os.pidfd_open(job._process.pid)

    descriptor = asyncio.run(leave())
    assert select.select([descriptor], [], [], LONGEST)[0] == [descriptor]
    os.close(descriptor)


async def test_a_job_whose_server_is_killed_keeps_what_it_has_and_ends(tmp_path):
    """The kernel closes the server's end of the pipe then; no other job has it."""
    watches = "from cdpr_drake.cli.process import exit_with_parent\nexit_with_parent()\n"
    job, other = toy(watches + POLITE, tmp_path), toy(SLEEPS, tmp_path)
    job.begin()
    await until(lambda: job.lines == ["ready"])
    other.begin()
    await until(lambda: other._process is not None)
    os.dup2(os.open(os.devnull, os.O_WRONLY), job._lifeline)
    assert await job.wait(LONGEST)
    assert (tmp_path / "kept").read_text() == "all"
    assert not other.state.is_over
    other.stop(signal.SIGKILL)
    assert await other.wait(LONGEST)


<<<<<<< HEAD
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
=======
STEADY = """
import pathlib, signal, sys, time
folder = pathlib.Path(next(a for a in sys.argv if a.startswith("--out="))[6:])
folder.mkdir(parents=True, exist_ok=True)
def stop(*_):
    (folder / "kept").write_text("half")
    sys.exit(130)
signal.signal(signal.SIGTERM, stop)
print("progress: some: 50 %, half of it", file=sys.stderr, flush=True)
if (folder / "kept").exists():
    (folder / "results.json").write_text("{}")
    sys.exit(0)
time.sleep(3600)
"""


@pytest.fixture(scope="module")
def forms():
    return command_forms()


async def test_stop_keeps_what_is_finished_and_continue_goes_on_in_the_same_folder(
    tmp_path, monkeypatch, forms
):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", STEADY))
    jobs = JobManager()
    board = CommandBoard(jobs, tmp_path, "workspaces", forms)
    about = {"robot": "acrobot_small", "digest": "x"}
    first = board.start("some", ["workspace", "acrobot_small"], about)
    assert jobs.free_folder(first.folder).name == "some-2"
    await until(lambda: first.progress[0] is not None)  # it listens to SIGTERM then
    assert first.progress == (0.5, "some: half of it")
    there = board.choices()[board.shown]
    assert (there.name, there.job, there.asked) == ("some, running", first, ())
    assert board.go_on(there) is None  # it works
    first.stop()
    assert await first.wait(LONGEST)
    assert first.state == JobState.STOPPED
    await until(lambda: board.choices()["some"].asked)
    assert board.choices()["some"].job is first
    await jobs.close()
    jobs = JobManager()  # as when the server was started anew
    board = CommandBoard(jobs, tmp_path, "workspaces", forms)
    await until(lambda: board.choices())
    there = board.choices()["some"]
    assert (there.name, there.job, there.is_whole) == ("some, stopped", None, False)
    assert there.about == about
    second = board.go_on(there)
    assert await second.wait(LONGEST)
    assert second.state == JobState.FINISHED
    assert (second.arguments, second.folder) == (first.arguments, first.folder)
    await until(lambda: board.choices()["some"].is_whole)
    assert board.choices()["some"].asked == ()  # it is done
    assert {path.name for path in board.folder.iterdir()} == {"some", ".some.about.json"}


@pytest.mark.parametrize(
    ("words", "runs"),
    [
        ('["workspace", "acrobot_small", "--kind=static", "--certify"]', True),
        ('["study", "case-9", "--quick"]', True),
        ('["workspace", "mine.yaml"]', True),
        ('["workspace", "/etc/hostname"]', False),
        ('["workspace", "acrobot_small", "--obstacles=../secret.yaml"]', False),
        ('["workspace", "acrobot_small", "--certify=yes"]', False),
        ('["study", "case-9", "--runs-from=/etc"]', False),
        ('["study", "case-9", "--out=/tmp"]', False),
        ('["simulate", "acrobot_pbvs"]', False),
        ('["study"]', False), ("{}", False), ("[1]", False), ("[", False),
        (json.dumps(["study", "case-9"] + ["--quick"] * 20_000), False),
    ],
)  # fmt: skip
def test_a_file_asks_for_no_more_than_a_page_would(tmp_path, forms, words, runs):
    (tmp_path / "studies" / "some").mkdir(parents=True)
    (tmp_path / "studies" / ".some.asked.json").write_text(words)
    jobs = JobManager()
    board = CommandBoard(jobs, tmp_path, "studies", forms)
    there = board.choices()["some"]
    assert bool(there.asked) == runs
    if not runs:
        assert board.go_on(there) is None
        assert jobs.jobs == []


def test_a_board_lists_finished_folders_the_newest_first_and_no_links(tmp_path):
    board = CommandBoard(JobManager(), tmp_path, "studies", {})
    assert board.choices() == {}
    for time, name in enumerate(("c", "b", "a")):
        (tmp_path / "studies" / name).mkdir(parents=True)
        (tmp_path / "studies" / name / ("results.json" if name != "b" else "x")).write_text("{}")
        os.utime(tmp_path / "studies" / name, (time, time))
    (tmp_path / "studies" / "link").symlink_to(tmp_path / "studies" / "a")
    assert list(board.choices()) == ["a", "c"]
    assert RunBoard(JobManager(), tmp_path).choices() == {}
>>>>>>> runs-ready
