"""Meshcat scenes and recordings."""

import base64
import json
import re
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.geometry import MeshcatVisualizer, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.analyses.visualization import replay
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay import (
    RobotPicture,
    frame_indices,
    robot_picture,
    write_replay,
)
from cdpr_drake.analyses.visualization.replay_page import CameraView, with_notes
from cdpr_drake.analyses.visualization.shown_things import frustum
from cdpr_drake.analyses.visualization.solids import transparent_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import TENSIONS
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.diagrams.camera import add_pictured_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.pinhole import Pinhole
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS


@pytest.mark.parametrize(
    ("times", "rows"),
    [
        (np.arange(0.0, 1.001, 0.02), range(0, 51, 2)), ([0.0], [0]), ([0.0, 0.5, 1.0], range(3)),
    ],
)  # fmt: skip
def test_frames_are_the_nearest_rows_each_once(times, rows):
    assert frame_indices(np.array(times), 25.0) == list(rows)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_has_a_page(name):
    page = robot_picture(load_robot(name)).html()
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert 'src="http' not in page
    notes = notes_of(page)
    assert notes["frames"] is None  # no time is shown
    assert notes["names"]


def test_hours_of_frames_take_little_memory_and_are_capped():
    """Twenty simulated minutes once took rows x frames numbers: more than there is memory."""
    times = np.arange(0.0, 3 * 3600.0, 0.02)
    tracemalloc.start()
    frames = frame_indices(times, 25.0, 15_000)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6
    assert len(frames) <= 15_000
    assert frames[0] == 0
    assert frames[-1] == len(times) - 1
    steps = np.diff(frames)
    assert steps.max() - steps.min() <= 1


@given(st.lists(st.floats(0.001, 0.1), min_size=1, max_size=60), st.floats(5.0, 50.0))
def test_frames_of_uneven_rows_are_the_nearest(gaps, rate):
    times = np.cumsum([0.0, *gaps])
    wanted = np.arange(times[0], times[-1] + 0.5 / rate, 1.0 / rate)
    nearest = np.argmin(np.abs(times[:, None] - wanted[None, :]), axis=0)
    gap = np.abs(times[nearest] - wanted)
    frames = np.array(frame_indices(times, rate))
    found = np.min(np.abs(times[frames][:, None] - wanted[None, :]), axis=0)
    np.testing.assert_allclose(found, gap, atol=1e-12)


def notes_of(page):
    (words,) = re.findall(r'id="cdpr-data">(.*?)</script>', page, re.DOTALL)
    return json.loads(words)


PINHOLE = Pinhole.from_view_angles(640, 480, 1.0, 0.8)


def unpacked(words, kind):
    return np.frombuffer(base64.b64decode(words), kind)


def moving_log(robot, rows):
    times = np.arange(rows) * 0.04
    poses = [
        pose_row(pose_from_angles([0.1 * np.sin(t), 0.1 * np.cos(t), 0.3], np.zeros(3)))
        for t in times
    ]
    tensions = 5.0 + np.sin(times[:, None] + np.arange(len(robot.cables)))
    return {"time": times, "X_WP": np.array(poses), "tensions": tensions}


def test_a_replay_says_its_time_and_names_cables_tensions_and_lines(tmp_path):
    robot, path = load_robot("acrobot_small"), tmp_path / "replay.html"
    camera = CameraMounting(pose_from_angles([0.0, 0.0, 0.0], [np.pi, 0.0, 0.0])), PINHOLE
    log = moving_log(robot, 5)
    log["tensions"][2, 3] = 0.0
    write_replay(path, robot, log, camera=camera)
    page = path.read_text()
    notes = notes_of(page)
    assert notes["names"] == [cable.name for cable in robot.cables]
    np.testing.assert_allclose(notes["places"], robot.exit_points().T)
    assert notes["scale"] == pytest.approx(np.max(log["tensions"]))
    assert notes["colors"] == list(TENSIONS)
    np.testing.assert_array_equal(unpacked(notes["frames"]["time"], "<f8"), log["time"])
    tensions = unpacked(notes["frames"]["tensions"], "<f4").reshape(-1, 8)
    np.testing.assert_allclose(tensions, log["tensions"], rtol=1e-6)
    slack = unpacked(notes["frames"]["slack"], "u1").reshape(-1, 8)
    assert np.argwhere(slack).tolist() == [[2, 3]]
    assert notes["curves"]["limits"] == list(robot.tension_limits())
    assert notes["camera"] is None
    assert [line[0] for line in notes["lines"]] == [
        "path of the platform, Po", "view of the camera", "path of the camera, Co",
    ]  # fmt: skip
    assert 'src="http' not in page


def test_words_of_a_user_cannot_end_the_script():
    names = ["</script><script>alert(1)</script>", "C2"]
    page = with_notes("<html><body></body></html>", names, np.zeros((3, 2)), 1.0)
    assert notes_of(page)["names"] == names
    assert "<script>alert" not in page


def test_the_view_of_a_camera_ends_at_the_corners_of_its_image():
    starts, ends = frustum(PINHOLE, 0.5)
    np.testing.assert_array_equal(starts[:, :4], 0.0)
    np.testing.assert_allclose(ends[2, :4], 0.5)
    corners = [[-0.5, 639.5, 639.5, -0.5], [-0.5, -0.5, 479.5, 479.5]]
    np.testing.assert_allclose(PINHOLE.project(ends[:, :4]), corners)
    assert ends[1, 8] < np.min(ends[1, :4])  # what is up in the image has the smaller v


def test_a_page_that_would_be_too_large_has_fewer_frames(tmp_path, monkeypatch):
    """Sagging cables take many bodies each: twenty minutes of them once gave 150 MB."""
    robot, path = load_robot("acrobot_small"), tmp_path / "replay.html"
    log = moving_log(robot, 150)
    write_replay(path, robot, log)
    whole = path.stat().st_size
    empty = len(robot_picture(robot).html())
    assert (whole - empty) / 6.0 < 60_000  # a second, as the guide says
    most = int(empty + 0.5 * (whole - empty))
    monkeypatch.setattr(replay, "LARGEST_PAGE", most)
    monkeypatch.setattr(replay, "BYTES_EACH", 1)  # as if the estimate were far too low
    write_replay(path, robot, log)
    assert empty < path.stat().st_size <= most


@pytest.mark.parametrize(("name", "moves"), [("acrobot_pbvs", False), ("acrobot_moving_tag", True)])
def test_a_picture_has_systems_of_drake_alone_unless_its_target_moves(name, moves):
    """pydrake frees no diagram with a system that is written in Python."""
    builder, scenario = DiagramBuilder(), load_scenario(name)
    block = add_pictured_robot(builder, load_robot(scenario.robot), scenario)
    modules = {type(system).__module__.partition(".")[0] for system in builder.GetSystems()}
    assert ("cdpr_drake" in modules) == moves
    inspector = block.scene_graph.model_inspector()
    names = [inspector.GetName(each) for each in inspector.GetAllGeometryIds()]
    assert any(name.startswith("target") for name in names)


def test_three_hours_of_frames_fit_by_estimate(tmp_path):
    robot = load_robot("acrobot_small")
    log = moving_log(robot, 100)
    picture = RobotPicture(robot, 5.0)
    each = replay.affordable_frames(picture, log, 0)
    assert each * replay.BYTES_EACH * (len(robot.cables) + 3) <= replay.LARGEST_PAGE
    slack = log | {"unstrained_lengths": np.full((100, 8), 3.0)}  # all hang
    assert replay.affordable_frames(picture, slack, 0) < each / 3


def test_a_replay_has_the_marks_of_its_frames_and_the_desired_ones(tmp_path):
    robot, path = load_robot("acrobot_small"), tmp_path / "replay.html"
    log = moving_log(robot, 200)
    log["time"] = np.arange(200) * 0.01  # four rows a frame
    log["ellipses_px"] = np.arange(200.0)[:, None] + np.arange(5)
    log["found"] = (np.arange(200) % 8 > 0)[:, None].astype(float)
    desired = [(0.0, np.arange(5.0)), (1.0, None)]
    view = CameraView(pinhole=PINHOLE, kind="projected", mark="ellipses", desired=desired)
    write_replay(path, robot, log, view=view)
    notes = notes_of(path.read_text())
    rows = frame_indices(log["time"], replay.REPLAY_RATE)
    camera = notes["camera"]
    assert [camera["width"], camera["height"], camera["size"]] == [640, 480, 5]
    marks = unpacked(camera["marks"], "<f4").reshape(-1, 5)
    np.testing.assert_array_equal(marks, log["ellipses_px"][rows])
    np.testing.assert_array_equal(unpacked(camera["found"], "u1"), log["found"][rows, 0])
    assert camera["desired"] == [[0.0, [0.0, 1.0, 2.0, 3.0, 4.0]], [1.0, None]]
    assert camera["images"] == []


def test_no_peak_between_two_frames_is_lost_in_the_curves(tmp_path):
    robot, path = load_robot("acrobot_small"), tmp_path / "replay.html"
    times = np.arange(20_000) * 0.001
    log = {
        "time": times,
        "X_WP": np.tile(pose_row(pose_from_angles([0.0, 0.0, 0.3], np.zeros(3))), (20_000, 1)),
        "tensions": np.full((20_000, 8), 5.0),
    }
    log["tensions"][12_345, 6] = 31.0
    write_replay(path, robot, log)
    curves = notes_of(path.read_text())["curves"]
    tensions = unpacked(curves["tensions"], "<f4").reshape(-1, 8)
    assert len(tensions) < 3000
    row = int(np.argmax(tensions[:, 6]))
    assert tensions[row, 6] == 31.0
    assert unpacked(curves["time"], "<f8")[row] == pytest.approx(12.345)


def test_every_frame_has_a_place_of_its_own_in_the_recording():
    """Rounded down to 25 steps a second, the frame of 1.16 s once took the place of that before."""
    picture = RobotPicture(load_robot("acrobot_small"), 5.0)
    picture.start_recording()
    recording = picture.meshcat.get_mutable_recording()
    times = np.arange(200) * 0.04
    steps = np.array([recording.frame(time) for time in times])
    assert np.all(np.diff(steps) > 30)
    np.testing.assert_allclose(steps / recording.frames_per_second(), times, atol=1.0e-3)


def test_transparent_shapes_of_a_scene_are_found_where_meshcat_has_them():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("glass", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    for parent, alpha, name in (
        (plant.world_body(), 0.4, "wall"), (plant.world_body(), 1.0, "floor"), (body, 0.5, "ball"),
    ):  # fmt: skip
        color = [0.5, 0.5, 0.5, alpha]
        plant.RegisterVisualGeometry(parent, RigidTransform(), Sphere(0.1), name, color)
    plant.Finalize()
    meshcat = open_meshcat()
    visualizer = MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())
    assert visualizer is not None
    paths = transparent_paths(scene_graph.model_inspector())
    assert len(paths) == 2
    for path in paths:
        assert meshcat.HasPath(f"{path}/<object>") or meshcat.HasPath(path)
