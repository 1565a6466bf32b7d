"""Grids of poses: points, numbering, orientations, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.errors import WorkspaceGridError
from cdpr_drake.geometry.poses import pose_row, rotation_from_angles
from cdpr_drake.workspaces.pose_grid import (
    WorkspaceGrid,
    axis_by_count,
    axis_by_step,
    grid_by_count,
    grid_by_step,
)

ROUNDING = 1e-12


def test_grids_of_the_thesis_have_its_points():
    acrobot = grid_by_step([-0.48, -0.48, 0.0], [0.48, 0.48, 1.1], [0.03, 0.03, 0.1])
    assert acrobot.shape == (1, 33, 33, 12)
    np.testing.assert_allclose(acrobot.upper, [0.48, 0.48, 1.1], atol=ROUNDING)
    np.testing.assert_allclose(acrobot.steps, [0.03, 0.03, 0.1], atol=ROUNDING)
    caroca = grid_by_step([-1.92, -3.36, 0.0], [1.92, 3.36, 3.0], [0.12, 0.21, 0.3])
    assert caroca.shape == (1, 33, 33, 11)


@given(st.floats(-5, 5), st.floats(0, 10), st.floats(0.05, 3.0))
def test_an_axis_by_step_stays_in_its_box_and_fills_it(lower, length, step):
    axis = axis_by_step(lower, lower + length, step)
    assert axis[0] == lower
    assert axis[-1] <= lower + length + 1e-5 * step
    assert axis[-1] + step > lower + length
    np.testing.assert_allclose(np.diff(axis), step, rtol=1e-9)


def test_one_point_lies_in_the_middle():
    assert axis_by_count(1.0, 3.0, 1) == [2.0]
    assert list(axis_by_count(1.0, 1.0, 5)) == [1.0]
    np.testing.assert_allclose(axis_by_count(0.0, 1.0, 3), [0.0, 0.5, 1.0])


def test_poses_are_numbered_with_z_fastest_and_orientations_slowest():
    angles = [[0.0, 0.0, 0.0], [0.1, -0.2, 0.3]]
    grid = grid_by_count([0.0, 10.0, 20.0], [1.0, 11.0, 21.0], [2, 3, 4], angles)
    assert grid.size == 48
    positions = grid.positions().reshape(*grid.shape, 3)
    assert positions[1, 0, 2, 3] == pytest.approx([0.0, 11.0, 21.0])
    assert positions[0, 1, 0, 0] == pytest.approx([1.0, 10.0, 20.0])
    turn = rotation_from_angles(np.array(angles[1])).matrix()
    np.testing.assert_allclose(grid.rotations()[24:], np.broadcast_to(turn, (24, 3, 3)))


@given(st.integers(0, 30), st.integers(0, 30))
def test_a_part_is_the_same_as_the_whole_cut(start, stop):
    grid = grid_by_count([0, 0, 0], [1, 1, 1], [2, 2, 3], [[0, 0, 0], [0.1, 0, 0]])
    np.testing.assert_array_equal(grid.positions(start, stop), grid.positions()[start:stop])
    np.testing.assert_array_equal(grid.rotations(start, stop), grid.rotations()[start:stop])


def test_poses_are_the_positions_with_the_rotations():
    grid = grid_by_count([0, 0, 0], [1, 1, 1], [2, 1, 1], [[0.1, 0.2, 0.3]])
    for X_WP, p, R in zip(grid.poses(), grid.positions(), grid.rotations(), strict=True):
        np.testing.assert_array_equal(X_WP.translation(), p)
        np.testing.assert_array_equal(X_WP.rotation().matrix(), R)
    for X_WP, row in zip(grid.poses(), grid.pose_rows(), strict=True):
        np.testing.assert_allclose(pose_row(X_WP), row, atol=ROUNDING)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: grid_by_step([0, 0, 0], [1, 1, 1], [0.1, 0.0, 0.1]), ["y", "step > 0"]),
        (lambda: grid_by_step([0, 0, 2], [1, 1, 1], [0.1, 0.1, 0.1]), ["z", "2 to 1"]),
        (lambda: grid_by_step([0, 0, 0], [np.inf, 1, 1], [0.1, 0.1, 0.1]), ["x", "inf"]),
        (lambda: grid_by_count([0, 0, 0], [1, 1, 1], [0, 1, 1]), ["x", "0 points"]),
        (lambda: WorkspaceGrid(([], [0.0], [0.0]), np.zeros((1, 3))), ["x", "no points"]),
        (lambda: WorkspaceGrid(([0, np.nan], [0], [0]), np.zeros((1, 3))), ["x", "NaN"]),
        (lambda: WorkspaceGrid(([1, 0], [0], [0]), np.zeros((1, 3))), ["x", "ascending"]),
        (lambda: WorkspaceGrid(([0], [0], [0]), np.zeros((0, 3))), ["0 orientations"]),
    ],
)
def test_refuses(make, words):
    with pytest.raises(WorkspaceGridError) as refused:
        make()
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)
