"""What pictures of a workspace show: cables as they are held, cells within the grid."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from cdpr_drake.analyses.visualization.replay import robot_picture
from cdpr_drake.analyses.workspaces.workspace_figures import OUTSIDE, planes_figure
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceRequest,
    make_workspace_question,
)
from cdpr_drake.analyses.workspaces.workspace_results import robot_workspace
from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.figure_faults import figure_faults


def small_workspace(robot, counts=(3, 2, 2), **asked):
    grid = grid_by_count([-0.3, -0.2, 0.2], [0.3, 0.2, 0.4], counts)
    question = make_workspace_question(
        robot, ["static"], grid, ["capacity-margin"], asked=WorkspaceRequest(**asked)
    )
    return robot_workspace(question).workspace


def notes_of(pictures, folder):
    (write,) = pictures.values()
    page = folder / "page.html"
    write(page)
    (words,) = re.findall(r'id="cdpr-data">(.*?)</script>', page.read_text(), re.DOTALL)
    return json.loads(words)


def test_a_held_robot_is_drawn_with_its_tensions(tmp_path):
    """All cables were red and the legend had nothing but slack."""
    robot = load_robot("acrobot_large")
    pictures, note = workspace_page(small_workspace("acrobot_large"), robot)
    notes = notes_of(pictures, tmp_path)
    held = robot_picture(robot)
    assert held.problem == note == ""
    assert notes["scale"] > robot.tension_limits()[0]
    assert notes["slack"]
    assert notes["lines"] == []


def test_a_robot_that_is_not_held_has_plain_cables_and_says_so(tmp_path):
    """No tensions within 1000 to 1001 N hold it: neither a scale nor slack is said."""
    workspace = small_workspace("acrobot_large", limits=(1000.0, 1001.0))
    pictures, note = workspace_page(workspace, load_robot("acrobot_large"))
    notes = notes_of(pictures, tmp_path)
    assert "no tensions within 1000..1001 N" in note
    assert notes["scale"] == 0.0
    assert notes["slack"] is None
    assert [words for words, _ in notes["lines"]] == ["cables, tensions unknown"]


@pytest.mark.parametrize("measure", [None, "capacity-margin"])
@pytest.mark.parametrize("counts", [(3, 2, 2), (5, 4, 1), (1, 3, 4), (4, 1, 1)])
def test_planes_paint_the_grid_and_nothing_beside(measure, counts):
    """Cells of points on the border were painted half a step beyond the grid's box."""
    workspace = small_workspace("acrobot_large", counts)
    figure = planes_figure(workspace, measure)
    assert figure_faults(figure) == []
    lower, upper = np.array([-0.3, -0.2, 0.2]), np.array([0.3, 0.2, 0.4])
    painted = [axes for axes in figure.axes if axes.get_title().partition(" ")[0] in tuple("xyz")]
    assert painted
    for axes in painted:
        (mesh,) = [one for one in axes.collections if hasattr(one, "get_coordinates")]
        corners = mesh.get_coordinates().reshape(-1, 2)
        u, v = ("xyz".index(name()[0]) for name in (figure_u(painted), figure_v(painted)))
        for k, column in ((u, corners[:, 0]), (v, corners[:, 1])):
            if counts[k] > 1:
                assert column.min() == pytest.approx(lower[k])
                assert column.max() == pytest.approx(upper[k])


def figure_u(painted):
    return next(axes.get_xlabel for axes in painted if axes.get_xlabel())


def figure_v(painted):
    return next(axes.get_ylabel for axes in painted if axes.get_ylabel())


@pytest.mark.parametrize("measure", [None, "capacity-margin"])
def test_planes_show_the_frame_the_exit_points_and_the_box_of_the_grid(measure):
    robot = load_robot("acrobot_large")
    figure = planes_figure(small_workspace("acrobot_large"), measure, robot)
    assert figure_faults(figure) == []
    axes = figure.axes[0]
    drawn = {line.get_label(): np.array(line.get_data()) for line in axes.lines}
    np.testing.assert_array_equal(drawn["exit points of the cables"], robot.exit_points()[:2])
    np.testing.assert_allclose(drawn["frame"].min(axis=1), robot.frame.lower[:2])
    np.testing.assert_allclose(drawn["box of the grid"].max(axis=1), [0.3, 0.2])
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    for points in drawn.values():
        assert np.all(low < points.T)
        assert np.all(high > points.T)
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {*drawn} <= {*told}


def test_planes_of_a_measure_say_where_there_is_no_number():
    """A plane without a pose inside was an empty panel."""
    workspace = small_workspace("acrobot_large")
    held = workspace.inside("static").copy()
    assert held.any(axis=(0, 1, 2))[1]
    held[..., 0] = False
    workspace = replace(workspace, holds={"static": held})
    figure = planes_figure(workspace, "capacity-margin")
    assert figure_faults(figure) == []
    assert "outside" in [text.get_text() for text in figure.legends[0].get_texts()]
    (mesh,) = [one for one in figure.axes[0].collections if hasattr(one, "get_coordinates")]
    assert np.all(np.ma.getmaskarray(mesh.get_array()))
    painted = mesh.to_rgba(mesh.get_array())
    np.testing.assert_allclose(painted.reshape(-1, 4)[0], to_rgba(OUTSIDE))
