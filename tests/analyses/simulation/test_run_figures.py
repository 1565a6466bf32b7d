"""Figures carry titles, units and legends."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation import run_figures
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.figure_faults import figure_faults


@pytest.fixture(scope="module")
def result():
    return run_scenario(load_scenario("planar_pbvs", ["camera.kind=projected", "duration=0.4"]))


@pytest.mark.parametrize(
    "draw",
    [
        run_figures.image_path_figure,
        run_figures.error_figure,
        lambda result: run_figures.cable_curves_figure(result, "cable_velocities"),
        lambda result: run_figures.cable_curves_figure(result, "lengths"),
        lambda result: run_figures.cable_curves_figure(result, "tensions"),
        run_figures.platform_path_figure,
    ],
)
def test_axes_have_units(result, draw):
    figure = draw(result)
    assert figure_faults(figure) == []
    title = figure.get_suptitle()
    assert "planar_pbvs" in title
    assert result.servo.scenario.title in title.replace("\n", " ")
    for axes in figure.axes:
        labels = [axes.get_ylabel()]
        if axes.xaxis.get_tick_params()["labelbottom"]:  # else it shares the axis below
            labels.append(axes.get_xlabel())
        if hasattr(axes, "get_zlabel"):
            labels.append(axes.get_zlabel())
        for label in labels:
            assert "[" in label, f"{label!r} has no unit"


def test_cables_are_in_the_legend(result):
    axes = run_figures.cable_curves_figure(result, "tensions").axes[0]
    labels = [words.get_text() for words in axes.get_legend().get_texts()]
    assert labels[:4] == ["C1", "C2", "C3", "C4"]


def test_no_panel_is_empty_where_nobody_looked(result):
    """An open loop has no feature error; its panels once were empty."""
    blind = replace(result, log={**result.log, "gain": np.zeros_like(result.log["gain"])})
    figure = run_figures.error_figure(blind)
    assert figure_faults(figure) == []
    assert len(figure.axes) == 2
    assert all(len(axes.lines) == 1 for axes in figure.axes)
    assert "no feature was controlled" in figure.get_suptitle()


def test_a_target_that_was_never_found_leaves_no_empty_panel(result):
    unseen = replace(result, log={**result.log, "found": np.zeros_like(result.log["found"])})
    figure = run_figures.image_path_figure(unseen)
    assert figure_faults(figure) == []
    (image,) = figure.axes
    assert [text.get_text() for text in image.get_legend().get_texts()] == ["desired"]
    assert "never found" in figure.get_suptitle()


def test_times_without_the_target_are_shaded_and_said(result):
    gain = result.log["gain"].copy()
    gain[5:9] = 0.0
    figure = run_figures.error_figure(replace(result, log={**result.log, "gain": gain}))
    assert figure_faults(figure) == []
    words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert "target not seen" in words


def test_before_the_first_image_nothing_is_shaded(result):
    """Of every run 0.02 s were shaded, too narrow to be seen, and the legend named them."""
    axes = run_figures.error_figure(result).axes[0]
    assert "target not seen" not in [text.get_text() for text in axes.get_legend().get_texts()]
    assert not axes.patches
    gain = result.log["gain"].copy()
    gain[:9] = 0.0
    axes = run_figures.error_figure(replace(result, log={**result.log, "gain": gain})).axes[0]
    (shade,) = axes.patches
    assert shade.get_x() == pytest.approx(0.02)
    assert shade.get_width() == pytest.approx(8 * 0.02)


def test_every_run_has_its_figures_in_the_formats_asked_for(result):
    pictures = run_figures.run_figures(result, ("pdf", "svg"))
    assert {name.rpartition(".")[2] for name in pictures} == {"pdf", "svg"}
    assert {"tensions.pdf", "tensions.svg", "platform_path.pdf"} <= set(pictures)
