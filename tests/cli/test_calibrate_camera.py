"""`cdpr calibrate-camera`: from drawn images to a camera that scenarios take."""

import json

import cv2
import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.cli.commands import ended, refuse
from tests.vision.boards import board_image, board_poses, make_board

K = np.array([[520.0, 0.0, 331.2], [0.0, 518.0, 236.4], [0.0, 0.0, 1.0]])
LENS = np.array([-0.28, 0.09, 0.0012, -0.0008, 0.0])
FOCAL = 0.005  # share of the focal length; of eight drawn images
BOARD = ("--board", "charuco", "--squares", "9x7", "--size", "0.035")


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Files of drawn images, one of them without a board."""
    folder, board = tmp_path_factory.mktemp("boards"), make_board("charuco")
    files = []
    for k, pose in enumerate(board_poses(board, 10, 0.45, spread=0.35)):
        path = folder / f"board_{k}.png"
        cv2.imwrite(str(path), board_image(board, K, LENS, (640, 480), pose))
        files.append(str(path))
    empty = folder / "empty.png"
    cv2.imwrite(str(empty), np.full((480, 640), 128, np.uint8))
    return [*files, str(empty)]


@pytest.fixture(scope="module")
def calibrated(images, tmp_path_factory):
    """The folder that the command writes."""
    out = tmp_path_factory.mktemp("calibrated") / "camera"
    assert ended("calibrate-camera", *images, *BOARD, "--out", out) == 0
    return out


def test_images_become_a_camera_that_scenarios_take(calibrated):
    numbers = json.loads((calibrated / "results.json").read_text(encoding="utf-8"))
    values = {row["name"]: row["value"] for row in numbers["parameters"]}
    assert values["fx"] == pytest.approx(520.0, rel=FOCAL)
    assert values["fy"] == pytest.approx(518.0, rel=FOCAL)
    assert all(row["std"] > 0.0 for row in numbers["parameters"])
    assert numbers["fitted_rms_px"] < 0.3
    assert numbers["held_out_rms_px"] < 0.5
    assert [row["role"] for row in numbers["images"]].count("held out") == 2
    assert any("empty.png" in words for words in numbers["remarks"])
    assert (calibrated / "camera.png").stat().st_size > 10_000
    file = str(calibrated / "camera.yaml")
    pinhole = load_camera(file).pinhole(640, 480)
    for name in ("fx", "fy", "cx", "cy"):
        assert getattr(pinhole, name) == pytest.approx(values[name], abs=1e-9)
    assert pinhole.distortion.coefficients[:5] == pytest.approx(
        [values[name] for name in ("k1", "k2", "p1", "p2", "k3")], abs=1e-15
    )
    assert load_scenario("acrobot_pbvs", [f"camera.model={file}"]).camera.model == file


SAME = 1e-3
"""Of standard deviations. OpenCV adds up in parallel, so that its results change in the seventh
digit from call to call; another set of images would change them by whole deviations."""


def test_pictures_give_what_the_command_writes_of_files(images, calibrated):
    pictures = [cv2.imread(name) for name in images]
    fit = cdpr.calibrate_camera(pictures, squares=(9, 7), size=0.035, name="mine", rate=25.0)
    assert fit.folder is None
    assert (fit.model.name, fit.model.rate_hz) == ("mine", 25.0)
    assert "held out" in repr(fit)
    assert len(fit.tables()) == 4
    rows = json.loads((calibrated / "results.json").read_text(encoding="utf-8"))["parameters"]
    apart = [abs(u.value - row["value"]) / u.std for u, row in zip(fit.unknowns, rows, strict=True)]
    assert max(apart) < SAME


def test_what_gives_no_camera_is_refused(images, tmp_path, capsys):
    cv2.imwrite(str(tmp_path / "other.png"), np.full((100, 100), 128, np.uint8))
    for files, more, words in (
        (images[:3], (), "images: found the board in 3; accepted: at least 5"),
        ([images[0], tmp_path / "other.png"], (), "other.png: found 100 x 100 pixels"),
        ([tmp_path / "nothing.png"], (), "nothing.png: found no image"),
        (images[:5], ("--hold-out", "0.8"), "--hold-out: found 0.8"),
    ):
        asked = ("calibrate-camera", *files, *BOARD, *more, "--out", tmp_path / "no")
        assert words in refuse(capsys, *asked)
        assert not (tmp_path / "no").exists()
