"""Figures in the layout of published ones: what they are of, and how they are filled."""

from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.case_figures import (
    bar_figure,
    shown_of,
    small_multiples,
)
from cdpr_drake.analyses.studies.framework.case_layouts import (
    CableLayout,
    Panel,
    PanelLayout,
    paths_layout,
)
from cdpr_drake.analyses.studies.framework.case_panels import bars, metric
from cdpr_drake.analyses.studies.framework.runs import MissingRuns
from cdpr_drake.palette import nth_look
from tests.analyses.studies.made_runs import CASE_STUDIES, made_run, made_runs

CASES = {study.name: study.cases for study in CASE_STUDIES}
CASE = CASES["case-5"]

PATH = np.linspace([0.0, 0.0, 1.0], [1.0, 2.0, 0.5], 12)


def run(name, seed=0, off=3.0):
    """A run on straight lines."""
    time = np.linspace(0.0, 2.0, 12)
    traces = {
        "time": time, "image_time": time, "image_size": np.array([1600.0, 1200.0]),
        "image_path": 400.0 * PATH[:, :2], "image_line": 400.0 * PATH[[0, -1], :2],
        "image_deviation": np.full(12, off), "camera_path": PATH, "camera_line": PATH[[0, -1]],
        "camera_deviation": np.full(12, 1e-3 * off),
    }  # fmt: skip
    traces |= {"image_max_px": off, "summary": {"robot": "caroca"}}
    return made_run(name, seed=seed, **traces)


@pytest.fixture(scope="module")
def runs():
    return made_runs([run("none"), run("none", 1, 5.0), run("within", 0, 9.0)])


@pytest.mark.parametrize("name", sorted(CASES))
def test_layouts_are_of_configurations_that_there_are(name):
    case = CASES[name]
    known = {configuration.name for configuration in case.configurations}
    for layout in case.layouts.values():
        if isinstance(layout, CableLayout):
            assert set(layout.of) <= known
            continue
        for panel in (panel for row in layout.rows for panel in row):
            assert set(panel.of) <= known
            assert len(set(panel.of)) == len(panel.of)


def test_paths_are_four_panels_of_the_configurations_that_were_run(runs):
    layout = paths_layout("four panels", ("none", "within", "beyond"))
    figure = layout.figure(partial(shown_of, CASE, runs), runs)
    assert [axes.get_title()[:3] for axes in figure.axes] == ["(a)", "(b)", "(c)", "(d)"]
    _, image, _, space = figure.axes
    highest = [float(np.max(line.get_ydata())) for line in image.lines]
    assert highest == [3.0, 9.0]  # the first run of each
    np.testing.assert_allclose([float(np.max(line.get_ydata())) for line in space.lines], highest)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["no perturbation", "0.2 m, 4 deg", "straight line", "desired"]


def test_a_layout_of_which_nothing_was_run_is_not_drawn(runs):
    layout = paths_layout("four panels", ("beyond",))
    with pytest.raises(MissingRuns, match="four panels"):
        layout.figure(partial(shown_of, CASE, runs), runs)


def test_bars_are_means_over_all_runs_with_their_range(runs):
    draw = bars("[px]", {"largest": metric("image_max_px")}, letters=True)
    layout = PanelLayout("bars", ((Panel(draw, ("none", "within", "beyond")),),))
    (axes,) = layout.figure(partial(shown_of, CASE, runs), runs).axes
    assert [patch.get_height() for patch in axes.patches] == [4.0, 9.0]
    assert [label.get_text()[:2] for label in axes.get_xticklabels()] == ["A:", "B:"]
    (segments,) = (one.get_segments() for one in axes.collections[:1])
    np.testing.assert_allclose(segments[0][:, 1], [3.0, 5.0])  # the range of two runs


def test_looks_differ_where_configurations_of_two_experiments_are_in_one_figure():
    case = CASES["case-a6"]
    first_of_each = [group[0].name for group in case.groups().values()]
    assert len(first_of_each) > 1
    looks = [
        look for _, _, look in shown_of(case, made_runs(map(run, first_of_each)), first_of_each)
    ]
    assert len(set(looks)) == len(looks)
    # Alone, it has the look of its experiment's figures.
    ((_, _, look),) = shown_of(case, made_runs([run(first_of_each[1])]), first_of_each[1:2])
    assert look == nth_look(0)


@pytest.mark.parametrize(("largest", "shared"), [(2.0, True), (20.0, False)])
def test_curves_that_a_common_scale_would_press_flat_have_their_own(largest, shared):
    names = [f"cable {k}" for k in range(2)]
    curves = [np.linspace([-1.0, 0.0], [1.0, 0.5], 12), np.linspace([0.0, 0.0], [largest, 0.1], 12)]
    made = made_runs(
        made_run(one, summary={"robot": "planar"}, features=names,
                 time=np.linspace(0.0, 2.0, 12), error=curve)
        for one, curve in zip(("none", "within"), curves, strict=True)
    )  # fmt: skip
    axes = small_multiples(
        "made up", shown_of(CASE, made, ("none", "within")), "error", "error [-]", 1.0
    ).axes
    assert (axes[0].get_ylim() == axes[1].get_ylim()) is shared


def test_a_bar_alone_does_not_fill_its_axes(runs):
    alone = [c for c in CASE.configurations if c.name == "none"]
    figure = bar_figure("made up", alone, runs, [("image_max_px", "largest [px]", 1.0)])
    (axes,) = figure.axes
    (bar,) = axes.patches
    assert bar.get_width() < 0.25 * np.ptp(axes.get_xlim())
