"""Figures carry titles, units and legends."""

import pytest

from cdpr_drake.analyses.runs import figures as run_figures
from cdpr_drake.analyses.runs.visual_servo_run import run_scenario
from cdpr_drake.systems.diagrams import load_scenario


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
    assert "planar_pbvs" in figure.get_suptitle()
    for axes in figure.axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        if hasattr(axes, "get_zlabel"):
            labels.append(axes.get_zlabel())
        for label in labels:
            assert "[" in label, f"{label!r} has no unit"


def test_cables_are_in_the_legend(result):
    (axes,) = run_figures.cable_curves_figure(result, "tensions").axes
    labels = [words.get_text() for words in axes.get_legend().get_texts()]
    assert labels[:4] == ["C1", "C2", "C3", "C4"]
