"""Case I: table 2.1, the servo's accuracy, how estimates repeat, on runs that are made up."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.caroca_cases import LIFT
from cdpr_drake.analyses.studies.case_1 import (
    CONFIGURATIONS,
    FOLLOWING,
    MOST_LAPS,
    POINTS,
    STUDY,
    TABLE_2_1,
    accuracy_figure,
    final_accuracy,
)
from cdpr_drake.analyses.studies.facts import MissingRuns, facts_of
from cdpr_drake.analyses.studies.servo_figures import beginning, largest_by_lap
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.figure_faults import figure_faults


def verdict(name, rows):
    (fact,) = [fact for fact in facts_of("case-1") if fact.name == name]
    return fact.judge(pd.DataFrame(rows), STUDY.finds, STUDY.moments, "")["verdict"]


def ends(scatter, offset, turned, lost=()):
    """Runs of table 2.1 that end beside the goal [m], or turned about x [deg]."""
    rows = []
    for prefix in TABLE_2_1["position"]:
        for key in "1234567":
            for sign in (-1.0, 1.0):
                off = offset + sign * scatter
                half = 0.5 * np.radians(off) if turned else 0.0
                end = [np.cos(half), np.sin(half), 0, 0, 0.0 if turned else off, 0, 0]
                rows.append({
                    "configuration": f"{prefix}_{key}",
                    "outcome": "target_lost" if prefix in lost else "converged",
                    "arrays": {"camera_ends": np.array([end, [1.0, 0, 0, 0, 0, 0, 0]])},
                })  # fmt: skip
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("of", "scatter", "offset", "expected"),
    [
        ("position", 1e-3, 1.8e-3, "confirmed"),
        ("position", 1e-3, 1e-4, "in part"),
        ("position", 1e-5, 1e-5, "not confirmed"),  # another robot
        ("position", 1e-2, 1e-2, "not confirmed"),
        ("rotation", 0.3, 0.6, "confirmed"),
        ("rotation", 0.3, 0.01, "in part"),
        ("rotation", 3.0, 6.0, "not confirmed"),
    ],
)
def test_table_2_1_is_judged_by_scatter_and_offset(of, scatter, offset, expected):
    name = {"position": "repeatable", "rotation": "turns_repeat"}[of]
    assert verdict(name, ends(scatter, offset, of == "rotation")) == expected


def test_a_row_of_table_2_1_of_which_no_run_converged_is_not_met():
    rows = ends(1e-3, 1.8e-3, False, lost=("cp",))
    held, words = final_accuracy(rows, "position")
    assert held == [True] * 5 + [False]
    assert "cp inf and inf (0 runs)" in words
    with pytest.raises(MissingRuns, match="cp of table"):
        final_accuracy(rows[rows["configuration"] != "cp_4"], "position")


@pytest.mark.parametrize(
    ("far", "near", "expected"),
    [(10.0, 2.0, "confirmed"), (40.0, 2.0, "in part"), (1.0, 2.0, "not confirmed")],
)
def test_how_many_times_better_a_servo_is(far, near, expected):
    errors = {"g_blind": far} | {f"g_{key}": near for key in "123456"}
    rows = pd.DataFrame(
        {"configuration": name, "position_error_m": 1e-3 * e, "rotation_error_rad": 1e-3 * e}
        for name, e in errors.items()
    )
    assert verdict("servo_pays", rows) == expected
    assert figure_faults(accuracy_figure(rows, {})) == []


@pytest.mark.parametrize(
    ("spread", "fourth", "mean", "expected"),
    [
        (1e-4, 0.01, 0.068, "confirmed"),
        (1e-4, 1e-4, 0.068, "in part"),
        (0.05, 0.001, 0.01, "not confirmed"),
    ],
)
def test_how_estimates_repeat(spread, fourth, mean, expected):
    rows = [
        {
            "configuration": f"ap_{key}", "seed": seed, "estimate_mean_m": mean,
            "estimate_max_m": 0.07 + (seed == 0) * (fourth if key == "4" else spread),
            "estimate_max_rad": 0.1 + (seed == 0) * 3.0 * (fourth if key == "4" else spread),
        }
        for key in "14567"
        for seed in range(5)
    ]  # fmt: skip
    assert verdict("repeats_by_estimator", rows) == expected
    assert verdict("repeats_by_estimator", rows[::5]) == "not judged"  # one run does not repeat


def test_heights_points_and_laps():
    """Section 2.3.5: from 1.899 m up to a believed 2.202 m."""
    changes = {one.name: one.changes for one in CONFIGURATIONS}
    for name, lift in (("cp_1", 0.0), ("cr_1", LIFT)):
        scenario = load_scenario("caroca_pbvs", changes[name])
        assert scenario.initial_pose.position[2] == pytest.approx(1.899 + lift, abs=1e-9)
        believed = scenario.perturbations.initial_pose.position[2]
        assert believed == pytest.approx(2.202 + lift, abs=1e-9)
    assert set(POINTS) <= set(FOLLOWING)
    assert MOST_LAPS * 16.0 > 210.0  # the printed laps fit into it


def test_figures_have_the_first_laps_or_the_largest_error_of_each():
    curves = {
        "time": np.array([0.0, 1.0, 2.0, 2.9, 3.0, 4.0]),
        "estimate_distance": np.array([1.0, 5.0, 2.0, 3.0, 4.0, 0.0]), "estimate_angle": np.ones(6),
        "image_time": np.arange(3.0), "image_line": np.zeros((2, 2)),
    }  # fmt: skip
    curves |= dict.fromkeys(("image_path", "image_deviation"), np.arange(3.0))
    others = ("camera_path", "camera_deviation", "error", "cable_velocities")
    curves |= dict.fromkeys(others, np.arange(6.0))
    first = beginning(curves, 2.0)
    assert [len(first[name]) for name in ("time", "error", "image_path", "image_line")] == [
        3, 3, 3, 2
    ]  # fmt: skip
    laps = largest_by_lap(curves, 2.0)
    np.testing.assert_allclose(laps["time"], [0.5, 2.5, 4.0])
    assert laps["estimate_distance"].tolist() == [5.0, 4.0, 0.0]
