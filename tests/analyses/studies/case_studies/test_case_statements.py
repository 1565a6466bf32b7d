"""Verdicts of case studies on made-up runs: neither by construction nor too kind."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.case_studies import case_1, case_4
from cdpr_drake.analyses.studies.case_studies.case_1 import MOVING_TIME, moving
from cdpr_drake.analyses.studies.case_studies.case_1_ends import (
    GOAL_KEYS,
    accuracy_figure,
    repeatable,
    repeats_by_estimator,
    servo_pays,
    turns_repeat,
)
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.runs import MissingRuns
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.studies.made_runs import made_run, made_runs
from tests.figure_faults import figure_faults


def run(name, outcome="converged", end=None, **metrics):
    """A run that was not made; `end` is where the camera ends beside its goal [m]."""
    place = np.zeros(3) if end is None else np.array(end)
    path = np.array([np.ones(3), place])
    return made_run(name, outcome, camera_path=path, camera_line=np.zeros((2, 3)), **metrics)


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ({"none": 0.004, "within": 0.0041}, "not testable"),  # below where runs end
        ({"none": 0.004, "within": 0.012}, "not confirmed"),
        ({"none": 0.001, "beyond": None}, "not testable"),  # one has nothing to compare with
    ],
)
def test_an_accuracy_needs_two_that_converge_and_the_threshold_at_which_runs_end(runs, expected):
    made = [
        run(name, "target_lost") if error is None else run(name, position_error_m=error)
        for name, error in runs.items()
    ]
    assert same_accuracy(tuple(runs), "").judge(made_runs(made)).verdict == expected


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        # Times of estimators 1, 4, 5, 6, 7; None lasts until the run is stopped.
        ((192.0, 32.0, 48.0, 48.0, 64.0), "confirmed"),
        ((192.0, 80.0, 90.0, 70.0, 60.0), "in part"),
        ((None, 32.0, 48.0, 48.0, 64.0), "in part"),
        ((None, None, None, None, None), "not confirmed"),
        ((None, None, 48.0, 48.0, 64.0), "not confirmed"),
        ((40.0, 32.0, 48.0, 48.0, 64.0), "not confirmed"),
    ],
)
def test_lasting_until_the_end_of_the_run_is_no_order(times, expected):
    runs = [
        run(f"m_{key}", "target_lost" if time else "timeout", time_s=time or MOVING_TIME)
        for key, time in zip("14567", times, strict=True)
    ]
    assert moving.judge(made_runs(runs)).verdict == expected
    assert max(12 * 16.0, 210.0) < MOVING_TIME  # twelve laps fit into it


ROWS = ("a", "ap", "c", "cp")


def table_runs(scatter, offset):
    """Converged runs of all four rows of table 2.1, spread and shifted by given lengths [m]."""
    return [
        run(f"{prefix}_{key}", end=[offset + sign * scatter, 0.0, 0.0])
        for prefix in ROWS
        for key in "1234567"
        for sign in (-1.0, 1.0)
    ]


def turned_runs(scatter, offset):
    """Converged runs of table 2.1 that end turned about x by given angles [deg]."""
    found = table_runs(0.0, 0.0)
    for k, one in enumerate(found):
        half = np.radians(offset + (2 * (k % 2) - 1) * scatter) / 2.0
        end = np.array([np.cos(half), np.sin(half), 0, 0, 0, 0, 0])
        one.measured["camera_ends"] = np.array([end, [1.0, 0, 0, 0, 0, 0, 0]])
    return found


@pytest.mark.parametrize(
    ("judge", "made", "scatter", "offset", "expected"),
    [
        (repeatable, table_runs, 1e-3, 1.8e-3, "confirmed"),
        (repeatable, table_runs, 1e-3, 1e-4, "in part"),  # far better than printed
        (repeatable, table_runs, 1e-5, 1e-5, "in part"),
        (repeatable, table_runs, 1e-2, 1e-2, "not confirmed"),
        (turns_repeat, turned_runs, 0.3, 0.6, "confirmed"),
        (turns_repeat, turned_runs, 0.3, 0.01, "in part"),
        (turns_repeat, turned_runs, 1e-3, 1e-3, "in part"),
        (turns_repeat, turned_runs, 3.0, 0.6, "not confirmed"),
    ],
)
def test_table_2_1_is_judged_by_scatter_and_offset(judge, made, scatter, offset, expected):
    assert judge.judge(made_runs(made(scatter, offset))).verdict == expected


def test_a_row_of_table_2_1_of_which_no_run_converged_is_not_met():
    lost = [run(f"cp_{key}", outcome="target_lost") for key in "1234567"]
    placed = [one for one in table_runs(1e-3, 1.8e-3) if not one.case.startswith("cp")]
    turned = [one for one in turned_runs(0.3, 0.6) if not one.case.startswith("cp")]
    for found in (
        repeatable.judge(made_runs(placed + lost)),
        turns_repeat.judge(made_runs(turned + lost)),
    ):
        assert found.verdict == "not confirmed"
        assert "cp: none of 5 runs converged" in found.found
    with pytest.raises(MissingRuns):
        repeatable.judge(made_runs(placed))


@pytest.mark.parametrize(
    ("far", "near", "expected"),
    [(10.0, 2.0, "confirmed"), (40.0, 2.0, "in part"), (1.0, 2.0, "not confirmed")],
)
def test_how_many_times_better_a_servo_is(far, near, expected):
    errors = {"g_blind": far} | {f"g_{key}": near for key in GOAL_KEYS}
    runs = made_runs(
        run(name, position_error_m=1e-3 * e, rotation_error_rad=1e-3 * e)
        for name, e in errors.items()
    )
    said = servo_pays.judge(runs)
    assert said.verdict == expected
    assert f"{far / near:.1f} and {far / near:.1f} times" in said.found
    figure = accuracy_figure(runs)
    assert figure_faults(figure) == []
    assert len(figure.axes) == 2


@pytest.mark.parametrize(
    ("spread", "fourth", "expected"),
    [(1e-4, 0.01, "confirmed"), (1e-4, 1e-4, "in part"), (0.05, 0.01, "not confirmed")],
)
def test_how_estimates_repeat(spread, fourth, expected):
    runs = []
    for key in "14567":
        for sign in (0.0, 1.0):
            apart = fourth if key == "4" else spread
            one = run(
                f"ap_{key}", estimate_max_m=0.07 + sign * apart,
                estimate_max_rad=0.1 + sign * (0.03 if key == "4" else 1e-3),
            )  # fmt: skip
            one.measured["estimate_distance"] = np.full(
                3, 0.068 if expected != "not confirmed" else 0.01
            )
            runs.append(one)
    assert repeats_by_estimator.judge(made_runs(runs)).verdict == expected


def test_case_1_is_judged_with_the_printed_heights_and_shows_raised_ones():
    """Section 2.3.5: from 1.899 m up to a believed 2.202 m."""
    cases = {case.name: case for case in case_1.STUDY.cases(Form())}
    heights = [
        load_scenario("caroca_pbvs", cases[name].changes).initial_pose.position[2]
        for name in ("cp_1", "cr_1")
    ]
    np.testing.assert_allclose(heights, [1.899, 1.899 + case_4.LIFT], atol=1e-9)
