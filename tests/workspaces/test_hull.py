"""Hulls of sets whose volume is known, and the files they are written to."""

import numpy as np
import pytest

from cdpr_drake.workspaces.hull import workspace_hull
from cdpr_drake.workspaces.mesh_files import write_hull

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
