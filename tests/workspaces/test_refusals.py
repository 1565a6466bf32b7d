"""Input of workspaces that makes no sense is refused in one line that names it."""

import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.errors import (
    DataFileError,
    TensionProblemError,
    WorkspaceError,
    WorkspaceGridError,
    WrenchSetError,
)
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.proofs.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.proofs.box_refinement import PathTube, refine
from cdpr_drake.proofs.certified_boxes import PoseBox, certify
from cdpr_drake.proofs.cuboid_cover import cover_cells
from cdpr_drake.proofs.proven_sets import PoseSets
from cdpr_drake.workspaces.available_wrenches import available_wrenches
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row
from cdpr_drake.workspaces.demanded_wrenches import MotionDemand, SpatialSet
from cdpr_drake.workspaces.hull import workspace_hull
from cdpr_drake.workspaces.mesh_files import write_hull
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, grid_by_count, grid_by_step
from cdpr_drake.workspaces.single_failure import cases_after_breaks, without_cable
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.volume import workspace_volume
from tests.workspaces.test_grids import BOX, CENTER, ball
from tests.workspaces.test_proven_sets import made_sets
from tests.workspaces.workspace_cases import frame_box, random_poses, robot_case

NAN, INFINITY, ONE = np.nan, np.inf, np.zeros((1, 3))
ROBOT, CASE = robot_case("acrobot_large")
PLANE = frame_box(robot_case("planar")[0])


def task(kind=CertifiedKind.STATIC, case=None, **more):
    return CertifyTask(kind, case or robot_case("planar")[1], **more)


@cache
def boxes():
    return certify(task(), PLANE, 50)


def by_step(lower=(0, 0, 0), upper=(1, 1, 1), step=(0.1, 0.1, 0.1)):
    return grid_by_step(lower, upper, step)


def two_cables():
    cables = CableSet.make(np.zeros((3, 2)), np.zeros((3, 2)), 1.0)
    rows = tuple(range(6))
    wrench = np.zeros(6)
    return StaticCase(cables, np.zeros(2), np.ones(2), 1.0, np.zeros(3), wrench=wrench, rows=rows)


def feasible(**changes):
    return statically_feasible(replace(CASE, **changes), *random_poses(ROBOT, 2))


def hull(holds=ball, center=CENTER, **more):
    return workspace_hull(holds, np.asarray(center, float), *BOX, **more)


ALL, NONE = np.ones((3, 3), bool), np.zeros((0, 2))


def no_point(p):
    return np.zeros(len(p), bool)


def cover(good=ALL, share=0.9, must=NONE):
    return cover_cells(good, share, must)


def six_cables():
    return robot_case("nist_robocrane")[1]


SINGULAR = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
SPARE = r"6 cables for 6 degrees.*more than 6"

REFUSALS = {
    WrenchSetError: {
        "no vertices": (lambda: SpatialSet(vertices=np.zeros((0, 6))), "vertices.*at least one"),
        "vertices": (lambda: SpatialSet(vertices=np.full((1, 6), INFINITY)), "vert.*without bound"),
        "box": (lambda: SpatialSet(box=np.full(6, -1.0)), "box.*-1"),
        "ellipsoid": (lambda: SpatialSet(ellipsoid=np.full(6, INFINITY)), "ellipsoid.*finite"),
        "no corners": (lambda: SpatialSet(ellipsoid=np.ones(6)).corners((3, 4)), "ellipsoid.*vert"),
        "no velocities": (
            lambda: MotionDemand(1.0, np.zeros(3), np.eye(3), SpatialSet(), np.zeros((0, 6))),
            "velocities",
        ),
        "flat set": (lambda: available_wrenches(SINGULAR, np.zeros(3), np.ones(3)), "flat"),
        "point set": (lambda: available_wrenches(np.eye(2), np.ones(2), np.ones(2)), "flat"),
    },
    TensionProblemError: {
        "crossed": (lambda: available_wrenches(np.eye(2), np.ones(2), np.zeros(2)), "above upper"),
        "two cables": (two_cables, "found 2 for 6 degrees"),
        "weight": (lambda: replace(CASE, weight=-1.0), "weight"),
        "lower": (lambda: feasible(lower=np.full(8, -1.0)), "lower"),
    },
    WorkspaceGridError: {
        "step": (lambda: by_step(step=(0.1, 0.0, 0.1)), "y.*step > 0"),
        "order": (lambda: by_step(lower=(0, 0, 2)), "z.*2 to 1"),
        "bound": (lambda: by_step(lower=(INFINITY, 0, 0)), "x.*inf"),
        "count": (lambda: grid_by_count([0, 0, 0], [1, 1, 1], [0, 1, 1]), "x.*0 points"),
        "no points": (lambda: WorkspaceGrid(([], [0.0], [0.0]), ONE), "x.*no points"),
        "NaN": (lambda: WorkspaceGrid(([0, NAN], [0], [0]), ONE), "x.*NaN"),
        "down": (lambda: WorkspaceGrid(([1, 0], [0], [0]), ONE), "x.*ascending"),
        "no turns": (lambda: WorkspaceGrid(([0], [0], [0]), np.zeros((0, 3))), "0 orientations"),
        "size": (
            lambda: workspace_volume(np.ones((2, 3)), [[0, 1], [0, 1, 2], [0, 1, 2, 3]], "points"),
            r"\(2, 3\) on axes of \(2, 3, 4\)",
        ),
    },
    WorkspaceError: {
        "point": (lambda: PoseBox(np.zeros(6), np.zeros(6)), "varies"),
        "fixed": (lambda: task(case=replace(CASE, lower=CASE.upper)), "cannot change"),
        "nothing around": (lambda: task(CertifiedKind.INTERFERENCE_FREE), "around: found nothing"),
        "no bodies": (lambda: task(CertifiedKind.COLLISION_FREE), "around: found nothing"),
        "exit error": (lambda: task(exit_error=-1.0), "exit_error"),
        "no boxes": (lambda: certify(task(), PLANE, 0), "most_boxes"),
        "no kinds": (lambda: certify([], PLANE), "certify: found 0 kinds; accepted: 1 to 7"),
        "no refining": (lambda: refine(boxes(), task(), PLANE, 0), "most_boxes: found 0"),
        "other kinds": (lambda: refine(boxes(), [task(), task()], PLANE, 10),
         "task: found 2 kinds; accepted: those that"),
        "reach": (lambda: PathTube(np.zeros((2, 6)), np.full(6, -1.0)),
         "reach: accepted: six numbers"),
        "exit free": (lambda: Surroundings(CASE.cables, np.full(8, 0.001), exit_free=-1.0),
         "exit_free"),
        "box of less": (lambda: box_row(np.zeros(3), [1.0, -1.0, 1.0]), "box"),
        "no spare": (lambda: cases_after_breaks(six_cables()), SPARE),
        "no break": (lambda: task(CertifiedKind.SINGLE_FAILURE, six_cables()), SPARE),
        "cable": (lambda: without_cable(six_cables(), 6), "cable: found 6; accepted: 0 to 5"),
        "center": (lambda: hull(center=[1.9, 1.9, 1.9]), "outside the workspace.*such as"),
        "empty": (lambda: hull(no_point), "none was found"),
        "far center": (lambda: hull(center=[3.0, 3.0, 3.0]), "within"),
        "rays": (lambda: hull(rays=3), "rays"),
        "no cell": (lambda: cover(np.zeros((3, 3), bool)), "no cell that is proven"),
        "no share": (lambda: cover(share=0.0), "cover: found 0"),
        "large share": (lambda: cover(share=1.5), "cover: found 1.5"),
        "must": (lambda: cover(np.eye(3, dtype=bool), must=np.array([[0, 1]])), "must: found a c"),
    },
}  # fmt: skip

ROWS = {f"{E.__name__}-{k}": (E, *row) for E, rows in REFUSALS.items() for k, row in rows.items()}


@pytest.mark.parametrize(("error", "call", "words"), ROWS.values(), ids=ROWS.keys())
def test_refusal(error, call, words):
    with pytest.raises(error, match=words) as caught:
        call()
    assert len(str(caught.value).splitlines()) == 1


def test_a_centre_outside_is_told_where_one_is():
    with pytest.raises(WorkspaceError, match=r"such as") as refused:
        hull(center=[1.9, 1.9, 1.9])
    place = str(refused.value).rsplit("(", 1)[1].rstrip(")").split(",")
    assert ball(np.array([[float(x) for x in place]]))[0]


# Files.

OBSTACLES = """\
boxes:
  - {pose: {position: [0.1, 0.2, 0.3]}, size: [0.1, 0.2, 0.3]}
spheres:
  - {position: [0, 0, 0.5], radius: 0.1}
capsules:
  - {start: [0.3, 0, 0], end: [0.3, 0, 0.4], radius: 0.05}
meshes:
  - {file: wedge.obj, pose: {position: [-0.3, 0, 0], angles_deg: [0, 0, 90]}, scale: 0.1}
"""
WEDGE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 0.1\n"


def load(folder, words=OBSTACLES, mesh=WEDGE):
    (folder / "wedge.obj").write_text(mesh)
    (folder / "obstacles.yaml").write_text(words)
    return load_obstacles(folder / "obstacles.yaml")


def test_files_of_obstacles_have_all_shapes(tmp_path):
    obstacles = load(tmp_path)
    assert obstacles.boxes.shape == (1, 15)
    ball, capsule, mesh = obstacles.solids
    assert (ball.points.tolist(), ball.radius) == ([[0.0, 0.0, 0.5]], 0.1)
    assert (capsule.points[:, 2].tolist(), capsule.radius) == ([0.0, 0.4], 0.05)
    corners = [[-0.3, 0, 0], [-0.3, 0.1, 0], [-0.4, 0, 0], [-0.3, 0, 0.1]]
    assert mesh.points == pytest.approx(np.array(corners))
    assert len(obstacles.shapes()) == 4


@pytest.mark.parametrize(
    ("old", "new", "mesh", "words"),
    [
        (OBSTACLES, "boxes: []\n", WEDGE, "found no obstacle; accepted: some of boxes, spheres, c"),
        ("", "", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", r"meshes\[0\].file: wedge.obj: found 3 vertices"),
        ("wedge.obj", "none.obj", WEDGE, r"none.obj: there is no such mesh"),
        ("radius: 0.1", "radius: -0.1", WEDGE, r"spheres\[0\].radius.*-0.1"),
    ],
)
def test_files_of_obstacles_that_are_wrong(tmp_path, old, new, mesh, words):
    with pytest.raises(DataFileError, match=words):
        load(tmp_path, OBSTACLES.replace(old, new) if old else OBSTACLES, mesh)


@pytest.mark.parametrize(
    ("old", "new"),
    [("about:", "abut:"), ("- x", "- q"), ("z: 0.5", "y: 0.5"), ("regions:", "region:")],
)
def test_a_damaged_file_of_sets_is_refused_by_name(tmp_path, old, new):
    file = made_sets().save(tmp_path / "sets.yaml")
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(DataFileError, match=r"sets\.yaml: found"):
        PoseSets.load(file)
    with pytest.raises(DataFileError, match="no such file"):
        PoseSets.load(tmp_path / "none.yaml")


def test_hulls_that_cannot_be_written(tmp_path, monkeypatch):
    small = hull(rays=50)
    with pytest.raises(WorkspaceError, match="ending 'docx'"):
        write_hull(small, tmp_path / "hull.docx")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(WorkspaceError, match="needs trimesh"):
        write_hull(small, tmp_path / "hull.stl")
    assert not any(tmp_path.iterdir())
