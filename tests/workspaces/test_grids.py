"""Grids of poses, volumes and surfaces of sets of their points, hulls: by hand and by counts."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdpr_drake.geometry.poses import pose_row, rotation_from_angles
from cdpr_drake.workspaces.hull import workspace_hull
from cdpr_drake.workspaces.mesh_files import write_hull
from cdpr_drake.workspaces.pose_grid import (
    axis_by_count,
    axis_by_step,
    grid_by_count,
    grid_by_step,
)
from cdpr_drake.workspaces.volume import (
    VolumeRule,
    cell_hull_share,
    cells_inside,
    corner_share,
    surface_quads,
    triangles,
    workspace_volume,
)

ROUNDING = 1e-12
DISCRETE = 0.03  # relative error of a ball's volume where step over radius is 1/30
ACROBOT = grid_by_step([-0.48, -0.48, 0.0], [0.48, 0.48, 1.1], [0.03, 0.03, 0.1])
masks = arrays(bool, st.tuples(*[st.integers(2, 5)] * 3))


def unit_grid(*counts):
    return grid_by_count([0, 0, 0], [1, 1, 1], counts)


def by_rules(inside, grid):
    return {rule: workspace_volume(inside, grid.axes, rule) for rule in VolumeRule}


# Points.


def test_grids_of_the_thesis_have_its_points():
    assert ACROBOT.shape == (1, 33, 33, 12)
    np.testing.assert_allclose(ACROBOT.upper, [0.48, 0.48, 1.1], atol=ROUNDING)
    np.testing.assert_allclose(ACROBOT.steps, [0.03, 0.03, 0.1], atol=ROUNDING)
    caroca = grid_by_step([-1.92, -3.36, 0.0], [1.92, 3.36, 3.0], [0.12, 0.21, 0.3])
    assert caroca.shape == (1, 33, 33, 11)


@given(st.floats(-5, 5), st.floats(0, 10), st.floats(0.05, 3.0))
@settings(max_examples=50)
def test_an_axis_by_step_stays_in_its_box_and_fills_it(lower, length, step):
    axis = axis_by_step(lower, lower + length, step)
    assert axis[0] == lower
    assert axis[-1] <= lower + length + 1e-5 * step
    assert axis[-1] + step > lower + length
    np.testing.assert_allclose(np.diff(axis), step, rtol=1e-9)


def test_an_axis_by_count_is_even_and_one_point_lies_in_the_middle():
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
    numbers = grid.poses(), grid.positions(), grid.rotations(), grid.pose_rows()
    for X_WP, p, R, row in zip(*numbers, strict=True):
        np.testing.assert_array_equal(X_WP.translation(), p)
        np.testing.assert_array_equal(X_WP.rotation().matrix(), R)
        np.testing.assert_allclose(pose_row(X_WP), row, atol=ROUNDING)
    for start, stop in ((0, 0), (0, 48), (5, 29), (23, 25), (24, 60), (50, 60), (9, 3)):
        np.testing.assert_array_equal(grid.positions(start, stop), grid.positions()[start:stop])
        np.testing.assert_array_equal(grid.rotations(start, stop), grid.rotations()[start:stop])


# Volumes.


@pytest.mark.parametrize("rule", VolumeRule)
def test_the_whole_grid_has_the_volume_of_its_box_by_every_rule(rule):
    volume = workspace_volume(np.ones(ACROBOT.shape[1:], bool), ACROBOT.axes, rule)
    assert volume.value == pytest.approx(0.96 * 0.96 * 1.1, rel=ROUNDING)  # 1.014 m^3
    assert volume.share == pytest.approx(1.0, rel=ROUNDING)
    assert volume.unit == "m^3"
    assert workspace_volume(np.zeros(ACROBOT.shape[1:], bool), ACROBOT.axes, rule).value == 0.0


def test_a_ball_has_its_volume_and_a_hollow_one_keeps_its_hull_only():
    grid = grid_by_count([-1, -1, -1], [1, 1, 1], [81, 81, 81])
    radius = np.linalg.norm(grid.positions().reshape(*grid.shape[1:], 3), axis=-1)
    ball = by_rules(radius <= 0.75, grid)
    shell = by_rules((radius <= 0.75) & (radius > 0.42), grid)
    for rule in (VolumeRule.POINTS, VolumeRule.HULL):
        assert ball[rule].value == pytest.approx(4 / 3 * np.pi * 0.75**3, rel=DISCRETE)
    assert shell[VolumeRule.HULL].value == pytest.approx(ball[VolumeRule.HULL].value, rel=ROUNDING)
    assert shell[VolumeRule.POINTS].value < 0.85 * ball[VolumeRule.POINTS].value


def test_planar_grids_have_areas():
    grid = grid_by_step([-0.48, -0.48, 0.3], [0.48, 0.48, 0.3], [0.03, 0.03, 0.1])
    inside = (grid.positions()[:, 0] >= -1e-9).reshape(grid.shape[1:])
    areas = by_rules(inside, grid)
    for area in areas.values():
        assert area.unit == "m^2"
        assert area.full == pytest.approx(0.9216, rel=ROUNDING)  # 0.92 m^2
    assert areas[VolumeRule.CORNERS].share == pytest.approx(0.5)
    assert areas[VolumeRule.HULL].share == pytest.approx(0.5)
    # The column on the border counts with half a cell on the other side.
    assert areas[VolumeRule.POINTS].share == pytest.approx(16.5 / 32.0)


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


@pytest.mark.parametrize("points", [np.s_[:, 1, :], np.s_[::3, 0, 0]], ids=["plane", "two"])
def test_flat_sets_have_no_hull(points):
    inside = np.zeros((4, 4, 4), bool)
    inside[points] = True
    assert workspace_volume(inside, unit_grid(4, 4, 4).axes, "hull").value == 0.0


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


def enclosed(vertices, faces):
    """Volume by the divergence theorem; positive if the faces turn outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


@given(masks)
@settings(max_examples=60)
def test_rules_of_any_set_are_ordered_and_its_surface_encloses_its_cells(inside):
    cells = cells_inside(inside)
    for i, j, k in itertools.product(*(range(n) for n in cells.shape)):
        assert cells[i, j, k] == np.all(inside[i : i + 2, j : j + 2, k : k + 2])
    grid = grid_by_count([-1, 0, 1], [0, 2, 4], inside.shape)
    corners, points, hull = (
        workspace_volume(inside, grid.axes, rule) for rule in ("corners", "points", "hull")
    )
    assert corner_share(inside) == np.sum(cells) / cells.size
    assert corners.share == pytest.approx(corner_share(inside), rel=ROUNDING)
    assert corners.value <= points.value + ROUNDING
    share = cell_hull_share(inside)
    assert corners.share <= share + ROUNDING
    assert share <= hull.share + ROUNDING
    sixths = 6.0 * share * cells.size
    assert sixths == pytest.approx(round(sixths), abs=1e-9)
    surface = triangles(surface_quads(inside, grid.axes))
    assert enclosed(*surface) == pytest.approx(corners.value, abs=ROUNDING)


# Surfaces.


def sides(quads):
    return np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 1])


def test_a_box_has_its_faces_and_no_more():
    grid = grid_by_count([0, 0, 0], [2, 3, 4], [3, 4, 5])
    quads = surface_quads(np.ones((3, 4, 5), bool), grid.axes)
    assert len(quads) == 2 * (2 * 3 + 3 * 4 + 2 * 4)
    assert np.sum(np.linalg.norm(sides(quads), axis=1)) == pytest.approx(2 * (6 + 12 + 8))


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_a_plane_has_the_squares_with_four_corners(flat):
    counts = [4, 5, 6]
    counts[flat] = 1
    grid = grid_by_count([0, 0, 0], [3, 4, 5], counts)
    inside = np.random.default_rng(0).random(counts) < 0.8
    area = workspace_volume(inside, grid.axes, "corners").value
    assert np.sum(sides(surface_quads(inside, grid.axes))[:, flat]) == pytest.approx(area)
    assert area > 0.0


def test_nothing_has_no_surface():
    quads = surface_quads(np.zeros((3, 3, 3), bool), unit_grid(3, 3, 3).axes)
    assert quads.shape == (0, 4, 3)
    assert triangles(quads)[1].shape == (0, 3)


# Hulls of sets whose volume is known, and the files they are written to.

TOLERANCE = 1e-4
SHARE = 0.005  # of the volume, that a polyhedron of some thousand triangles may lack
CENTER = np.array([0.1, 0.2, -0.1])
BALL = np.array([0.2, 0.1, 0.0])
BOX = np.full(3, -2.0), np.full(3, 2.0)


def ball(points):
    return np.linalg.norm(points - BALL, axis=1) <= 1.0


def cube(points):
    return np.all(np.abs(points) <= 0.8, axis=1)


@pytest.mark.parametrize(
    ("holds", "volume", "area", "centroid"),
    [
        (ball, 4 / 3 * np.pi, 4 * np.pi, BALL),
        (cube, 1.6**3, 6 * 1.6**2, [0.0, 0.0, 0.0]),
    ],
)
def test_hulls_have_volume_area_and_centroid_and_a_closed_surface(holds, volume, area, centroid):
    hull = workspace_hull(holds, CENTER, *BOX, rays=4000, tolerance=TOLERANCE)
    assert hull.volume == pytest.approx(volume, rel=SHARE)
    assert hull.area == pytest.approx(area, rel=2 * SHARE)
    np.testing.assert_allclose(hull.centroid, centroid, atol=0.01)
    assert len(hull.vertices) <= 4000
    assert not np.any(hull.cut)
    if holds is ball:
        off = np.linalg.norm(hull.vertices - BALL, axis=1) - 1.0
        assert np.max(np.abs(off)) <= TOLERANCE
    edges = np.concatenate([hull.faces[:, [0, 1]], hull.faces[:, [1, 2]], hull.faces[:, [2, 0]]])
    one_way = {tuple(edge) for edge in edges.tolist()}
    assert len(one_way) == len(edges)
    assert {(b, a) for a, b in one_way} == one_way
    assert len(hull.vertices) - len(edges) // 2 + len(hull.faces) == 2  # Euler, of a sphere
    assert np.all(hull._volumes() > 0.0)  # faces turn outwards


def test_rays_gather_where_the_surface_bends():
    hull = workspace_hull(cube, np.zeros(3), *BOX, rays=3000, tolerance=TOLERANCE)
    edge = np.sort(np.abs(hull.vertices), axis=1)[:, 1] > 0.7  # two coordinates near 0.8
    assert np.mean(edge) > 0.5


def test_rays_that_meet_nothing_end_at_the_box():
    hull = workspace_hull(
        lambda p: np.ones(len(p), bool), CENTER, *BOX, rays=3000, tolerance=TOLERANCE
    )
    assert np.all(hull.cut)
    assert hull.volume == pytest.approx(64.0, rel=SHARE)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "glb"])
def test_files_have_the_triangles(tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    hull = workspace_hull(ball, CENTER, *BOX, rays=300, tolerance=TOLERANCE)
    mesh = trimesh.load(write_hull(hull, tmp_path / f"hull.{ending}"), force="mesh")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(hull.volume, rel=1e-5)
    assert mesh.area == pytest.approx(hull.area, rel=1e-5)
