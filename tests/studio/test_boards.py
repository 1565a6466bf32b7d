"""Boards of results: commands that stop and go on in their folder, and what files may ask for."""

import json
import os
import sys

import pytest

from cdpr_drake.cli.studio import verbs
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import Board
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.jobs import Job, JobManager
from tests.studio.pages import LONGEST, until

MAKES = """
import pathlib, signal, sys, time
folder = pathlib.Path(next(a for a in sys.argv if a.startswith("--out="))[6:])
folder.mkdir(parents=True, exist_ok=True)
"""

OWN = f"""{MAKES}
(folder / "results.json").write_text("own")
print('{{"printed": 1}}')
"""

STEADY = f"""{MAKES}
def stop(*_):
    (folder / "kept").write_text("half")
    sys.exit(130)
signal.signal(signal.SIGTERM, stop)
print("progress: some: 50 %, half of it", file=sys.stderr, flush=True)
if (folder / "kept").exists():
    print('{{"half": 2}}')
    sys.exit(0)
time.sleep(3600)
"""

WORDS, VERBS = ["workspace", "--robot=planar"], verbs()


@pytest.fixture
def board(tmp_path):
    return Board(JobManager(), tmp_path, "studies")


def program(monkeypatch, code):
    monkeypatch.setattr(Job, "program", (sys.executable, "-c", code))


async def test_stop_keeps_what_is_finished_and_continue_goes_on_in_the_same_folder(
    tmp_path, monkeypatch, board
):
    program(monkeypatch, STEADY)
    folder, about = WorkingFolder(tmp_path), {"robot": "acrobot_small", "digest": "x"}
    first = await board.start(VERBS["workspace"], WORDS, "some", about)
    assert board._jobs.free_folder(first.folder).name == "some-2"
    await until(lambda: first.progress[0] is not None)  # it listens to SIGTERM then
    board.follow()
    there = board.entry
    assert (there.name, there.job) == ("some, running", first)
    with pytest.raises(CdprError, match="it works"):
        await board.go_on(there, VERBS, folder)
    first.stop()
    assert await first.wait(LONGEST)
    await until(lambda: board.choices()["some"].asked)
    assert board.choices()["some"].job is first
    board = Board(JobManager(), tmp_path, "studies")  # as when the server was started anew
    await until(board.choices)
    board.follow()
    there = board.entry
    assert (there.name, there.job, there.is_whole) == ("some, stopped", None, False)
    assert there.about == about
    assert (there.digest("acrobot_small"), there.digest("planar")) == ("x", "")
    second = await board.go_on(there, VERBS, folder)
    assert await second.wait(LONGEST)
    assert (second.state, second.arguments) == ("finished", first.arguments)
    assert second.folder == first.folder
    await until(lambda: board.choices()["some"].is_whole)
    await until(lambda: board.choices()["some"].asked == ())  # it is done
    assert json.loads((second.folder / "results.json").read_text()) == {"half": 2}
    assert board.choices()["some"].about == about


@pytest.mark.parametrize(
    ("code", "files"), [("raise SystemExit(2)", {}), (OWN, {"results.json": "own"})]
)
async def test_what_leaves_no_folder_leaves_nothing_and_own_numbers_stay(
    monkeypatch, board, code, files
):
    program(monkeypatch, code)
    job = await board.start(VERBS["workspace"], WORDS, "some", {})
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
async def test_a_file_asks_for_no_more_than_a_page_would(tmp_path, monkeypatch, board, words, runs):
    program(monkeypatch, "")
    (board.folder / "some").mkdir(parents=True)
    (board.folder / ".some.asked.json").write_text(json.dumps({"words": words}))
    offered = {name: VERBS[name] for name in ("workspace", "study")}
    await until(board.choices)
    try:
        await board.go_on(board.follow()[board.shown], offered, WorkingFolder(tmp_path))
    except CdprError:
        assert not runs
    assert len(board._jobs.jobs) == runs
    await board._jobs.close()


async def test_a_board_lists_finished_folders_the_newest_first_and_no_links(board):
    assert board.choices() == {}
    await until(lambda: not board._looks)
    for time, name in enumerate(("c", "b", "a")):
        (board.folder / name).mkdir(parents=True)
        (board.folder / name / ("results.json" if name != "b" else "x")).write_text("{}")
        os.utime(board.folder / name, (time, time))
    (board.folder / "link").symlink_to(board.folder / "a")
    await until(lambda: len(board.choices()) > 1)
    assert list(board.choices()) == ["a", "c"]
