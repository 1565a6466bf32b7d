"""Meshcat scenes and recordings."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
