"""Plans and fits that end while their figures are drawn are made again."""

import os
from pathlib import Path

import cv2
import pytest

from cdpr_drake.schema.yaml_files import load_yaml
from tests.analyses.fits.logs import MOTION_NOISE, write_motion
from tests.cli.commands import ended, refuse
from tests.cli.test_fits import BOARD, LENS, K
from tests.identification.logs import log
from tests.vision.boards import board_image, board_poses, make_board

pytestmark = pytest.mark.usefixtures("here")


class Ended(BaseException):
    """What no handler takes, as the end of a process."""


def end_at_once(*_):
    raise Ended


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
    write_motion(folder / "log.csv", *log(span=2.0, **MOTION_NOISE))
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
def test_a_fit_that_stops_before_its_figures_keeps_its_numbers(asked, here, monkeypatch, capsys):
    words = asked(here)
    with monkeypatch.context() as patch:
        patch.setattr("cdpr_drake.analyses.frame.figures.figure_writers", end_at_once)
        with pytest.raises(Ended):
            ended(*words)
    names = [name for name in os.listdir("fit") if name.endswith((".json", ".yaml"))]
    numbers = {name: told(name) for name in names if not name.startswith(".")}
    assert len(numbers) == 3  # results, what was shown, the model
    assert ended(*words) == 0
    assert any(name.endswith(".png") for name in os.listdir("fit"))
    assert ended(*words) == 0  # read again
    assert {name: told(name) for name in numbers} == numbers
