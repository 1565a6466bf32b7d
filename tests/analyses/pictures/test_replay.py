"""Meshcat scenes and recordings."""

import json
import re
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.analyses.pictures import replay
from cdpr_drake.analyses.pictures.replay import (
    RobotPicture,
    frame_indices,
    frustum,
    robot_html,
    write_replay,
)
from cdpr_drake.analyses.pictures.replay_page import PageNotes, with_notes
from cdpr_drake.models import load_robot
from cdpr_drake.palette import PLATFORM, TENSIONS
from cdpr_drake.servoing import CameraMounting
from cdpr_drake.spatial import pose_from_angles, pose_row
from cdpr_drake.vision import Pinhole
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS


def test_frames_are_the_nearest_rows():
    times = np.arange(0.0, 1.001, 0.02)
    assert frame_indices(times, 25.0) == list(range(0, 51, 2))
    assert frame_indices(times[:1], 25.0) == [0]


def test_frames_of_a_sparse_log_are_not_repeated():
    assert frame_indices(np.array([0.0, 0.5, 1.0]), 25.0) == [0, 1, 2]


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_has_a_page(name):
    page = robot_html(load_robot(name))
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert 'src="http' not in page


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


def moving_log(robot, rows):
    times = np.arange(rows) * 0.04
    poses = [
        pose_row(pose_from_angles([0.1 * np.sin(t), 0.1 * np.cos(t), 0.3], np.zeros(3)))
        for t in times
    ]
    return {
        "time": times,
        "X_WP": np.array(poses),
        "tensions": 5.0 + np.sin(times[:, None] + np.arange(len(robot.cables))),
    }


def test_a_replay_says_its_time_and_names_cables_tensions_and_lines(tmp_path):
    robot, path = load_robot("acrobot_small"), tmp_path / "replay.html"
    camera = CameraMounting(pose_from_angles([0.0, 0.0, 0.0], [np.pi, 0.0, 0.0])), PINHOLE
    log = moving_log(robot, 5)
    write_replay(path, robot, log, camera=camera)
    page = path.read_text()
    notes = notes_of(page)
    assert notes["names"] == [cable.name for cable in robot.cables]
    np.testing.assert_allclose(notes["places"], robot.exit_points().T)
    assert notes["scale"] == pytest.approx(np.max(log["tensions"]))
    assert notes["colors"] == list(TENSIONS)
    assert notes["recorded"]
    assert [line[0] for line in notes["lines"]] == [
        "path of the platform, Po", "view of the camera", "path of the camera, Co",
    ]  # fmt: skip
    assert 'src="http' not in page


def test_a_still_page_shows_no_time():
    notes = notes_of(robot_html(load_robot("acrobot_small")))
    assert not notes["recorded"]
    assert notes["names"]


def test_words_of_a_user_cannot_end_the_script():
    names = ["</script><script>alert(1)</script>", "C2"]
    page = with_notes(
        "<html><body></body></html>", PageNotes(names, np.zeros((3, 2)), full_scale=1.0)
    )
    assert notes_of(page)["names"] == names
    assert "<script>alert" not in page


def test_the_scene_has_the_trace_and_the_view_of_the_camera():
    robot = load_robot("acrobot_small")
    picture = RobotPicture(robot, 5.0)
    picture.show_trace("platform, Po", moving_log(robot, 5)["X_WP"][:, 4:], PLATFORM)
    picture.show_camera(PINHOLE)
    assert picture.meshcat.HasPath("traces/platform, Po")
    assert picture.meshcat.HasPath("camera/view")


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
    empty = len(robot_html(robot))
    most = int(empty + 0.5 * (whole - empty))
    monkeypatch.setattr(replay, "LARGEST_PAGE", most)
    monkeypatch.setattr(replay, "BYTES_EACH", 1)  # as if the estimate were far too low
    write_replay(path, robot, log)
    assert empty < path.stat().st_size <= most


def test_three_hours_of_frames_fit_by_estimate(tmp_path):
    robot = load_robot("acrobot_small")
    log = moving_log(robot, 100)
    picture = RobotPicture(robot, 5.0)
    each = replay._affordable_frames(picture, log)
    assert each * replay.BYTES_EACH * (len(robot.cables) + 3) <= replay.LARGEST_PAGE
    slack = log | {"unstrained_lengths": np.full((100, 8), 3.0)}  # all hang
    assert replay._affordable_frames(picture, slack) < each / 3
