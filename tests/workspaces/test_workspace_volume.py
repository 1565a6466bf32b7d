"""Volumes of sets of grid points: bodies of known volume, counts by hand, order of the rules."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdpr_drake.errors import WorkspaceGridError
from cdpr_drake.workspaces.pose_grid import grid_by_count, grid_by_step
from cdpr_drake.workspaces.volume import (
    VolumeRule,
    cell_hull_share,
    cells_inside,
    corner_share,
    workspace_volume,
)

ROUNDING = 1e-12
DISCRETE = 0.03
"""Relative error of a ball's volume on the grid used here: step over radius is 1/30."""


def test_the_whole_grid_has_the_volume_of_its_box_by_every_rule():
    grid = grid_by_step([-0.48, -0.48, 0.0], [0.48, 0.48, 1.1], [0.03, 0.03, 0.1])
    for rule in VolumeRule:
        volume = workspace_volume(np.ones(grid.shape[1:], bool), grid.axes, rule)
        assert volume.value == pytest.approx(0.96 * 0.96 * 1.1, rel=ROUNDING)  # 1.014 m^3
        assert volume.share == pytest.approx(1.0, rel=ROUNDING)
        assert volume.unit == "m^3"
        none = workspace_volume(np.zeros(grid.shape[1:], bool), grid.axes, rule)
        assert none.value == 0.0


def test_a_ball_has_its_volume():
    grid = grid_by_count([-1, -1, -1], [1, 1, 1], [81, 81, 81])
    positions = grid.positions().reshape(*grid.shape[1:], 3)
    inside = np.linalg.norm(positions, axis=-1) <= 0.75
    for rule in (VolumeRule.POINTS, VolumeRule.HULL):
        value = workspace_volume(inside, grid.axes, rule).value
        assert value == pytest.approx(4 / 3 * np.pi * 0.75**3, rel=DISCRETE)


def test_a_hollow_ball_keeps_its_hull_only():
    grid = grid_by_count([-1, -1, -1], [1, 1, 1], [31, 31, 31])
    radius = np.linalg.norm(grid.positions().reshape(*grid.shape[1:], 3), axis=-1)
    ball, shell = radius <= 0.9, (radius <= 0.9) & (radius > 0.5)
    hull = [workspace_volume(mask, grid.axes, "hull").value for mask in (ball, shell)]
    assert hull[0] == pytest.approx(hull[1], rel=ROUNDING)
    points = [workspace_volume(mask, grid.axes, "points").value for mask in (ball, shell)]
    assert points[1] < 0.85 * points[0]


def test_planar_grids_have_areas():
    grid = grid_by_step([-0.48, -0.48, 0.3], [0.48, 0.48, 0.3], [0.03, 0.03, 0.1])
    inside = (grid.positions()[:, 0] >= -1e-9).reshape(grid.shape[1:])
    for rule in VolumeRule:
        area = workspace_volume(inside, grid.axes, rule)
        assert area.unit == "m^2"
        assert area.full == pytest.approx(0.9216, rel=ROUNDING)  # 0.92 m^2
    assert workspace_volume(inside, grid.axes, "corners").share == pytest.approx(0.5)
    assert workspace_volume(inside, grid.axes, "hull").share == pytest.approx(0.5)
    # The column on the border counts with half a cell on the other side.
    assert workspace_volume(inside, grid.axes, "points").share == pytest.approx(16.5 / 32.0)


def test_lines_and_single_points():
    line = grid_by_count([0, 0, 0], [2, 0, 0], [5, 1, 1])
    some = np.array([False, True, True, True, False]).reshape(5, 1, 1)
    for rule, value in (("points", 1.5), ("corners", 1.0), ("hull", 1.0)):
        length = workspace_volume(some, line.axes, rule)
        assert (length.value, length.full, length.unit) == (value, 2.0, "m")
    point = grid_by_count([0, 0, 0], [0, 0, 0], [1, 1, 1])
    for rule in VolumeRule:
        assert workspace_volume(np.ones((1, 1, 1)), point.axes, rule).value == 1.0
        assert workspace_volume(np.zeros((1, 1, 1)), point.axes, rule).value == 0.0


def test_flat_sets_have_no_hull():
    grid = grid_by_count([0, 0, 0], [1, 1, 1], [4, 4, 4])
    plane = np.zeros((4, 4, 4), bool)
    plane[:, 1, :] = True
    assert workspace_volume(plane, grid.axes, "hull").value == 0.0
    two = np.zeros((4, 4, 4), bool)
    two[0, 0, 0] = two[3, 3, 3] = True
    assert workspace_volume(two, grid.axes, "hull").value == 0.0


@given(arrays(bool, st.tuples(*[st.integers(2, 4)] * 3)))
def test_cells_have_their_corners_inside_and_the_rules_are_ordered(inside):
    cells = cells_inside(inside)
    for i, j, k in itertools.product(*(range(n) for n in cells.shape)):
        assert cells[i, j, k] == np.all(inside[i : i + 2, j : j + 2, k : k + 2])
    assert corner_share(inside) == np.sum(cells) / cells.size
    grid = grid_by_count([0, 0, 0], [1, 2, 3], inside.shape)
    by = {rule: workspace_volume(inside, grid.axes, rule).value for rule in VolumeRule}
    assert by[VolumeRule.CORNERS] <= by[VolumeRule.POINTS] + ROUNDING
    assert by[VolumeRule.CORNERS] <= by[VolumeRule.HULL] + 1e-9


def test_refuses_sizes_that_do_not_fit():
    grid = grid_by_count([0, 0, 0], [1, 1, 1], [2, 3, 4])
    with pytest.raises(WorkspaceGridError, match=r"\(2, 3\) on axes of \(2, 3, 4\)"):
        workspace_volume(np.ones((2, 3)), grid.axes, "points")


@pytest.mark.parametrize(
    ("missing", "share"),
    [
        ([], 1.0),
        ([(0, 0, 0)], 5 / 6),  # without the tetrahedron of that corner
        ([(0, 0, 0), (1, 1, 1)], 4 / 6),
        ([(0, 0, 0), (1, 0, 0)], 3 / 6),  # half a cell, a prism
        ([(0, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1)], 0.0),  # a face has no volume
        ([(0, 0, 0), (1, 1, 0), (1, 0, 1), (0, 1, 1)], 2 / 6),  # a regular tetrahedron
    ],
)
def test_hulls_of_a_cell_by_hand(missing, share):
    inside = np.ones((2, 2, 2), bool)
    for corner in missing:
        inside[corner] = False
    assert cell_hull_share(inside) == pytest.approx(share, abs=ROUNDING)


def test_hulls_of_cells_in_a_plane_and_on_a_line():
    inside = np.array([[1, 1, 0], [1, 1, 1]], bool)
    assert cell_hull_share(inside) == pytest.approx((1.0 + 0.5) / 2)
    assert cell_hull_share(np.array([1, 1, 0, 1], bool)) == pytest.approx(1 / 3)


@given(arrays(bool, (4, 3, 5)))
def test_hulls_of_cells_lie_between_whole_cells_and_the_hull_of_all(inside):
    grid = grid_by_count([0, 0, 0], [3, 2, 4], [4, 3, 5])
    share = cell_hull_share(inside)
    assert corner_share(inside) <= share + ROUNDING
    assert share <= workspace_volume(inside, grid.axes, "hull").share + ROUNDING
    sixths = 6.0 * share * 24
    assert sixths == pytest.approx(round(sixths), abs=1e-9)
