"""Commands without a page: forms of verbs, jobs, and boards of what they leave in folders.

Small programs stand for `cdpr`.
"""

import asyncio
import errno
import json
import os
import select
import signal
import sys
import tempfile
from dataclasses import replace
from functools import partial
from typing import Annotated

import pytest
from cyclopts import App

from cdpr_drake.analyses.frame.words import words
from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.cli.studio import NOT_OFFERED, verbs
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import Board
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.jobs import Job, JobManager
from cdpr_drake.studio.results import NOTHING, Subject
from cdpr_drake.studio.runs import RunJob
from cdpr_drake.studio.verb_form import Verb, VerbForm
from tests.studio.pages import LONGEST, field, simulated, until

ROBOT = "acrobot_small"
VERBS = verbs()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "link.yaml").symlink_to("/etc/hostname")
    return WorkingFolder(tmp_path)


# Forms.


def test_every_command_and_form_is_offered_with_its_options():
    forms = {f"{name} --{form}" for name, command in COMMANDS.items() for form in command.forms}
    assert VERBS.keys() == ({*COMMANDS} | forms) - {*NOT_OFFERED}
    for name in ("workspace", "plan --free", "check"):
        names = [argument.name for argument in shown_arguments(*name.split())]
        assert [option.argument.name for option in VERBS[name].options.values()] == names
    some = ("workspace", "tension", "import-log")
    assert [name for name in some if VERBS[name].writes_folder] == ["workspace"]
    assert [name for name in some if VERBS[name].needs_robot] == ["workspace", "tension"]


@pytest.mark.parametrize(
    ("name", "values", "line"),
    [
        ("workspace",
         {"robot": ROBOT, "kind": "static", "measure": "payload", "certify": True,
          "force": "2.5", "velocity": "0,0,1; 0,0,2", "grid": "", "pulleys": False},
         [f"--robot={ROBOT}", "--measure=payload", "--force=2.5", "--velocity=0,0,1",
          "--velocity=0,0,2", "--no-pulleys", "--certify"]),
        ("plan --free", {"robot": ROBOT, "from": "-0.1,0,0.3", "to": "0,0,0.4"},
         ["--free", f"--robot={ROBOT}", "--from=-0.1,0,0.3", "--to=0,0,0.4"]),
        ("simulate --seeds", {"seeds": "0:3", "set": "duration=1; robot=planar"},
         ["--set=duration=1", "--set=robot=planar", "--seeds=0:3"]),
        ("robots", {"suspended": "no"}, ["--not-suspended"]),
        ("check", {"files": "mine.yaml; b/c.yaml"}, ["--", "mine.yaml", "b/c.yaml"]),
    ],
)  # fmt: skip
def test_a_form_says_words_of_the_command_line(folder, name, values, line):
    assert VERBS[name].words(values, folder) == [name.split()[0], *line]


@pytest.mark.parametrize(
    ("key", "value"),
    [("force", "much"), ("force", "nan"), ("force", "1e999"), ("rays", "1.5"), ("rays", "9" * 5000),
     ("obstacles", "../secret.yaml"), ("obstacles", "/etc/passwd"), ("obstacles", "link.yaml"),
     ("velocity", "0,0,1;/etc/passwd"), ("grid", "five"), ("method", "guess"), ("robot", "")],
)  # fmt: skip
def test_a_wrong_value_is_refused_for_its_field(folder, key, value):
    with pytest.raises(CdprError) as problem:
        VERBS["workspace"].words({"robot": ROBOT, key: value}, folder)
    assert VERBS["workspace"].field_of(str(problem.value)) == key
    assert "--help" not in str(problem.value)


@pytest.mark.parametrize(
    ("name", "word"),
    [("simulate", "--set=robot=../../mine.yaml"), ("workspace", "--out=x"),
     ("workspace", "--overwrite"), ("workspace", "--kind=a\x00b"), ("check", "/etc/passwd"),
     ("simulate", "--set=world={file: /etc/passwd}"), ("workspace", "--no-such=1")],
)  # fmt: skip
def test_words_that_no_form_makes_are_refused(folder, name, word):
    robot = [f"--robot={ROBOT}"] if VERBS[name].needs_robot else []
    with pytest.raises(CdprError):
        VERBS[name].accept([name, *robot, word], folder)


async def test_inputs_are_those_of_the_declarations_and_say_what_is_refused(folder):
    filled = {"workspace": {"kind": "static,closed", "robot": "mine.yaml"}}  # before
    refusals, forms = [], []

    def check(_):
        if refusals:
            raise CdprError(refusals.pop())

    def page():
        for name in ("check", "workspace"):
            forms.append(VerbForm(replace(VERBS[name], check=check), filled, folder, ["mine.yaml"]))

    async with simulated(page) as user:
        kind, method, scenario, rays, pulleys, robot = (
            field(user, f"workspace-{key}")
            for key in ("kind", "method", "scenario", "rays", "pulleys", "robot")
        )
        assert (kind.value, robot.value) == (["static"], "mine.yaml")
        assert "wrench-feasible" in kind.options
        assert "mine.yaml" in scenario.options
        assert "mine.yaml" not in method.options
        assert (rays.props["placeholder"], pulleys.value) == ("10000", True)
        assert rays.props["hint"] == "Largest number of rays of the hull"
        for many in ("workspace-velocity", "check-files"):
            assert field(user, many).props["hint"].endswith("several by semicolons")
        refusals.append(f"--rays: {'r' * 5000}")
        assert await forms[-1].words({}) == []
        assert rays.error == f"--rays: {'r' * 5000}"[:400]
        refusals.append("never; see cdpr workspace --help")
        with pytest.raises(CdprError, match=r"^never$"):  # no field can say it
            await forms[-1].words({})
        assert rays.error is None
        rays.value = "12"
        line = ["workspace", f"--robot={ROBOT}", "--rays=12"]
        assert await forms[-1].words({"robot": ROBOT, "kind": "static"}) == line


async def test_an_option_of_a_new_type_has_its_input_and_words_at_once(folder):
    """Its one entry are the words of its type."""

    def hue(word):
        return float(word.removeprefix("hue "))

    def verb(*, hue: Annotated[float, words(hue, "a hue, as hue 12", "HUE")] = 0.0):
        """Does it.

        Args:
            hue: Hue of it.
        """

    app, forms = App(), []
    app.default(verb)
    arguments = partial(app.assemble_argument_collection, parse_docstring=True)
    parsed = partial(app.parse_args, exit_on_error=False, print_error=False)
    new = Verb("new", "", arguments, lambda line: parsed(line[1:]))
    async with simulated(lambda: forms.append(VerbForm(new, {}, folder, []))) as user:
        field(user, "new-hue").value = "hue 12"
        assert field(user, "new-hue").props["hint"] == "Hue of it"
        assert await forms[0].words({}) == ["new", "--hue=hue 12"]
        field(user, "new-hue").value = "red"
        assert await forms[0].words({}) == []
        assert field(user, "new-hue").error == "--hue: found 'red'; accepted: a hue, as hue 12"


# Jobs.


class Toy(Job):
    """A program of a few lines, which is its argument."""

    program = (sys.executable, "-c")


SLEEPS = "import time; time.sleep(3600)"

POLITE = """
import pathlib, signal, sys, time
folder = pathlib.Path(next((word[6:] for word in sys.argv if word.startswith("--out=")), "."))
folder.mkdir(parents=True, exist_ok=True)
kept = folder / "kept"
stop = lambda *_: (kept.write_text("half"), sys.exit(130))
signal.signal(signal.SIGTERM, stop)
print("progress: Grid, building", file=sys.stderr, flush=True)
if not kept.exists():
    time.sleep(3600)
print('{"half": 2}')
"""

DEAF = POLITE.replace("SIGTERM, stop", "SIGTERM, signal.SIG_IGN")

OWN = f"""{POLITE.partition("kept")[0]}
(folder / "results.json").write_text("own")
print('{{"printed": 1}}')
"""

SAYS = r"""
import sys
print('{"answer": 42}')
print("progress: Grid:  45 %, 9 of 20\nGrid:  46 %, 9 of 20\nat last", end="", file=sys.stderr)
sys.exit(int(sys.argv[1]))
"""


def ready(job):
    """Waits until it listens to signals."""
    return until(lambda: job.progress == (None, "Grid, building"))


@pytest.mark.parametrize(
    ("program", "state", "words"),
    [
        ([SAYS, "0"], "finished", ""),
        ([SAYS, "3"], "finished", "exit code 3: at last"),
        ([SAYS, "1"], "failed", "exit code 1: at last"),
        (["import sys; print('cdpr: a\\ncdpr: b', file=sys.stderr); sys.exit(2)"], "failed",
         "a; and 1 more"),
        (["1 / 0"], "failed", "exit code 1: ZeroDivisionError: division by zero"),
        (["import os; os.kill(os.getpid(), 9)"], "failed", "the process was ended by SIGKILL"),
        (["a\0b"], "failed", "cannot be started: embedded null byte"),
    ],
)  # fmt: skip
async def test_how_a_job_ends_is_one_line(tmp_path, program, state, words):
    job, states = Toy(program, tmp_path), []
    job.changed = lambda: states.append(job.state)
    assert job.elapsed == 0.0
    job.begin()
    assert await job.wait(LONGEST)
    assert (states, job.message) == (["running", state], words)
    assert job.elapsed > 0.0
    if SAYS in program:
        assert job.result() == {"answer": 42}
        assert job.lines == ["Grid:  46 %, 9 of 20", "at last"]
        assert job.progress == ((1.0, "") if state == "finished" else (0.45, "Grid: 9 of 20"))


async def test_a_job_that_a_full_disk_keeps_from_starting_has_failed(tmp_path, monkeypatch):
    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    files = len(os.listdir("/proc/self/fd"))
    for job in (Toy("", tmp_path), RunJob("", tmp_path, tmp_path)):
        job.begin()
        assert await job.wait(LONGEST)
        assert (job.state, job.message) == (
            "failed", "cannot be started: [Errno 28] No space left on device",
        )  # fmt: skip
    del job
    await until(lambda: len(os.listdir("/proc/self/fd")) == files)


@pytest.mark.parametrize(("code", "seconds"), [(POLITE, LONGEST), (DEAF, 0.0)])
async def test_so_many_at_once_the_rest_in_order_and_no_server_leaves_one(tmp_path, code, seconds):
    jobs = JobManager(at_once=1)
    programs = SLEEPS, SLEEPS, code, SLEEPS
    first, second, third, last = (jobs.submit(Toy([text], tmp_path)) for text in programs)
    assert [job.state for job in jobs.jobs] == ["running", "queued", "queued", "queued"]
    second.stop()
    first.stop()
    assert [job.state for job in jobs.jobs] == ["stopping", "stopped", "queued", "queued"]
    await ready(third)
    first.stop(signal.SIGKILL)  # it is over
    assert jobs.is_busy
    await jobs.close(seconds)
    assert ({job.state for job in jobs.jobs}, jobs.is_busy) == ({"stopped"}, False)
    assert (tmp_path / "kept").exists() == (code == POLITE)
    with pytest.raises(CdprError, match="ending"):
        jobs.submit(last)


def test_no_process_outlives_the_event_loop(tmp_path):
    async def leave():
        job = Toy([DEAF], tmp_path)
        job.begin()
        await ready(job)
        return os.pidfd_open(job._process.pid)

    descriptor = asyncio.run(leave())
    assert select.select([descriptor], [], [], LONGEST)[0] == [descriptor]
    os.close(descriptor)


async def test_a_job_whose_server_is_killed_keeps_what_it_has_and_ends(tmp_path):
    """The kernel closes the server's end of the pipe then."""
    watches = "from cdpr_drake.cli.process import exit_with_parent\nexit_with_parent()\n"
    job = Toy([watches + POLITE], tmp_path)
    job.begin()
    await ready(job)
    os.dup2(os.open(os.devnull, os.O_WRONLY), job._lifeline)
    assert await job.wait(LONGEST)
    assert (tmp_path / "kept").read_text() == "half"


# Boards.


@pytest.fixture
def board(tmp_path):
    return Board(JobManager(), tmp_path, "studies")


async def start(monkeypatch, board, code, about):
    """The job of a command for which a program stands."""
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", code))
    return await board.start(VERBS["workspace"], ["workspace", "--robot=planar"], "some", about)


async def test_stop_keeps_what_is_finished_and_it_goes_on_there(folder, monkeypatch, board):
    about = Subject(ROBOT, "x")
    first = await start(monkeypatch, board, POLITE, about)
    await ready(first)
    await until(lambda: board.choices()["some"].asked)
    there = board.follow()[board.shown]
    assert (there.name, there.job) == ("some, running", first)
    with pytest.raises(CdprError, match="it works"):
        await board.go_on(there, VERBS, folder)
    first.stop()
    assert await first.wait(LONGEST)
    board = Board(JobManager(), folder.root, "studies")  # as when the server was started anew
    await until(board.choices)
    there = board.follow()[board.shown]
    assert (there.name, there.job, there.is_whole) == ("some, stopped", None, False)
    assert there.about == about
    second = await board.go_on(there, VERBS, folder)
    assert await second.wait(LONGEST)
    assert (second.state, second.arguments) == ("finished", first.arguments)
    await until(lambda: board.choices()["some"].is_whole and not board.choices()["some"].asked)
    assert json.loads((first.folder / "results.json").read_text()) == {"half": 2}
    assert board.choices()["some"].about == about


async def test_own_numbers_stay_and_what_leaves_no_folder_leaves_nothing(monkeypatch, board):
    own = await start(monkeypatch, board, OWN, NOTHING)
    assert await own.wait(LONGEST)
    nothing = await start(monkeypatch, board, "raise SystemExit(2)", NOTHING)
    assert await nothing.wait(LONGEST)
    asked = board.folder / ".some.asked.json"
    await until(lambda: json.loads(asked.read_text())["words"] == [])
    await until(lambda: {*board.folder.iterdir()} == {own.folder, asked})
    assert nothing.folder.name == "some-2"
    assert (own.folder / "results.json").read_text() == "own"


@pytest.mark.parametrize(
    ("words", "runs"),
    [
        (["study", "--quick", "--", "case-9"], True),
        (["workspace", "--robot=mine.yaml", "--certify"], True),
        (["workspace", "--robot=/etc/hostname"], False),
        (["simulate", "acrobot_pbvs"], False),
        ([], False), ({}, False), ([1], False),
        (["study", "case-9"] + ["--quick"] * 20_000, False),
    ],
)  # fmt: skip
async def test_a_file_asks_for_no_more_than_a_page_would(folder, monkeypatch, board, words, runs):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", ""))
    (board.folder / "some").mkdir(parents=True)
    (board.folder / ".some.asked.json").write_text(json.dumps({"words": words}))
    offered = {name: VERBS[name] for name in ("workspace", "study")}
    await until(board.choices)
    try:
        await board.go_on(board.follow()[board.shown], offered, folder)
    except CdprError:
        assert not runs
    assert len(board._jobs.jobs) == runs
    await board._jobs.close()


async def test_a_board_lists_finished_folders_the_newest_first_and_no_links(board):
    for time, name in enumerate(("c", "b", "a")):
        (board.folder / name).mkdir(parents=True)
        (board.folder / name / ("results.json" if name != "b" else "x")).write_text("{}")
        os.utime(board.folder / name, (time, time))
    (board.folder / "link").symlink_to(board.folder / "a")
    await until(board.choices)
    assert list(board.choices()) == ["a", "c"]
