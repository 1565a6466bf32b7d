"""Hulls of sets whose volume is known, and what is refused."""

import sys

import numpy as np
import pytest

from cdpr_drake.errors import WorkspaceError
from cdpr_drake.workspaces.hull import workspace_hull
from cdpr_drake.workspaces.mesh_files import write_hull

TOLERANCE = 1e-4

SHARE = 0.005
"""Of the volume, that a polyhedron of some thousand triangles may lack."""

CENTER = np.array([0.1, 0.2, -0.1])
BOX = np.full(3, -2.0), np.full(3, 2.0)


def ball(points):
    return np.linalg.norm(points - [0.2, 0.1, 0.0], axis=1) <= 1.0


def cube(points):
    return np.all(np.abs(points) <= 0.8, axis=1)


@pytest.mark.parametrize(
    ("holds", "volume", "area", "centroid"),
    [
        (ball, 4 / 3 * np.pi, 4 * np.pi, [0.2, 0.1, 0.0]),
        (cube, 1.6**3, 6 * 1.6**2, [0.0, 0.0, 0.0]),
    ],
)
def test_volume_area_and_centroid(holds, volume, area, centroid):
    hull = workspace_hull(holds, CENTER, *BOX, rays=4000, tolerance=TOLERANCE)
    assert hull.volume == pytest.approx(volume, rel=SHARE)
    assert hull.area == pytest.approx(area, rel=2 * SHARE)
    np.testing.assert_allclose(hull.centroid, centroid, atol=0.01)
    assert len(hull.vertices) <= 4000
    assert not np.any(hull.cut)


def test_ends_are_as_near_to_the_border_as_named():
    hull = workspace_hull(ball, CENTER, *BOX, rays=500, tolerance=TOLERANCE)
    off = np.linalg.norm(hull.vertices - [0.2, 0.1, 0.0], axis=1) - 1.0
    assert np.max(np.abs(off)) <= TOLERANCE


def test_the_surface_is_closed_and_faces_out():
    hull = workspace_hull(cube, CENTER, *BOX, rays=1500, tolerance=TOLERANCE)
    edges = np.concatenate([hull.faces[:, [0, 1]], hull.faces[:, [1, 2]], hull.faces[:, [2, 0]]])
    one_way = {tuple(edge) for edge in edges.tolist()}
    assert len(one_way) == len(edges)
    assert {(b, a) for a, b in one_way} == one_way
    assert len(hull.vertices) - len(edges) // 2 + len(hull.faces) == 2  # Euler, of a sphere
    assert np.all(hull._volumes() > 0.0)


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


def test_a_centre_outside_is_told_where_one_is():
    with pytest.raises(WorkspaceError, match=r"outside the workspace.*such as") as refused:
        workspace_hull(ball, np.array([1.9, 1.9, 1.9]), *BOX)
    place = str(refused.value).rsplit("(", 1)[1].rstrip(")").split(",")
    assert ball(np.array([[float(x) for x in place]]))[0]
    with pytest.raises(WorkspaceError, match="none was found"):
        workspace_hull(lambda p: np.zeros(len(p), bool), CENTER, *BOX)
    with pytest.raises(WorkspaceError, match="within"):
        workspace_hull(ball, np.full(3, 3.0), *BOX)
    with pytest.raises(WorkspaceError, match="rays"):
        workspace_hull(ball, CENTER, *BOX, rays=3)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "glb"])
def test_files_have_the_triangles(tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    hull = workspace_hull(ball, CENTER, *BOX, rays=300, tolerance=TOLERANCE)
    path = write_hull(hull, tmp_path / f"hull.{ending}")
    mesh = trimesh.load(path, force="mesh")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(hull.volume, rel=1e-5)
    assert mesh.area == pytest.approx(hull.area, rel=1e-5)


def test_files_that_cannot_be_written(tmp_path, monkeypatch):
    hull = workspace_hull(ball, CENTER, *BOX, rays=50, tolerance=TOLERANCE)
    with pytest.raises(WorkspaceError, match="ending 'docx'"):
        write_hull(hull, tmp_path / "hull.docx")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(WorkspaceError, match="needs trimesh"):
        write_hull(hull, tmp_path / "hull.stl")
    assert not any(tmp_path.iterdir())
