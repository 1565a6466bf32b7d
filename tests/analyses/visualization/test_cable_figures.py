"""Figures of cables: bounds, who is slack and when, the platform, paths as they run."""

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure, platform_edges
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import DOTTED, PLATFORM, SOLID, nth_look, rgb


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
    edges = platform_edges(robot)
    lengths = sorted(float(np.linalg.norm(edge[:, 1] - edge[:, 0])) for edge in edges)
    np.testing.assert_allclose(lengths, np.sort(np.repeat(robot.platform.size, 4)))
    assert min(np.min(edge[2]) for edge in edges) == 0.0  # P lies in the bottom face
    poses = [robot.home.transform(), pose_from_angles([0.2, 0.1, 0.4], [0.1, 0.0, 0.5])]
    log = {"X_WP": np.array([pose_row(X) for X in poses]), "slack": np.zeros((2, 8))}
    path = Path3D(log["X_WP"][:, 4:], "platform", PLATFORM)
    figure = path_figure("t", robot, robot.cable_set(), log, [path])
    for axes in figure.axes:  # with the whole robot, and close up, as the path is long enough
        drawn = [np.array(line.get_data_3d()) for line in axes.lines]
        for X_WP in poses:
            for edge in edges:
                ends = X_WP.multiply(edge)
                assert any(d.shape == (3, 2) and np.allclose(d, ends, atol=1e-12) for d in drawn)
        assert [axes.get_xlabel(), axes.get_zlabel()] == ["x in W [m]", "z in W [m]"]
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert {"platform's body at the start", "platform's body at the end"} <= set(words)
    names = {text.get_text().strip() for text in figure.axes[0].texts}
    assert {"W", "P"} <= names


def tension_log(slack_at=(), top=20.0):
    times = np.linspace(0.0, 10.0, 101)
    slack = np.zeros((101, 8))
    for cable, begin, end in slack_at:
        slack[(times >= begin) & (times < end), cable] = 1.0
    return {"time": times, "slack": slack, "tensions": top * np.ones((101, 8)) * (1.0 - slack)}


def tensions_of(log):
    """Figure of tensions between 1 and 60 N."""
    robot = load_robot("acrobot_large")
    return cable_figure("t", robot, log, "tensions", "tension [N]", bounds=(1.0, 60.0))


def legend_words(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_bars_say_which_cable_is_slack_and_when():
    names = [cable.name for cable in load_robot("acrobot_large").cables]
    _, band = tensions_of(tension_log([(2, 1.0, 3.0), (2, 5.0, 6.0), (7, 0.0, 10.1)])).axes
    assert [label.get_text() for label in band.get_yticklabels()] == names
    spans = {}
    for place, row in enumerate(band.collections):
        boxes = [path.get_extents() for path in row.get_paths()]
        assert all(box.y0 < place < box.y1 for box in boxes)
        if boxes:
            spans[place] = [(box.x0, box.x1) for box in boxes]
            np.testing.assert_allclose(row.get_facecolor()[0][:3], rgb(nth_look(place).color))
    assert sorted(spans) == [2, 7]
    np.testing.assert_allclose(spans[2], [(1.0, 3.0), (5.0, 6.0)])
    np.testing.assert_allclose(spans[7], [(0.0, 10.0)])


@pytest.mark.parametrize(("top", "drawn"), [(50.0, True), (5.0, False)])
def test_bounds_are_drawn_or_said(top, drawn):
    axes, _ = tensions_of(tension_log([(0, 1.0, 2.0)], top)).axes
    levels = [line.get_ydata()[0] for line in axes.lines if len(set(line.get_ydata())) == 1]
    assert 1.0 in levels
    assert (60.0 in levels) == drawn
    words = " ".join(legend_words(axes))
    assert "lower bound 1 N" in words
    assert "upper bound 60 N" in words
    assert ("above the axis" in words) != drawn


def test_without_slack_there_is_no_empty_band_and_it_is_said():
    (axes,) = tensions_of(tension_log()).axes
    assert "no cable is slack" in legend_words(axes)


def test_other_quantities_are_shaded_while_a_cable_is_slack_in_the_same_looks():
    robot, log = load_robot("acrobot_large"), tension_log([(0, 1.0, 3.0), (1, 2.0, 4.0)])
    (axes,) = cable_figure("t", robot, log, "tensions", "speed [mm/s]", scale=1e3).axes
    (shaded,) = axes.patches
    assert shaded.get_extents().width > 0.0
    assert "some cable slack" in legend_words(axes)
    assert max(np.max(line.get_ydata()) for line in axes.lines) == 20e3
    tensions = tensions_of(log).axes[0]
    for k in range(8):
        for line in (axes.lines[k], tensions.lines[k]):
            assert (line.get_color(), line.get_marker()) == (nth_look(k).color, nth_look(k).marker)


def test_names_of_frames_at_one_place_are_beside_each_other():
    robot = load_robot("acrobot_large")
    log = {"X_WP": np.tile([1.0, 0, 0, 0, 0, 0, 0.02], (2, 1)), "slack": np.zeros((2, 8))}
    paths = [Path3D(log["X_WP"][:, 4:], "Po", PLATFORM)]
    figure = path_figure("home", robot, robot.cable_set(), log, paths)
    figure.canvas.draw()
    names = [text for text in figure.axes[0].texts if text.get_text().strip() in ("W", "P")]
    first, second = (text.get_window_extent() for text in names)
    assert not first.shrunk(0.9, 0.9).overlaps(second)


def test_tensions_that_chatter_are_a_curve_of_means_in_a_band_of_extremes():
    """Thirty seconds of noise once were a thick band of the curve's colour."""
    times, robot = np.linspace(0.0, 30.0, 1501), load_robot("acrobot_large")
    chatter = 0.8 * np.random.default_rng(3).uniform(-1.0, 1.0, 1501)
    tensions = np.tile(10.0 + np.arange(8.0), (1501, 1))
    tensions[:, 1] += np.sin(times)  # which is no chatter
    tensions[:, 2] += chatter
    log = {"time": times, "slack": np.zeros((1501, 8)), "tensions": tensions}
    axes = cable_figure("t", robot, log, "tensions", "tension [N]", bounds=(0.0, 60.0)).axes[0]
    band, _ = axes.collections
    extent = band.get_paths()[0].get_extents()
    assert (extent.y0, extent.y1) == (np.min(tensions[:, 2]), np.max(tensions[:, 2]))
    smooth, means = (axes.lines[k].get_ydata() for k in (1, 2))
    np.testing.assert_array_equal(smooth, tensions[:, 1])
    assert np.std(means) < 0.6 * np.std(tensions[:, 2])
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert (legend[2], legend[8]) == ("C3", "band: extremes,\ncurve in it: means")
