"""Cameras as ROS and OpenCV calibrate them become cameras of robots and scenarios."""

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.diagrams.load import load_scenario

K = np.array([[520.0, 0.0, 331.2], [0.0, 518.0, 236.4], [0.0, 0.0, 1.0]])
LENS = np.array([-0.28, 0.09, 0.0012, -0.0008, 0.01])
FISHEYE = np.array([0.02, -0.01, 0.003, -0.0005])
PIXEL = 1e-9
"""Of a projection by OpenCV with the same numbers [px]."""

ROS = """image_width: 640
image_height: 480
camera_name: mine
camera_matrix:
  rows: 3
  cols: 3
  data: [520., 0., 331.2, 0., 518., 236.4, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.28, 0.09, 0.0012, -0.0008, 0.01]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
"""
MESSAGE = """header:
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [-0.28, 0.09, 0.0012, -0.0008, 0.01]
K: [520.0, 0.0, 331.2, 0.0, 518.0, 236.4, 0.0, 0.0, 1.0]
---
"""


def opencv(path, coefficients=LENS, **more):
    """A file as OpenCV's FileStorage writes it."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in {"image_width": 640, "image_height": 480, **more}.items():
        storage.write(key, value)
    storage.write("camera_matrix", K)
    storage.write("distortion_coefficients", coefficients.reshape(-1, 1))
    storage.write("avg_reprojection_error", 0.21)
    storage.release()
    return path


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


POINTS = np.array([[0.3, -0.2, 1.0], [-0.1, 0.25, 0.8], [0.0, 0.1, 2.0]])


@pytest.mark.parametrize("kind", ["ros.yaml", "message.yml", "opencv.yaml", "opencv.xml"])
def test_a_calibration_of_another_tool_projects_as_opencv_does(kind, tmp_path):
    path = tmp_path / kind
    if kind.startswith("opencv"):
        opencv(path)
    else:
        written(path, ROS if kind == "ros.yaml" else MESSAGE)
    pinhole = load_camera(str(path)).pinhole(640, 480)
    uv, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), K, LENS)
    np.testing.assert_allclose(pinhole.project(POINTS.T).T, uv[:, 0], rtol=0, atol=PIXEL)


def test_a_fisheye_of_opencv_projects_as_opencv_does(tmp_path):
    path = opencv(tmp_path / "fisheye.xml", FISHEYE, fisheye_model=1)
    uv, _ = cv2.fisheye.projectPoints(POINTS[:, None], np.zeros(3), np.zeros(3), K, FISHEYE)
    found = load_camera(str(path)).pinhole(640, 480).project(POINTS.T).T
    np.testing.assert_allclose(found, uv[:, 0], rtol=0, atol=PIXEL)


def test_a_robot_and_a_scenario_take_it_and_what_is_not_used_is_said(tmp_path):
    path = opencv(tmp_path / "mine.xml")
    assert load_scenario("acrobot_pbvs", [f"camera.model={path}"]).camera.model == str(path)
    camera = load_camera(str(written(tmp_path / "ros.yaml", ROS)))
    assert camera.name == "mine"
    assert camera.assumptions == "rate_hz: the file says none. Not used: rectification_matrix."
    robot = load_robot("acrobot_small")
    robot.cameras[0].model = "mine.xml"
    robot_file = written(tmp_path / "robot.yaml", dump_typed(robot))
    assert load_robot(str(robot_file)).cameras[0].model == str(path)


def test_a_run_keeps_it_beside_its_scenario(tmp_path):
    path, folder = opencv(tmp_path / "mine.xml"), tmp_path / "run"
    folder.mkdir()
    scenario = load_scenario("acrobot_pbvs", [f"camera.model={path}"])
    write_run_inputs(folder, scenario, load_robot(scenario.robot))
    path.unlink()
    again = load_scenario(str(folder / "scenario.yaml"))
    assert again.camera.model == str(folder / "model.xml")


WIDE = ROS.replace("plumb_bob", "equidistant").replace("520.", "160.").replace("518.", "160.")
"""A fisheye that sees more than a half space."""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ROS.replace("plumb_bob", "kannala"), "distortion_model: found 'kannala'; accepted: plumb"),
        (ROS.replace("520., 0.", "520., 3."), "camera_matrix: found [520.0, 3.0"),
        (ROS.replace("image_width: 640\n", ""), "image_width, image_height: found none"),
        (ROS.replace("0.01]", ".nan]"), "distortion_coefficients: found"),
        (ROS.replace("331.2", "900"), "found a principal point (900, 236.4); accepted: one in"),
        (ROS.replace("-0.0008, 0.01]", "-0.0008]").replace("distortion_model: plumb_bob\n", ""),
         "distortion_model: found none with 4 coefficients"),
        (ROS.replace("0.01]", "0.01, 0, 0, 0, 0.1]"), "distortion_coefficients: found 9 numbers"),
        (WIDE.replace("[-0.28, 0.09, 0.0012, -0.0008, 0.01]", "[0.01, 0, 0, 0]"),
         "sees more than 88.9 deg from the axis"),
    ],
)  # fmt: skip
def test_a_calibration_that_is_no_camera_is_refused(text, words, tmp_path):
    path = written(tmp_path / "camera.yaml", text)
    with pytest.raises(RobotFileError) as caught:
        load_camera(str(path))
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_xml_without_a_camera_is_refused(tmp_path):
    path = written(tmp_path / "camera.xml", "<opencv_storage><a>1</a></opencv_storage>")
    with pytest.raises(RobotFileError, match="camera_matrix: found none"):
        load_camera(str(path))
