"""Figures of cables: bounds, who is slack and when, the platform, paths as they run."""

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure, platform_edges
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import DOTTED, PLATFORM, SOLID, nth_look


@pytest.mark.parametrize("pulleys", [False, True])
def test_cables_run_over_the_pulleys_that_the_run_has(pulleys):
    robot = load_robot("caroca")
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    X_WP = robot.home.transform()
    slack = np.arange(cables.count) == 2
    log = {"X_WP": pose_row(X_WP)[None], "slack": slack[None]}
    path = Path3D(np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]]), "way", PLATFORM)
    lines = path_figure("t", robot, cables, log, [path]).axes[0].lines[1 : 1 + cables.count]
    tangents = cable_paths(X_WP, cables).p_WT
    for i, line in enumerate(lines):
        points = np.array(line.get_data_3d())
        np.testing.assert_allclose(points[:, 0], cables.p_WA[:, i], atol=1e-12)
        np.testing.assert_allclose(points[:, -2], tangents[:, i], atol=1e-12)
        np.testing.assert_allclose(points[:, -1], X_WP.multiply(cables.p_PB[:, i]), atol=1e-12)
        assert (points.shape[1] > 2) == pulleys
        assert line.get_color() == nth_look(i).color
        assert line.get_linestyle() == (DOTTED if slack[i] else SOLID)


def test_the_platform_is_drawn_at_the_start_and_at_the_end():
    robot = load_robot("acrobot_large")
    poses = [robot.home.transform(), pose_from_angles([0.2, 0.1, 0.4], [0.1, 0.0, 0.5])]
    log = {"X_WP": np.array([pose_row(X) for X in poses]), "slack": np.zeros((2, 8))}
    path = Path3D(log["X_WP"][:, 4:], "platform", PLATFORM)
    figure = path_figure("t", robot, robot.cable_set(), log, [path])
    for axes in figure.axes:  # with the whole robot, and close up, as the path is long enough
        drawn = [np.array(line.get_data_3d()) for line in axes.lines]
        for X_WP in poses:
            for edge in platform_edges(robot):
                ends = X_WP.multiply(edge)
                assert any(d.shape == (3, 2) and np.allclose(d, ends, atol=1e-12) for d in drawn)
        assert [axes.get_xlabel(), axes.get_zlabel()] == ["x in W [m]", "z in W [m]"]
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert {"platform's body at the start", "platform's body at the end"} <= set(words)
    names = {text.get_text().strip() for text in figure.axes[0].texts}
    assert {"W", "P"} <= names


def test_edges_of_the_platform_are_those_of_its_box():
    robot = load_robot("acrobot_large")
    edges = platform_edges(robot)
    lengths = sorted(float(np.linalg.norm(edge[:, 1] - edge[:, 0])) for edge in edges)
    np.testing.assert_allclose(lengths, np.sort(np.repeat(robot.platform.size, 4)))
    assert min(np.min(edge[2]) for edge in edges) == 0.0  # P lies in the bottom face


def tension_log(slack_at=(), top=20.0):
    times = np.linspace(0.0, 10.0, 101)
    slack = np.zeros((101, 8))
    for cable, begin, end in slack_at:
        slack[(times >= begin) & (times < end), cable] = 1.0
    return {"time": times, "slack": slack, "tensions": top * np.ones((101, 8)) * (1.0 - slack)}


def test_bars_say_which_cable_is_slack_and_when():
    robot = load_robot("acrobot_large")
    log = tension_log([(2, 1.0, 3.0), (2, 5.0, 6.0), (7, 0.0, 10.1)])
    figure = cable_figure("t", robot, log, "tensions", "tension [N]", bounds=(1.0, 60.0))
    _, band = figure.axes
    assert [label.get_text() for label in band.get_yticklabels()] == [c.name for c in robot.cables]
    spans = {}
    for place, bars in enumerate(band.collections):
        boxes = [path.get_extents() for path in bars.get_paths()]
        spans[place] = [(box.x0, box.x1) for box in boxes]
        for box in boxes:
            assert box.y0 < place < box.y1
        np.testing.assert_allclose(
            bars.get_facecolor()[0][:3] if boxes else 0.0,
            _rgb(nth_look(place).color) if boxes else 0.0,
        )
    assert {place: len(s) for place, s in spans.items() if s} == {2: 2, 7: 1}
    np.testing.assert_allclose(spans[2], [(1.0, 3.0), (5.0, 6.0)])
    np.testing.assert_allclose(spans[7], [(0.0, 10.0)])


def _rgb(color):
    return [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]


def test_without_slack_there_is_no_empty_band_and_it_is_said():
    robot = load_robot("acrobot_large")
    figure = cable_figure("t", robot, tension_log(), "tensions", "tension [N]", bounds=(1.0, 60.0))
    (axes,) = figure.axes
    assert "no cable is slack" in [text.get_text() for text in axes.get_legend().get_texts()]


@pytest.mark.parametrize(("top", "drawn"), [(50.0, True), (5.0, False)])
def test_bounds_are_drawn_or_said(top, drawn):
    robot = load_robot("acrobot_large")
    log = tension_log([(0, 1.0, 2.0)], top)
    axes, _ = cable_figure("t", robot, log, "tensions", "tension [N]", bounds=(1.0, 60.0)).axes
    levels = [line.get_ydata()[0] for line in axes.lines if len(set(line.get_ydata())) == 1]
    assert 1.0 in levels
    assert (60.0 in levels) == drawn
    words = " ".join(text.get_text() for text in axes.get_legend().get_texts())
    assert "lower bound 1 N" in words
    assert "upper bound 60 N" in words
    assert ("above the axis" in words) != drawn


def test_other_quantities_are_shaded_while_some_cable_is_slack():
    robot = load_robot("acrobot_large")
    log = tension_log([(0, 1.0, 3.0), (1, 2.0, 4.0)])
    (axes,) = cable_figure("t", robot, log, "tensions", "speed [mm/s]", scale=1e3).axes
    (shaded,) = axes.patches
    assert shaded.get_extents().width > 0.0
    assert "some cable slack" in [text.get_text() for text in axes.get_legend().get_texts()]
    assert max(np.max(line.get_ydata()) for line in axes.lines) == 20e3


def test_a_cable_keeps_its_look_in_all_figures():
    robot = load_robot("acrobot_large")
    log = tension_log([(0, 1.0, 3.0)])
    first = cable_figure("t", robot, log, "tensions", "a [N]").axes[0].lines
    second = cable_figure("t", robot, log, "tensions", "b [N]", bounds=(1.0, 60.0)).axes[0].lines
    for k in range(8):
        for line in (first[k], second[k]):
            assert line.get_color() == nth_look(k).color
            assert line.get_marker() == nth_look(k).marker
    assert nth_look(0).dash == SOLID


def test_names_of_frames_at_one_place_are_beside_each_other():
    robot = load_robot("acrobot_large")
    log = {"X_WP": np.tile([1.0, 0, 0, 0, 0, 0, 0.02], (2, 1)), "slack": np.zeros((2, 8))}
    paths = [Path3D(log["X_WP"][:, 4:], "Po", PLATFORM)]
    figure = path_figure("home", robot, robot.cable_set(), log, paths)
    figure.canvas.draw()
    names = [text for text in figure.axes[0].texts if text.get_text().strip() in ("W", "P")]
    first, second = (text.get_window_extent() for text in names)
    assert not first.shrunk(0.9, 0.9).overlaps(second)
