"""A run that is killed, interrupted, cannot write or ends while it draws is finished or goes on."""

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.front import simulation
from cdpr_drake.analyses.reporting.written_files import DRAWING, others_in
from cdpr_drake.analyses.runs.log import CHECKPOINT, PARTS, DiskLog
from cdpr_drake.analyses.simulation import log_keeper, run_loop
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.schema.yaml_files import load_yaml
from tests.cli.commands import answer, ended, killed_after, refuse, run
from tests.cli.conftest import only
from tests.cli.test_calibrate_camera import BOARD, LENS, K
from tests.cli.test_identify import write
from tests.identification.logs import log
from tests.vision.boards import board_image, board_poses, make_board

pytestmark = pytest.mark.usefixtures("here")

PROJECTED = ("simulate", "acrobot_pbvs", "--camera", "projected")
RUN = ("simulate", "acrobot_mobile_robot", "--log-rate", "25", "--duration", "1.0")
KILLED = killed_after(
    4,
    "cdpr_drake.analyses.reporting.log_on_disk.DiskLog.append",
    "from cdpr_drake.analyses.simulation import log_keeper; log_keeper.CHECKPOINT_WAIT = 0.0",
)
"""It has rows by then that came after its last checkpoint."""


@pytest.fixture(autouse=True)
def _checkpoints_at_once(monkeypatch):
    monkeypatch.setattr(log_keeper, "CHECKPOINT_WAIT", 0.0)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Results of the run that nobody ended."""
    folder = tmp_path_factory.mktemp("undisturbed") / "out"
    with only(".mat"):
        assert ended(*RUN, "--out", folder) == 0
    return folder


@pytest.fixture(scope="module")
def left_by_a_killed_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("killed")
    command = [sys.executable, "-c", KILLED, *RUN, "--out", "out"]
    assert subprocess.run(command, cwd=folder, check=False).returncode == -signal.SIGKILL
    return folder


@pytest.fixture
def killed(here, left_by_a_killed_run):
    """The folder that it was called in."""
    shutil.copytree(left_by_a_killed_run, here, dirs_exist_ok=True)
    assert list(here.glob(".out-work-*"))
    return here


def same_files(one, other):
    """All data of two runs, but for what tells how long they took."""
    names = sorted(path.name for path in one.iterdir() if path.is_file())
    assert names == sorted(path.name for path in other.iterdir() if path.is_file())
    assert {"log.npz", "log.csv", "scenario.yaml", "summary.json"} < set(names)
    for name in names:
        if name != "summary.json":
            assert (one / name).read_bytes() == (other / name).read_bytes(), name
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (one, other)]
    for summary in summaries:
        assert summary.pop("wall_time_s") > 0.0
        assert summary.pop("realtime_factor") > 0.0
    assert summaries[0] == summaries[1]


@pytest.mark.usefixtures("without_pictures")
def test_a_run_that_is_killed_goes_on_to_the_same_bytes(capsys, killed, undisturbed):
    code, out, _ = run(capsys, "simulate", "--continue", "out")
    assert code == 0
    assert "results" in out
    assert os.listdir(killed) == ["out"]
    assert not (killed / "out" / PARTS).exists()
    same_files(undisturbed, killed / "out")


@pytest.mark.usefixtures("without_pictures")
def test_a_killed_run_can_be_finished_by_its_name_and_is_found_by_the_next(capsys, killed):
    shutil.copytree(killed, "aside")
    code, _, err = run(capsys, *PROJECTED, "--duration", "0.1", "--out", "out")
    assert code == 0
    assert "--finish out-unfinished" in err
    assert ended("simulate", "--finish", "out-unfinished") == 0
    summary = json.loads((killed / "out-unfinished" / "summary.json").read_text())
    assert summary["message"] == "the program ended before the run did"
    assert summary["sim_time_s"] > 0.0
    os.chdir("aside")
    assert "out-unfinished" in answer(capsys, "simulate", "--finish", "out")


def interrupt_at(monkeypatch, sim_time):
    """Stops a run as Ctrl-C does."""
    advance = run_loop.advance

    def stopped(simulator, duration, outcome_after, errors, session, keeper):
        asked = lambda: simulator.get_context().get_time() >= sim_time  # noqa: E731
        session = replace(session, should_stop=asked)
        return advance(simulator, duration, outcome_after, errors, session, keeper)

    monkeypatch.setattr("cdpr_drake.analyses.simulation.visual_servo_run.advance", stopped)


@pytest.mark.usefixtures("without_pictures")
def test_a_run_that_is_interrupted_goes_on_in_its_folder(capsys, here, monkeypatch, undisturbed):
    with monkeypatch.context() as patch:
        interrupt_at(patch, 0.6)
        code, _, err = run(capsys, *RUN, "--out", "out")
    assert code == 130
    assert "cdpr simulate --continue out" in err
    summary = json.loads((here / "out" / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"

    # What is there is changed: refused in one line, and nothing is lost.
    scenario, parts = here / "out" / "scenario.yaml", here / "damaged" / PARTS
    words = scenario.read_text()
    scenario.write_text(words.replace("lambda_slope: 30.0", "lambda_slope: 29.0"))
    said = refuse(capsys, "simulate", "--continue", "out")
    assert "controller.lambda_slope is 30.0 there, 29.0 here" in said
    scenario.write_text(words)
    shutil.copytree("out", "damaged")
    assert ended("simulate", "--continue", "out") == 0
    same_files(undisturbed, here / "out")

    asked = "simulate", "--continue", "damaged"
    rows = (parts / "time.f8").read_bytes()
    (parts / "time.f8").write_bytes(rows[:16])
    assert "found 2 rows of the log" in refuse(capsys, *asked)
    (parts / "time.f8").write_bytes(rows)
    (parts / CHECKPOINT).write_bytes(b"no")
    assert "no checkpoint that can be read" in refuse(capsys, *asked)
    (parts / CHECKPOINT).unlink()
    assert "holds no checkpoint" in refuse(capsys, *asked)
    assert ended("simulate", "--finish", "damaged") == 0


def full_disk(monkeypatch, after):
    """Lets the disk be full once the log has some rows."""
    monkeypatch.setattr(log_keeper, "MOST_ROWS", 10)
    append = DiskLog.append

    def refused(self, rows):
        if self._rows >= after:
            raise OSError(errno.ENOSPC, "No space left on device")
        append(self, rows)

    monkeypatch.setattr(DiskLog, "append", refused)


@pytest.mark.parametrize("words", [PROJECTED, ("simulate", "acrobot_computed_torque")])
@pytest.mark.usefixtures("replay_only")
def test_a_full_disk_keeps_what_was_simulated(capsys, here, monkeypatch, words):
    arguments = (*words, "--duration", "0.5", "--out", "out")
    with monkeypatch.context() as patch:
        patch.setattr(log_keeper, "CHECKPOINT_WAIT", 1e9)
        full_disk(patch, after=15)
        said = refuse(capsys, *arguments)
    assert "No space left on device" in said
    assert "what was simulated is in" in said
    assert os.listdir(here) == ["out-unfinished"]

    code, out, _ = run(capsys, "simulate", "--finish", "out-unfinished", "--json")
    assert code == 0
    summary = json.loads(out)
    assert (summary["outcome"], summary["realtime_factor"]) == ("interrupted", None)
    folder = here / "out-unfinished"
    with np.load(folder / "log.npz") as arrays:
        rows = len(arrays["time"])
        assert arrays["time"][-1] == summary["sim_time_s"] > 0.1
    assert rows >= 15
    assert (folder / "replay.html").is_file()
    assert not (folder / PARTS).exists()
    assert "holds no log" in refuse(capsys, "simulate", "--finish", "out-unfinished")

    # What was kept is the beginning of the run that was not disturbed.
    with only(".mat"):
        assert ended(*arguments) == 0
    with np.load(folder / "log.npz") as part, np.load(here / "out" / "log.npz") as whole:
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][:rows])


class Ended(BaseException):
    """What no handler takes, as the end of a process."""


def end_at_once(*_):
    raise Ended


FEW = ("error.png", "velocities.png", "tensions.png", "replay.html")


@pytest.fixture
def drawn(monkeypatch):
    """Runs have few pictures; the function returned ends the process after so many of them."""
    write = simulation.write_pictures

    def some(folder, pictures, *more, count=None):
        few = {name: draw for name, draw in pictures.items() if name.endswith(FEW)}
        return write(folder, dict(islice(few.items(), count)), *more)

    def end_after(patch, count):
        def few(*arguments):
            some(*arguments, count=count)
            raise Ended

        patch.setattr(simulation, "write_pictures", few)

    monkeypatch.setattr(simulation, "write_pictures", some)
    return end_after


SHORT = (*PROJECTED, "--duration", "0.05", "--out", "run")
TENSIONS = ("simulate", "planar_computed_torque", "--duration", "0.05", "--out", "run")


@pytest.mark.parametrize("words", [SHORT, TENSIONS], ids=["servo", "tensions"])
def test_the_same_command_draws_what_is_missing(words, here, monkeypatch, drawn, capsys):
    assert ended(*words) == 0
    whole = sorted(os.listdir("run"))
    shutil.rmtree("run")
    with monkeypatch.context() as patch:
        drawn(patch, 1)
        with pytest.raises(Ended):
            ended(*words)
    there = sorted(os.listdir("run"))
    assert DRAWING in there
    assert len(there) < len(whole)
    assert others_in(here / "run") == []
    data = (here / "run" / "log.npz").read_bytes()
    times = {name: os.stat(f"run/{name}").st_mtime_ns for name in there if name[0] != "."}
    code, out, _ = run(capsys, *words)
    assert code == 0
    assert re.search(r"results\W+run\b", out)
    assert sorted(os.listdir("run")) == whole
    assert (here / "run" / "log.npz").read_bytes() == data
    assert {name: os.stat(f"run/{name}").st_mtime_ns for name in times} == times
    assert "--overwrite" in refuse(capsys, *words)  # what is complete is not touched


def test_another_command_does_not_draw_it(here, monkeypatch, drawn, capsys):
    shutil.copy(robot_file("acrobot_small"), "mine.yaml")
    words = (*SHORT, "--set", "robot=mine.yaml")
    with monkeypatch.context() as patch:
        drawn(patch, 1)
        with pytest.raises(Ended):
            ended(*words)
    before = sorted(os.listdir("run"))
    assert "holds files already" in refuse(capsys, *words, "--seed", "7")
    text = (here / "mine.yaml").read_text()
    (here / "mine.yaml").write_text(text.replace("  mass: 1.5\n", "  mass: 1.95\n"))
    assert "holds files already" in refuse(capsys, *words)
    assert sorted(os.listdir("run")) == before
    (here / "mine.yaml").write_text(text)
    assert ended(*words) == 0
    assert DRAWING not in os.listdir("run")


PLAN = ("plan", "planar", "--no-track", "--stations", "40", "--out", "plan", "--waypoints")


def test_a_plan_that_ends_while_its_figures_are_drawn_is_made_again(here, monkeypatch, capsys):
    whole = "0,0,0.3;0.02,0,0.3"
    with monkeypatch.context() as patch:
        patch.setattr("cdpr_drake.analyses.frame.figures.figure_writers", end_at_once)
        for _ in range(2):  # and nothing piles up beside it
            with pytest.raises(Ended):
                ended(*PLAN, whole)
            assert os.listdir(here) == ["plan"]
    assert "holds other results" in refuse(capsys, *PLAN, "0,0,0.3;0.01,0,0.3")
    assert ended(*PLAN, whole) == 0
    assert "path.png" in os.listdir("plan")
    assert "--overwrite" in refuse(capsys, *PLAN, whole)


def fitted(folder):
    """A command that identifies a robot in a log."""
    write(folder / "log.csv", *log(span=2.0, tension=0.3, place=1e-4, angle=2e-4))
    return ["identify", "acrobot_large", "log.csv", "--no-pulleys", "--out", "fit"]


def seen(folder):
    """A command that finds a camera in images of a board."""
    board, names = make_board("charuco"), []
    for k, pose in enumerate(board_poses(board, 6, 0.45, spread=0.35)):
        names.append(f"{k}.png")
        cv2.imwrite(str(folder / names[-1]), board_image(board, K, LENS, (640, 480), pose))
    return ["calibrate-camera", *names, *BOARD, "--out", "fit"]


def told(name):
    """What a file of the fit says, but for how long it took, and which files there are."""
    told = load_yaml(Path("fit", name).read_text())
    return {key: told[key] for key in told.keys() - {"wall_time_s", "files"}}


@pytest.mark.parametrize("asked", [fitted, seen])
def test_a_fit_that_ends_while_its_figures_are_drawn_is_made_again(asked, here, monkeypatch):
    words = asked(here)
    with monkeypatch.context() as patch:
        figures = "cdpr_drake.analyses.frame.figures.write_pictures"
        patch.setattr(figures, end_at_once)
        with pytest.raises(Ended):
            ended(*words)
    there = sorted(os.listdir("fit"))
    assert DRAWING in there  # and the numbers, which no figure can cost
    numbers = {name: told(name) for name in there if name.endswith((".json", ".yaml"))}
    assert len(numbers) == 3
    assert ended(*words) == 0
    made = os.listdir("fit")
    assert any(name.endswith(".png") for name in made)
    assert DRAWING not in made
    assert {name: told(name) for name in numbers} == numbers
    assert [name for name in os.listdir(".") if name.startswith("fit")] == ["fit"]
    assert ended(*words) == 2  # what is complete is not touched
