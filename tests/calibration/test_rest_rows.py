"""Rows at rest in logs that recorders write."""

from itertools import pairwise

import numpy as np
import pytest

from cdpr_drake.calibration.rest_rows import rows_at_rest

STANDS, MOVES, STOPS = 30, 40, 6
"""Rows of a stop and of a way between stops, and stops."""

NOISE, TENSION_NOISE, SWING = 5e-4, 0.5, 8.0
"""Of lengths [m] and tensions [N]; and how far tensions swing after a stop [N]."""

CREPT = 4e-3
"""Largest deviation in a group; the stop creeps by 60 mm [m]."""

EDGE = 4
"""Rows at the ends of a stop that a window cannot tell from motion."""


def recorded(noise=NOISE, step=0.1, seed=0, rows_of_a_stop=STANDS):
    """Times, lengths and tensions of a drive between stops, with friction; rows that stand."""
    random = np.random.default_rng(seed)
    corners = random.uniform(1.0, 2.0, (STOPS + 1, 4))
    way = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, MOVES))
    rows, stands = [], []
    for here, there in pairwise(corners):
        rows += [here] * rows_of_a_stop + [here + s * (there - here) for s in way]
        stands += [True] * rows_of_a_stop + [False] * MOVES
    lengths = np.array(rows)
    tensions = 50.0 + 10.0 * lengths + 4.0 * np.sign(np.gradient(lengths, axis=0))
    lengths = lengths + noise * random.standard_normal(lengths.shape)
    tensions = tensions + TENSION_NOISE * random.standard_normal(lengths.shape)
    return step * np.arange(len(lengths)), lengths, tensions, np.array(stands)


@pytest.mark.parametrize("noise", [0.0, NOISE, 2.0 * NOISE])
@pytest.mark.parametrize("step", [0.1, 0.02, 1.0])
def test_stops_of_a_drive_are_found_and_nothing_else(noise, step):
    time, lengths, tensions, stands = recorded(noise, step)
    found = rows_at_rest(time, [lengths], tensions)
    if step < 0.1:  # a way takes less than the window
        assert not any(~stands[group].all() for group in found.groups)
        return
    assert len(found.groups) == STOPS
    for number, group in enumerate(found.groups):
        begin = number * (STANDS + MOVES)
        assert begin - EDGE <= group.start <= begin + EDGE
        assert begin + STANDS - EDGE <= group.stop <= begin + STANDS + EDGE
    assert found.is_motion
    assert not (found.moving & found.unsteady).any()
    outside = np.ones(len(time), bool)
    for group in found.groups:
        outside[group] = False
    np.testing.assert_array_equal(outside, found.moving | found.unsteady)


@pytest.mark.parametrize("noise", [1e-5, NOISE])
def test_stops_no_longer_than_a_window_are_found(noise):
    time, lengths, tensions, stands = recorded(noise, rows_of_a_stop=10)
    found = rows_at_rest(time, [lengths], tensions)
    assert len(found.groups) == STOPS
    # The first and the last row of a way are where the platform stands.
    assert all(np.sum(~stands[group]) <= 2 for group in found.groups)


def test_means_are_those_of_the_rows():
    time, lengths, tensions, _ = recorded()
    lengths[3, 0] = np.nan
    tensions[:, 2] = np.nan
    found = rows_at_rest(time, [lengths], tensions)
    mean, std = found.means(lengths)
    first = lengths[found.groups[0]]
    np.testing.assert_allclose(mean[0], np.nanmean(first, axis=0))
    np.testing.assert_allclose(std[0], np.nanstd(first, axis=0))
    assert np.isnan(found.means(tensions)[0][:, 2]).all()


def test_a_platform_that_swings_does_not_rest():
    time, lengths, tensions, _ = recorded()
    stop = slice(STANDS + MOVES, 2 * STANDS + MOVES)
    tensions[stop] += SWING * np.sin(7.0 * time[stop])[:, None]
    found = rows_at_rest(time, [lengths], tensions)
    assert len(found.groups) == STOPS - 1
    assert found.unsteady[stop][EDGE:-EDGE].all()


def test_a_log_with_a_row_for_each_pose_has_no_groups():
    random = np.random.default_rng(1)
    lengths = random.uniform(1.0, 2.0, (40, 8))
    for step in (0.1, 1.0, 60.0):
        found = rows_at_rest(step * np.arange(40), [lengths], None)
        assert not found.groups
        assert not found.is_motion


def test_a_motion_without_stops_is_one():
    time = 0.1 * np.arange(300)
    lengths = 2.0 + 0.4 * np.sin(0.5 * time[:, None] + np.arange(4))
    found = rows_at_rest(time, [lengths + 1e-4 * np.sin(90.0 * time)[:, None]], None)
    assert found.is_motion
    assert found.moving.mean() > 0.9


def test_a_gap_parts_two_stops():
    """The recorder was off while the robot moved."""
    time, lengths, tensions, stands = recorded()
    lengths, tensions, time = lengths[stands], tensions[stands], time[stands]
    found = rows_at_rest(time, [lengths], tensions)
    assert len(found.groups) == STOPS
    assert all(group.start // STANDS == (group.stop - 1) // STANDS for group in found.groups)


def test_rows_on_both_sides_of_a_gap_are_two_groups():
    _, lengths, tensions, _ = recorded()
    lengths, tensions = (np.vstack([rows[:STANDS], rows]) for rows in (lengths, tensions))
    numbers = np.arange(len(lengths))
    found = rows_at_rest(0.1 * numbers + 60.0 * (numbers >= STANDS), [lengths], tensions)
    assert len(found.groups) == STOPS + 1
    assert found.groups[0].stop <= STANDS <= found.groups[1].start


def test_an_angle_that_swings_on_standing_winches_is_no_rest():
    time, lengths, _, _ = recorded()
    angles = lengths - 1.5
    stop = slice(STANDS + MOVES, 2 * STANDS + MOVES)
    angles[stop] += 0.02 * np.sin(9.0 * time[stop])[:, None]  # rates of a window are small
    found = rows_at_rest(time, [lengths, angles], None)
    assert not any(stop.start + EDGE < group.start < stop.stop - EDGE for group in found.groups)
    assert len(found.groups) == STOPS - 1


def test_a_stop_that_creeps_is_split():
    lengths = recorded()[1]
    last = np.tile(lengths[-1], (300, 1)) + 2e-3 * 0.1 * np.arange(1, 301)[:, None]
    lengths = np.vstack([lengths, last])
    time = 0.1 * np.arange(len(lengths))
    found = rows_at_rest(time, [lengths], None)
    assert len(found.groups) > STOPS + 1
    assert np.max(found.means(lengths)[1]) < CREPT
