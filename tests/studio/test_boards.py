"""Boards of results: commands that stop and go on in their folder, and what files may ask for."""

import json
import os
import sys

import pytest

from cdpr_drake.cli.studio import verbs
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import Board
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import Job, JobManager, JobState
from tests.studio.pages import until

LONGEST = 120.0
"""That a process may take on a busy machine [s]."""

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
    print('{"half": 2}')
    sys.exit(0)
time.sleep(3600)
"""


@pytest.fixture(scope="module")
def every():
    return verbs()


async def test_stop_keeps_what_is_finished_and_continue_goes_on_in_the_same_folder(
    tmp_path, monkeypatch, every
):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", STEADY))
    jobs, folder = JobManager(), WorkingFolder(tmp_path)
    board = Board(jobs, tmp_path, "workspaces")
    about, words = {"robot": "acrobot_small", "digest": "x"}, ["workspace", "--robot=planar"]
    first = await board.start(every["workspace"], words, "some", about)
    assert jobs.free_folder(first.folder).name == "some-2"
    await until(lambda: first.progress[0] is not None)  # it listens to SIGTERM then
    there = board.shown_entry()
    assert (there.name, there.job) == ("some, running", first)
    with pytest.raises(CdprError, match="it works"):
        await board.go_on(there, every, folder)
    first.stop()
    assert await first.wait(LONGEST)
    await until(lambda: board.choices()["some"].asked)
    assert board.choices()["some"].job is first
    await jobs.close()
    jobs = JobManager()  # as when the server was started anew
    board = Board(jobs, tmp_path, "workspaces")
    await until(lambda: board.choices())
    there = board.shown_entry()
    assert (there.name, there.job, there.is_whole) == ("some, stopped", None, False)
    assert there.about == about
    assert (there.digest("acrobot_small"), there.digest("planar")) == ("x", "")
    second = await board.go_on(there, every, folder)
    assert await second.wait(LONGEST)
    assert second.state == JobState.FINISHED
    assert (second.arguments, second.folder) == (first.arguments, first.folder)
    await until(lambda: board.choices()["some"].is_whole)
    await until(lambda: board.choices()["some"].asked == ())  # it is done
    assert json.loads((second.folder / "results.json").read_text()) == {"half": 2}
    assert board.choices()["some"].about == about


OWN = (
    STEADY.partition("def stop")[0]
    + """
(folder / "results.json").write_text("own")
print('{"printed": 1}')
"""
)


@pytest.mark.parametrize(
    ("program", "files"),
    [("raise SystemExit(2)", {}), (OWN, {"results.json": "own"})],
    ids=["none", "own"],
)
async def test_what_leaves_no_folder_leaves_nothing_and_own_numbers_stay(
    tmp_path, monkeypatch, every, program, files
):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", program))
    board = Board(JobManager(), tmp_path, "workspaces")
    job = await board.start(every["workspace"], ["workspace", "--robot=planar"], "some", {})
    assert await job.wait(LONGEST)
    asked = board.folder / ".some.asked.json"
    await until(lambda: not asked.exists() or json.loads(asked.read_text())["words"] == [])
    assert asked.exists() == bool(files)
    assert {path.name: path.read_text() for path in board.folder.glob("some/*")} == files


@pytest.mark.parametrize(
    ("words", "runs"),
    [
        (["workspace", "--robot=acrobot_small", "--kind=static", "--certify"], True),
        (["study", "--quick", "--", "case-9"], True),
        (["workspace", "--robot=mine.yaml"], True),
        (["workspace", "--robot=/etc/hostname"], False),
        (["workspace", "--robot=acrobot_small", "--obstacles=../secret.yaml"], False),
        (["workspace", "--robot=acrobot_small", "--certify=often"], False),
        (["study", "--runs-from=/etc", "--", "case-9"], False),
        (["study", "--out=/tmp", "--", "case-9"], False),
        (["simulate", "acrobot_pbvs"], False),
        (["study"], False),
        ([], False), ({}, False), ([1], False),
        (["study", "case-9"] + ["--quick"] * 20_000, False),
    ],
)  # fmt: skip
async def test_a_file_asks_for_no_more_than_a_page_would(tmp_path, monkeypatch, every, words, runs):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", ""))
    (tmp_path / "studies" / "some").mkdir(parents=True)
    (tmp_path / "studies" / ".some.asked.json").write_text(json.dumps({"words": words}))
    jobs, offered = JobManager(), {name: every[name] for name in ("workspace", "study")}
    board = Board(jobs, tmp_path, "studies")
    await until(board.choices)
    if runs:
        await board.go_on(board.shown_entry(), offered, WorkingFolder(tmp_path))
    else:
        with pytest.raises(CdprError):
            await board.go_on(board.shown_entry(), offered, WorkingFolder(tmp_path))
    assert len(jobs.jobs) == runs
    await jobs.close()


async def test_a_board_lists_finished_folders_the_newest_first_and_no_links(tmp_path):
    board = Board(JobManager(), tmp_path, "studies")
    assert board.choices() == {}
    for time, name in enumerate(("c", "b", "a")):
        (tmp_path / "studies" / name).mkdir(parents=True)
        (tmp_path / "studies" / name / ("results.json" if name != "b" else "x")).write_text("{}")
        os.utime(tmp_path / "studies" / name, (time, time))
    (tmp_path / "studies" / "link").symlink_to(tmp_path / "studies" / "a")
    await until(lambda: list(board.choices()) == ["a", "c"])
