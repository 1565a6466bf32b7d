"""What figures of workspaces show: every cell, curve and exit point, cables as they are held."""

import json
import re
from dataclasses import replace

import matplotlib.colors
import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from cdpr_drake.analyses.studies.control_stability_figures import table_figure
from cdpr_drake.analyses.studies.stability_tables import BY_NAME
from cdpr_drake.analyses.visualization.replay import robot_picture
from cdpr_drake.analyses.workspaces.plane_panels import even_choice
from cdpr_drake.analyses.workspaces.stability import Stability
from cdpr_drake.analyses.workspaces.stability_figures import (
    COLORS,
    MOST_PLANES,
    curves_figure,
    solids_figure,
)
from cdpr_drake.analyses.workspaces.stability_figures import planes_figure as stability_planes
from cdpr_drake.analyses.workspaces.workspace import compute_workspace
from cdpr_drake.analyses.workspaces.workspace_figures import OUTSIDE, planes_figure
from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.verdict import VERDICTS
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.figure_faults import figure_faults


def workspaces(counts, stable=True, feasible=True, values=(), robot=None):
    """A result that was not computed; `values` are those of r_A [m] beside the baseline."""
    grid = grid_by_count([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0], counts)
    names = ("baseline", *(f"r_A={value:g}" for value in values))
    bounds = {name: {"r_A": r} for name, r in zip(names, (0.005, *values), strict=True)}
    arguments = {
        "robot": "acrobot_large", "scheme": "pbvs", "verdict": "sampled", "bounds": bounds,
        "case": {"lever": "error"},
    }  # fmt: skip
    shape = (len(names), *grid.shape)
    return Stability(
        arguments=arguments,
        grid=grid,
        stable=np.broadcast_to(stable, shape),
        margin=np.zeros(shape),
        feasible=np.broadcast_to(feasible, grid.shape),
        versions={},
        robot=robot,
    )


def meshes(figure):
    """The coloured cells of every panel."""
    figure.draw_without_rendering()
    return [c for axes in figure.axes for c in axes.collections if isinstance(c, QuadMesh)]


def test_planes_show_frame_exit_points_and_the_box_of_the_grid():
    """A grid whose points are all alike was a plain square, with one number at its ticks."""
    robot = load_robot("acrobot_large")
    figure = stability_planes(workspaces((5, 5, 3), robot=robot))
    assert not figure_faults(figure)
    for axes in figure.axes:
        box, frame, exits = axes.lines
        assert np.ptp(box.get_xdata()) == 1.0
        assert np.ptp(frame.get_xdata()) == np.ptp([robot.frame.lower[0], robot.frame.upper[0]])
        np.testing.assert_array_equal(exits.get_xydata().T, robot.cable_set().p_WA[:2])
        low, high = axes.get_xlim()
        assert low < min(exits.get_xdata()) < max(exits.get_xdata()) < high
        assert sum(low <= tick <= high for tick in axes.get_xticks()) >= 2
    shown = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"frame", "exit points of the cables", "box of the grid"} <= shown


@pytest.mark.parametrize(
    ("counts", "across", "up", "panels"),
    [
        ((4, 3, 2), "x", "y", 2),
        ((7, 1, 6), "x", "z", 1),
        ((1, 7, 6), "y", "z", 1),
        ((1, 1, 6), "x", "z", 1),
        ((5, 1, 1), "x", "y", 1),
        ((1, 5, 1), "x", "y", 1),
        ((1, 1, 1), "x", "y", 1),
    ],
)
def test_planes_show_every_point_as_a_cell(counts, across, up, panels):
    figure = stability_planes(workspaces(counts))
    assert figure_faults(figure) == []
    found = meshes(figure)
    assert len(found) == panels
    size = dict(zip("xyz", counts, strict=True))
    for mesh in found:
        corners = mesh.get_coordinates()  # shape (rows + 1, columns + 1, 2)
        assert corners.shape == (size[up] + 1, size[across] + 1, 2)
        sides = [np.diff(corners[..., 0], axis=1), np.diff(corners[..., 1], axis=0)]
        assert min(np.min(side) for side in sides) > 0.05
    assert figure.axes[-1].get_xlabel() == f"{across} in W [m]"
    assert figure.axes[0].get_ylabel() == f"{up} in W [m]"


@pytest.mark.parametrize("counts", [(7, 1, 6), (1, 7, 6), (4, 3, 1)])
def test_cells_are_coloured_by_their_own_points(counts):
    stable = np.random.default_rng(0).random((1, 1, *counts)) < 0.5
    (mesh,) = meshes(stability_planes(workspaces(counts, stable)))
    wanted = [COLORS["SZ" if one else "S"] for one in np.squeeze(stable).T.ravel()]
    np.testing.assert_allclose(mesh.get_facecolors(), matplotlib.colors.to_rgba_array(wanted))


def test_planes_are_evenly_spaced_and_a_selection_is_said():
    for count in range(1, 60):
        chosen = even_choice(count, MOST_PLANES)
        assert len(chosen) <= MOST_PLANES
        assert len(set(np.diff(chosen))) <= 1
        assert 0 <= chosen[0] <= chosen[-1] < count
    figure = stability_planes(workspaces((3, 3, 16)))
    assert len(meshes(figure)) == 16
    assert "planes" not in figure.get_suptitle()
    figure = stability_planes(workspaces((3, 3, 25)))
    assert figure_faults(figure) == []
    assert f"{len(meshes(figure))} of 25 planes" in figure.get_suptitle()


def test_planes_of_one_colour_are_left_out_where_others_have_a_border():
    """Ten of twelve panels were plain rectangles."""
    stable = np.ones((1, 1, 4, 4, 6), bool)
    stable[..., 0, 4] = False
    figure = stability_planes(workspaces((4, 4, 6), stable))
    assert [axes.get_title() for axes in figure.axes] == ["z = 0.8 m"]
    assert "1 of 6 planes, the others have one colour" in figure.get_suptitle()


def test_ticks_of_a_square_plane_are_alike():
    figure = stability_planes(workspaces((9, 7, 4)))
    assert figure_faults(figure) == []
    for ticks in (figure.axes[0].get_xticks(), figure.axes[0].get_yticks()):
        np.testing.assert_allclose(ticks[np.abs(ticks) < 0.6], [-0.5, 0.0, 0.5], atol=1e-12)


def test_exit_points_are_over_the_solids_and_in_the_legend():
    figure = solids_figure(workspaces((4, 4, 4), robot=load_robot("acrobot_large")))
    assert figure_faults(figure) == []
    for axes in figure.axes:
        assert not axes.computed_zorder  # else matplotlib sorts by depth, solids last
        (solid,) = (c for c in axes.collections if isinstance(c, Poly3DCollection))
        (exits,) = (line for line in axes.lines if line.get_marker() == "^")
        assert exits.get_zorder() > solid.get_zorder()
    (legend,) = figure.legends
    assert "exit points of the cables" in [text.get_text() for text in legend.get_texts()]
    assert "all eight corners inside" in legend.get_title().get_text()


def test_curves_that_lie_on_each_other_can_both_be_seen():
    figure = curves_figure(workspaces((3, 3, 3), values=(0.01, 0.02)))
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    assert axes.get_xlabel() == "r_A [m]"
    lines = {line.get_label(): line for line in axes.lines}
    below, above = lines["Z, r_A [m]"], lines["SZ, r_A [m]"]
    np.testing.assert_array_equal(below.get_ydata(), above.get_ydata())
    assert below.get_linewidth() > 2.0 * above.get_linewidth()
    assert below.get_markersize() > above.get_markersize()
    figure.draw_without_rendering()
    labels = [text.get_text() for text in axes.get_xticklabels()]
    assert "0.01" in labels
    assert len(labels) <= 7


def test_titles_have_formulas_in_the_place_of_what_a_terminal_prints():
    title = stability_planes(workspaces((5, 5, 3))).get_suptitle()
    assert "$L_s$ with $[e_t]_\\times$" in " ".join(title.split())


def test_curves_of_two_bounds_have_colours_that_are_far_from_each_other():
    """Vermillion and orange, the bounds' places in their list, were one colour to readers."""
    made = workspaces((3, 3, 3), values=(0.01,))
    bounds = {"baseline": {"r_A": 0.005, "r_bp": 0.03}, "r_A=0.01": {"r_A": 0.01, "r_bp": 0.03},
              "r_bp=0.05": {"r_A": 0.005, "r_bp": 0.05}}  # fmt: skip
    stable = np.broadcast_to(True, (3, *made.grid.shape))
    made = replace(
        made, arguments=made.arguments | {"bounds": bounds}, stable=stable,
        margin=np.zeros(stable.shape),
    )  # fmt: skip
    (axes,) = curves_figure(made).axes
    lines = {line.get_label(): line.get_color() for line in axes.lines}
    one, other = (matplotlib.colors.to_rgb(lines[f"SZ, {name} [m]"]) for name in ("r_A", "r_bp"))
    assert np.linalg.norm(np.subtract(one, other)) > 0.5


@pytest.mark.parametrize("quick", [True, False])
def test_tables_tell_verdicts_apart_and_say_that_a_grid_is_coarse(quick):
    rows = [
        {
            "question": "verdicts", "table": "A.8", "bound": bound, "value": value,
            "grid": "coarse" if quick else "full", "printed_percent": 60.0,
            **{f"{verdict}_percent": 50.0 for verdict in VERDICTS},
        }
        for bound, value in (("r_bp", 0.05), ("r_A", 0.01), ("r_A", 0.03))
    ]  # fmt: skip
    figure = table_figure(pd.DataFrame(rows), BY_NAME["A.8"])
    assert figure_faults(figure) == []
    assert ("not to be compared" in figure.get_suptitle()) == quick
    assert "3 of 44 printed rows" in figure.get_suptitle()
    for axes in figure.axes:
        assert axes.get_xlim()[0] == 0.0
        lines = [line for line in axes.lines if line.get_label() in VERDICTS]
        assert len({line.get_marker() for line in lines}) == len(VERDICTS)
        assert len({line.get_linestyle() for line in lines}) == len(VERDICTS)
        sizes = [line.get_markersize() for line in lines]
        assert sizes == sorted(sizes, reverse=True)


def small_workspace(robot, counts=(3, 2, 2), **asked):
    grid = grid_by_count([-0.3, -0.2, 0.2], [0.3, 0.2, 0.4], counts)
    return compute_workspace(robot, "static", grid, measures="capacity-margin", workers=1, **asked)


def notes_of(pictures, folder):
    (write,) = pictures.values()
    page = folder / "page.html"
    write(page)
    (words,) = re.findall(r'id="cdpr-data">(.*?)</script>', page.read_text(), re.DOTALL)
    return json.loads(words)


@pytest.mark.parametrize(
    ("limits", "reason", "line"),
    [
        (None, "", "workspace static"),
        ((1000.0, 1001.0), "no tensions within 1000..1001 N", "cables, tensions unknown"),
    ],
)
def test_a_page_has_tensions_or_says_why_not(tmp_path, limits, reason, line):
    """All cables were red, and the legend had nothing but slack; nor is a scale said without."""
    robot = load_robot("acrobot_large")
    pictures, note = workspace_page(small_workspace("acrobot_large", limits=limits), robot)
    notes = notes_of(pictures, tmp_path)
    assert (reason in note) if reason else note == robot_picture(robot).problem == ""
    assert notes["scale"] == 0.0 if reason else notes["scale"] > robot.tension_limits()[0]
    assert bool(notes["slack"]) == (not reason)
    assert [words for words, _ in notes["lines"]] == [line]


@pytest.mark.parametrize(
    ("measure", "counts"),
    [
        *((None, counts) for counts in ((3, 2, 2), (5, 4, 1), (1, 3, 4), (4, 1, 1))),
        *(("capacity-margin", counts) for counts in ((3, 2, 2), (4, 1, 1))),
    ],
)
def test_planes_paint_the_grid_and_nothing_beside(measure, counts):
    """Cells of points on the border were painted half a step beyond the grid's box."""
    workspace = small_workspace("acrobot_large", counts)
    figure = planes_figure(workspace, measure)
    assert figure_faults(figure) == []
    lower, upper = np.array([-0.3, -0.2, 0.2]), np.array([0.3, 0.2, 0.4])
    painted = [axes for axes in figure.axes if axes.get_title().partition(" ")[0] in tuple("xyz")]
    assert painted
    across, up = (
        "xyz".index(next(filter(None, (getattr(axes, name)() for axes in painted)))[0])
        for name in ("get_xlabel", "get_ylabel")
    )
    for axes in painted:
        (mesh,) = [one for one in axes.collections if hasattr(one, "get_coordinates")]
        corners = mesh.get_coordinates().reshape(-1, 2)
        for k, column in ((across, corners[:, 0]), (up, corners[:, 1])):
            if counts[k] > 1:
                assert column.min() == pytest.approx(lower[k])
                assert column.max() == pytest.approx(upper[k])


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
