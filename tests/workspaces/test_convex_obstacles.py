"""Clearances from spheres, capsules and meshes, and files of them."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.analyses.workspaces.workspace_question import interference_bodies
from cdpr_drake.errors import DataFileError
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.workspaces.cable_interference import Obstacles, box_row, clearances
from tests.workspaces.workspace_cases import random_poses, robot_case

DIGITS = 1e-12
"""Of distances of some metres: a thousand times their rounding [m]."""

FILE = """\
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


def write(folder, words, mesh=WEDGE):
    (folder / "wedge.obj").write_text(mesh)
    path = folder / "obstacles.yaml"
    path.write_text(words)
    return path


@pytest.mark.parametrize("pulleys", [False, True])
def test_boxes_as_convex_shapes_have_the_clearances_of_boxes(pulleys):
    robot, _ = robot_case("acrobot_large")
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    rows = np.array(
        [box_row([0.2, 0.1, 0.4], [0.3, 0.2, 0.2], turn), box_row([0, 0, 0], [1, 1, 0.1])]
    )
    boxes = interference_bodies(robot, rows, pulleys=pulleys)
    solids = tuple(ConvexShape.box(row) for row in rows)
    shapes = interference_bodies(robot, Obstacles(solids=solids), pulleys=pulleys)
    poses = random_poses(robot, 2000)
    one, other = clearances(boxes, *poses), clearances(shapes, *poses)
    assert other[:, :3] == pytest.approx(one[:, :3], abs=0.0, nan_ok=True)
    radius = boxes.radius[0]
    assert np.maximum(other[:, 3], -radius) == pytest.approx(one[:, 3], abs=DIGITS, nan_ok=True)
    assert np.maximum(other[:, 4], 0.0) == pytest.approx(one[:, 4], abs=DIGITS, nan_ok=True)
    assert np.any(other[:, 3] < -radius)  # signed: deeper than the cable is thick
    assert np.any(other[:, 4] < 0.0)


def test_files_of_obstacles_have_all_shapes(tmp_path):
    found = load_obstacles(write(tmp_path, FILE))
    assert found.boxes.shape == (1, 15)
    ball, capsule, mesh = found.solids
    assert (ball.points.tolist(), ball.radius) == ([[0.0, 0.0, 0.5]], 0.1)
    assert (capsule.points[:, 2].tolist(), capsule.radius) == ([0.0, 0.4], 0.05)
    assert mesh.points == pytest.approx(
        np.array([[-0.3, 0, 0], [-0.3, 0.1, 0], [-0.4, 0, 0], [-0.3, 0, 0.1]])
    )
    assert len(found.shapes()) == 4


@pytest.mark.parametrize(
    ("words", "mesh", "said"),
    [
        ("boxes: []\n", WEDGE, "found no obstacle; accepted: some of boxes, spheres, capsules"),
        (FILE, "v 0 0 0\nv 1 0 0\nv 0 1 0\n", r"meshes\[0\].file: wedge.obj: found 3 vertices in"),
        (FILE.replace("wedge.obj", "none.obj"), WEDGE, r"none.obj: there is no such mesh"),
        (FILE.replace("radius: 0.1", "radius: -0.1"), WEDGE, r"spheres\[0\].radius.*-0.1"),
    ],
)
def test_files_of_obstacles_that_are_wrong(tmp_path, words, mesh, said):
    with pytest.raises(DataFileError, match=said):
        load_obstacles(write(tmp_path, words, mesh))


def test_questions_without_convex_shapes_say_nothing_of_them():
    robot, _ = robot_case("acrobot_large")
    around = interference_bodies(robot)
    assert "solids" not in plain(around)
    some = replace(around, solids=(ConvexShape.sphere(np.zeros(3), 0.1, "ball"),))
    assert plain(some)["solids"][0]["radius"] == 0.1
