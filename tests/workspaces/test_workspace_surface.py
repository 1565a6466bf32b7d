"""The surface of a set of cells encloses the volume that is counted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdpr_drake.workspaces.pose_grid import grid_by_count
from cdpr_drake.workspaces.volume import surface_quads, triangles, workspace_volume

ROUNDING = 1e-12


def enclosed(vertices, faces):
    """Volume by the divergence theorem; positive if the faces turn outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


@given(arrays(bool, st.tuples(*[st.integers(2, 5)] * 3)))
def test_encloses_the_volume_of_its_cells(inside):
    grid = grid_by_count([-1, 0, 1], [1, 3, 2], inside.shape)
    quads = surface_quads(inside, grid.axes)
    volume = workspace_volume(inside, grid.axes, "corners").value
    assert enclosed(*triangles(quads)) == pytest.approx(volume, abs=ROUNDING)


def test_a_box_has_its_faces_and_no_more():
    grid = grid_by_count([0, 0, 0], [2, 3, 4], [3, 4, 5])
    quads = surface_quads(np.ones((3, 4, 5), bool), grid.axes)
    assert len(quads) == 2 * (2 * 3 + 3 * 4 + 2 * 4)
    sides = np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 1])
    assert np.sum(np.linalg.norm(sides, axis=1)) == pytest.approx(2 * (6 + 12 + 8))


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_a_plane_has_the_squares_with_four_corners(flat):
    counts = [4, 5, 6]
    counts[flat] = 1
    grid = grid_by_count([0, 0, 0], [3, 4, 5], counts)
    inside = np.random.default_rng(0).random(counts) < 0.8
    quads = surface_quads(inside, grid.axes)
    sides = np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 1])
    area = workspace_volume(inside, grid.axes, "corners").value
    assert np.sum(sides[:, flat]) == pytest.approx(area)
    assert area > 0.0


def test_nothing_has_no_surface():
    grid = grid_by_count([0, 0, 0], [1, 1, 1], [3, 3, 3])
    quads = surface_quads(np.zeros((3, 3, 3), bool), grid.axes)
    assert quads.shape == (0, 4, 3)
    assert triangles(quads)[1].shape == (0, 3)
