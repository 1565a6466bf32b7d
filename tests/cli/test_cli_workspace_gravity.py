"""`cdpr workspace` where gravity is not along -z: nothing is turned, all coordinates are of W."""

import json

import numpy as np
import pytest
import yaml
from scipy.optimize import linprog

from cdpr_drake.analyses.workspaces.workspace_result import load_workspace
from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page
from cdpr_drake.models.robot_loader import load_robot
from tests.cli.commands import answer, ended, run, told
from tests.cli.conftest import only
from tests.models.formats import foreign_files
from tests.motion.small_robots import content, small_robot

DOWN = np.array([0.5, 0.0, -1.0]) / np.sqrt(1.25)


@pytest.fixture(scope="module")
def tilted(tmp_path_factory):
    """A body in the plane xz, gravity 26.6 deg off -z in it; the file, and what is found."""
    folder = tmp_path_factory.mktemp("tilted")
    path = folder / "robot.yaml"
    body = content("upright_body", gravity_direction=[0.5, 0.0, -1.0])
    body["platform"] = body["platform"] | {"center_of_mass": [0.05, 0.0, 0.04]}
    body["tension_bounds"] = {"lower": 0.0, "upper": 40.0}
    path.write_text(yaml.safe_dump(body), encoding="utf-8")
    arguments = (
        "workspace", path, "--grid", "7,1,7", "--measure", "payload", "--workers", "1",
        "--certify", "--boxes", "1500", "--out", folder / "found",
    )  # fmt: skip
    with only("workspace.html"):
        assert ended(*arguments) == 0
    return path, arguments, folder / "found"


def held(robot, position, gravity):
    """Whether tensions hold the level platform there: a linear programme, by hand."""
    A, B = robot.exit_points() - np.array(position)[:, np.newaxis], robot.anchor_points()
    u = (A - B) / np.linalg.norm(A - B, axis=0)
    force = robot.platform.mass * gravity
    W = np.array([np.cross(B.T, u.T)[:, 1], u[0], u[2]])
    moment = np.cross(robot.center_of_mass(), force)[1]
    found = linprog(
        np.zeros(4), A_eq=W, b_eq=-np.array([moment, force[0], force[2]]), bounds=[(0.0, 40.0)] * 4
    )
    return found.status == 0


def test_verdicts_are_those_of_the_tilted_weight(tilted):
    path, _, folder = tilted
    robot, found = load_robot(str(path)), load_workspace(folder)
    places = found.places("static")
    verdicts, upright = (
        np.array([
            [held(robot, (x, robot.home.position[1], z), g) for z in found.grid.axes[2]]
            for x in found.grid.axes[0]
        ])
        for g in (9.81 * DOWN, np.array([0.0, 0.0, -9.81]))
    )  # fmt: skip
    np.testing.assert_array_equal(places[:, 0], verdicts)
    assert 5 < np.count_nonzero(places) < 44
    assert np.any(upright != verdicts)
    assert np.count_nonzero(np.isfinite(found.values["payload"])) == np.count_nonzero(places)


def test_boxes_agree_with_the_grid(tilted):
    told = json.loads((tilted[2] / "results.json").read_text())
    agreement = told["agreement"]["grid"]
    assert agreement["contradictions"] == 0
    assert agreement["in_boxes_proven_inside"] > 3
    assert agreement["in_boxes_proven_outside"] > 3


def test_it_is_said_of_which_world_coordinates_are(tilted, capsys):
    _, arguments, folder = tilted
    words = (
        "those of W, which was not turned; the weight pulls along (0.447214, 0, -0.894427), "
        "26.57 deg off -z"
    )
    found = json.loads((folder / "results.json").read_text())
    assert found["axes"] == words
    assert found["statics"]["down"] == pytest.approx(DOWN)
    assert words in (folder / "workspace.html").read_text(encoding="utf-8")
    with only("workspace.html"):
        assert words in " ".join(answer(capsys, *arguments).split())


@pytest.mark.usefixtures("without_pictures")
def test_a_robot_of_grab_whose_frame_leans_by_a_degree(here, capsys):
    path = foreign_files.grab_on_board(here)
    text = path.read_text()
    assert '"gravity_axis": [[0], [0], [1]]' in text
    leaning = foreign_files.column([np.sin(np.radians(1.0)), 0.0, np.cos(np.radians(1.0))])
    assert f'"radius": {foreign_files.RADIUS}' in text
    points = text.replace(f'"radius": {foreign_files.RADIUS}', '"radius": 0')
    path.write_text(points.replace("[[0], [0], [1]]", leaning))
    found = told(capsys, "workspace", path, "--grid", "3,3,3", "--workers", "1")
    assert found["workspaces"]["static"]["pose_share"] > 0.0
    assert found["axes"].endswith("1 deg off -z")


@pytest.mark.usefixtures("without_pictures")
def test_a_level_plane_carries_what_of_the_weight_is_across_it(here, capsys):
    """In a level plane nothing but the part of the weight along it can be lifted."""
    body = content("level_point", gravity_direction=[0.1, 0.0, -1.0])
    (here / "robot.yaml").write_text(yaml.safe_dump(body))
    asked = ("workspace", "robot.yaml", "--grid", "5,5,1", "--measure", "payload")
    assert ended(*asked, "--workers", "1") == 0
    body["gravity_direction"] = [0.0, 0.0, -1.0]
    (here / "robot.yaml").write_text(yaml.safe_dump(body))
    code, _, err = run(capsys, *asked)
    assert (code, "whose plane carries the weight" in err) == (2, True)


def test_of_an_upright_robot_axes_are_not_mentioned(tilted):
    """The title of the page is for what is out of the ordinary."""
    found = load_workspace(tilted[2])
    found.arguments["statics"]["down"] = [0.0, 0.0, -1.0]
    assert "axes" not in repr(found)
    assert found.as_dict()["axes"] == "those of W; the weight pulls along -z"
    pages, _ = workspace_page(found, small_robot("upright_body"))
    pages["workspace.html"](tilted[2] / "upright.html")
    assert "axes: " not in (tilted[2] / "upright.html").read_text(encoding="utf-8")
