"""Figures in the layout of published ones: what they are of, and how they are filled."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.case_figures import (
    bar_figure,
    group_figure,
    largest_of_each,
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
from tests.figure_faults import figure_faults

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


LAPS = 15


@pytest.mark.parametrize(
    "name", ["errors", "cable_velocities", "image_paths", "camera_paths", "pose_estimates"]
)
def test_laps_behind_an_object_that_moves_are_no_dark_band(name):
    """Fifteen laps lay on each other, and the distance was one from a line that nobody follows."""
    time = np.linspace(0.0, 16.0 * LAPS, 50 * LAPS, endpoint=False)
    turn = 2.0 * np.pi * LAPS * time / time[-1]
    around = np.transpose([np.cos(turn), np.sin(turn), 0.0 * turn])
    goal = np.zeros((2, 3))
    made = made_run(
        "m_7", summary={"robot": "planar"}, features=["x_m", "y_m", "z_m"], time=time,
        image_time=time, image_size=np.array([1600.0, 1200.0]), image_max_px=None,
        image_path=800.0 + 100.0 * around[:, :2], image_line=800.0 + goal[:, :2],
        image_deviation=np.abs(around[:, 0]), camera_path=around, camera_line=goal,
        camera_deviation=np.abs(around[:, 0]), error=around,
        cable_velocities=np.hstack([around, around[:, :1]]),
        estimate_distance=time * (turn % 0.7), estimate_angle=time,
    )  # fmt: skip
    plan = CASES["case-1"]
    ((group, lap),) = plan.laps_s.items()
    assert group in plan.groups()
    figure = group_figure(plan, group, name, made_runs([made]))
    assert figure_faults(figure) == []
    over_time = [axes for axes in figure.axes if axes.get_xlabel() == "time [s]"]
    whole = name == "pose_estimates"  # what accumulates is seen over all laps
    for axes in over_time:
        last = max(float(np.max(line.get_xdata())) for line in axes.lines)
        assert last == pytest.approx(time[-1] - 0.5 * lap if whole else 2.0 * lap, abs=time[1])
        assert not whole or len(axes.lines[0].get_ydata()) == LAPS
    assert ("the first 32 s" in figure.get_suptitle()) is not whole
    assert ("in each lap of 16 s" in figure.get_suptitle()) is whole
    if name in ("image_paths", "camera_paths"):
        (axes,) = over_time
        assert axes.get_ylabel().startswith("distance from the desired point")
        np.testing.assert_allclose(axes.lines[0].get_ydata(), axes.lines[0].get_ydata()[0])
        words = [text.get_text() for text in figure.legends[0].get_texts()]
        assert "straight line" not in words
    # A plan that says nothing shows all.
    every = group_figure(replace(plan, laps_s={}), group, name, made_runs([made]))
    assert "the first" not in every.get_suptitle()
    assert "in each lap" not in every.get_suptitle()


def test_the_largest_of_each_lap():
    times, largest = largest_of_each(
        np.array([0.0, 1.0, 2.0, 2.9, 3.0, 4.0]), np.array([1.0, 5.0, 2.0, 3.0, 4.0, 0.0]), 2.0
    )
    np.testing.assert_allclose(times, [0.5, 2.5, 4.0])
    np.testing.assert_array_equal(largest, [5.0, 4.0, 0.0])
