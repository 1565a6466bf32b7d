"""Figures 5.11 to 5.15: residuals by another way, and that made-up runs are drawn."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.framework.cable_figures import cable_panels
from cdpr_drake.analyses.studies.framework.case_definition import Configuration
from cdpr_drake.analyses.studies.framework.runs import MissingRuns
from cdpr_drake.analyses.studies.tension_cases.case_9_figures import (
    ACCURACY,
    EXPERIMENTS,
    polygon_figure,
    residual_figure,
    residual_range,
    sensor_accuracy,
)
from cdpr_drake.analyses.studies.tension_cases.case_9_statements import PUBLISHED_TENSIONS
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import nth_look
from cdpr_drake.tensions.methods import solution_space
from tests.analyses.studies.made_runs import made_run, made_runs
from tests.figure_faults import figure_faults

POSE = RigidTransform([-0.11, -0.20, 0.366])
"""The printed last position."""

ROUNDING = 1e-9
"""Of residuals of some newtons [N]."""


def run_of(name, tensions=None):
    """A run that stays at a pose with the printed tensions."""
    printed = PUBLISHED_TENSIONS[int(name[1:])] if tensions is None else tensions
    rows = np.tile(np.array(printed, float), (30, 1))
    traces = {
        "time": np.linspace(0.0, 1.0, 30), "measured_tensions": rows,
        "unstrained_lengths": np.ones((30, 8)), "X_WP": np.tile(pose_row(POSE), (30, 1)),
    }  # fmt: skip
    return made_run(name, summary={"robot": "acrobot_large"}, **traces)


@pytest.fixture(scope="module")
def runs():
    return made_runs(run_of(name) for name in EXPERIMENTS)


@pytest.fixture(scope="module")
def problem():
    return tension_problem(load_robot("acrobot_large"), POSE, limits=(1.0, 60.0))


def test_a_residual_is_the_distance_from_the_solutions_and_its_range_holds(problem):
    tensions = np.array(PUBLISHED_TENSIONS[2])
    here, least, most = residual_range(problem, tensions, ACCURACY)
    _, N = solution_space(problem)
    # Another way: what is left of the balance by the pseudo-inverse of W.
    left = np.linalg.pinv(problem.W) @ (problem.W @ tensions + problem.wrench)
    assert here == pytest.approx(np.linalg.norm(left), abs=ROUNDING)
    rng = np.random.default_rng(0)
    drawn = tensions + rng.uniform(-ACCURACY, ACCURACY, (400, 8))
    off = np.linalg.norm(
        (drawn @ problem.W.T + problem.wrench) @ np.linalg.pinv(problem.W).T, axis=1
    )
    assert least <= np.min(off) + ROUNDING
    assert np.max(off) <= most + ROUNDING
    np.testing.assert_allclose(problem.W @ N, 0.0, atol=ROUNDING)


def test_tensions_that_balance_have_no_residual_and_no_accuracy_no_range(problem):
    particular, N = solution_space(problem)
    balanced = particular + N @ [1.0, 2.0]
    here, least, most = residual_range(problem, balanced, ACCURACY)
    assert here == pytest.approx(0.0, abs=ROUNDING)
    assert least == pytest.approx(0.0, abs=ROUNDING)
    assert most > ACCURACY
    np.testing.assert_allclose(
        residual_range(problem, balanced + 1.0, 1e-12),
        residual_range(problem, balanced + 1.0, 1e-12)[0],
        atol=1e-6,
    )


def test_figures_need_the_runs_that_they_show(runs):
    # Four of the printed points are within a newton of each other: their names do not meet.
    assert figure_faults(polygon_figure(runs)) == []
    assert residual_figure(runs).axes
    with pytest.raises(MissingRuns):
        polygon_figure(made_runs([run_of("E1")]))


def test_accuracy_matters_where_residuals_are_small_only(problem):
    particular, N = solution_space(problem)
    balanced = particular + N @ [1.0, 2.0]
    pulled = np.linalg.pinv(problem.W) @ np.array([0.0, 0.0, 0.0, 0.0, 0.0, 40.0])
    for tensions, expected in ((balanced, "confirmed"), (balanced + pulled, "not confirmed")):
        runs = made_runs(run_of(name, tensions) for name in EXPERIMENTS)
        assert sensor_accuracy.judge(runs).verdict == expected


def test_a_panel_for_each_cable():
    shown = [
        (Configuration(name, name), run_of(name), nth_look(k))
        for k, name in enumerate(("E1", "E3"))
    ]
    figure = cable_panels("made up", shown, "cable_tensions")
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == [cable.name for cable in load_robot("acrobot_large").cables]
    np.testing.assert_array_equal(figure.axes[4].lines[1].get_ydata(), np.zeros(30))
    del shown[1][1].measured["measured_tensions"]
    assert cable_panels("made up", shown, "cable_tensions") is None
