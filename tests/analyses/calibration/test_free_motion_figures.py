"""Figures of free motion, of numbers that are made up."""

from types import SimpleNamespace

import numpy as np

from cdpr_drake.analyses.calibration import free_motion_report
from cdpr_drake.models.robot_loader import load_robot
from tests.figure_faults import figure_faults


def stretch(begin):
    """One that swings, on which a hand pulls ever more."""
    time = np.linspace(0.0, 2.4, 121)
    turns = np.radians(np.exp(-time)[:, None] * np.sin(12.0 * time[:, None] + [0.0, 1.0, 2.0]))
    force = np.outer(20.0 * time, [0.0, 0.0, 1.0])
    rest = SimpleNamespace(time=time, force=force, means=lambda values: values[:96])
    return SimpleNamespace(
        stretch=SimpleNamespace(time=begin + time, known=np.ones(121)), measured_turns=turns,
        predicted_turns=0.9 * turns, lead=0.8, unexplained=rest,
    )  # fmt: skip


def found(count):
    robot = load_robot("irma4u")
    return SimpleNamespace(
        task=SimpleNamespace(robot=robot), held_out=[stretch(6.78)], values=None,
        fitted=[stretch(float(k)) for k in range(count - 1)],
        model=SimpleNamespace(by_name=lambda values: {"mass": robot.platform.mass}),
    )  # fmt: skip


def test_no_legend_lies_on_curves_and_titles_are_whole():
    for figure in (
        free_motion_report._figure(found(1), "held_out"),
        free_motion_report._unexplained_figure(found(1)),
        free_motion_report._unexplained_figure(found(2)),
    ):
        assert figure_faults(figure) == []
        assert all(axes.get_legend() is None for axes in figure.axes)
        assert "\n" not in figure.get_suptitle()
