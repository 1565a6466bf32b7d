"""A run that ends while its figures are drawn is completed by the same command."""

import os
import shutil
from pathlib import Path

import cv2
import pytest

from cdpr_drake.analyses.front import simulation
from cdpr_drake.analyses.reporting.written_files import DRAWING, others_in
from cdpr_drake.cli import main
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.schema.yaml_files import load_yaml
from tests.cli.test_calibrate_camera import BOARD, LENS, K
from tests.cli.test_identify import write
from tests.identification.logs import log
from tests.messages import printed
from tests.vision.boards import board_image, board_poses, make_board

COMMAND = [
    "simulate",
    "acrobot_pbvs",
    "--camera",
    "projected",
    "--duration",
    "0.05",
    "--out",
    "run",
]
TENSIONS = ["simulate", "planar_computed_torque", "--duration", "0.05", "--out", "run"]


def call(words):
    with pytest.raises(SystemExit) as end:
        main(words)
    return end.value.code


class Ended(BaseException):
    """What no handler takes, as the end of a process."""


def end_after(monkeypatch, count, error=Ended):
    """The process ends when so many pictures are drawn."""
    write = simulation.write_pictures

    def some(folder, pictures, say, stop):
        write(folder, dict(list(pictures.items())[:count]), say, stop)
        raise error

    monkeypatch.setattr(simulation, "write_pictures", some)


@pytest.mark.parametrize("words", [COMMAND, TENSIONS], ids=["servo", "tensions"])
def test_the_same_command_draws_what_is_missing(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(words) in (0, 3)
    whole = sorted(os.listdir("run"))
    shutil.rmtree("run")
    with monkeypatch.context() as ending:
        end_after(ending, 2)
        with pytest.raises(Ended):
            main(words)
    there = sorted(os.listdir("run"))
    assert DRAWING in there
    assert len(there) < len(whole)
    assert others_in(tmp_path / "run") == []
    data = (tmp_path / "run" / "log.npz").read_bytes()
    times = {name: os.stat(f"run/{name}").st_mtime_ns for name in there if name[0] != "."}
    printed(capsys)
    assert call(words) in (0, 3)
    assert sorted(os.listdir("run")) == whole
    assert (tmp_path / "run" / "log.npz").read_bytes() == data
    assert {name: os.stat(f"run/{name}").st_mtime_ns for name in times} == times
    assert "results: run" in printed(capsys).out or "run" in os.listdir(".")
    assert call(words) == 2  # what is complete is not touched
    assert "--overwrite" in printed(capsys).err


def test_another_command_does_not_touch_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(robot_file("acrobot_small"), "mine.yaml")
    words = [*COMMAND, "--set", "robot=mine.yaml"]
    with monkeypatch.context() as ending:
        end_after(ending, 1)
        with pytest.raises(Ended):
            main(words)
    before = sorted(os.listdir("run"))
    assert call([*words, "--seed", "7"]) == 2
    text = (tmp_path / "mine.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text.replace("  mass: 1.5\n", "  mass: 1.95\n"))
    assert call(words) == 2
    assert sorted(os.listdir("run")) == before
    assert "holds files already" in printed(capsys).err
    (tmp_path / "mine.yaml").write_text(text)
    assert call(words) in (0, 3)
    assert DRAWING not in os.listdir("run")


@pytest.mark.parametrize("kind", [SystemError, KeyError, RuntimeError, TypeError])
def test_an_interruption_that_a_compiler_wraps_is_no_traceback(kind, monkeypatch, capsys):
    def wrapped(*_, **__):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as problem:
            raise kind("returned a result with an exception set") from problem

    monkeypatch.setattr("cdpr_drake.cli.check.check_file", wrapped, raising=False)
    monkeypatch.setattr("cdpr_drake.cli.app.make_app", lambda given: wrapped)
    assert call(["check", "x.yaml"]) == 130
    assert printed(capsys).err == "cdpr: stopped\n"


PLAN = ["plan", "planar", "--waypoints", "0,0,0.3;0.02,0,0.3", "--out", "plan"]


def test_a_plan_that_ends_while_its_figures_are_drawn_is_made_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):  # and nothing piles up beside it
        with monkeypatch.context() as ending:
            ending.setattr(
                "cdpr_drake.cli.plan.write_pictures", lambda *_: (_ for _ in ()).throw(Ended)
            )
            with pytest.raises(Ended):
                main(PLAN)
        assert DRAWING in os.listdir("plan")
        assert os.listdir(".") == ["plan"]
    assert call([*PLAN[:2], "--waypoints", "0,0,0.3;0.01,0,0.3", *PLAN[-2:]]) == 0
    assert sorted(os.listdir(".")) == ["plan", "plan-before"]
    assert call(PLAN) == 2
    assert "--overwrite" in printed(capsys).err


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
def test_a_fit_that_ends_while_its_figures_are_drawn_is_made_again(asked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = asked(tmp_path)
    with monkeypatch.context() as ending:
        ending.setattr(
            "cdpr_drake.analyses.visualization.figure_files.write_pictures",
            lambda *_: (_ for _ in ()).throw(Ended),
        )
        with pytest.raises(Ended):
            main(words)
    there = sorted(os.listdir("fit"))
    assert DRAWING in there  # and the numbers, which no figure can cost
    numbers = {name: told(name) for name in there if name.endswith((".json", ".yaml"))}
    assert len(numbers) == 3
    assert call(words) == 0
    made = os.listdir("fit")
    assert any(name.endswith(".png") for name in made)
    assert DRAWING not in made
    assert {name: told(name) for name in numbers} == numbers
    assert [name for name in os.listdir(".") if name.startswith("fit")] == ["fit"]
    assert call(words) == 2  # what is complete is not touched
