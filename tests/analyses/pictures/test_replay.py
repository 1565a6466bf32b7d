"""Meshcat scenes and recordings."""

import numpy as np
import pytest

from cdpr_drake.analyses.pictures.replay import frame_indices, robot_html
from cdpr_drake.models import load_robot, robot_names


def test_frames_are_the_nearest_rows():
    times = np.arange(0.0, 1.001, 0.02)
    assert frame_indices(times, 25.0) == list(range(0, 51, 2))
    assert frame_indices(times[:1], 25.0) == [0]


def test_frames_of_a_sparse_log_are_not_repeated():
    assert frame_indices(np.array([0.0, 0.5, 1.0]), 25.0) == [0, 1, 2]


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_has_a_page(name):
    page = robot_html(load_robot(name))
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert 'src="http' not in page
